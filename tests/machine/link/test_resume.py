"""Resuming a print whose host or printer has died: the line to continue at, and the path back to it."""

import json
import re
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from io import StringIO
from pathlib import Path
from threading import Event as Flag

import numpy as np
import pytest

from machine.cli.cli import main
from machine.gcode.lines import GcodeFile
from machine.gcode.modes import ModalState, axes_of
from machine.link import status
from machine.link.journal import Checkpoint, Journal, JournalContents, JournalHeading, read_journal
from machine.link.medium import SERIAL, Medium, Wire
from machine.link.pause.park_moves import homes_z
from machine.link.pending_commands import Command, Control
from machine.link.port import open_port
from machine.link.print_state import PrintState, PrintStatus
from machine.link.protocol.framing import frame
from machine.link.resume import InterruptedPrint, ResumePoint, heights_mm, plan_resume, read_interrupted_print
from machine.link.status import PrinterStatus
from machine.link.stream import print_lines
from machine.printing.journal_folder import continue_journal
from machine.printing.serial_log import tap
from machine.simulator import commands
from machine.simulator.board import BuildOptions
from machine.simulator.faults import Fault, FaultScript
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import FirmwareError, JournalError, PrinterError, SilenceError
from profiles.profile import Profile, load
from tests.machine.peers import happened, on_terminal
from tests.machine.virtual_printer import PATH, VirtualPrinter

PROFILE = load()
LIMIT = 95
START = ["G21", "G90", "M83", "M140 S60", "M104 S200", "G28 X Y Z", "G92 A0 C0", "M190 S60", "M109 S200", "G92 E0", "M106 S128"]


def part(number: int, tilt: int, turn: int, strokes: int = 90) -> list[str]:
    way = [f";PART:{number} of 3", "G1 E-2 F2100", "G0 Z150 F900", f"G0 A{tilt} C{turn} F6000", f"G0 X10 Y10 F{6000 + number}"]
    lines = [f"G1 X{10 + 7 * i % 23 + 0.01 * i:.2f} Y{10 + 5 * i % 19} E0.0{5 + i % 3} F1800" for i in range(strokes)]
    layer = [";LAYER_CHANGE", f"G0 Z{60 + number}.2 F900"]
    return [*way, f"G0 Z{60 + number} F900", "G1 E2 F2100", *lines[: strokes // 2], *layer, *lines[strokes // 2 :]]


PROGRAM = [*START, *part(1, 5, 15), *part(2, 30, 725), *part(3, -20, 360), "M104 S0", "M140 S0"]


class KilledError(BaseException):
    """The host is killed: no cleanup runs."""


class _Mortal:
    """A wire whose host dies after a number of writes; after that, nothing is sent or received."""

    def __init__(self, wire: Wire, writings: int) -> None:
        self._wire, self._left, self.name = wire, writings, wire.name
        self.discard, self.close = wire.discard, wire.close

    def write(self, data: bytes) -> None:
        self._left -= b" M114*" not in data  # a query for the number of waiting moves does not count
        if self._left < 0:
            raise KilledError
        self._wire.write(data)

    def read(self) -> bytes:
        if self._left < 0:
            raise KilledError
        return self._wire.read()


@pytest.fixture
def text(tmp_path: Path) -> GcodeFile:
    (tmp_path / "p.gcode").write_text("\n".join(PROGRAM) + "\n", encoding="utf-8")
    return GcodeFile(tmp_path / "p.gcode")


def journal_of(text: GcodeFile, name: str) -> Journal:
    profile = PROFILE.model_dump(mode="json")
    return Journal(text.path.with_name(name), JournalHeading(str(text.path), text.sha256(), "p", profile))


def killed(text: GcodeFile, printer: VirtualPrinter, writings: int) -> JournalContents:
    """Print until the host dies."""
    medium = replace(printer.medium, open=lambda name, baud: _Mortal(printer.medium.open(name, baud), writings))
    with journal_of(text, "first") as journal, pytest.raises(KilledError):
        print_lines(text, PATH, medium=medium, profile=PROFILE, journal=journal)
    return read_journal(journal.path)


def cut_off(program: Iterable[str], last: Checkpoint) -> InterruptedPrint:
    return read_interrupted_print(program, last, PROFILE, LIMIT)


def resumed(text: GcodeFile, printer: VirtualPrinter, story: JournalContents) -> tuple[ResumePoint, list[str]]:
    """Resume; the decision, and the commands sent."""
    plans: list[ResumePoint] = []
    sent: list[bytes] = []

    def begin(seen: PrinterStatus) -> ResumePoint:
        plans.append(plan_resume(cut_off(text, story.last), seen, PROFILE))
        return plans[0]

    with journal_of(text, "rest") as journal:
        print_lines(
            text,
            PATH,
            medium=tap(lambda way, data: sent.append(data) if way == ">" else None, printer.medium),
            profile=PROFILE,
            journal=journal,
            begin=begin,
        )
    assert read_journal(journal.path).finished
    return plans[0], [re.sub(r"^N\d+ |\*\d+$", "", line) for line in b"".join(sent).decode().splitlines()]


def moved(printer: VirtualPrinter) -> np.ndarray:
    """X Y Z A C of the end points, and the filament, of the executed moves."""
    record = printer.record
    return np.column_stack([record.end[:, :5], record.end[:, 5] - record.start[:, 5]]).round(4)


@pytest.fixture(scope="module")
def whole() -> np.ndarray:
    printer = VirtualPrinter(PROFILE.machine)
    print_lines(PROGRAM, PATH, medium=printer.medium)
    return moved(printer)


@pytest.mark.parametrize("writings", [50, 90, 120, 233])
def test_after_the_host_has_died_the_rest_follows_without_gap_or_overlap(
    text: GcodeFile, whole: np.ndarray, writings: int
) -> None:
    printer = VirtualPrinter(PROFILE.machine)
    story = killed(text, printer, writings)
    way, _ = resumed(text, printer, story)
    assert way.reason.endswith("nothing is repeated")
    assert np.array_equal(moved(printer), whole)


def test_a_print_that_had_hardly_started_restarts_from_the_first_line(text: GcodeFile, whole: np.ndarray) -> None:
    printer = VirtualPrinter(PROFILE.machine)
    way, _ = resumed(text, printer, killed(text, printer, 9))
    assert (way.line, way.before) == (1, ())
    assert np.array_equal(moved(printer)[-len(whole) :], whole)


def cold(text: GcodeFile, writings: int) -> tuple[VirtualPrinter, JournalContents, ResumePoint, list[str]]:
    """The power of host and printer fails and comes back."""
    printer = VirtualPrinter(PROFILE.machine)
    story = killed(text, printer, writings)
    printer.firmware.reset()
    return printer, story, *resumed(text, printer, story)


def test_after_a_power_cut_all_that_was_not_surely_printed_is_printed_again(text: GcodeFile, whole: np.ndarray) -> None:
    printer, story, way, _ = cold(text, 233)
    assert way.line == story.last.executed + 1
    done = moved(printer)[:, [0, 1, 5]]
    rest = whole[sum(is_move(line) for line in PROGRAM[: way.line - 1]) :][:, [0, 1, 5]]
    assert np.array_equal(done[-len(rest) :], rest)


def is_move(line: str) -> bool:
    return re.match(r"G[01] .*[XYZACE]", line) is not None


def test_after_a_power_cut_z_and_the_table_are_neither_homed_nor_turned(text: GcodeFile) -> None:
    _, _, way, _ = cold(text, 233)
    homed = [line for line in way.before if line.startswith("G28")]
    assert homed == ["G28 X Y"]
    assert not [line for line in way.before if re.match(r"G[01] .*[AC]", line)]


def test_after_a_power_cut_the_bed_heats_first_and_the_tip_rises_before_anything_else_moves(text: GcodeFile) -> None:
    _, _, way, _ = cold(text, 233)
    order = [next(i for i, line in enumerate(way.before) if line.startswith(word)) for word in (
        "G92 X", "M190 S60", "M109 S200", "G1 E-", "G0 Z", "G28 X Y", "G0 X", "G1 Z", "M106")]  # fmt: skip
    assert order == sorted(order)


def test_the_turns_of_the_table_are_not_forgotten(text: GcodeFile) -> None:
    _, _, way, _ = cold(text, 150)
    assert any(line.startswith("G92 X") and line.endswith("A30 C725") for line in way.before)


def test_a_parked_printer_resumes_without_homing_after_its_host_has_died(text: GcodeFile, whole: np.ndarray) -> None:
    printer = VirtualPrinter(PROFILE.machine)
    story = killed(text, printer, 233)
    line = printer.medium.open(PATH, 0)
    line.write(b"G91\nG0 Z20 F900\nG90\nG0 X-100 Y-100 F6000\nM400\n")
    printer.medium.wait(30.0)
    line.close()
    way, sent = resumed(text, printer, story)
    assert "has not restarted and knows its place" in way.reason
    assert not [line for line in sent if line.startswith(("G28", "G92 X"))]
    rest = whole[sum(is_move(line) for line in PROGRAM[: way.line - 1]) :]
    assert np.array_equal(moved(printer)[-len(rest) :], rest)


def test_a_second_death_is_resumed_from_the_second_journal(text: GcodeFile, whole: np.ndarray) -> None:
    printer = VirtualPrinter(PROFILE.machine)
    story = killed(text, printer, 120)
    medium = replace(printer.medium, open=lambda name, baud: _Mortal(printer.medium.open(name, baud), 60))
    with journal_of(text, "second") as journal, pytest.raises(KilledError):
        print_lines(
            text, PATH, medium=medium, profile=PROFILE, journal=journal,
            begin=lambda seen: plan_resume(cut_off(text, story.last), seen, PROFILE),
        )  # fmt: skip
    again = read_journal(journal.path)
    assert again.last.executed > story.last.executed
    resumed(text, printer, again)
    assert np.array_equal(moved(printer), whole)


def shifted_then_killed(text: GcodeFile, printer: VirtualPrinter) -> JournalContents:
    """Print with feed at 150 % and the tip raised by 0.1 mm from line 50 until the host dies."""
    control, asked_for = Control(), [(Command.FEED, 150.0), (Command.BABYSTEP, 0.1)]

    def watch(status: PrintStatus) -> None:
        while asked_for and status.file_line >= 50:
            control.ask(*asked_for.pop())

    medium = replace(printer.medium, open=lambda name, baud: _Mortal(printer.medium.open(name, baud), 233))
    with journal_of(text, "first") as journal, pytest.raises(KilledError):
        print_lines(text, PATH, medium=medium, profile=PROFILE, journal=journal, control=control, on_progress=watch)
    return read_journal(journal.path)


def heights_of_strokes(printer: VirtualPrinter) -> set[float]:
    """The real position of the Z axis in the strokes of the third part."""
    record = printer.record
    rows = (record.end[:, 5] - record.start[:, 5] > 1e-9) & (record.end[:, 3] == -20.0)
    return set(np.round(record.end[rows & (record.end[:, 0] != record.start[:, 0]), 2], 3).tolist())


def test_a_print_resumed_after_a_host_crash_keeps_its_z_offset_and_undoes_it_at_the_end(text: GcodeFile) -> None:
    printer = VirtualPrinter(PROFILE.machine)
    story = shifted_then_killed(text, printer)
    way, sent = resumed(text, printer, story)
    assert (story.last.z_offset_mm, way.z_offset_mm) == (0.1, 0.1)
    assert "it must still have the Z offset of +0.1 mm" in way.reason
    assert heights_of_strokes(printer) == {63.1, 63.3}
    assert [line for line in sent if line.startswith(("M290", "M22"))] == ["M220 S100", "M221 S100", "M290 Z-0.100"]


def test_a_z_offset_requested_before_a_resumed_print_moves_is_added_to_that_of_the_interrupted_print(text: GcodeFile) -> None:
    printer, control, shown = VirtualPrinter(PROFILE.machine), Control(), list[float]()
    story = shifted_then_killed(text, printer)
    control.ask(Command.BABYSTEP, 0.05)
    print_lines(
        text, PATH, medium=printer.medium, profile=PROFILE, control=control,
        on_progress=lambda status: shown.append(status.z_offset_mm),
        begin=lambda seen: plan_resume(cut_off(text, story.last), seen, PROFILE),
    )  # fmt: skip
    assert max(shown) == 0.15
    assert 63.35 in heights_of_strokes(printer)
    assert printer.record.end[-1, 2] == pytest.approx(moved(printer)[-1, 2])


def test_a_host_that_dies_before_a_resumed_print_moves_leaves_a_journal_of_what_was_printed(text: GcodeFile) -> None:
    for writings in range(1, 25):
        printer = VirtualPrinter(PROFILE.machine)
        story = killed(text, printer, 233)
        text.path.with_name("first").unlink()
        done = story.last.executed
        printer.medium.wait(1.0)  # a record may be due at once
        medium = replace(
            printer.medium,
            open=lambda name, baud, left=writings: _Mortal(printer.medium.open(name, baud), left),  # noqa: B023
        )
        with journal_of(text, f"after {writings}") as journal:

            def begin(seen: PrinterStatus, journal: Journal = journal, last: Checkpoint = story.last) -> ResumePoint:
                way = plan_resume(cut_off(text, last), seen, PROFILE)
                journal.write(replace(last, sent=way.line - 1, acknowledged=way.line - 1, executed=way.line - 1))
                return way

            with suppress(KilledError):
                print_lines(text, PATH, medium=medium, profile=PROFILE, journal=journal, begin=begin)
            if journal.last != Checkpoint():  # the printer's position had been queried
                assert journal.last.executed >= done


def test_after_a_power_cut_the_axis_keeps_the_z_offset_which_marlin_does_not_set_before_z_is_homed(text: GcodeFile) -> None:
    printer = VirtualPrinter(PROFILE.machine)
    story = shifted_then_killed(text, printer)
    stands_mm = printer.record.end[-1, 2]
    printer.firmware.reset()
    way, sent = resumed(text, printer, story)
    set_mm = next(float(match[1]) for line in way.before if (match := re.match(r"G92 X.* Z(\S+)", line)))
    assert set_mm == pytest.approx(stands_mm - 0.1, abs=0.005)
    assert way.before.index("M17") < way.before.index("G28 X Y")
    assert (way.z_offset_mm, way.reason.endswith("its Z offset of +0.1 mm is kept")) == (0.0, True)
    assert not [line for line in sent if line.startswith("M290")]
    assert heights_of_strokes(printer) == {63.1, 63.3}


def test_after_a_power_cut_a_further_z_offset_is_refused_because_marlin_would_ignore_it(text: GcodeFile) -> None:
    printer, control, messages = VirtualPrinter(PROFILE.machine), Control(), list[str]()
    story = shifted_then_killed(text, printer)
    printer.firmware.reset()

    def watch(status: PrintStatus) -> None:
        messages.append(status.message)
        if len(messages) == 60:
            control.ask(Command.BABYSTEP, 0.05)

    print_lines(
        text, PATH, medium=printer.medium, profile=PROFILE, control=control, on_progress=watch,
        begin=lambda seen: plan_resume(cut_off(text, story.last), seen, PROFILE),
    )  # fmt: skip
    assert "no Z offset: this firmware cannot shift Z now (Marlin needs BABYSTEPPING, and Z homed since it started)" in messages
    assert heights_of_strokes(printer) == {63.1, 63.3}


def test_a_host_crash_after_a_power_cut_still_records_that_marlin_ignores_a_z_offset(text: GcodeFile) -> None:
    printer = VirtualPrinter(PROFILE.machine)
    story = shifted_then_killed(text, printer)
    printer.firmware.reset()
    medium = replace(printer.medium, open=lambda name, baud: _Mortal(printer.medium.open(name, baud), 40))
    with journal_of(text, "second") as journal, pytest.raises(KilledError):
        print_lines(
            text, PATH, medium=medium, profile=PROFILE, journal=journal,
            begin=lambda seen: plan_resume(cut_off(text, story.last), seen, PROFILE),
        )  # fmt: skip
    again = read_journal(journal.path)
    way, _ = resumed(text, printer, again)
    assert (again.last.shifts_z, way.shifts_z, way.homes) == (False, False, False)


@pytest.mark.parametrize(("block", "homes"), [
    ("", False), ("G28 X Y", False), ("; G28 Z", False), ("G28 Z F100\nG28 X Y", True), ("g28", True), ("G28 XZ ; all", True),
    ("G28 O", True), ("G28 R5", True), ("G28XYZ", True), ("G28 X0 Y0", False),
])  # fmt: skip
def test_a_resume_block_homes_z_by_g28_alone_or_with_that_letter(block: str, homes: bool) -> None:
    gcode = PROFILE.machine.gcode.model_copy(update={"resume": block})
    assert homes_z(PROFILE.machine.model_copy(update={"gcode": gcode})) is homes


def test_a_restarted_print_reports_that_its_z_offset_is_lost() -> None:
    way = plan_resume(replace(point(12), checkpoint=Checkpoint(12, 12, 12, 100, z_offset_mm=-0.05)), asked(), PROFILE)
    assert (way.line, way.z_offset_mm) == (1, 0.0)
    assert way.reason.endswith("set its Z offset of -0.05 mm again")


def test_a_firmware_that_cannot_set_the_z_offset_of_an_interrupted_print_is_refused_before_anything_moves(
    text: GcodeFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    printer = VirtualPrinter(PROFILE.machine)
    story = shifted_then_killed(text, printer)
    printer.firmware.reset()
    moves = len(printer.record.end)
    monkeypatch.setattr(commands, "THERE", ())
    gcode = PROFILE.machine.gcode.model_copy(update={"resume": "G28 Z\nG28 X Y\nG0 Z{clear_z_mm} F900"})
    homing = PROFILE.model_copy(update={"machine": PROFILE.machine.model_copy(update={"gcode": gcode})})
    with pytest.raises(PrinterError, match=r"a Z offset of \+0.1 mm, which this firmware cannot set: nothing was moved"):
        print_lines(
            text, PATH, medium=printer.medium, profile=PROFILE,
            begin=lambda seen: plan_resume(cut_off(text, story.last), seen, homing),
        )  # fmt: skip
    assert len(printer.record.end) == moves


@pytest.mark.parametrize("advanced", [True, False])
def test_a_power_cut_at_any_line_never_resumes_beyond_what_was_executed(text: GcodeFile, advanced: bool) -> None:
    for line in range(20, len(PROGRAM), 47):
        fault = FaultScript((Fault("reset", at=line, unit="line"),))
        printer = VirtualPrinter(PROFILE.machine, None if advanced else BuildOptions(advanced_ok=False), fault)
        with journal_of(text, f"at {line}") as journal, pytest.raises(FirmwareError):
            print_lines(text, PATH, medium=printer.medium, profile=PROFILE, journal=journal)
        last = read_journal(journal.path).last
        surely = sum(is_move(entry) for entry in PROGRAM[: last.executed])
        assert surely <= len(printer.record.start), line
        assert last.executed <= last.acknowledged <= last.sent


@pytest.mark.parametrize("advanced", [True, False])
@pytest.mark.parametrize("line", range(60, len(PROGRAM), 23))
def test_after_a_power_cut_few_moves_are_done_twice_and_the_height_is_known_while_it_prints(
    text: GcodeFile, line: int, advanced: bool
) -> None:
    """15 blocks of the planner (BLOCK_BUFFER_SIZE 16 in Configuration_adv.h), four lines not recorded, four lines in flight."""
    fault = FaultScript((Fault("reset", at=line, unit="line"),))
    printer = VirtualPrinter(PROFILE.machine, BuildOptions(advanced_ok=advanced), fault)
    with journal_of(text, "first") as journal, pytest.raises(FirmwareError):
        print_lines(text, PATH, medium=printer.medium, profile=PROFILE, journal=journal)
    point, record = cut_off(text, read_journal(journal.path).last), printer.record
    assert len(record.end) - sum(is_move(command) for command in PROGRAM[: point.line - 1]) <= 15 + 4 + (4 if advanced else 1)
    at = heights_mm(point)
    assert any(abs(z - record.end[-1, 2]) < 0.01 for z in at)
    assert len(at) == 1 or record.end[-1, 5] <= record.start[-1, 5]


class _Frozen:
    """A wire whose printer always reports a full planner."""

    def __init__(self, wire: Wire) -> None:
        self._wire, self.name, self.write = wire, wire.name, wire.write
        self.discard, self.close = wire.discard, wire.close

    def read(self) -> bytes:
        return re.sub(rb" P\d+ ", b" P0 ", self._wire.read())


def seconds_of_a_print(text: GcodeFile, journal: str, wrap: Callable[[Wire], Wire]) -> float:
    printer = VirtualPrinter(PROFILE.machine)
    medium = replace(printer.medium, open=lambda name, baud: wrap(printer.medium.open(name, baud)))
    with journal_of(text, journal) as written:
        print_lines(text, PATH, medium=medium, profile=PROFILE, journal=written)
    return printer.now_s


def test_a_printer_with_frozen_reports_is_waited_for_once(text: GcodeFile) -> None:
    usual_s = seconds_of_a_print(text, "usual", lambda wire: wire)
    assert seconds_of_a_print(text, "frozen", _Frozen) - usual_s < 10.0


def test_a_simulated_printer_at_full_speed_is_not_queried_for_waiting_moves(text: GcodeFile) -> None:
    sent: list[bytes] = []
    with SimulatedPrinter(PROFILE.machine) as printer, journal_of(text, "fast") as journal:
        medium = tap(lambda way, data: sent.append(data) if way == ">" else None)
        print_lines(text, printer.path, profile=PROFILE, journal=journal, medium=medium)
    written = b"".join(sent)
    assert written.count(b"G1 X") > 100
    assert written.count(b" M114*") < 10


def doubtful(text: GcodeFile, journal: Path, printer: SimulatedPrinter) -> None:
    assert main(["print", str(text.path), "--port", printer.path, "--journal", str(journal), "--force"]) == 1


# The lines added by the greeting, the queries and the barriers place the cut where the tip rises.
IN_DOUBT = [Fault("reset", at=PROGRAM.index("G0 Z62.2 F900") + 18, unit="line")]
STOCK = BuildOptions(advanced_ok=False)


def test_a_height_in_doubt_is_not_guessed(text: GcodeFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    journal = tmp_path / "journal"
    with SimulatedPrinter(PROFILE.machine, build=STOCK, faults=IN_DOUBT) as printer:
        doubtful(text, journal, printer)
        assert main(["resume", str(journal), "--port", printer.path, "--yes"]) == 1
    errors = capsys.readouterr().err
    assert "it stands at Z 62.00 or Z 62.20; look at the print below it, for Z is not homed" in errors
    assert "you must see at which height the tip stands (1: Z 62.00, 2: Z 62.20)" in errors


@pytest.mark.parametrize(("said", "called"), [("2", "Z62.2 "), ("n", "")])
def test_the_height_confirmed_by_the_user_is_set_as_the_axis_position(
    text: GcodeFile, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: str, called: str
) -> None:
    monkeypatch.setattr("sys.stdin", Person([said, "y"]))
    journal, log = tmp_path / "journal", tmp_path / "log"
    with SimulatedPrinter(PROFILE.machine, build=STOCK, faults=IN_DOUBT) as printer:
        doubtful(text, journal, printer)
        ended = main(["resume", str(journal), "--port", printer.path, "--log", str(log)])
    assert (ended, called in log.read_text()) == (0 if called else 1, True)


class Person(StringIO):
    """Pretends to be a terminal."""

    def __init__(self, answers: list[str]) -> None:
        super().__init__("".join(f"{answer}\n" for answer in answers))

    def isatty(self) -> bool:
        return True


def point(executed: int, acknowledged: int | None = None, number: int = 100) -> InterruptedPrint:
    moment = Checkpoint(acknowledged or executed, acknowledged or executed, executed, number)
    return cut_off(PROGRAM, moment)


def asked(position: dict[str, float] | None = None, last: int | None = 0) -> PrinterStatus:
    return PrinterStatus(last, position)


LINE = PROGRAM.index(";PART:2 of 3") + 40


def test_the_point_knows_part_layer_pose_and_modes() -> None:
    at = point(LINE)
    assert (at.line, at.position.part, at.position.parts) == (LINE + 1, 2, 3)
    assert at.modal.at[3:5] == [30.0, 725.0]
    assert (at.modal.modes.filament_relative, at.modal.modes.relative, at.modal.modes.feed, at.modal.nozzle_c) == (
        True,
        False,
        1800.0,
        200.0,
    )
    assert at.stroked


def test_a_position_that_matches_the_ends_of_several_lines_resumes_at_the_first() -> None:
    still = [*START, "G0 X10 Y20 Z30", "G1 X11 E1 F600", "M106 S10", "M106 S20", "M106 S30", "G1 X12 E1"]
    at = cut_off(still, Checkpoint(13, 13, 13, 5))
    way = plan_resume(at, asked({"X": 11.0, "Y": 20.0, "Z": 30.0, "E": 1.0}), PROFILE)
    assert way.line == still.index("M106 S10") + 1


@pytest.mark.parametrize("state", [PrintState.PAUSED, PrintState.CANCELLED])
def test_the_position_of_a_parked_tip_is_set_to_where_it_was_moved(state: str) -> None:
    moment = Checkpoint(LINE + 3, LINE, LINE, 100, (159.0, -159.0, 120.0, 30.0, 725.0, 5.0), state)
    before = plan_resume(cut_off(PROGRAM, moment), asked(), PROFILE).before
    assert "G92 X159 Y-159 Z120 A30 C725" in before


def test_the_journal_of_a_cancelled_print_records_where_the_tip_was_lifted_to(text: GcodeFile) -> None:
    printer, stop = VirtualPrinter(PROFILE.machine), Flag()

    def see(progress: PrintStatus) -> None:
        if progress.file_line > LINE:
            stop.set()

    with journal_of(text, "first") as journal:
        print_lines(text, PATH, on_progress=see, control=Control(stop), medium=printer.medium, profile=PROFILE, journal=journal)
    last = read_journal(journal.path).last
    assert last.state is PrintState.CANCELLED
    assert last.pose[:5] == pytest.approx(tuple(printer.record.end[-1, :5]), abs=0.005)


def test_a_profile_s_resume_block_homes_instead() -> None:
    block = "G28 Z\nG28 X Y\nHOME_AC\nG0 Z{clear_z_mm}\nG0 {tilt}{tilt_deg} {turn}{turn_deg}"
    profile = load(settings=[f"machine.gcode.resume={block!r}"])
    before = plan_resume(point(LINE), asked(), with_block(profile, block)).before
    assert before[before.index("G28 Z") : before.index("G28 Z") + 3] == ("G28 Z", "G28 X Y", "HOME_AC")
    assert "G0 A30 C725" in before
    assert not [line for line in before if line.startswith("G92 X")]


def with_block(profile: Profile, block: str) -> Profile:
    gcode = profile.machine.gcode.model_copy(update={"resume": block})
    return profile.model_copy(update={"machine": profile.machine.model_copy(update={"gcode": gcode})})


AT_HOME = {"X": -160.0, "Y": -160.0, "Z": 260.0, "A": -95.0, "C": -3600.0, "E": 0.0}  # the real Marlin's answer after a reset


def test_a_marlin_that_has_restarted_believes_itself_at_its_home_positions_and_is_resumed() -> None:
    way = plan_resume(point(LINE), asked(AT_HOME), PROFILE)
    assert way.reason.startswith("the printer has restarted")
    assert way.homes
    assert "G92 X" in " ".join(way.before)


TURN = PROGRAM.index("G0 A30 C725 F6000")
ON_THE_WAY = Checkpoint(LINE + 3, LINE, LINE, 100, (10.0, 10.0, 62.0, 30.0, 725.0, 5.0), PrintState.PAUSING)
NOWHERE = [*START, "G1 X1 E1", "G28", *(f"M106 S{k}" for k in range(60)), "G1 X5 E1"]
FOLLOWING = PROFILE.model_copy(update={"machine": PROFILE.machine.model_copy(update={"coordinates": "workpiece"})})
MOVED = {"X": 50.0, "Y": 50.0, "Z": 50.0}


@pytest.mark.parametrize(("at", "said", "profile", "sentence"), [
    (point(TURN, TURN + 5), asked(), PROFILE, r"the table was turning about A.*machine\.gcode\.resume"),
    (cut_off(PROGRAM, ON_THE_WAY), asked(), PROFILE, "was on its way between print and parking place"),
    (cut_off(PROGRAM, replace(ON_THE_WAY, state="resuming")), asked(), PROFILE, "was on its way between print and parking place"),
    (point(LINE), asked(MOVED), PROFILE, "reports the position X50 Y50 Z50: it was homed or moved since; switch it off and on"),
    (point(LINE), asked(AT_HOME, last=7), PROFILE, "another program has sent it 7 lines since: it may have been homed"),
    (cut_off(NOWHERE, Checkpoint(14, 14, 13, 5)), asked(), PROFILE, "where X Y Z stand is unknown"),
    (point(LINE), asked(), FOLLOWING, "follows the table by itself"),
])  # fmt: skip
def test_a_resume_that_would_be_a_guess_is_refused(
    at: InterruptedPrint, said: PrinterStatus, profile: Profile, sentence: str
) -> None:
    with pytest.raises(JournalError, match=sentence):
        plan_resume(at, said, profile)


def test_a_printer_that_sent_its_greeting_has_restarted_whatever_position_it_reports() -> None:
    greeted = replace(asked(MOVED), greeted=True)
    assert plan_resume(point(LINE), greeted, PROFILE).homes


def test_the_profile_s_home_positions_identify_a_restarted_firmware() -> None:
    elsewhere = asked({"X": -5.0, "Y": 330.0, "Z": 300.0, "A": 0.0, "C": 0.0})
    with pytest.raises(JournalError, match=r"write it as machine\.x\.home_mm"):
        plan_resume(point(LINE), elsewhere, PROFILE)
    with_homes = load(settings=["machine.x.home_mm=-5", "machine.y.home_mm=330", "machine.z.home_mm=300"])
    assert plan_resume(point(LINE), elsewhere, with_homes).homes


def test_home_positions_say_nothing_about_a_firmware_that_does_not_count_lines() -> None:
    assert not plan_resume(point(LINE), asked(AT_HOME, last=None), PROFILE).homes


def test_a_board_that_restarts_during_the_query_has_reset_its_line_numbers() -> None:
    printer = VirtualPrinter(PROFILE.machine, faults=FaultScript((Fault("reset", at=2, unit="line"),)))
    line = printer.medium.open(PATH, 0)
    line.write(frame(1, "M110 N500") + b"\n")
    seen = status.query_status(line, printer.medium, lambda: None)
    assert (seen.greeted, seen.last_number) == (True, 0)
    assert seen.position is not None
    assert seen.position == AT_HOME


def test_the_command_resumes_after_a_power_cut(
    text: GcodeFile, whole: np.ndarray, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    journal, cut = tmp_path / "journal", Fault("reset", at=255, unit="line")
    with SimulatedPrinter(PROFILE.machine, faults=[cut]) as printer:
        assert main(["print", str(text.path), "--port", printer.path, "--journal", str(journal), "--force"]) == 1
        assert "the printer restarted in the middle of the print" in capsys.readouterr().err
        assert main(["resume", str(journal), "--port", printer.path, "--yes"]) == 0
        errors, record = capsys.readouterr().err, printer.record
    assert "the printer has restarted; lines" in errors
    assert record.clamped == 0
    assert [event for _, event in record.events if event.startswith("homed")] == ["homed XYZ", "homed XY"]
    assert record.end[-1, :5].tolist() == pytest.approx(whole[-1, :5])


def test_when_the_table_must_turn_back_it_turns_above_everything() -> None:
    turned = {"X": 20.0, "Y": 14.0, "Z": 150.0, "A": -20.0, "C": 360.0, "E": 3.0}
    way = plan_resume(point(LINE, number=10), asked(turned, last=20), PROFILE)
    lines = list(way.before)
    turn = next(i for i, line in enumerate(lines) if re.match(r"G0 A30\S* C725", line))
    heights = [float(m[1]) for line in lines[:turn] if (m := re.match(r"G0 Z(\S+)", line))]
    assert heights[0] >= 80.0


MODES: list[tuple[str, Callable[[ModalState], object], object]] = [
    ("G91", lambda modal: (modal.modes.relative, modal.modes.filament_relative), (True, True)),
    ("M82", lambda modal: modal.modes.filament_relative, False),
    ("G20", lambda modal: modal.modes.inches, True),
    ("G1 F7200", lambda modal: modal.modes.feed, 7200.0),
    ("G01X5Y6", lambda modal: modal.at[:2], [5.0, 6.0]),
    ("M106 P1 S9", lambda modal: modal.fans["1"], "M106 P1 S9"),
    ("M204 P500", lambda modal: modal.settings["M204P"], "M204 P500"),
    ("M568 P0 S230", lambda modal: modal.nozzle_c, 230.0),
    ("SET_HEATER_TEMPERATURE HEATER=extruder TARGET=215", lambda modal: modal.nozzle_c, 215.0),
    ("G92 C1085", lambda modal: modal.at[4], 1085.0),
    ("G28", lambda modal: modal.at[:5], [None] * 5),
]


@pytest.mark.parametrize(("command", "look", "expected"), MODES)
def test_the_modal_state_after_a_command(command: str, look: Callable[[ModalState], object], expected: object) -> None:
    modal = ModalState(axes_of(PROFILE.machine))
    modal.take(command)
    assert look(modal) == expected


def test_saying_all_again_leads_to_the_same_state() -> None:
    first, second = ModalState(axes_of(PROFILE.machine)), ModalState(axes_of(PROFILE.machine))
    for command in [*START, "M204 P500 T900", "G20", "G91", "G1 X1 E2 F50", "M106 P1 S3"]:
        first.take(command)
    for command in first.lines():
        second.take(command)
    assert second.lines() == first.lines()


@pytest.mark.parametrize("dialect", ["open5x_voron0", "open5x_jubilee", "fractal5pro"])
def test_every_firmware_is_sent_its_axis_positions(dialect: str) -> None:
    profile = load(dialect)
    letters = (profile.machine.tilt.letter, profile.machine.turn.letter)
    x, y = (0.5 * sum(axis.limits_mm) for axis in (profile.machine.x, profile.machine.y))
    lines = [f"G92 {letters[0]}0 {letters[1]}0", f"G0 X{x} Y{y} Z60 F600", "M109 S200", *(f"G1 X{x + k} E1" for k in range(9))]
    way = plan_resume(read_interrupted_print(lines, Checkpoint(6, 6, 6, 5), profile, 120), asked(), profile)
    assert re.search(r"(G92 X\S+ Y\S+ Z60|SET_KINEMATIC_POSITION X=\S+ Y=\S+ Z=60)", "\n".join(way.before))
    assert "G28 X Y" in way.before


def cancelled(text: GcodeFile, port: str) -> Path:
    """A print on a pseudo-terminal that was stopped in its second part."""
    stop = Flag()
    with journal_of(text, "first") as journal:
        outcome = print_lines(
            text,
            port,
            250000,
            on_progress=lambda progress: stop.set() if progress.file_line > 190 else None,
            control=Control(stop),
            profile=PROFILE,
            journal=journal,
        )
    assert outcome.cancelled
    return journal.path


@pytest.mark.slow
def test_the_command_resumes_a_cancelled_print_and_refuses_to_do_it_twice(
    text: GcodeFile, capsys: pytest.CaptureFixture[str]
) -> None:
    with SimulatedPrinter(PROFILE.machine, speed=100.0) as printer:
        journal = cancelled(text, printer.path)
        further = str(journal.with_name("rest"))
        assert (
            main(["resume", str(journal), "--port", printer.path, "--yes", "--journal", further, "--watch", "--no-browser"]) == 0
        )
        record = printer.record
        assert main(["resume", str(journal), "--port", printer.path, "--yes"]) == 1
    errors = capsys.readouterr().err
    assert re.search(r"p, part [23] of 3, (layer 1, )?line \d+ of 310", errors)
    assert "has not restarted and knows its place" in errors
    assert "watch the print at http://" in errors
    assert "was resumed already, its rest is in" in errors
    assert record.end[-1, 3:5].tolist() == [-20.0, 360.0]


def test_the_command_lists_the_prints_that_can_be_resumed_and_no_others(
    text: GcodeFile, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(text.path.parent))
    states = {
        "cut-off": Checkpoint(20, 20, 10, 20),
        "done": Checkpoint(20, 20, 20, 20, state=PrintState.DONE),
        "begun": Checkpoint(),
    }
    for name, state in states.items():
        with continue_journal(text, PROFILE, name) as journal:
            journal.write(state)
    (journal.path.parent / "torn.journal").write_bytes(b"nothing")
    assert main(["resume"]) == 0
    head, row = (re.split("  +", line) for line in capsys.readouterr().out.splitlines())
    assert head == ["print", "machine", "up to line", "interrupted", "journal"]
    assert row[:3] == ["cut-off", "generic A/C table", "10"]
    path = row[-1]
    assert path.endswith("-cut-off.journal")
    assert main(["resume", path]) == 1
    assert capsys.readouterr().err.endswith("at which port is the printer? --port PORT is expected\n")


def test_a_missing_journal_is_reported_before_a_port_is_required(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["resume", "not-there.journal"]) == 1
    assert capsys.readouterr().err == "tiltprint: journal not-there.journal cannot be read: no such file or directory\n"


@pytest.mark.parametrize(("spoil", "words"), [
    (lambda path: path.write_text("G28\n"), "is of another program"),
    (lambda path: path.unlink(), "is gone"),
])  # fmt: skip
def test_the_command_refuses_a_journal_of_another_program(
    text: GcodeFile, spoil: Callable[[Path], object], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with journal_of(text, "j") as journal:
        journal.write(Checkpoint(20, 20, 10, 20))
    spoil(text.path)
    assert main(["resume", str(journal.path), "--port", "/dev/none"]) == 1
    assert words in capsys.readouterr().err


def test_a_power_cut_during_a_table_turn_is_resumed_with_a_profile_that_defines_homing(
    text: GcodeFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with journal_of(text, "j") as journal:
        journal.write(Checkpoint(TURN + 5, TURN, TURN, 100))
    mine = tmp_path / "mine.toml"
    block = "G28 X Y\nHOME_AC\nG0 Z{clear_z_mm}\nG0 {tilt}{tilt_deg} {turn}{turn_deg}"
    mine.write_text(f'inherits = "generic_ac"\n\n[machine.gcode]\nresume = {json.dumps(block)}\n')
    for machine in ((), ("--machine", str(mine))):
        with SimulatedPrinter(PROFILE.machine) as printer:
            assert main(["resume", str(journal.path), "--port", printer.path, *machine]) == 1
    errors = capsys.readouterr().err.splitlines()
    assert "the table was turning about A" in errors[2]
    assert "name that profile with --machine" in errors[2]
    assert errors[-2] == "then: machine.gcode.resume homes the axes, bed and nozzle heat"


def test_a_journal_stays_whole_when_the_printer_does_not_answer(
    text: GcodeFile, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(status, "ANSWER_S", 0.1)
    with journal_of(text, "j") as journal:
        journal.write(Checkpoint(233, 233, 220, 20))
    with on_terminal(lambda data, baud: b"") as path:
        assert main(["resume", str(journal.path), "--port", path, "--yes"]) == 1
    assert "is --baud the firmware's rate" in capsys.readouterr().err
    assert read_journal(journal.path).last.continued_in is None


def test_resume_refuses_a_finished_print_another_machine_and_a_missing_answer(
    text: GcodeFile, capsys: pytest.CaptureFixture[str]
) -> None:
    with journal_of(text, "j") as journal:
        journal.write(Checkpoint(50, 50, 40, 20))
    with SimulatedPrinter(PROFILE.machine) as printer:
        assert main(["resume", str(journal.path), "--port", printer.path, "--machine", "gen5x"]) == 1
        assert main(["resume", str(journal.path), "--port", printer.path]) == 1
        assert not happened(printer.record, "nozzle")
    with journal_of(text, "done") as journal:
        journal.write(Checkpoint(120, 120, 100, 20, state=PrintState.DONE))
    assert main(["resume", str(journal.path), "--port", "x"]) == 1
    assert main(["resume", str(journal.path), "--port", "sim"]) == 1
    errors = capsys.readouterr().err
    assert "--machine gives another machine" in errors
    assert "give --yes if there is no terminal" in errors
    assert "ran to its end" in errors
    assert "a simulated printer ends with its print" in errors


def test_a_cancel_is_handled_while_the_printer_s_position_is_queried(text: GcodeFile) -> None:
    printer, stop = VirtualPrinter(PROFILE.machine), Flag()
    deaf = Medium(lambda name, baud: _Deaf(printer.medium.open(name, baud)), printer.medium.now_s, printer.medium.wait)
    stop.set()
    outcome = print_lines(text, PATH, control=Control(stop), medium=deaf, profile=PROFILE, begin=lambda seen: ResumePoint(1, ()))
    assert (outcome.cancelled, outcome.sent, outcome.heaters_off) == (True, 0, None)
    assert printer.now_s < 1.0


def test_a_printer_that_reports_an_error_instead_of_its_place_is_not_called_silent() -> None:
    seen = PrinterStatus(fault="MCU 'mcu' shutdown: Timer too close")
    with pytest.raises(FirmwareError, match="does not say where it stands, but reports: MCU 'mcu' shutdown: Timer too close"):
        plan_resume(point(LINE), seen, PROFILE)


def test_a_printer_that_says_nothing_is_not_resumed(text: GcodeFile) -> None:
    printer = VirtualPrinter(PROFILE.machine)
    story = killed(text, printer, 233)
    deaf = Medium(lambda name, baud: _Deaf(printer.medium.open(name, baud)), printer.medium.now_s, printer.medium.wait)
    seen: list[PrinterStatus] = []

    def begin(asked: PrinterStatus) -> ResumePoint:
        seen.append(asked)
        return plan_resume(cut_off(text, story.last), asked, PROFILE)

    with pytest.raises(SilenceError, match=r"did not answer when it was asked where it stands"):
        print_lines(text, PATH, medium=deaf, profile=PROFILE, begin=begin)
    assert seen == [PrinterStatus()]


class _Deaf:
    """A wire on which nothing arrives."""

    def __init__(self, wire: Wire) -> None:
        self.name, self.read, self.discard, self.close = wire.name, wire.read, wire.discard, wire.close

    def write(self, data: bytes) -> None:
        pass


@pytest.mark.parametrize("said", [
    b"Error:Line Number is not Last Line Number+1, Last Line: 41\n",
    b"Error: expected line 42 got 999999\nResend: 42\n",
])  # fmt: skip
def test_the_last_line_is_known_by_a_refusal_or_by_what_is_wanted_next(said: bytes) -> None:
    def answer(data: bytes, baud: int) -> bytes:
        return said + b"ok\n" if b"N999999" in data else b"ok T:20.0 /0.0\n" if b"M105" in data else b""

    with on_terminal(answer) as path, open_port(path, 115200) as port:
        seen = status.query_status(port, SERIAL, lambda: None)
    assert seen.last_number == 41


def test_a_firmware_built_without_z_offsets_is_refused_while_the_journal_is_untouched(
    text: GcodeFile, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(commands, "THERE", ())
    with journal_of(text, "j") as journal:
        journal.write(Checkpoint(233, 233, 220, 20, z_offset_mm=0.1))
    mine, further, before = tmp_path / "mine.toml", tmp_path / "further", journal.path.read_bytes()
    block = "G28 Z\nG28 X Y\nG0 Z{clear_z_mm} F900"
    mine.write_text(f'inherits = "generic_ac"\n\n[machine.gcode]\nresume = {json.dumps(block)}\n')
    with SimulatedPrinter(PROFILE.machine) as printer:
        options = ["--port", printer.path, "--yes", "--machine", str(mine), "--journal", str(further)]
        assert main(["resume", str(journal.path), *options]) == 1
        assert not happened(printer.record, "nozzle")
    assert "a Z offset of +0.1 mm, which this firmware cannot set: nothing was moved" in capsys.readouterr().err
    assert journal.path.read_bytes() == before
    assert not further.exists()
