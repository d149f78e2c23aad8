"""A journal that loses a record is refused, wherever and however its disk fails."""

import errno
import os
import shutil
import subprocess
import threading
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.link import journal as journal_module
from machine.link import journal as journals
from machine.link.journal import Checkpoint, Journal, JournalContents, JournalHeading, read_journal
from profiles.errors import JournalError, OutputError
from tests.machine.link.failing_disk import FailingDisk, full_disk, keep_notes_in, small_disk

HEADING = JournalHeading("/prints/a.gcode", "00" * 32, "a", {"machine": {"name": "m"}})
INCOMPLETE = "is incomplete: its print continued after the journal could no longer be written"
ERRORS = [errno.ENOSPC, errno.EIO, errno.EDQUOT, errno.EROFS, errno.EFBIG, FailingDisk.SHORT]


def at(line: int) -> Checkpoint:
    return Checkpoint(line, line, line, line, (1.0, 2.0, line / 10, 30.0, 725.0, 0.5))


@pytest.fixture(autouse=True)
def _notes_of_their_own(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    keep_notes_in(tmp_path_factory.mktemp("notes"), monkeypatch)


def readable(path: Path) -> JournalContents | None:
    try:
        return read_journal(path)
    except JournalError:
        return None


@settings(max_examples=60)
@given(
    after=st.integers(0, 12),
    number=st.sampled_from(ERRORS),
    times=st.sampled_from([1, 2, 3, 1e9]),
    syncs=st.sets(st.integers(1, 6)),
)
def test_after_any_failure_a_readable_journal_holds_the_last_record(
    tmp_path_factory: pytest.TempPathFactory, after: int, number: int, times: float, syncs: set[int]
) -> None:
    path = tmp_path_factory.mktemp("failing") / "j"
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(journal_module, "SYNC_S", 0.01)
        disk = FailingDisk(monkeypatch, path, after, number, times)
        try:
            with Journal(path, HEADING) as journal:
                for line in range(1, 7):
                    journal.write(at(line))
                    if line in syncs:
                        journal.settle()
                    seen = readable(path)
                    assert seen is None or seen.last == at(line)
        except OutputError:
            assert not path.exists()
            return
    assert (readable(path) is None, journal.warning != "") == (disk.failed, disk.failed)


def test_a_disk_that_fills_up_loses_no_record(tmp_path: Path) -> None:
    path = tmp_path / "disk" / "j"
    with small_disk(path.parent) as mount, Journal(path, HEADING) as journal, full_disk(path, mount("-o", "remount,rw")):
        for line in range(1, 5001):
            journal.write(at(line))
        assert (journal.settle(), read_journal(path).last) == ("", at(5000))


def test_a_journal_that_does_not_fit_on_a_full_disk_is_not_created(tmp_path: Path) -> None:
    first = tmp_path / "disk" / "first"
    with small_disk(tmp_path / "disk") as mount:
        first.write_bytes(b"")
        with full_disk(first, mount("-o", "remount,rw")), pytest.raises(OutputError, match=r"journal .*j cannot be written: "):
            Journal(first.with_name("j"), HEADING)
        assert not first.with_name("j").exists()


def test_a_journal_deleted_or_replaced_during_writing_is_refused_at_any_path(tmp_path: Path) -> None:
    for act in (Path.unlink, lambda path: path.rename(tmp_path / "moved"), lambda path: shutil.copy(path, tmp_path / "copy")):
        with Journal(tmp_path / "j", HEADING) as journal:
            journal.write(at(16))
            act(journal.path)
            if (tmp_path / "copy").exists():
                (tmp_path / "copy").replace(journal.path)
            assert journal.settle() == f"journal {journal.path} was deleted, moved or replaced"
        assert all(readable(file) is None for file in (tmp_path / "j", tmp_path / "moved"))


def test_a_removed_usb_drive_is_reported_and_its_journal_refused_when_it_is_back(tmp_path: Path) -> None:
    stick, drawer = tmp_path / "stick", tmp_path / "drawer"
    stick.mkdir()
    with Journal(stick / "j", HEADING) as journal, pytest.MonkeyPatch.context() as monkeypatch:
        journal.write(at(16))
        journal.settle()
        shutil.copytree(stick, drawer)  # the content of the drive while it is unplugged
        FailingDisk(monkeypatch, journal.path, 0, errno.EIO)
        stick.rename(tmp_path / "removed")
        assert "was deleted, moved or replaced" in journal.settle()
        drawer.rename(stick)
        with pytest.raises(JournalError, match=INCOMPLETE):
            read_journal(journal.path)


def test_a_disk_unmounted_during_a_print_is_reported(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk") as mount, Journal(tmp_path / "disk" / "j", HEADING) as journal:
        if mount("-o", "remount,rw"):
            subprocess.run(["umount", "-l", str(tmp_path / "disk")], check=True)
        else:
            (tmp_path / "disk").rename(tmp_path / "gone")
        assert "was deleted, moved or replaced" in journal.settle()


def test_a_failing_sync_is_final_although_the_next_one_succeeds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Journal(tmp_path / "j", HEADING) as journal:
        journal.write(at(16))
        journal.settle()
        FailingDisk(monkeypatch, journal.path, 1, errno.EIO, times=1)
        journal.write(at(32))
        assert journal.settle().endswith("cannot be written: input/output error")
        journal.write(at(48))
        journal.settle()
    with pytest.raises(JournalError, match=INCOMPLETE):
        read_journal(tmp_path / "j")


def test_a_failing_disk_is_noticed_by_itself_and_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journal_module, "SYNC_S", 0.01)
    noted = threading.Event()
    monkeypatch.setattr(journal_module, "note_incomplete", lambda key: bool(noted.set()) or True)
    with Journal(tmp_path / "j", HEADING) as journal:
        FailingDisk(monkeypatch, journal.path, 1, errno.EIO)
        journal.write(at(16))
        assert noted.wait(60.0)
        assert journal.trouble


def test_a_mark_that_cannot_be_saved_anywhere_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a file").write_text("")
    monkeypatch.setattr(journals, "state_folders", lambda: (tmp_path / "a file" / "state",))
    monkeypatch.setattr(journals, "MEMORY", tmp_path / "a file")
    with Journal(tmp_path / "j", HEADING) as journal:
        FailingDisk(monkeypatch, journal.path, 0, errno.EIO)
        journal.write(at(16))
        journal.settle()
    assert journal.warning.endswith("; that could not be noted anywhere: delete it, and never resume from it")


def test_the_journal_of_a_print_that_never_began_is_deleted_and_where_that_fails_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    notes = tmp_path / "notes"
    notes.mkdir()
    keep_notes_in(notes, monkeypatch)
    journals = [Journal(tmp_path / name, HEADING) for name in ("deleted", "kept")]
    journals[0].abandon()
    assert (journals[0].path.exists(), list(notes.rglob("*.incomplete"))) == (False, [])
    monkeypatch.setattr(Path, "unlink", lambda *_given, **_options: os.rmdir(tmp_path))
    journals[1].abandon()
    with pytest.raises(JournalError, match=INCOMPLETE):
        read_journal(journals[1].path)
