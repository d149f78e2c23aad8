"""Files: never visible half written, with any concurrent writers, and locked exclusively on every system."""

import errno
import os
from pathlib import Path
from threading import Thread
from types import SimpleNamespace
from typing import BinaryIO

import pytest

from profiles import files
from profiles.files import LOCK, SHARED, lock, lock_folder, remove_locked, whole_file, write_whole


def test_a_file_is_the_old_or_the_new_one_and_no_temporary_file_remains(tmp_path: Path) -> None:
    file = tmp_path / "work.json"
    write_whole(file, b"old")

    def fail(half: BinaryIO) -> None:
        half.write(b"ne")
        half.flush()
        assert file.read_bytes() == b"old"
        raise OSError("full")

    with pytest.raises(OSError, match="full"), whole_file(file) as half:
        fail(half)
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("work.json", b"old")]
    write_whole(file, b"new", SHARED)
    assert file.read_bytes() == b"new"


def test_two_that_write_the_same_file_at_the_same_time_do_not_mix(tmp_path: Path) -> None:
    file = tmp_path / "work.json"
    with whole_file(file) as first, whole_file(file) as second:
        second.write(b"second" * 1000)
        first.write(b"first" * 1000)
    assert file.read_bytes() == b"first" * 1000
    threads = [Thread(target=lambda letter=letter: write_whole(file, letter * 100_000)) for letter in (b"a", b"b", b"c")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({*file.read_bytes()}) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["work.json"]


class Msvcrt:
    """Windows' module msvcrt: one descriptor can lock a byte of a file."""

    LK_NBLCK = 2

    def __init__(self) -> None:
        self.locked: dict[int, int] = {}

    def locking(self, descriptor: int, mode: int, count: int) -> None:
        assert (mode, count, os.lseek(descriptor, 0, os.SEEK_CUR)) == (self.LK_NBLCK, 1, 1 << 30)
        holder = self.locked.setdefault(os.fstat(descriptor).st_ino, descriptor)
        if holder != descriptor:
            raise OSError(errno.EACCES, "Permission denied")


@pytest.fixture(params=["posix", "windows"])
def system(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    if request.param == "windows":
        monkeypatch.setattr(files, "sys", SimpleNamespace(platform="win32"))
        monkeypatch.setattr(files, "msvcrt", Msvcrt(), raising=False)
        for name in ("O_DIRECTORY", "geteuid"):
            monkeypatch.delattr(os, name)
    return str(request.param)


def test_a_folder_is_locked_by_one_and_removed_with_its_lock(system: str, tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    (folder / "1").mkdir(parents=True)
    (folder / "1" / "a.stl").touch()
    locked = lock_folder(folder, surely=True)
    assert locked is not None
    assert lock_folder(folder) is None
    assert {path.name for path in folder.iterdir()} == {"1"} | ({LOCK} if system == "windows" else set())
    remove_locked(folder, locked)
    assert not folder.exists()


def test_without_file_locks_a_folder_counts_as_locked_only_on_request(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(files.fcntl, "flock", none)
    with (tmp_path / "file").open("w") as file:
        assert lock(file.fileno())
    assert lock_folder(tmp_path, surely=True) is None
    assert lock_folder(tmp_path) is not None
