"""Shared by all campaigns: options of numbered trials, trials in several processes, tables by group, and JSON lines with which an
interrupted campaign resumes."""

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

Result = TypeVar("Result")


def options_of(doc: str, **numbers: int) -> argparse.ArgumentParser:
    """Options of a campaign. numbers: its integers and their defaults."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, number in numbers.items():
        parser.add_argument(f"--{name}", type=int, default=number)
    return parser


def trials(trial: Callable[[int], Result], first: int, count: int, jobs: int) -> Iterator[Result]:
    """The results of numbered trials in order; a number determines its trial."""
    # Processes, not threads: a process forked while another thread holds a lock waits for that lock for ever.
    with ProcessPoolExecutor(jobs, get_context("fork")) as pool:
        yield from pool.map(trial, range(first, first + count), chunksize=4)


def table(
    results: Sequence[Result], group: str, group_of: Callable[[Result], str], columns: dict[str, Callable[[list[Result]], object]]
) -> str:
    """A Markdown table with a row per group; columns: functions of a group's results."""
    rows = [f"| {' | '.join((group, *columns))} |", "|---" * (len(columns) + 1) + "|"]
    for name in sorted({group_of(result) for result in results}):
        mine = [result for result in results if group_of(result) == name]
        rows.append(f"| {name} | {' | '.join(str(figure(mine)) for figure in columns.values())} |")
    return "\n".join(rows)


def counts(ends: Sequence[str], end_of: Callable[[Any], str]) -> dict[str, Callable[[list[Any]], object]]:
    """A column for each possible end of a trial: how many of a group had it."""
    return {end: (lambda mine, end=end: sum(end_of(result) == end for result in mine)) for end in ends}


def append_line(file: Path, record: dict[str, Any]) -> None:
    """Append a line of JSON, even after a truncated one."""
    whole = not file.exists() or file.read_bytes()[-1:] in (b"", b"\n")
    with file.open("a") as lines:
        lines.write(("" if whole else "\n") + json.dumps(record) + "\n")


def read_lines(file: Path) -> list[dict[str, Any]]:
    """The records of a file, without a truncated line."""
    records = []
    for line in file.read_text().splitlines() if file.exists() else ():
        try:
            records.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return records
