"""Print campaign: the models of some folders and forms of our own, through the whole program; a table of what failed and why.

    python tools/campaign_prints.py OUT [--meshes DIR] [--models DIR] [--hard DIR] [--forms N] [--varied-share 0.1] [--only WORD]
        [--sample N] [--workers N] [--scheduler ADDRESS] [--time-limit S] [--core-limit S] [--memory-limit GB] [--planted N]

Meshes (.npz too) are scaled to 60 mm, models and hard ones taken as they are, forms made by tools/print_forms.py; a share of them
is printed a second time with settings that their name decides. A run is `tiltprint export` in a process of its own: its exit
code, sentence, findings, core seconds, memory, and what tools/print_look.py sees in its layers stand in one line of
OUT/runs.jsonl, at once; what stands there is not run again. Runs are ordered by a hash of their names, so the first --sample of
them, or those before --time-limit, are a fair sample. --planted: prints into which faults are planted (OUT/planted.jsonl).
OUT/table.md has it all; --table makes that alone. --scheduler: workers that see the same folders.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mdp.batch.pool import Workers, connected
from mdp.kernels.workers import CallError
from tools.campaign_planted import plant_all, planted_table
from tools.campaign_run import PRINTED, Limits, run_print, tiltprint
from tools.campaign_runs import Run, all_runs
from tools.campaign_table import table

GROUPS = ("meshes", "models", "hard")
MOST_LINES = 40_000


def main() -> None:
    """Read the options, run what is missing, write the table."""
    given = options().parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    if not given.table:
        limits = Limits(given.core_limit, int(given.memory_limit * 2**30), time.time() + given.time_limit)
        folders = {group: getattr(given, group) for group in GROUPS if getattr(given, group) is not None}
        runs = [run for run in all_runs(folders, given.forms, given.varied_share) if given.only in run.name]
        prints(given, runs[: given.sample], limits)
        faults(given, runs, limits)
    text = table(read(given.out / "runs.jsonl"))
    planted = read(given.out / "planted.jsonl")
    text += "\n\n" + planted_table(planted) if planted else ""
    (given.out / "table.md").write_text(text + "\n")
    print(text)


def options() -> argparse.ArgumentParser:
    """The options of the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    for group in GROUPS:
        parser.add_argument(f"--{group}", type=Path, metavar="DIR")
    parser.add_argument("--forms", type=int, default=600, metavar="N")
    parser.add_argument("--varied-share", type=float, default=0.1)
    parser.add_argument("--only", default="", metavar="WORD")
    parser.add_argument("--sample", type=int, metavar="N")
    parser.add_argument("--workers", type=int, default=1, metavar="N")
    parser.add_argument("--scheduler", metavar="ADDRESS")
    parser.add_argument("--time-limit", type=float, default=float("inf"), metavar="S", help="no run is begun later than this")
    parser.add_argument("--core-limit", type=int, default=600, metavar="S", help="core seconds that one run may take")
    parser.add_argument("--memory-limit", type=float, default=8.0, metavar="GB", help="that one run may take")
    parser.add_argument("--planted", type=int, default=0, metavar="N")
    parser.add_argument("--keep", action="store_true", help="the G-code of every run, not of those alone that failed")
    parser.add_argument("--table", action="store_true")
    return parser


def prints(given: argparse.Namespace, runs: Sequence[Run], limits: Limits) -> None:
    """Print all that is not printed yet."""
    done = {record["name"] for record in read(given.out / "runs.jsonl")}
    missing = [run for run in runs if run.name not in done]
    if missing and given.scheduler is None:
        warm_up(limits)
    calls = {run.name: (run, given.out.resolve(), limits, given.keep) for run in missing}
    for record in worked_off(given, run_print, calls):
        append(given.out / "runs.jsonl", record)
        said = record.get("suspect") or record["sentence"] or ""
        print(f"{record['name']}: {record['outcome']}, {record['core_s']:.0f} core s {said}", flush=True)


def faults(given: argparse.Namespace, runs: Sequence[Run], limits: Limits) -> None:
    """Plant faults into the first of the prints, those of three parts and not too many lines before others."""
    printed = {record["name"]: record for record in read(given.out / "runs.jsonl") if record["outcome"] == PRINTED}
    among = [run for run in runs if run.name in printed and not run.varies]
    chosen = sorted(among, key=lambda run: fitness(printed[run.name]))[: given.planted]
    done = {record["name"] for record in read(given.out / "planted.jsonl")}
    calls = {run.name: (run, limits) for run in chosen if run.name not in done}
    for record in worked_off(given, plant_all, calls):
        append(given.out / "planted.jsonl", record)
        print(f"{record['name']}: planted", flush=True)


def fitness(record: dict[str, Any]) -> tuple[int, bool]:
    """Sorts prints by how well faults fit into them: many are of a third part, and each of them takes a dry run."""
    return -min(3, record["parts"]), record["lines"] > MOST_LINES


def warm_up(limits: Limits) -> None:
    """Compile the kernels, so that no run's seconds hold that."""
    with TemporaryDirectory() as folder:
        tiltprint(["export", "demo:bracket", "-o", "warm.gcode"], Path(folder), limits)


def worked_off(
    given: argparse.Namespace, task: Callable[..., dict[str, Any] | None], calls: dict[str, tuple[Any, ...]]
) -> Iterator[dict[str, Any]]:
    """The record of every call as it is done, on a cluster; what is too late has none, and what failed is told."""
    if not calls:
        return
    with connected(Workers(given.scheduler, given.workers, 0)) as queue:
        for name, record in queue.completed(task, calls, lambda: None):
            if isinstance(record, CallError):
                print(f"{name}: the campaign itself failed: {record}", flush=True)
            elif record is not None:
                yield record


def append(file: Path, record: dict[str, Any]) -> None:
    """One line more, behind one that was cut off, too."""
    whole = not file.exists() or file.read_bytes()[-1:] in (b"", b"\n")
    with file.open("a") as lines:
        lines.write(("" if whole else "\n") + json.dumps(record) + "\n")


def read(file: Path) -> list[dict[str, Any]]:
    """The records of a file; a last line that was cut off counts for nothing."""
    records = []
    for line in file.read_text().splitlines() if file.exists() else ():
        try:
            records.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return records


if __name__ == "__main__":
    main()
