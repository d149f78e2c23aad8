"""The batch command: processes all models of a folder on many cores or machines, and writes a table with a row for each."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from machine.cli.terminal.requests import BatchRequest
from machine.gcode.blocks import check_blocks
from machine.notices import plain_line, say, show
from machine.pipeline import compilers
from machine.pipeline.batch_model import (
    ACTIONS,
    BETWEEN,
    DONE,
    FAILED,
    REFUSED,
    STATUSES,
    Job,
    Row,
    inputs_of,
    job_of,
    row_of,
)
from machine.pipeline.output import check_folder, check_writable, delete
from machine.quantities import amount, duration
from mdp.batch.pool import connected
from mdp.batch.progress import BatchProgress
from mdp.batch.rows import append_row, read_rows, write_rows, writing_alone
from mdp.formats.readers import READERS
from mdp.kernels.workers import CallError
from mdp.ranking.ranker import ranker_named
from profiles.errors import UserError, counted

LOCK = "batch.lock"
NO_FILES = "estimate"  # writes no files
CLASH = "{} would have the files of {}: another name is expected"
REASONS = 5  # number of the most common ones that the summary lists
NUMBER = re.compile(r"\d+([.,]\d+)*")


def batch(request: BatchRequest) -> int:
    """Process every model of the folder; returns 0 if all are done, else 1."""
    if request.do not in ACTIONS:
        raise UserError(f"--do {request.do}: {', '.join(ACTIONS)} is expected")
    files = model_files(request.folder)
    check_folder(request.out)
    asked = request.asked()
    ranker_named(asked.ranker)
    check_blocks(asked.profile)
    job, table = job_of(request.do, asked, request.out.resolve()), request.out / f"{request.do}.csv"
    with writing_alone(request.out, LOCK):
        check_writable(table)
        clashes = {} if request.do == NO_FILES else same_files(files)
        rows = _rows_that_hold(table, {name: file for name, file in files.items() if name not in clashes}, job)
        rows |= {name: Row(name, REFUSED, sentence=CLASH.format(name, first)) for name, first in clashes.items()}
        write_rows(table, Row, _in_order(rows))
        try:
            _work_off(request, job, files, rows, table)
        except KeyboardInterrupt:
            done = sum(name in rows for name in files)
            say(f"{done} of {len(files)} models have a row in {table}; a repeated run continues there")
            raise
        finally:
            write_rows(table, Row, _in_order(rows))
    ours = [rows[name] for name in files]
    show(summary(ours, table))
    return int(any(row.status != DONE for row in ours))


def model_files(folder: Path) -> dict[str, Path]:
    """The models of a folder: name -> absolute path. Raises UserError if there are none."""
    if not folder.is_dir():
        raise UserError(f"{folder}: there is no such folder; models are expected in it")
    files = (file for file in folder.resolve().iterdir() if file.suffix.lower() in READERS and not file.name.startswith("."))
    named = {file.name: file for file in sorted(files)}
    if not named:
        raise UserError(f"folder {folder} holds no model; {', '.join(READERS)} are read")
    return named


def is_current(row: Row, file: Path, job: Job) -> bool:
    """Whether an earlier run's row is valid: same model and options, its files exist, and it is not a failure that may pass."""
    files = row.files.split(BETWEEN) if row.files else []
    return row.status != FAILED and all((job.out / name).is_file() for name in files) and row.inputs == inputs_of(file, job)


def _in_order(rows: Mapping[str, Row]) -> list[Row]:
    return [rows[name] for name in sorted(rows)]


def _delete_files(out: Path, row: Row) -> None:
    """Delete the files of an outdated row, so that no one prints them by mistake."""
    for name in row.files.split(BETWEEN) if row.files else ():
        if (out / name).resolve().is_relative_to(out):
            delete(out / name)


def _rows_that_hold(table: Path, files: Mapping[str, Path], job: Job) -> dict[str, Row]:
    """Rows of earlier runs that are valid, including those of models that have been removed."""
    earlier = {row.model: row for row in read_rows(table, Row)}
    stems = {_stem(name) for name in files}
    gone = {name for name, row in earlier.items() if name not in files and not (row.files and _stem(name) in stems)}
    rows = {name: row for name, row in earlier.items() if name in gone or (name in files and is_current(row, files[name], job))}
    for name in earlier.keys() - rows.keys():
        _delete_files(job.out, earlier[name])
    done = sum(name in rows for name in files)
    if done:
        others = ": continuing with the others" if done < len(files) else ""
        say(f"{done} of {len(files)} models were done before{others}")
    return rows


def _work_off(request: BatchRequest, job: Job, files: Mapping[str, Path], rows: dict[str, Row], table: Path) -> None:
    """Process the models without a row, and append each result to the table at once."""
    calls = {name: (file, job) for name, file in files.items() if name not in rows}
    if not calls:
        return
    if request.scheduler is None:
        _compile(job)
    folders = (request.folder.resolve(), job.out)
    with connected(replace(request.workers(), folders=folders)) as queue, BatchProgress(len(calls), "models") as progress:
        for name, result in queue.completed(row_of, calls, progress.tick):
            if isinstance(result, CallError):
                result = Row(name, FAILED, sentence=plain_line(f"{name}: {result}"), inputs=inputs_of(files[name], job))
            append_row(table, result)
            rows[name] = result
            progress.show(in_words(result), result.status != DONE)


def in_words(row: Row) -> str:
    """One line that reports the result of a model."""
    parts = f"{row.parts} part{'s' * (row.parts > 1)}, {duration(row.time_s)}"
    return row.sentence if row.sentence.startswith(row.model) else f"{row.model}: {row.sentence or parts}"


def same_files(names: Iterable[str]) -> dict[str, str]:
    """Models whose output files would overwrite those of another model: name -> name of the other one."""
    firsts: dict[str, str] = {}
    return {name: first for name in sorted(names) if (first := firsts.setdefault(_stem(name), name)) != name}


def _stem(name: str) -> str:
    """Stem that a model's output files share, case folded because some file systems ignore case."""
    return Path(name).stem.casefold()


def _compile(job: Job) -> None:
    """Compile the kernels that all processes of this machine share once, before these start."""
    program = compilers.bundles_to_build(job.asked.profile) if job.do == "export" else ()
    compilers.wait_for((*compilers.JUDGE, *compilers.SEARCH, *program))


def summary(rows: Iterable[Row], table: Path) -> str:
    """Counts of all results, total time and filament, and the most common reasons of failures."""
    rows = list(rows)
    counts = Counter(row.status for row in rows)
    text = f"{counted(len(rows), 'model')}: " + ", ".join(f"{counts[status]} {status}" for status in STATUSES if counts[status])
    done = [row for row in rows if row.status == DONE]
    if done:
        filament_m = sum(row.filament_mm for row in done) / 1000.0
        text += f"; to print: {duration(sum(row.time_s for row in done))}, {amount(filament_m, 1)} m of filament"
    lines = [f"{count:6} {reason}" for reason, count in reasons(rows)]
    return "\n".join([text, *lines, f"a row for each is in {table}"]) + "\n"


def reasons(rows: Iterable[Row]) -> list[tuple[str, int]]:
    """Most common reasons why models are not done, with counts; reasons that differ only in names and numbers count as one."""
    firsts: dict[str, str] = {}
    counts: Counter[str] = Counter()
    for row in rows:
        if row.status != DONE:
            sentence = row.sentence.removeprefix(row.model).lstrip(": ")
            kind = NUMBER.sub("0", sentence.replace(row.model, ""))
            counts[firsts.setdefault(kind, sentence)] += 1
    return counts.most_common(REASONS)
