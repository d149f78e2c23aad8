"""Incomplete mark: makes sure that no resume trusts a journal whose newest record is older than its print.

In place, the first byte of the journal is overwritten, which needs no free block. A disk that can no longer be written (a stick
that was removed, a read-only remount) cannot take that mark, so the same is noted under the journal's key in other folders.
"""

import os
import sys
from contextlib import suppress
from os.path import isfile, lexists, samestat
from pathlib import Path

from profiles.folders import state_folders

MARK = b"!"
MEMORY = Path("/dev/shm")  # of Linux: can be written when no disk can, and lasts until the computer restarts
BINARY = getattr(os, "O_BINARY", 0)  # Windows would write carriage returns otherwise


def write_at(descriptor: int, offset: int, data: bytes) -> None:
    """Write all bytes at a place of an open file. Raises OSError, also when only some were written."""
    os.lseek(descriptor, offset, os.SEEK_SET)
    if os.write(descriptor, data) < len(data):
        raise OSError("not all of it was written")


def mark_incomplete(path: Path, descriptor: int | None, heading: bytes) -> bool:
    """Mark an open journal, and the file at its path where that is another one with the same heading (a stick that was plugged
    in again, a copy). Returns whether the mark is on the disk, and no such file is left without it.
    """
    marked = descriptor is not None and _mark(descriptor)
    if descriptor is not None and is_at(path, descriptor):
        return marked
    if not isfile(path):
        return marked
    with suppress(OSError):
        there = os.open(path, os.O_RDWR | BINARY)
        try:
            return _mark(there) if os.read(there, len(heading))[1:] == heading[1:] else marked
        finally:
            os.close(there)
    return False


def _mark(descriptor: int) -> bool:
    try:
        write_at(descriptor, 0, MARK)
        os.fsync(descriptor)
    except OSError:
        return False
    return True


def is_at(path: Path, descriptor: int) -> bool:
    """Whether a path still leads to an open file, which was not deleted, moved or replaced."""
    if sys.platform == "win32":  # an open file is none of these there
        return True
    try:
        return samestat(os.stat(path), os.fstat(descriptor))
    except OSError:
        return False


def note_incomplete(key: str) -> bool:
    """Note in every folder that can be written that the journal of this key is incomplete; returns whether there was one."""
    return sum(map(_note, _notes(key))) > 0


def _note(file: Path) -> bool:
    try:
        if file.parent != MEMORY:
            file.parent.mkdir(0o700, parents=True, exist_ok=True)
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | BINARY, 0o600)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        _sync_folder(file.parent)
    except OSError:
        return False
    return True


def _sync_folder(folder: Path) -> None:
    """Bring the names of files to the disk, where the system can do that."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def is_noted_incomplete(key: str) -> bool:
    """Whether some folder notes that the journal of this key is incomplete."""
    return any(map(lexists, _notes(key)))


def _notes(key: str) -> list[Path]:
    return [folder / f"tiltprint-{key}.incomplete" for folder in (*state_folders(), MEMORY)]
