"""A print whose disk fails, from `print` to `resume`: reported at once and at the end, then refused or resumed at the cut."""

import errno
import shutil
import subprocess
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from time import sleep

import pytest

from machine.cli.cli import main
from machine.link import journal as journal_module
from machine.printing.journal_folder import resumable_journals
from machine.simulator.faults import Fault
from machine.simulator.simulator import SimulatedPrinter
from profiles.folders import state_folder
from profiles.profile import load
from tests.machine.link.failing_disk import FailingDisk, full_disk, keep_notes_in, once_sent, small_disk

MACHINE = load().machine
START = ["G21", "G90", "M83", "M140 S60", "M104 S200", "G28 X Y Z", "G92 A0 C0", "M190 S60", "M109 S200", "G92 E0"]


def program_of(strokes: int) -> list[str]:
    """Part 1 upright, part 2 tilted."""
    laid = [f"G1 X{10 + k % 9} Y{10 + k % 7} E0.05 F1800" for k in range(strokes)]
    turned = [";PART:2 of 2", "G0 Z150 F900", "G0 A-20 C360 F6000", "G0 Z64 F900"]
    return [*START, ";PART:1 of 2", "G0 X10 Y10 Z60 F6000", *laid, *turned, *laid]


PROGRAM = program_of(80)
IN_PART_2 = len(PROGRAM) - 40
LOST = "this print can no longer be resumed: journal "
PROMISED = "continues it"


@pytest.fixture(autouse=True)
def _notes_of_their_own(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    keep_notes_in(tmp_path_factory.mktemp("notes"), monkeypatch)


@pytest.fixture
def program(tmp_path: Path) -> Path:
    (tmp_path / "p.gcode").write_text("\n".join(PROGRAM) + "\n", encoding="utf-8")
    return tmp_path / "p.gcode"


def cut_off_in_part_2(line: int = IN_PART_2) -> SimulatedPrinter:
    return SimulatedPrinter(MACHINE, faults=[Fault("reset", at=line, unit="line")])


def printed(program: Path, printer: SimulatedPrinter, journal: Path) -> int:
    log = journal.with_name("log")
    return main(["print", str(program), "--port", printer.path, "--journal", str(journal), "--log", str(log), "--force"])


def resumed(printer: SimulatedPrinter, journal: Path, *options: str) -> int:
    return main(["resume", str(journal), "--port", printer.path, *(options or ["--yes"])])


def test_after_a_power_cut_with_a_full_disk_the_print_resumes_in_its_part_and_pose(
    program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    journal, lines = tmp_path / "disk" / "journal", program_of(900)  # enough for records beyond the last block of a file
    program.write_text("\n".join(lines))
    with small_disk(tmp_path / "disk") as mount, cut_off_in_part_2(len(lines) - 60) as printer:
        mounted = mount("-o", "remount,rw")
        with ExitStack() as until_freed, pytest.MonkeyPatch.context() as monkeypatch:
            once_sent(monkeypatch, 60, lambda path: until_freed.enter_context(full_disk(path, mounted)))
            assert printed(program, printer, journal) == 1
        said = capsys.readouterr().err.replace("\n", " ")
        assert resumed(printer, journal) == 0
        at = printer.record.end[-1, :5].tolist()
    assert "p.gcode, part 2 of 2, line " in capsys.readouterr().err
    assert at[2:] == [64.0, -20.0, 360.0]
    assert f"tiltprint resume {journal} {PROMISED}" in said
    assert f"what was sent and received is not wholly in {journal.with_name('log')}" in said


def fails(number: int, after: int = 0, times: float = 1e9) -> Callable[[Path, pytest.MonkeyPatch], object]:
    return lambda path, monkeypatch: FailingDisk(monkeypatch, path, after, number, times)


def seen_by_its_thread(action: object) -> None:
    """Give the journal's thread, which syncs every SYNC_S, time to notice the action."""
    sleep(20 * journal_module.SYNC_S)


DISKS = {
    "no write succeeds any more": fails(errno.EIO),
    "it is read-only from now on": fails(errno.EROFS),
    "one write is cut short": fails(FailingDisk.SHORT, times=1),
    "one sync fails": lambda path, monkeypatch: seen_by_its_thread(
        FailingDisk(monkeypatch, path, 0, errno.EIO, 1, of=("fsync",))
    ),
    "the journal is deleted": lambda path, monkeypatch: seen_by_its_thread(path.rename(path.with_name("elsewhere"))),
}


@pytest.mark.parametrize("disk", DISKS)
def test_a_print_whose_disk_fails_continues_reports_that_and_is_not_resumed_later(
    program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], disk: str
) -> None:
    journal = tmp_path / "journal"
    with cut_off_in_part_2() as printer:
        with pytest.MonkeyPatch.context() as monkeypatch:
            monkeypatch.setattr(journal_module, "SYNC_S", 0.01)
            once_sent(monkeypatch, 60, lambda path: DISKS[disk](path, monkeypatch))
            assert printed(program, printer, journal) == 1
        said, moves = capsys.readouterr().err, len(printer.record.start)
        if (moved := tmp_path / "elsewhere").exists():
            moved.rename(journal)
        assert resumed(printer, journal) == 1
        assert len(printer.record.start) == moves
    assert (said.replace("\n", " ").count(LOST), PROMISED in said) == (2, False)
    refused = capsys.readouterr().err.replace("\n", " ")
    assert f"journal {journal} is incomplete" in refused


def test_a_successful_print_also_reports_that_its_journal_was_lost(
    program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with SimulatedPrinter(MACHINE) as printer, pytest.MonkeyPatch.context() as monkeypatch:
        once_sent(monkeypatch, 60, lambda path: DISKS["no write succeeds any more"](path, monkeypatch))
        assert printed(program, printer, tmp_path / "journal") == 0
    assert LOST in capsys.readouterr().err.splitlines()[-1]


def test_an_incomplete_journal_is_not_offered(
    program: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    offered = []
    for disk in ("it works", "one write is cut short"):
        with cut_off_in_part_2() as printer, pytest.MonkeyPatch.context() as failing:
            if disk in DISKS:
                once_sent(failing, 60, lambda path, disk=disk, failing=failing: DISKS[disk](path, failing))
            assert main(["print", str(program), "--port", printer.path, "--force"]) == 1
        offered.append([entry.line for entry in resumable_journals()])
    assert len(list((state_folder() / "journals").glob("*.journal"))) == 2
    assert offered[0] == offered[1]
    assert len(offered[0]) == 1


def half_printed(program: Path, journal: Path, printer: SimulatedPrinter) -> int:
    """Print until the cut in part 2; the number of moves made."""
    assert printed(program, printer, journal) == 1
    return len(printer.record.start)


@pytest.mark.parametrize(("file", "number", "after"), [
    ("rest", errno.ENOSPC, 0), ("rest", errno.EIO, 3), ("journal", errno.EIO, 1),
])  # fmt: skip
def test_nothing_moves_when_the_journals_of_a_resumed_print_cannot_be_written(
    program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], file: str, number: int, after: int
) -> None:
    journal, rest = tmp_path / "journal", tmp_path / "rest"
    with cut_off_in_part_2() as printer:
        moves = half_printed(program, journal, printer)
        with pytest.MonkeyPatch.context() as monkeypatch:
            FailingDisk(monkeypatch, tmp_path / file, after, number)
            assert resumed(printer, journal, "--yes", "--journal", str(rest)) == 1
        assert f"journal {tmp_path / file} cannot be written" in capsys.readouterr().err.replace("\n", " ")
        assert (len(printer.record.start), rest.exists()) == (moves, False)
        assert resumed(printer, journal) == (0 if (file, after) != ("journal", 1) else 1)


def test_a_journal_on_a_disk_that_is_read_only_now_is_not_resumed_for_it_could_be_resumed_twice(
    program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    journal = tmp_path / "disk" / "journal"
    with small_disk(tmp_path / "disk") as mount, cut_off_in_part_2() as printer, pytest.MonkeyPatch.context() as monkeypatch:
        moves = half_printed(program, journal, printer)
        if not mount("-o", "remount,ro"):
            FailingDisk(monkeypatch, journal, 0, errno.EROFS)
        assert resumed(printer, journal, "--yes", "--journal", str(tmp_path / "rest")) == 1
        assert (len(printer.record.start), (tmp_path / "rest").exists()) == (moves, False)
    assert f"journal {journal} cannot be written: read-only file system" in capsys.readouterr().err.replace("\n", " ")


def test_a_resumed_print_whose_journal_fails_cannot_be_resumed_from_either_journal(
    program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    journal, rest = tmp_path / "journal", tmp_path / "rest"
    with cut_off_in_part_2() as printer:
        half_printed(program, journal, printer)
        with pytest.MonkeyPatch.context() as monkeypatch:
            once_sent(monkeypatch, IN_PART_2 + 10, lambda path: DISKS["it is read-only from now on"](path, monkeypatch))
            assert resumed(printer, journal, "--yes", "--journal", str(rest)) == 0
        assert LOST in capsys.readouterr().err
        assert [resumed(printer, file) for file in (journal, rest)] == [1, 1]
    errors = capsys.readouterr().err.replace("\n", " ")
    assert f"was resumed already, its rest is in {rest}" in errors
    assert f"journal {rest} is incomplete" in errors


def test_after_a_restart_of_the_computer_the_user_must_check(
    program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = tmp_path / "journal"
    with cut_off_in_part_2() as printer:
        moves = half_printed(program, journal, printer)
        monkeypatch.setattr(journal_module, "BOOT_ID", tmp_path / "another")
        assert resumed(printer, journal) == 1
        assert len(printer.record.start) == moves
    errors = capsys.readouterr().err.replace("\n", " ")
    assert "this computer may have restarted since the print began, so the newest records may be missing" in errors
    assert "you must answer that question: resume at a terminal, without --yes" in errors


def test_a_journal_on_a_disk_unmounted_during_the_print_is_reported(
    program: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "disk"
    with small_disk(folder) as mount, SimulatedPrinter(MACHINE) as printer, pytest.MonkeyPatch.context() as monkeypatch:
        mounted = mount("-o", "remount,rw")

        def remove(_path: Path) -> None:
            if mounted:
                subprocess.run(["umount", "-l", str(folder)], check=True)
            else:
                shutil.move(folder, tmp_path / "drawer")

        once_sent(monkeypatch, 60, remove)
        assert printed(program, printer, folder / "journal") == 0
    assert f"{LOST}{folder / 'journal'} was deleted, moved or replaced" in capsys.readouterr().err
