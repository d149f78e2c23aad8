"""Kept work: what lies on a bench, as a project's folder in the state folder, so that a crash or a restart loses nothing of it.

The record of a folder is written last and as a whole, so a folder without it, or half a folder, is none. A folder is locked as
long as a bench writes to it.
"""

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from secrets import token_hex

from machine.pipeline.project import PLAN, Project, figures_of, write_folder
from machine.pipeline.project_record import RECORD
from machine.workbench.bench.bench import Bench, plan_of_bench
from mdp.model_file import DEMO
from profiles.files import lock_folder
from profiles.folders import state_folder

FOLDER = "benches"
MOST_KEPT = 10  # the newest ones


def kept_folder() -> Path:
    """Where all work is kept. Raises OutputError."""
    folder = state_folder() / FOLDER
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def new_folder() -> Path:
    """A folder for the work of one more bench. Raises OSError and OutputError."""
    folder = kept_folder() / f"{time.strftime('%Y%m%d-%H%M%S')}-{token_hex(4)}"
    folder.mkdir(mode=0o700)
    return folder


def write_work(folder: Path, bench: Bench) -> None:
    """Keep what lies on a bench with a model. Raises OSError, then what was kept before is there still."""
    write_folder(folder, work_of(bench), plan_of_bench(bench, PLAN) if bench.planned else None)


def work_of(bench: Bench) -> Project:
    """What lies on a bench with a model; its files are where they are."""
    model = bench.model
    assert model is not None
    return Project(
        name=model.name,
        model=None if model.name.startswith(DEMO) else model.path,
        given=bench.given,
        rotation=bench.rotation,
        parts=bench.parts,
        locked=tuple(k for k, part in enumerate(bench.cuts or ()) if part in bench.locked),
        stops=bench.stops,
        copies=bench.copies,
        plate=model.plate,
        marks_in_plan=True,
        figures=figures_of(next((row for row in bench.rows if row.parts == bench.parts), None)),
    )


def folders_kept() -> list[Path]:
    """The folders with work that no bench writes to, the newest first; where more are kept than may be, the oldest go."""
    folders = sorted(_folders(), key=lambda folder: (folder / RECORD).stat().st_mtime, reverse=True)
    for folder in folders[MOST_KEPT:]:
        shutil.rmtree(folder, ignore_errors=True)
    return folders[:MOST_KEPT]


def _folders() -> Iterator[Path]:
    for folder in kept_folder().iterdir():
        with suppress(OSError):
            if (folder / RECORD).is_file() and (lock := lock_folder(folder)) is not None:
                os.close(lock)
                yield folder
