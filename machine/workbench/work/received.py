"""Received: the files that pages have sent, in temporary folders that go with the program; the next ones find those of a program
that was killed."""

import itertools
import os
import re
import shutil
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from weakref import finalize

from profiles.files import LOCK, lock_folder, remove_locked

PREFIX = "tiltprint-edit-"
FOUND = "found"  # file in a folder that was left, as old as the knowledge of that
BEGUN_S = 60.0  # an empty folder as new as this may be of a program that starts now and has not locked it yet
KEPT_S = 24 * 3600.0  # what lay on the benches of a program that was killed: nobody else may have it
UNSAFE = re.compile(r"[^\w .()+-]")
LONGEST_NAME = 100
NAMES_KEPT = 20


class Received:
    """A folder that is locked as long as its program lives, and in it one for each file. names: of the files that came last."""

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix=PREFIX))
        self._lock = lock_folder(self.path)
        self.names: tuple[str, ...] = ()
        self._numbers = itertools.count(1)
        self._at_exit = finalize(self, shutil.rmtree, self.path, ignore_errors=True)

    def new_file(self, name: str) -> Path:
        """A place for a file that a page calls so."""
        folder = self.path / str(next(self._numbers))
        folder.mkdir()
        plain = UNSAFE.sub("_", name.encode("ascii", "replace").decode())  # a disk counts bytes, so letters have one each
        file = folder / (plain[-LONGEST_NAME:].strip(". ") or "model")
        self.names = (*self.names, name, file.name)[-2 * NAMES_KEPT :]
        return file

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
