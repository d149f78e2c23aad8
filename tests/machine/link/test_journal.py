"""The journal: records that survive a torn end, what is surely executed, bounded cost."""

import json
import os
import threading
from pathlib import Path
from zlib import crc32

import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.app.printer.journal_folder import KEPT, new_journal
from machine.link import journal as journal_module
from machine.link.journal import EVERY_LINES, Checkpoint, Journal, JournalHeading, mark_resumed, read_journal
from machine.reader.gcode_file import GcodeFile
from profiles.errors import JournalError, OutputError
from profiles.profile import load

HEADING = JournalHeading("/prints/a.gcode", "00" * 32, "a", {"machine": {"name": "m"}})
POSE = (1.5, -2.0, 60.25, 30.0, 725.0, 12.34567)


def at(line: int, state: str = "printing") -> Checkpoint:
    return Checkpoint(line + 4, line, max(0, line - 16), line + 5, POSE, state)


def written(path: Path, moments: list[Checkpoint]) -> Path:
    with Journal(path, HEADING) as journal:
        for moment in moments:
            journal.write(moment)
    return path


def test_what_was_marked_is_read_back(tmp_path: Path) -> None:
    story = read_journal(written(tmp_path / "j", [at(16), at(32)]))
    assert (story.heading, story.last, story.torn, story.finished) == (HEADING, at(32), 0, False)


def test_every_record_is_one_checked_line_of_text(tmp_path: Path) -> None:
    lines = written(tmp_path / "j", [at(16), at(32)]).read_bytes().splitlines()
    assert len(lines) == 3
    for line in lines:
        assert line[:8] == b"%08x" % crc32(line[9:])
        json.loads(line[9:])


@given(cut=st.integers(0, 400))
def test_a_torn_end_costs_only_what_is_torn(tmp_path_factory: pytest.TempPathFactory, cut: int) -> None:
    path = written(tmp_path_factory.mktemp("torn") / "j", [at(16 * k) for k in range(1, 9)])
    whole = path.read_bytes()
    left = whole[: max(len(whole) - cut, whole.index(b"\n") + 1)]
    path.write_bytes(left)
    records = left.count(b"\n") - 1
    assert read_journal(path).last == (at(16 * records) if records else Checkpoint())


def test_a_disk_that_left_zeros_at_the_end_costs_only_the_end(tmp_path: Path) -> None:
    path = written(tmp_path / "j", [at(16), at(32)])
    path.write_bytes(path.read_bytes() + bytes(3000))
    story = read_journal(path)
    assert (story.last, story.torn) == (at(32), 1)


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_record_damaged_before_the_end_is_refused_by_its_number(tmp_path: Path, index: int) -> None:
    path = written(tmp_path / "j", [at(16), at(32), at(48)])
    lines = path.read_bytes().splitlines(keepends=True)
    lines[index] = lines[index].replace(b"1", b"2").replace(b"0", b"1")
    path.write_bytes(b"".join(lines))
    with pytest.raises(JournalError, match=r"is no journal|damaged: record 2|damaged: record 3"):
        read_journal(path)


@pytest.mark.parametrize(("content", "words"), [
    (b"", "is empty"),
    (b"G28\nG1 X5\n", "is no journal of a print"),
    (b"%08x {}\n" % crc32(b"{}"), "another version"),
    (b'%08x {"format":2}\n' % crc32(b'{"format":2}'), "does not tell program and profile"),
    (os.urandom(5000), "is no journal"),
])  # fmt: skip
def test_what_is_no_journal_is_refused_with_a_sentence(tmp_path: Path, content: bytes, words: str) -> None:
    (tmp_path / "j").write_bytes(content)
    with pytest.raises(JournalError, match=words):
        read_journal(tmp_path / "j")


def test_a_journal_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(JournalError, match="cannot be read: no such file"):
        read_journal(tmp_path / "none")


def test_a_journal_never_replaces_another(tmp_path: Path) -> None:
    written(tmp_path / "j", [at(16)])
    with pytest.raises(OutputError, match="exists already"):
        Journal(tmp_path / "j", HEADING)


def test_a_folder_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written: no such file or directory"):
        Journal(tmp_path / "none" / "j", HEADING)


def test_notes_are_taken_ten_times_a_second(tmp_path: Path) -> None:
    with Journal(tmp_path / "j", HEADING) as journal:
        for step in range(1, 101):
            journal.update(at(step), 0.1 + step / 100)
    assert len((tmp_path / "j").read_bytes().splitlines()) == 1 + 10


def test_the_sender_is_never_sixteen_lines_ahead_of_the_record(tmp_path: Path) -> None:
    with Journal(tmp_path / "j", HEADING) as journal:
        journal.write(at(100))
        assert [journal.record_due(104 + ahead) for ahead in (0, EVERY_LINES - 1, EVERY_LINES)] == [False, False, True]


def test_a_record_in_a_hurry_is_on_the_disk_before_its_second_is_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced, fsync = threading.Semaphore(0), os.fsync

    def sync(descriptor: int) -> None:
        fsync(descriptor)
        synced.release()

    monkeypatch.setattr(journal_module, "SYNC_S", 1e6)
    monkeypatch.setattr(os, "fsync", sync)
    with Journal(tmp_path / "j", HEADING) as journal:
        assert synced.acquire(timeout=60.0)  # the heading
        journal.write(at(16), hurry=True)
        assert synced.acquire(timeout=60.0)
        assert read_journal(tmp_path / "j").last == at(16)


def test_nothing_new_is_not_noted(tmp_path: Path) -> None:
    with Journal(tmp_path / "j", HEADING) as journal:
        for second in range(100):
            journal.update(at(3), float(second))
    assert len((tmp_path / "j").read_bytes().splitlines()) == 2


def test_a_resumed_journal_names_the_one_that_goes_on_even_after_a_torn_end(tmp_path: Path) -> None:
    path = written(tmp_path / "j", [at(16), at(32)])
    path.write_bytes(path.read_bytes() + b"0123abcd [4")
    mark_resumed(path, read_journal(path), tmp_path / "rest")
    story = read_journal(path)
    assert (story.continued_in, story.last.executed, story.torn) == (str(tmp_path / "rest"), 16, 0)


def test_the_program_of_a_model_is_kept_beside_its_journal(tmp_path: Path) -> None:
    with new_journal(["G28", "G1 X5"], load(), "demo:figure", None, tmp_path / "j") as journal:
        pass
    heading = read_journal(journal.path).heading
    assert heading.program == str((tmp_path / "j.gcode").resolve())
    assert list(GcodeFile(Path(heading.program))) == ["G28", "G1 X5"]
    assert heading.sha256 == GcodeFile(tmp_path / "j.gcode").sha256()
    assert [oct(file.stat().st_mode & 0o777) for file in (journal.path, tmp_path / "j.gcode")] == ["0o600"] * 2


def test_a_journal_that_cannot_be_kept_is_one_sentence(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "tiltprint").mkdir()
    (tmp_path / "tiltprint" / "journals").write_text("a file", encoding="utf-8")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with pytest.raises(OutputError, match=r"folder .*journals cannot be written: file exists"):
        new_journal(["G28"], load(), "a")


def test_only_the_newest_journals_and_their_programs_are_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))  # what prints before have left there is not counted
    for number in range(KEPT + 3):
        with new_journal([f"G1 X{number}"], load(), f"model {number}") as journal:
            pass
    folder = journal.path.parent
    assert len(list(folder.glob("*.journal"))) == len(list(folder.glob("*.gcode"))) == KEPT
    assert journal.path.exists()
