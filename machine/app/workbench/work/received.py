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

try:
    import fcntl
except ImportError:  # without locks nothing is known of other programs, and nothing of theirs removed
    fcntl = None  # type: ignore[assignment]

PREFIX = "tiltprint-edit-"
FOUND = "found"  # file in a folder that was left, as old as the knowledge of that
BEGUN_S = 60.0  # an empty folder as new as this may be of a program that starts now and has not locked it yet
KEPT_S = 24 * 3600.0  # what lay on the benches of a program that was killed: nobody else may have it
UNSAFE = re.compile(r"[^\w .()+-]")
LONGEST_NAME = 100


class Received:
    """A folder that is locked as long as its program lives, and in it one for each file."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix=PREFIX)
        self._lock = lock_folder(self.path)
        self._numbers = itertools.count(1)

    @property
    def path(self) -> Path:
        """The folder."""
        return Path(self._folder.name)

    def new_file(self, name: str) -> Path:
        """A place for a file that a page calls so."""
        folder = self.path / str(next(self._numbers))
        folder.mkdir()
        plain = UNSAFE.sub("_", name.encode("ascii", "replace").decode())  # a disk counts bytes, so letters have one each
        return folder / (plain[-LONGEST_NAME:].strip(". ") or "model")

    def remove(self) -> None:
        """Remove the folder with all files."""
        self._folder.cleanup()
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
            lock = None if _is_begun(folder) else lock_folder(folder)
            if lock is None:
                continue
            try:
                if _is_done_with(folder):
                    shutil.rmtree(folder)
                else:
                    left.append(folder)
            finally:
                os.close(lock)
    return tuple(left)


def files_in(*folders: Path) -> list[Path]:
    """The files of the folders of some Received, the newest ones first."""
    files = [path for folder in folders for path in folder.glob("*/*") if path.is_file()]
    return sorted(files, key=lambda path: (path.stat().st_mtime, path), reverse=True)


def _is_begun(folder: Path) -> bool:
    return time.time() - folder.stat().st_mtime < BEGUN_S and not any(folder.iterdir())


def _is_done_with(folder: Path) -> bool:
    marker = folder / FOUND
    if not files_in(folder):
        return True
    if not marker.exists():
        marker.touch()
    return time.time() - marker.stat().st_mtime > KEPT_S


def lock_folder(folder: Path) -> int | None:
    """Lock a folder of this user's for this process; None when another process holds it, or where there are no such locks."""
    if fcntl is None:
        return None
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        if os.fstat(opened).st_uid == os.geteuid():
            fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return opened
    except OSError:
        pass  # locked, or a disk without locks
    os.close(opened)
    return None
