"""The journal: whole records after a power cut, the lines certainly executed, and bounded cost."""

import json
import os
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from zlib import crc32

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.gcode.lines import GcodeFile
from machine.link import journal as journal_module
from machine.link.journal import BLOCK_BYTES, EVERY_LINES, SLOTS, Checkpoint, Journal, JournalHeading, mark_resumed, read_journal
from machine.link.print_state import PrintState
from machine.printing.journal_folder import KEPT, new_journal
from profiles.errors import JournalError, OutputError
from profiles.profile import load

HEADING = JournalHeading("/prints/a.gcode", "00" * 32, "a", {"machine": {"name": "m"}})
POSE = (1.5, -2.0, 60.25, 30.0, 725.0, 12.34567)


def at(line: int, state: PrintState = PrintState.PRINTING) -> Checkpoint:
    return Checkpoint(line + 4, line, max(0, line - 16), line + 5, POSE, state)


def written(path: Path, moments: list[Checkpoint]) -> Path:
    with Journal(path, HEADING) as journal:
        for moment in moments:
            journal.write(moment)
    return path


def test_a_recorded_mark_is_read_back(tmp_path: Path) -> None:
    story = read_journal(written(tmp_path / "j", [at(16), at(32)]))
    assert (story.heading, story.last, story.torn, story.finished) == (HEADING, at(32), 0, False)


def test_every_record_is_one_checked_line_of_text(tmp_path: Path) -> None:
    lines = written(tmp_path / "j", [at(16), at(32)]).read_bytes().splitlines()
    assert len(lines) == 1 + SLOTS
    for line in lines:
        assert line[:8] == b"%08x" % crc32(line[9:])
        json.loads(line[9:])


@pytest.fixture
def restarted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[], None]:
    """Simulates a restart of the computer by a new boot ID."""
    boot = tmp_path / "boot"
    boot.write_text("first\n")
    monkeypatch.setattr(journal_module, "BOOT_ID", boot)
    return lambda: monkeypatch.setattr(journal_module, "BOOT_ID", tmp_path / "boot that nobody knows")


def damage(path: Path, slot: int, content: bytes) -> None:
    whole = path.read_bytes()
    begin = len(whole) - (SLOTS - slot) * BLOCK_BYTES
    path.write_bytes(whole[:begin] + content + whole[begin + len(content) :])


@settings(max_examples=40)
@given(records=st.integers(0, 7), slot=st.integers(0, SLOTS - 1), content=st.binary(min_size=1, max_size=BLOCK_BYTES))
def test_a_power_cut_that_tears_a_record_leaves_one_before_it(
    tmp_path_factory: pytest.TempPathFactory, records: int, slot: int, content: bytes
) -> None:
    path = tmp_path_factory.mktemp("torn") / "j"
    with pytest.MonkeyPatch.context() as monkeypatch, Journal(path, HEADING) as journal:
        monkeypatch.setattr(journal_module, "boot_id", lambda: "")
        for line in range(16, 16 * records + 1, 16):
            journal.write(at(line))
            journal.settle()
            journal.settle()  # nothing new, as in a long pause
        damage(path, slot, b"!" + content[1:])
        story = read_journal(path)
    assert (story.torn, story.last in [at(16 * records), at(16 * records - 16), Checkpoint()]) == (1, True)
    assert story.last.acknowledged >= 16 * records - 16


def test_a_torn_record_is_damage_where_the_computer_has_not_restarted(tmp_path: Path, restarted: Callable[[], None]) -> None:
    path = written(tmp_path / "j", [at(16), at(32)])
    damage(path, 0, b"torn")
    with pytest.raises(JournalError, match="is damaged: 1 of its 3 records cannot be read"):
        read_journal(path)
    restarted()
    assert read_journal(path).torn == 1


def test_a_journal_reports_whether_its_computer_has_restarted(tmp_path: Path, restarted: Callable[[], None]) -> None:
    path = written(tmp_path / "j", [at(16)])
    assert read_journal(path).computer_ran_on
    restarted()
    assert not read_journal(path).computer_ran_on


@pytest.mark.parametrize("size", [BLOCK_BYTES, 3 * BLOCK_BYTES - 1, 0])
def test_a_journal_without_its_end_is_refused(tmp_path: Path, size: int) -> None:
    path = written(tmp_path / "j", [at(16), at(32)])
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(JournalError, match=r"is damaged|is empty"):
        read_journal(path)


def test_a_journal_never_grows(tmp_path: Path) -> None:
    with Journal(tmp_path / "j", HEADING) as journal:
        before = journal.path.stat()
        for line in range(1000):
            journal.write(at(line))
        after = journal.path.stat()
    assert (after.st_size, after.st_blocks) == (before.st_size, before.st_blocks)


@pytest.mark.parametrize(("content", "words"), [
    (b"", "is empty"),
    (b"G28\nG1 X5\n", "is not the journal of a print"),
    (b"%08x {}\n" % crc32(b"{}"), "another version"),
    (b'%08x {"format":2}\n' % crc32(b'{"format":2}'), "another version of this program: this one reads format 3"),
    (b'%08x {"format":3}\n' % crc32(b'{"format":3}'), "lacks the program or the profile"),
    (os.urandom(5000), "is not the journal"),
])  # fmt: skip
def test_an_invalid_journal_is_refused_with_a_message(tmp_path: Path, content: bytes, words: str) -> None:
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
    assert read_journal(tmp_path / "j").records == 10


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


def test_an_unchanged_position_is_not_recorded_again(tmp_path: Path) -> None:
    with Journal(tmp_path / "j", HEADING) as journal:
        for second in range(100):
            journal.update(at(3), float(second))
    assert read_journal(tmp_path / "j").records == 1


@given(records=st.integers(0, 7))
def test_a_resumed_journal_names_its_continuation(tmp_path_factory: pytest.TempPathFactory, records: int) -> None:
    path = written(tmp_path_factory.mktemp("resumed") / "j", [at(16 * k) for k in range(1, records + 1)])
    before = read_journal(path)
    mark_resumed(path, before, Path("rest"))
    after = read_journal(path)
    assert (after.last.continued_in, after.last.executed) == ("rest", before.last.executed)


@pytest.mark.parametrize(("state", "word"), [
    (PrintState.PRINTING, "printing"), (PrintState.PAUSED, "paused"),
    (PrintState.DONE, "finished"), (PrintState.CANCELLED, "left"),
])  # fmt: skip
def test_a_state_has_the_word_in_the_file_that_it_always_had(state: PrintState, word: str, tmp_path: Path) -> None:
    with Journal(tmp_path / "j", HEADING) as journal:
        journal.write(at(20, state))
    assert f'12.34567],"{word}"]'.encode() in journal.path.read_bytes()
    assert read_journal(journal.path).last == at(20, state)


def test_a_record_without_a_z_offset_reads_as_one_of_0_mm(tmp_path: Path) -> None:
    offsets = [at(4), replace(at(5), z_offset_mm=-0.05)]
    assert [read_journal(written(tmp_path / f"{k}", [moment])).last for k, moment in enumerate(offsets)] == offsets
    assert b'"printing"]' in (tmp_path / "0").read_bytes()  # the format of earlier versions


def test_a_record_says_that_the_firmware_cannot_change_the_z_offset(tmp_path: Path) -> None:
    path = written(tmp_path / "j", [at(4), replace(at(5), z_offset_mm=0.1, shifts_z=False)])
    assert (read_journal(path).last.z_offset_mm, read_journal(path).last.shifts_z) == (0.1, False)
    path = written(tmp_path / "k", [at(4), replace(at(5), shifts_z=False)])
    assert (read_journal(path).last.z_offset_mm, read_journal(path).last.shifts_z) == (0.0, False)


def test_a_record_with_a_state_that_no_print_has_is_damage(tmp_path: Path) -> None:
    with Journal(tmp_path / "j", HEADING) as journal:
        journal.write(replace(at(20), state="dancing"))  # type: ignore[arg-type]
    with pytest.raises(JournalError, match="is damaged: record 1 holds no state of a print"):
        read_journal(journal.path)


def test_a_journal_that_was_resumed_elsewhere_meanwhile_is_not_resumed_again(tmp_path: Path) -> None:
    path = written(tmp_path / "j", [at(16)])
    read = read_journal(path)
    mark_resumed(path, read, tmp_path / "rest")
    with pytest.raises(JournalError, match="has changed since it was read"):
        mark_resumed(path, read, tmp_path / "another")


def test_a_path_too_long_for_a_record_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "j", [at(16)])
    with pytest.raises(JournalError, match="cannot note a path as long as that"):
        mark_resumed(path, read_journal(path), Path("x" * BLOCK_BYTES))
    assert read_journal(path).last == at(16)


def test_the_program_of_a_model_is_saved_next_to_its_journal(tmp_path: Path) -> None:
    with new_journal(["G28", "G1 X5"], load(), "demo:figure", None, tmp_path / "j") as journal:
        pass
    heading = read_journal(journal.path).heading
    assert heading.program == str((tmp_path / "j.gcode").resolve())
    assert list(GcodeFile(Path(heading.program))) == ["G28", "G1 X5"]
    assert heading.sha256 == GcodeFile(tmp_path / "j.gcode").sha256()
    assert [oct(file.stat().st_mode & 0o777) for file in (journal.path, tmp_path / "j.gcode")] == ["0o600"] * 2


def test_a_journal_that_cannot_be_written_gives_a_one_line_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "tiltprint").mkdir()
    (tmp_path / "tiltprint" / "journals").write_text("a file", encoding="utf-8")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    with pytest.raises(OutputError, match=r"folder .*journals cannot be written: file exists"):
        new_journal(["G28"], load(), "a")


def test_only_the_newest_journals_and_their_programs_are_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))  # journals of earlier prints are not counted
    for number in range(KEPT + 3):
        with new_journal([f"G1 X{number}"], load(), f"model {number}") as journal:
            pass
    folder = journal.path.parent
    assert len(list(folder.glob("*.journal"))) == len(list(folder.glob("*.gcode"))) == KEPT
    assert journal.path.exists()
