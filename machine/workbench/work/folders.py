"""Folders: files that pages have sent, in temporary folders, and autosaved benches, each a project in the state folder, so that a
crash or a restart loses nothing; the next program finds both.

The record of an autosave is written last and as a whole, so a folder without it is none. A folder is locked as long as a program
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
from pathlib import Path
from secrets import token_hex
from weakref import finalize

from machine.pipeline.project import PLAN, Project, figures_of, write_folder
from machine.pipeline.project_record import RECORD
from machine.workbench.bench.bench import Bench, plan_of_bench
from mdp.model_file import DEMO
from profiles.files import LOCK, keep_newest, lock_folder, modified_s, remove_locked
from profiles.folders import state_folder

PREFIX = "tiltprint-edit-"
FOUND = "found"  # file in a folder that was left, as old as the knowledge of that
BEGUN_S = 60.0  # an empty folder as new as this may be of a program that starts now and has not locked it yet
KEPT_S = 24 * 3600.0  # what lay on the benches of a program that was killed: nobody else may have it
UNSAFE = re.compile(r"[^\w .()+-]")
LONGEST_NAME = 100
FOLDER = "benches"
MOST_KEPT = 10  # the newest ones


class Received:
    """A folder that is locked as long as its program lives, and in it one for each file."""

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        self._lock = lock_folder(self.path)
        self._numbers = itertools.count(1)
        self._at_exit = finalize(self, shutil.rmtree, self.path, ignore_errors=True)

    def new_file(self, name: str) -> Path:
        """A place for a file that a page calls so."""
        folder = self.path / str(next(self._numbers))
        folder.mkdir()
        plain = UNSAFE.sub("_", name.encode("ascii", "replace").decode())  # a disk counts bytes, so letters have one each
        return folder / (plain[-LONGEST_NAME:].strip(". ") or "model")

    def remove(self) -> None:
        """Remove the folder with all files."""
        if self._lock is not None:
            remove_locked(self.path, self._lock)
            self._lock = None
        self._at_exit()

    def leave(self) -> None:
        """Leave the files to the next start of the program, which finds them as if this one had been killed."""
        self._at_exit.detach()
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None


def remove_file(path: Path) -> None:
    """Remove a file of a Received with the folder that it has for itself."""
    shutil.rmtree(path.parent, ignore_errors=True)


def tidy_left() -> tuple[Path, ...]:
    """The folders of programs that were killed; those without a file, or known for a day, are removed instead."""
    left = []
    for folder in sorted(Path(tempfile.gettempdir()).glob(f"{PREFIX}*")):
        with suppress(OSError):
            # without locks nothing is known of other programs, so nothing of theirs is removed
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
    """The files of the folders of some Received, the newest ones first."""
    files = [path for folder in folders for path in folder.glob("*/*") if path.is_file()]
    return sorted(files, key=lambda path: (path.stat().st_mtime, path), reverse=True)


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
        recommended=bench.recommended,
        plate=model.plate,
        marks_in_plan=True,
        figures=figures_of(next((row for row in bench.rows if row.parts == bench.parts), None)),
    )


def folders_kept() -> list[Path]:
    """The folders with work that no bench writes to, the newest first; where more are kept than may be, the oldest go."""
    return keep_newest(_folders(), MOST_KEPT, lambda folder: modified_s(folder / RECORD))


def _folders() -> Iterator[Path]:
    for folder in kept_folder().iterdir():
        with suppress(OSError):
            if (folder / RECORD).is_file() and (lock := lock_folder(folder)) is not None:
                os.close(lock)
                yield folder
