"""Collect: records of wide searches over a folder of models, to train a ranker on.

    python -m mdp.learning.collect FOLDER -o OUT [--terms paper,ours] [--orientations N] [--machine NAME] [--set KEY=VALUE] ...

Each search writes one file, MODEL.ORIENTATION.TERMS.npz, and one line of OUT/index.csv. Finished searches are not repeated, so an
interrupted run resumes when it is started again.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from math import inf
from pathlib import Path

from mdp.batch.pool import Workers, connected
from mdp.batch.progress import BatchProgress
from mdp.batch.rows import append_row, writing_alone
from mdp.kernels.threads import THREADS
from mdp.kernels.workers import CallError
from mdp.learning import command
from mdp.learning.collection import (
    FAILED,
    INDEX,
    LOCK,
    TERMS,
    Key,
    Row,
    Settings,
    read_index,
    run,
    summary,
    unfinished,
    write_index,
)
from mdp.learning.models import model_files, name_of
from profiles.errors import UserError
from profiles.files import SHARED, write_whole
from profiles.profile import DEFAULTS

MOST_WIDE = 1000  # as search.beam_width allows


def main(arguments: Sequence[str] | None = None) -> int:
    """Collect the missing records; returns the exit code."""
    return command.run(collect, arguments, "started again, the collection continues where it stopped")


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = command.Parser(prog="python -m mdp.learning.collect", description="record wide searches over many models")
    parser.add_argument("folder", type=Path, help="holds models as npz (vertices in mm, faces) or as mesh files")
    parser.add_argument("-o", "--out", type=Path, required=True, help="folder of the records and their index.csv")
    parser.add_argument("--beam-width", type=int, default=50, metavar="B")
    parser.add_argument("--terms", default="paper,ours", help=f"of {', '.join(TERMS)}: paper searches as published")
    parser.add_argument("--orientations", type=int, default=1, metavar="N", help="of each model: as given, then on other sides")
    parser.add_argument("--faces", type=int, metavar="N", help="finer models are made coarser first")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a dask scheduler; else processes of this machine's own")
    parser.add_argument("--workers", type=int, default=THREADS, metavar="N", help="processes on this machine, one core each")
    parser.add_argument("--only", default="", metavar="TEXT", help="only models whose name has this in it")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="every N-th model by name")
    parser.add_argument("--retries", type=int, default=2, metavar="N", help="how often a search that was killed is tried again")
    parser.add_argument("--time-limit", type=float, metavar="S", help="a search ends after this time with what it has")
    for kind, usual in DEFAULTS.items():
        parser.add_argument(f"--{kind}", default=usual, metavar="NAME|FILE", help=f"profile; default {usual}")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="of the profiles, as in a search")
    options = parser.parse_args(arguments)
    for name, least, most in (
        *(("beam_width", 1, MOST_WIDE), ("orientations", 1, 1000), ("faces", 4, inf), ("workers", 1, 1000)),
        *(("every", 1, inf), ("retries", 0, 100), ("time_limit", 0, inf)),
    ):
        command.check_range(options, name, least, most)
    options.terms = list(dict.fromkeys(options.terms.split(",")))
    for terms in options.terms:
        if terms not in TERMS:
            raise UserError(f"--terms has {terms!r}: {', '.join(TERMS)} are allowed")
    return options


def collect(arguments: Sequence[str] | None) -> None:
    """Make the missing records, and print a summary."""
    options = _options(arguments)
    profiles = (_name_or_path(options.machine), _name_or_path(options.material), _name_or_path(options.process))
    settings = Settings(options.beam_width, options.faces, options.time_limit, *profiles, tuple(options.set))
    for terms in options.terms:
        settings.profile(terms)  # an invalid setting is reported before anything begins
    files = {name_of(file): file.resolve() for file in model_files(options.folder, options.only, options.every)}
    wanted = [(name, turn, terms) for turn in range(options.orientations) for terms in options.terms for name in files]
    with writing_alone(options.out, LOCK):
        rows = _rows(options.out, settings)
        missing = unfinished(options.out, rows.values(), wanted)
        rows = {key: row for key, row in rows.items() if key not in set(missing)}
        write_index(options.out, rows.values())
        if missing:
            _run(options, settings, {key: files[key[0]] for key in missing}, rows)
            write_index(options.out, rows.values())
    found = [rows[key] for key in wanted]
    sys.stdout.write("\n\n".join(summary(found)) + "\n")
    if all(row.excluded for row in found):
        raise UserError(f"folder {options.out}: nothing was collected")


def _name_or_path(profile: str) -> str:
    """A profile's name, or its file's absolute path, since workers start in other folders."""
    return str(Path(profile).resolve()) if Path(profile).is_file() else profile


def _rows(out: Path, settings: Settings) -> dict[Key, Row]:
    """The existing rows; raises UserError if they were collected with other settings."""
    rows = {row.key: row for row in read_index(out)}
    others = sorted({row.settings for row in rows.values()} - {settings.in_words})
    if others:
        raise UserError(f"folder {out} holds searches with {others[0]}, not {settings.in_words}: take another folder")
    return rows


def _run(options: argparse.Namespace, settings: Settings, files: dict[Key, Path], rows: dict[Key, Row]) -> None:
    """Search, and write each record and line as soon as it is available."""
    calls = {key: (Row(*key, settings.in_words), file, settings) for key, file in files.items()}
    workers = Workers(options.scheduler, options.workers, options.retries, folders=(options.folder.resolve(),))
    with connected(workers) as pool, BatchProgress(len(calls), "searches") as progress:
        for key, result in pool.completed(run, calls, progress.tick):
            if isinstance(result, CallError):
                row, record = replace(calls[key][0], excluded=f"{FAILED}{result}".splitlines()[0]), b""
            else:
                row, record = result
            if record:
                write_whole(options.out / row.file, record, SHARED)
            append_row(options.out / INDEX, row)
            rows[key] = row
            progress.show(f"{row.file.removesuffix('.npz')}: {row.in_words}", row.excluded.startswith(FAILED))


if __name__ == "__main__":
    sys.exit(main())
