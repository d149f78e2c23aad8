"""Pause, overrides, user lines, cancel, emergency stop and a lost port, on a simulated printer with a virtual clock."""

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from machine.link.medium import Medium, Wire
from machine.link.pending_commands import Command, Control
from machine.link.print_state import PrintStatus
from machine.link.protocol.framing import FAR_NUMBER
from machine.link.stream import Outcome, print_lines
from machine.printing.serial_log import tap
from machine.simulator.faults import Fault, FaultScript
from profiles.errors import FirmwareError, PortError, PrinterError
from profiles.profile import Profile, load
from tests.machine.peers import happened
from tests.machine.virtual_printer import PATH, VirtualPrinter

PROFILE = load()
MACHINE = PROFILE.machine
UNASKING = {dialect: load(settings=[f"machine.dialect={dialect}"]) for dialect in ("klipper", "reprapfirmware")}
START = ["G21", "G90", "M83", "M140 S60", "M104 S200", "G28 X Y Z", "G92 A0 C0", "M190 S60", "M109 S200", "G92 E0", "M106 S128"]
POSED = ["G0 Z120 F900", "G0 A30 C725 F6000", "G0 X10 Y10 F6000", "G0 Z60 F900", "M204 P800 T1200", "G1 F1500"]
# strokes with a travel after every tenth, where a pause can begin
BODY = [
    f"G1 X{10 + i % 7}.{i:03d} Y{10 + i % 5} E0.05" if i % 10 else f"G0 X{10 + i % 7}.{i:03d} Y{10 + i % 5}" for i in range(240)
]
PROGRAM = [*START, *POSED, *BODY, "M104 S0", "M140 S0"]


Act = Command | tuple[Any, ...] | Callable[[], object]  # a request of the user: command, value, text


class Watcher:
    """Makes requests when the print reaches a line or a state, and records the status shown and the commands sent."""

    def __init__(self, printer: VirtualPrinter, profile: Profile = PROFILE, when: Mapping[str | int, Act] | None = None) -> None:
        self.printer, self.control, self.profile = printer, Control(), profile
        self.shown: list[PrintStatus] = []
        self.sent = b""
        self.when = dict(when or {})

    def see(self, progress: PrintStatus) -> None:
        self.shown.append(progress)
        line = next((at for at in self.when if isinstance(at, int) and progress.file_line >= at), None)
        for key in (line, progress.state):
            if key is not None and key in self.when:
                act = self.when.pop(key)
                act() if callable(act) else self.control.ask(*act) if isinstance(act, tuple) else self.control.ask(act)

    def traffic(self, direction: str, data: bytes) -> None:
        self.sent += data if direction == ">" else b""

    def lines(self) -> list[str]:
        """The commands sent, without number and checksum."""
        return [re.sub(r"^N\d+ |\*\d+$", "", line) for line in self.sent.decode().splitlines()]

    def run(self, program: list[str], medium: Medium | None = None) -> Outcome:
        return print_lines(
            program,
            PATH,
            on_progress=self.see,
            control=self.control,
            profile=self.profile,
            medium=tap(self.traffic, medium or self.printer.medium),
        )

    def ask(self, wish: Command, value: float = 100.0, text: str = "") -> Callable[[], None]:
        return lambda: self.control.ask(wish, value, text)


def watched(when: Mapping[str | int, Act] | None = None, *faults: Fault, profile: Profile = PROFILE) -> Watcher:
    script = FaultScript(faults, 1) if faults else None
    return Watcher(VirtualPrinter(profile.machine, faults=script, most_s=20000.0), profile, when)


def strokes(printer: VirtualPrinter) -> np.ndarray:
    """X, Y and extruded filament of the executed moves that extrude while they move in X or Y."""
    record = printer.record
    pushed = record.end[:, 5] - record.start[:, 5]
    rows = (pushed > 1e-9) & (record.end[:, :2] != record.start[:, :2]).any(axis=1)
    return np.column_stack([record.end[rows, :2], pushed[rows]])


def planned(program: list[str]) -> np.ndarray:
    matches = [re.fullmatch(r"G1 X(\S+) Y(\S+) E(\S+)", line) for line in program]
    return np.array([[float(m[1]), float(m[2]), float(m[3])] for m in matches if m])


def is_exact(watcher: Watcher) -> bool:
    """Whether every stroke is where the program places it, by the real positions of the axes."""
    return bool(np.abs(strokes(watcher.printer) - planned(PROGRAM)).max() < 1e-6)


@pytest.fixture(scope="module")
def paused() -> Watcher:
    """A print that was paused at line 150 and continued."""
    watcher = watched({150: Command.PAUSE, "paused": Command.RESUME})
    assert not watcher.run(PROGRAM).cancelled
    return watcher


def test_a_pause_at_a_tilted_pose_returns_to_the_same_pose_filament_feed_and_modes(paused: Watcher) -> None:
    lines = paused.lines()
    back = lines[lines.index("M114") :]
    after = back[back.index("M109 S200") : back.index("M114", 5)]
    assert not [line for line in back if re.search(r"[AC]-?\d", line)]  # neither to 5 nor to 725: the table never moves
    assert [line for line in after if line.startswith("G92")] == [f"G92 E{filament_before_pause(lines):.5f}"]
    assert {"G90", "M83", "G21", "G1 F1500", "M106 S128", "M204 P800 T1200"} <= set(after)
    assert is_exact(paused)
    assert paused.printer.record.end[-1, 4] == 725.0


def filament_before_pause(lines: list[str]) -> float:
    """The sum of the program's extrusions up to the first M400."""
    return sum(float(m[1]) for line in lines[: lines.index("M400")] if (m := re.search(r" E(\S+)$", line)))


def test_the_states_of_a_pause_are_reported_in_order(paused: Watcher) -> None:
    states = list(dict.fromkeys(progress.state for progress in paused.shown))
    assert states == ["printing", "pausing", "paused", "resuming", "finishing"]


def test_a_pause_is_shown_at_once_although_it_starts_after_the_current_stroke(paused: Watcher) -> None:
    asked = next(index for index, progress in enumerate(paused.shown) if progress.acknowledged >= 150)
    assert [progress.state for progress in paused.shown[asked : asked + 2]] == ["printing", "pausing"]


def test_a_pause_that_is_wanted_while_the_printer_heats_says_that_it_begins_once_it_is_hot() -> None:
    watcher = watched({7: Command.PAUSE, "paused": Command.RESUME})  # line 8 waits for the bed
    watcher.run(PROGRAM)
    told = [progress.message for progress in watcher.shown if progress.state == "pausing"]
    assert "it pauses once it is hot" in told[:2]  # at once
    assert set(told) <= {"", "it pauses once it is hot"}
    (paused, *_) = [progress for progress in watcher.shown if progress.state == "paused"]
    assert paused.message == ""


def test_a_pause_requested_while_the_nozzle_heats_waits_so_that_no_filament_is_retracted_cold() -> None:
    watcher = watched({5: Command.PAUSE, "paused": Command.RESUME})  # line 5 sets the nozzle and does not wait
    assert not watcher.run(PROGRAM).cancelled
    (paused, *_) = [progress for progress in watcher.shown if progress.state == "paused"]
    assert paused.temperature.nozzle_c >= 190.0
    assert "it pauses once it is hot" in [progress.message for progress in watcher.shown if progress.state == "pausing"][:2]


def test_a_pause_at_a_nozzle_that_the_program_holds_cold_begins_and_moves_no_filament() -> None:
    start = [line.replace("S200", "S150") for line in START]
    moves = [f"G0 X{10 + k % 7} Y{10 + k % 5}" for k in range(40)]
    program = [*start, *POSED, *moves, "M109 S200", *BODY, "M104 S0", "M140 S0"]
    watcher = watched({len(START) + 20: Command.PAUSE, "paused": Command.RESUME})
    assert not watcher.run(program).cancelled
    (paused, *_) = [progress for progress in watcher.shown if progress.state == "paused"]
    assert paused.temperature.nozzle_target_c == 150.0
    before = watcher.lines()[: watcher.lines().index("M109 S200")]
    assert not [line for line in before if re.match(r"G1 E", line)]
    assert is_exact(watcher)


def test_an_emergency_stop_that_halts_the_printer_shows_heaters_without_targets() -> None:
    watcher = watched({150: Command.EMERGENCY_STOP})
    with pytest.raises(FirmwareError):
        watcher.run(PROGRAM)
    before, after = (progress.temperature for progress in (watcher.shown[-2], watcher.shown[-1]))
    assert (before.nozzle_target_c, before.bed_target_c) == (200.0, 60.0)
    assert (after.nozzle_target_c, after.bed_target_c) == (0.0, 0.0)


def test_the_targets_of_a_cancelled_print_are_off_once_the_printer_confirms_it() -> None:
    watcher = watched({150: Command.CANCEL})
    assert watcher.run(PROGRAM).heaters_off
    before, after = (progress.temperature for progress in (watcher.shown[-2], watcher.shown[-1]))
    assert (before.nozzle_target_c, before.bed_target_c) == (200.0, 60.0)
    assert (after.nozzle_target_c, after.bed_target_c) == (0.0, 0.0)


def test_a_pause_starts_after_the_current_stroke_and_lifts_before_it_moves_aside(paused: Watcher) -> None:
    lines = paused.lines()
    stop = lines.index("M400")
    assert " E" in lines[stop - 1]
    assert lines[stop + 3 : stop + 5] == ["G21", "M83"]
    away = lines[stop + 5 : stop + 9]
    assert re.fullmatch(r"G1 E-\S+ F\d+", away[0])
    assert re.fullmatch(r"G0 Z\S+ F\d+", away[2])
    assert re.fullmatch(r"G0 X\S+ Y\S+ F\d+", away[3])


@pytest.mark.parametrize("written", [str.lower, lambda line: line.replace("G1 ", "G01 ").replace(" E", "E")])
def test_a_pause_begins_at_a_travel_however_the_strokes_are_written(written: Callable[[str], str]) -> None:
    watcher = watched({150: Command.PAUSE, "paused": Command.RESUME})
    body = [written(line) if "E" in line else line for line in BODY]
    watcher.run([*START, *POSED, *body])
    lines = watcher.lines()
    following = next(line for line in lines[lines.index("M400") :] if line in body)
    assert following.startswith("G0 ")


@pytest.mark.parametrize("action", ["pause", "cancel"])
def test_the_printer_may_ask_for_a_pause_or_the_end(action: str) -> None:
    watcher = watched({"paused": Command.RESUME})
    watcher.when[150] = lambda: watcher.printer.firmware._said.append(f"//action:{action}")
    outcome = watcher.run(PROGRAM)
    assert outcome.cancelled == (action == "cancel")
    assert any(progress.state == "pausing" for progress in watcher.shown) == (action == "pause")


def test_cancelling_lifts_the_tip_and_neither_homes_nor_turns() -> None:
    watcher = watched({150: Command.CANCEL})
    outcome = watcher.run(PROGRAM)
    record = watcher.printer.record
    assert (outcome.cancelled, outcome.heaters_off) == (True, True)
    assert record.end[-1, 2] == pytest.approx(60.0 + MACHINE.lift_mm)
    assert (record.end[-1, 3], record.end[-1, 4]) == (30.0, 725.0)
    assert [text for _, text in record.events if text.startswith("homed")] == ["homed XYZ"]


def test_an_error_that_leaves_the_printer_alive_lifts_the_tip_too() -> None:
    watcher = watched()
    watcher.when = {150: lambda: watcher.printer.firmware._said.append("//action:disconnect")}
    with pytest.raises(PrinterError, match=r"asked to be disconnected.*; the printer reports its heaters off"):
        watcher.run(PROGRAM)
    assert watcher.printer.record.end[-1, 2] == pytest.approx(60.0 + MACHINE.lift_mm)
    assert [text for _, text in watcher.printer.record.events if text.startswith("homed")] == ["homed XYZ"]


def test_a_printer_that_has_stopped_by_itself_is_not_moved() -> None:
    watcher = watched({}, Fault("error", at=150, unit="line", text="Error:Thermal Runaway, system stopped! Heater_ID: 0"))
    with pytest.raises(FirmwareError, match="Thermal Runaway, system stopped"):
        watcher.run(PROGRAM)
    assert "G91" not in watcher.lines()


def test_a_cancel_while_the_tip_is_parked_leaves_it_there() -> None:
    watcher = watched({150: Command.PAUSE, "paused": Command.CANCEL})
    outcome = watcher.run(PROGRAM)
    assert outcome.heaters_off
    assert "G91" not in watcher.lines()


def test_the_emergency_stop_is_sent_next_and_no_line_follows() -> None:
    watcher = watched({150: Command.EMERGENCY_STOP})
    written: list[bytes] = []
    known = "nozzle 200 °C, bed 60 °C as last known, [0-5] s before"
    with pytest.raises(FirmwareError, match=f"emergency stop: the printer has halted; .*; {known}$"):
        watcher.run(PROGRAM, medium=_written(watcher.printer.medium, written))
    assert watcher.shown[-1].heat_is_old
    assert not watcher.shown[-2].heat_is_old
    assert written[-1] == b"\nM112\n"
    assert happened(watcher.printer.record, "M112")


def test_an_emergency_stop_without_answer_is_given_twice_and_says_to_cut_the_power() -> None:
    watcher = watched({150: Command.EMERGENCY_STOP})
    written: list[bytes] = []
    with pytest.raises(FirmwareError, match=r"did not confirm M112: cut the power; nozzle 200 .* as last known, \d s before"):
        watcher.run(PROGRAM, medium=_written(watcher.printer.medium, written, deaf=b"M112"))
    assert written[-2:] == [b"\nM112\n", b"\nM112\nM107\n"]


class _Tap:
    """A wire that records the bytes written; those that contain `deaf` do not arrive."""

    def __init__(self, wire: Wire, written: list[bytes], deaf: bytes) -> None:
        self._wire, self._written, self._deaf, self.name = wire, written, deaf, wire.name
        self.read, self.discard, self.close = wire.read, wire.discard, wire.close

    def write(self, data: bytes) -> None:
        self._written.append(data)
        if not self._deaf or self._deaf not in data:
            self._wire.write(data)


def _written(medium: Medium, written: list[bytes], deaf: bytes = b"") -> Medium:
    return Medium(lambda name, baud: _Tap(medium.open(name, baud), written, deaf), medium.now_s, medium.wait)


@pytest.mark.parametrize(("wish", "value", "sent", "undone"), [
    (Command.FEED, 150.0, "M220 S150", "M220 S100"), (Command.FLOW, 95.0, "M221 S95", "M221 S100"),
])  # fmt: skip
def test_overrides_are_sent_reported_and_undone_at_the_end(wish: Command, value: float, sent: str, undone: str) -> None:
    watcher = watched({100: (wish, value)})
    watcher.run(PROGRAM)
    lines, last = watcher.lines(), watcher.shown[-1]
    assert lines.index(sent) < lines.index(undone)
    assert value in (last.feed_percent, last.flow_percent)


@pytest.mark.parametrize(
    ("wish", "value"), [(Command.FEED, 5.0), (Command.FEED, 1000.0), (Command.FLOW, 0.0), (Command.FLOW, 250.0)]
)
def test_an_override_outside_its_limits_is_refused_with_what_is_allowed(wish: Command, value: float) -> None:
    watcher = watched({100: (wish, value)})
    watcher.run(PROGRAM)
    assert any(re.search(r"is not possible: 10 to [23]00 % are allowed", progress.message) for progress in watcher.shown)
    assert not [line for line in watcher.lines() if line.startswith("M22")]


@pytest.mark.parametrize("text", [
    "M110 N5", "M112", "M0", "G28", "G28 X", "g28", "G1 A5", "G0 Z0", "G1 X5 E1", "G92 E0", "G91", "M82", "T1", "M84", "M18 E",
    "MANUAL_STEPPER STEPPER=stepper_a MOVE=3", "HOME_AB", "G1 X1*5", "M104 S200ö", "", "; nothing", "M600",
])  # fmt: skip
def test_a_line_that_would_spoil_the_print_is_not_sent(text: str) -> None:
    watcher = watched({100: (Command.LINE, 100.0, text), 120: Command.PAUSE, "paused": Command.RESUME})
    watcher.run(PROGRAM)
    assert any(progress.message.startswith("not sent") for progress in watcher.shown)
    assert is_exact(watcher)


def test_a_harmless_user_line_is_sent_between_program_lines() -> None:
    watcher = watched({100: (Command.LINE, 100.0, "M117 half way ; a note")})
    watcher.run(PROGRAM)
    assert "M117 half way" in watcher.lines()
    assert is_exact(watcher)


def test_filament_may_be_changed_in_a_pause_and_the_count_is_restored() -> None:
    watcher = watched()

    def change() -> None:
        for text in ("G1 E-50 F300", "G1 E60 F300"):
            watcher.control.ask(Command.LINE, text=text)
        watcher.control.ask(Command.RESUME)

    watcher.when = {150: Command.PAUSE, "paused": change}
    watcher.run(PROGRAM)
    lines = watcher.lines()
    assert f"G92 E{filament_before_pause(lines):.5f}" in lines[lines.index("G1 E60 F300") :]
    assert is_exact(watcher)


def test_a_temperature_set_by_the_user_is_kept_after_a_pause() -> None:
    watcher = watched({100: (Command.LINE, 100.0, "M104 S215"), 150: Command.PAUSE, "paused": Command.RESUME})
    watcher.run(PROGRAM)
    assert "M109 S215" in watcher.lines()


@pytest.mark.parametrize("length_s", [0.5, 30.0])
def test_a_port_that_comes_back_to_a_printer_that_went_on_loses_and_doubles_nothing(length_s: float) -> None:
    watcher = watched({}, Fault("disconnect", at=120, unit="line", seconds=length_s))
    assert not watcher.run(PROGRAM).cancelled
    assert is_exact(watcher)
    lost = [progress for progress in watcher.shown if progress.state == "reconnecting"]
    assert all(progress.heat_is_old for progress in lost)
    assert lost[-1].heat_age_s - lost[0].heat_age_s == pytest.approx(lost[-1].elapsed_s - lost[0].elapsed_s)
    assert lost[0].elapsed_s > 0.0


@pytest.mark.parametrize("dialect", ["klipper", "reprapfirmware"])
@pytest.mark.parametrize("line", [14, 30, 61])
def test_a_firmware_that_never_requests_resends_continues_from_its_last_position(dialect: str, line: int) -> None:
    watcher = watched({}, Fault("disconnect", at=line, unit="line", seconds=2.0), profile=UNASKING[dialect])
    assert not watcher.run(PROGRAM).cancelled
    assert is_exact(watcher)


@pytest.mark.parametrize("dialect", ["klipper", "reprapfirmware"])
@pytest.mark.parametrize("byte", range(2000, 2040, 9))
def test_a_line_that_was_torn_with_the_port_is_never_done_twice_or_left_out(dialect: str, byte: int) -> None:
    watcher, error = watched({}, Fault("disconnect", at=byte, seconds=2.0), profile=UNASKING[dialect]), ""
    try:
        watcher.run(PROGRAM)
    except PrinterError as stopped:
        error = str(stopped)
    done, program = strokes(watcher.printer), planned(PROGRAM)
    assert np.abs(done - program[: len(done)]).max() < 1e-6
    assert len(done) == len(program) or "whether it was executed is unknown" in error or "can no longer be trusted" in error


@pytest.mark.parametrize("dialect", ["klipper", "reprapfirmware"])
def test_a_firmware_that_restarted_behind_the_lost_port_is_seen_by_its_place(dialect: str) -> None:
    watcher = watched({}, Fault("disconnect", at=120, unit="line", seconds=2.0), profile=UNASKING[dialect])
    reset = watcher.printer.firmware.reset
    watcher.when = {"reconnecting": lambda: reset(False)}
    with pytest.raises(PrinterError, match=r"was not answered|can no longer be trusted"):
        watcher.run(PROGRAM)
    assert len(strokes(watcher.printer)) < len(planned(PROGRAM))


@pytest.mark.parametrize("dialect", ["klipper", "reprapfirmware"])
def test_a_cancel_during_the_query_after_a_reconnection_switches_the_heaters_off(dialect: str) -> None:
    watcher = watched({}, Fault("disconnect", at=30, unit="line", seconds=2.0), profile=UNASKING[dialect])
    note = watcher.traffic

    def cancel_when_asked(direction: str, data: bytes) -> None:
        note(direction, data)
        if direction == ">" and b"N%d " % FAR_NUMBER in data:
            watcher.control.stop.set()

    watcher.traffic = cancel_when_asked  # type: ignore[method-assign]
    outcome = watcher.run(PROGRAM)
    assert (outcome.cancelled, outcome.heaters_off) == (True, True)


def test_a_port_that_comes_back_to_a_restarted_printer_ends_the_print() -> None:
    watcher = watched({}, Fault("disconnect", at=120, unit="line", seconds=2.0))
    reset = watcher.printer.firmware.reset
    watcher.when = {"reconnecting": lambda: reset(False)}
    with pytest.raises(FirmwareError, match="restarted"):
        watcher.run(PROGRAM)
    assert len(strokes(watcher.printer)) < len(planned(PROGRAM))


def test_a_port_that_stays_away_ends_the_print_in_bounded_time() -> None:
    watcher = watched({}, Fault("disconnect", at=120, unit="line", seconds=1e6))
    known = "nozzle 200 °C, bed 60 °C as last known, 12[0-9] s before"
    with pytest.raises(PortError, match=f"did not come back within 120 s; its heaters may still be on, .*; {known}"):
        watcher.run(PROGRAM)
    assert watcher.printer.now_s < 1000.0


class _Loose:
    """A wire that accepts nothing."""

    name = PATH

    def write(self, data: bytes) -> None:
        raise PortError("the plug is loose")

    def read(self) -> bytes:
        return b""

    def discard(self) -> None:
        pass

    close = discard


def test_a_plug_that_stays_loose_is_waited_for_no_longer_than_is_said() -> None:
    watcher = watched({}, Fault("disconnect", at=120, unit="line", seconds=100.0), profile=UNASKING["klipper"])
    usual = watcher.printer.medium
    wires: list[Wire] = []

    def opened(name: str, baud: int) -> Wire:
        wire = usual.open(name, baud) if len(wires) < 3 else None
        if wire is None:
            raise PortError("it is gone")
        wires.append(_Loose() if wires else wire)
        return wires[-1]

    with pytest.raises(PortError, match="did not come back within 120 s"):
        watcher.run(PROGRAM, medium=Medium(opened, usual.now_s, usual.wait))
    waited_s = [progress.elapsed_s for progress in watcher.shown if progress.state == "reconnecting"]
    assert waited_s[-1] - waited_s[0] == pytest.approx(120.0, abs=5.0)


def test_the_stop_flag_ends_the_wait_for_a_lost_port() -> None:
    watcher = watched({}, Fault("disconnect", at=120, unit="line", seconds=1e6))
    watcher.when = {"reconnecting": watcher.control.stop.set}
    outcome = watcher.run(PROGRAM)
    assert (outcome.cancelled, outcome.heaters_off) == (True, False)


def test_a_program_that_waits_for_the_user_is_paused_by_the_sender_itself() -> None:
    plain, paused = watched(), watched({"paused": Command.RESUME})
    plain.run(PROGRAM)
    middle = len(START) + len(POSED) + 200
    program = [*PROGRAM[:middle], "M600 ;PAUSE:filament change before layer 2 of part 1", *PROGRAM[middle:]]
    assert not paused.run(program).cancelled
    assert "the program pauses: filament change before layer 2 of part 1" in {progress.message for progress in paused.shown}
    assert not any(line.startswith("M600") for line in paused.lines())
    assert strokes(paused.printer) == pytest.approx(strokes(plain.printer))
