"""A disk that fails: a real small file system if one can be mounted, otherwise simulated system errors for one file."""

import errno
import os
import resource
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from machine.link import journal as journals
from machine.link.journal import Checkpoint, Journal


@contextmanager
def small_disk(folder: Path) -> Iterator[Callable[..., bool]]:
    """Mount a file system of 330 kB at a folder, if possible; yields mount(*options), which returns whether it succeeded."""
    folder.mkdir()

    def mount(*options: str) -> bool:
        command = ["mount", *options, str(folder)]
        with suppress(OSError):
            return subprocess.run(command, capture_output=True, check=False).returncode == 0
        return False

    mounted = mount("-t", "tmpfs", "-o", "size=330k", "tmpfs")
    try:
        yield mount if mounted else lambda *options: False
    finally:
        if mounted:
            subprocess.run(["umount", "-l", str(folder)], capture_output=True, check=False)


@contextmanager
def full_disk(file: Path, mounted: bool) -> Iterator[None]:
    """Fill the disk of this file; if no disk is mounted, limit the size of every file of this process to the size of this one."""
    if mounted:
        filler = file.with_name("filler")
        with suppress(OSError), filler.open("wb", buffering=0) as out:
            while True:
                out.write(bytes(4096))
        yield
        filler.unlink()
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (file.stat().st_size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


class FailingDisk:
    """Lets a number of writes and syncs of one file succeed; the next fail with a system error, or (SHORT) write only a part.

    of: which of the two operations count and fail.
    """

    SHORT = 0

    def __init__(
        self,
        monkeypatch: pytest.MonkeyPatch,
        file: Path,
        after: int,
        number: int,
        times: float = 1e9,
        of: tuple[str, ...] = ("write", "fsync"),
    ) -> None:
        self._file, self._left, self._number, self._times = file, after, number, times
        self.failed = False
        self._write, self._sync = os.write, os.fsync
        for name, failing in (("write", self.write), ("fsync", self.sync)):
            if name in of:
                monkeypatch.setattr(os, name, failing)

    def write(self, descriptor: int, data: bytes) -> int:
        if not self._fails(descriptor):
            return self._write(descriptor, data)
        if self._number != self.SHORT:
            raise OSError(self._number, os.strerror(self._number))
        return self._write(descriptor, data[: len(data) // 2]) if len(data) > 1 else 0

    def sync(self, descriptor: int) -> None:
        if self._fails(descriptor):
            raise OSError(self._number or errno.EIO, os.strerror(self._number or errno.EIO))
        self._sync(descriptor)

    def _fails(self, descriptor: int) -> bool:
        if not self._file.exists() or not os.path.samestat(os.fstat(descriptor), self._file.stat()):
            return False
        self._left -= 1
        if self._left >= 0 or self._times <= 0:
            return False
        self._times -= 1
        self.failed = True
        return True


def keep_notes_in(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the notes of incomplete journals in `folder`, apart from those of the user who runs the tests."""
    monkeypatch.setattr(journals, "state_folders", lambda: (folder / "state",))
    monkeypatch.setattr(journals, "MEMORY", folder)


def once_sent(monkeypatch: pytest.MonkeyPatch, line: int, act: Callable[[Path], object]) -> None:
    """Call `act` on a print's journal once this number of lines has been sent."""
    write, acted = Journal.write, set[Path]()

    def act_then_write(journal: Journal, checkpoint: Checkpoint, hurry: bool = False) -> None:
        if checkpoint.sent >= line and journal.path not in acted:
            acted.add(journal.path)
            act(journal.path)
        write(journal, checkpoint, hurry)

    monkeypatch.setattr(Journal, "write", act_then_write)
