"""Folders: uploaded files in temporary folders, and autosaved benches as projects in the state folder, so that nothing is lost in
a crash or restart; the next run finds both.

The record of an autosave is written last and atomically; a folder without a record is ignored. A folder is locked while a program
writes to it.
"""

import itertools
import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from secrets import token_hex
from weakref import finalize

from machine.pipeline.project import Project, figures_of, plan_file, write_folder
from machine.pipeline.project_record import RECORD
from machine.workbench.bench.bench import Bench, plan_of_bench
from machine.workbench.bench.model import Model
from mdp.model_file import DEMO
from profiles.files import LOCK, keep_newest, lock_folder, modified_s, remove_locked
from profiles.folders import state_folder

PREFIX = "tiltprint-edit-"
FOUND = "found"  # file in a folder left behind, created when that was first found
BEGUN_S = 60.0  # a newer empty folder may belong to a program that starts now and has not locked it yet
KEPT_S = 24 * 3600.0  # retention of the files of a killed program, which no one else has
UNSAFE = re.compile(r"[^\w .()+-]")
LONGEST_NAME = 100
FOLDER = "benches"
MOST_KEPT = 10  # retained autosaves


class Received:
    """A folder that is locked as long as its program lives, with a subfolder for each file."""

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        self._lock = lock_folder(self.path)
        self._numbers = itertools.count(1)
        self._at_exit = finalize(self, shutil.rmtree, self.path, ignore_errors=True)

    def new_file(self, name: str) -> Path:
        """A path for a file with this name on the page."""
        folder = self.path / str(next(self._numbers))
        folder.mkdir()
        plain = UNSAFE.sub("_", name.encode("ascii", "replace").decode())  # disks limit bytes, so each character has one
        return folder / (plain[-LONGEST_NAME:].strip(". ") or "model")

    def remove(self) -> None:
        """Delete the folder with all files."""
        if self._lock is not None:
            remove_locked(self.path, self._lock)
            self._lock = None
        self._at_exit()

    def leave(self) -> None:
        """Leave the files to the next run of the program, as if this one had been killed."""
        self._at_exit.detach()
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def remove_file(path: Path) -> None:
    """Delete a file of a Received with its subfolder."""
    shutil.rmtree(path.parent, ignore_errors=True)


def tidy_left() -> tuple[Path, ...]:
    """Folders of killed programs; deletes those that are empty, or were found a day ago."""
    left = []
    for folder in sorted(Path(tempfile.gettempdir()).glob(f"{PREFIX}*")):
        with suppress(OSError):
            # without locks the state of other programs is unknown, so nothing is deleted
            lock = None if _is_begun(folder) else lock_folder(folder, surely=True)
            if lock is None:
                continue
            if _is_done_with(folder):
                remove_locked(folder, lock)
            else:
                os.close(lock)
                left.append(folder)
    return tuple(left)


def files_in(*folders: Path) -> list[Path]:
    """The files in the folders of several Received, newest first."""
    dates = dict[Path, float]()
    for path in (path for folder in folders for path in folder.glob("*/*")):
        with suppress(FileNotFoundError):
            if path.is_file():
                dates[path] = modified_s(path)
    return sorted(dates, key=lambda path: (dates[path], path), reverse=True)


def _is_begun(folder: Path) -> bool:
    return time.time() - folder.stat().st_mtime < BEGUN_S and all(path.name == LOCK for path in folder.iterdir())


def _is_done_with(folder: Path) -> bool:
    marker = folder / FOUND
    if not files_in(folder):
        return True
    if not marker.exists():
        marker.touch()
    return time.time() - marker.stat().st_mtime > KEPT_S


def kept_folder() -> Path:
    """The folder of all autosaves. Raises OutputError."""
    folder = state_folder() / FOLDER
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def new_folder() -> Path:
    """Create a folder for the autosave of a bench. Raises OSError and OutputError."""
    folder = kept_folder() / f"{time.strftime('%Y%m%d-%H%M%S')}-{token_hex(4)}"
    folder.mkdir(mode=0o700)
    return folder


def write_work(folder: Path, bench: Bench) -> None:
    """Save a bench with a model. Raises OSError; the previous save then still exists."""
    plans = [plan_of_bench(each, plan_file(k)) if bench.planned else None for k, each in enumerate(bench.plate)]
    write_folder(folder, work_of(bench), plans)


def work_of(bench: Bench) -> Project:
    """The project of a bench with a model; it refers to its files."""
    first, *others = map(_of_model, bench.plate)
    return replace(first, stops=bench.stops, beside=tuple(others), worked_on=bench.number)


def _of_model(bench: Bench) -> Project:
    model = bench.model
    assert model is not None
    return Project(
        name=model.name,
        model=_own_file(model),
        given=bench.given,
        rotation=bench.rotation,
        parts=bench.parts,
        locked=tuple(k for k, part in enumerate(bench.cuts or ()) if part in bench.locked),
        copies=bench.copies,
        recommended=bench.recommended,
        plate=model.plate,
        marks_in_plan=True,
        figures=figures_of(next((row for row in bench.rows if row.parts == bench.parts), None)),
    )


def _own_file(model: Model) -> Path | None:
    """The file of a model, None for a demo."""
    return None if model.name.startswith(DEMO) else model.path


def folders_kept() -> list[Path]:
    """Autosave folders that no bench writes to, newest first; deletes the oldest beyond the limit."""
    return keep_newest(_folders(), MOST_KEPT, lambda folder: modified_s(folder / RECORD))


def _folders() -> Iterator[Path]:
    for folder in kept_folder().iterdir():
        with suppress(OSError):
            if (folder / RECORD).is_file() and (lock := lock_folder(folder)) is not None:
                os.close(lock)
                yield folder
