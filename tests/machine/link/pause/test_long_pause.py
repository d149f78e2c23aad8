"""Long pauses: the motors stay on, the nozzle cools, and the print continues as if there had been no pause."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from machine.link.journal import Journal, JournalHeading, read_journal
from machine.link.pending_commands import Command
from machine.link.print_state import PrintState, PrintStatus
from machine.link.stream import Outcome, print_lines
from machine.simulator.board import BuildOptions
from machine.simulator.faults import Fault, FaultScript
from profiles.errors import FirmwareError
from profiles.profile import Profile, load
from tests.machine.link.test_pause import BODY, PROGRAM, Watcher, is_exact
from tests.machine.peers import happened
from tests.machine.virtual_printer import PATH, VirtualPrinter

COOLS_S = 120.0
COLD_S = COOLS_S + 120.0  # two time constants of the simulated nozzle later


def profile_of(dialect: str = "marlin", minutes: float = COOLS_S / 60.0) -> Profile:
    return load(settings=[f"machine.dialect={dialect}", f"machine.pause_cools_after_min={minutes:g}"])


PROFILE = profile_of()
RETRACT_MM = PROFILE.material.retract_mm


class Patience(Watcher):
    """Pauses at line 150 and runs actions a given number of seconds after the tip has come to rest."""

    def __init__(self, profile: Profile = PROFILE, build: BuildOptions | None = None, faults: FaultScript | None = None) -> None:
        super().__init__(VirtualPrinter(profile.machine, build, faults, most_s=20000.0), profile)
        self.when[150] = self.ask(Command.PAUSE)
        self.paused_s: float | None = None
        self.due: list[tuple[float, Callable[[], None]]] = []
        self.heard: dict[float, PrintStatus] = {}  # seconds into the pause -> the status shown

    def see(self, progress: PrintStatus) -> None:
        super().see(progress)
        if progress.state == "paused" and self.paused_s is None:
            self.paused_s = progress.elapsed_s
        if self.paused_s is not None:
            self.heard[progress.elapsed_s - self.paused_s] = progress
            while self.due and progress.elapsed_s >= self.paused_s + self.due[0][0]:
                self.due.pop(0)[1]()

    def after(self, seconds: float, wish: Command, text: str = "") -> "Patience":
        self.due.append((seconds, self.ask(wish, text=text)))
        return self

    def shown_at(self, seconds: float) -> PrintStatus:
        """The status shown this many seconds after the tip has come to rest."""
        return self.heard[max(at for at in self.heard if at <= seconds)]


@pytest.mark.parametrize(("dialect", "seconds"), [("marlin", 200.0), ("klipper", 700.0), ("reprapfirmware", 200.0)])
def test_a_pause_longer_than_any_firmware_s_idle_time_keeps_the_motors_on_and_the_place(dialect: str, seconds: float) -> None:
    """Marlin switches X, Y and Z off after 120 s (Configuration_adv.h), Klipper shuts down after 600 s (idle_timeout.py)."""
    watcher = Patience(profile_of(dialect, minutes=0.0)).after(seconds, Command.RESUME)
    assert not watcher.run(PROGRAM).cancelled
    assert not happened(watcher.printer.record, "motors off")
    assert is_exact(watcher)


@pytest.mark.parametrize(("dialect", "said"), [("marlin", "M84 S0"), ("klipper", "G4 P1"), ("reprapfirmware", "")])
def test_each_firmware_is_kept_awake_with_its_own_command(dialect: str, said: str) -> None:
    watcher = Patience(profile_of(dialect, minutes=0.0)).after(200.0, Command.RESUME)
    watcher.run(PROGRAM)
    assert [watcher.lines().count(word) for word in ("M84 S0", "G4 P1")] == [4 * (said == "M84 S0"), 4 * (said == "G4 P1")]


def test_a_firmware_without_a_name_is_not_sent_m84_which_might_disable_its_motors() -> None:
    watcher = Patience().after(200.0, Command.RESUME)
    rules = watcher.printer.firmware.board.rules
    watcher.printer.firmware.board.rules = type(rules)(**{**vars(rules), "identity": "FIRMWARE_NAME:Homebrew 1"})
    watcher.run(PROGRAM)
    assert not [line for line in watcher.lines() if line.startswith("M84")]


def test_in_a_long_pause_the_nozzle_is_switched_off_but_the_bed_stays_on() -> None:
    watcher = Patience().after(COLD_S, Command.RESUME)
    watcher.run(PROGRAM)
    before, after = (watcher.shown_at(seconds).temperature for seconds in (COOLS_S - 5.0, COLD_S - 5.0))
    assert (before.nozzle_target_c, before.bed_target_c) == (200.0, 60.0)
    assert (after.nozzle_target_c, after.bed_target_c) == (0.0, 60.0)
    assert after.nozzle_c < 60.0 < after.bed_c + 1.0


def test_a_cooled_pause_announces_the_reheating_and_resumes_the_same_print() -> None:
    watcher = Patience().after(COLD_S, Command.RESUME)
    assert not watcher.run(PROGRAM).cancelled
    assert watcher.shown_at(COOLS_S - 5.0).message == ""
    assert watcher.shown_at(COOLS_S + 5.0).message == (
        "the nozzle was switched off after 2 min; when the print continues it is heated to 200 °C and filled where the tip "
        "waits: take the drop off"
    )
    assert is_exact(watcher)


def back_of(watcher: Watcher) -> list[str]:
    """The commands from those that heat again up to the next command of the program."""
    lines = watcher.lines()
    begin = len(lines) - lines[::-1].index("M109 S200") - 1
    return lines[begin : next(index for index in range(begin, len(lines)) if lines[index] in BODY)]


def test_a_cooled_nozzle_is_primed_at_the_parking_position_before_the_return() -> None:
    watcher = Patience().after(COLD_S, Command.RESUME)
    watcher.run(PROGRAM)
    back = back_of(watcher)
    pushes = [float(match[1]) for line in back[: back.index("G90")] if (match := re.fullmatch(r"G1 E(-?\S+) F\d+", line))]
    assert pushes == pytest.approx([RETRACT_MM + 1.0, -RETRACT_MM])
    assert not [line for line in back[: back.index("G90")] if re.match(r"G[01] .*[XYZ]", line)]


def test_a_short_pause_heats_and_pushes_no_more_than_before() -> None:
    watcher = Patience().after(COOLS_S - 30.0, Command.RESUME)
    watcher.run(PROGRAM)
    back = back_of(watcher)
    assert [line for line in back if line.startswith("G1 E")] == [f"G1 E{RETRACT_MM + PROFILE.material.prime_extra_mm:.5f} F2100"]
    assert "M104 S0" not in watcher.lines()[: watcher.lines().index("M109 S200") + 1]


def test_zero_minutes_leave_the_nozzle_hot() -> None:
    watcher = Patience(profile_of(minutes=0.0)).after(COLD_S, Command.RESUME)
    watcher.run(PROGRAM)
    assert watcher.shown_at(COLD_S - 5.0).temperature.nozzle_target_c == 200.0


@pytest.mark.parametrize("dialect", ["klipper", "reprapfirmware"])
def test_other_firmwares_switch_off_and_heat_again_with_their_own_commands(dialect: str) -> None:
    watcher = Patience(profile_of(dialect)).after(COLD_S, Command.RESUME)
    assert not watcher.run(PROGRAM).cancelled
    assert watcher.shown_at(COOLS_S + 60.0).temperature.nozzle_target_c == 0.0
    assert is_exact(watcher)


def test_a_pause_that_the_program_asks_for_cools_too() -> None:
    watcher = Patience().after(COLD_S, Command.RESUME)
    del watcher.when[150]
    middle = len(PROGRAM) - 80
    assert not watcher.run([*PROGRAM[:middle], "M600 ;PAUSE:filament change", *PROGRAM[middle:]]).cancelled
    assert watcher.shown_at(COOLS_S + 5.0).message.startswith("the program pauses: filament change; the nozzle was switched off")
    assert is_exact(watcher)


def test_a_temperature_set_by_the_user_in_a_pause_is_kept() -> None:
    watcher = Patience().after(60.0, Command.LINE, "M104 S215").after(120.0, Command.RESUME)
    watcher.run(PROGRAM)
    assert "M109 S215" in watcher.lines()
    assert happened(watcher.printer.record, "nozzle 215")


def test_a_user_command_in_a_pause_restarts_its_timer() -> None:
    watcher = Patience().after(100.0, Command.LINE, "M104 S215").after(400.0, Command.RESUME)
    watcher.run(PROGRAM)
    hot, off = (watcher.shown_at(100.0 + COOLS_S + seconds).temperature.nozzle_target_c for seconds in (-5.0, 5.0))
    assert (hot, off) == (215.0, 0.0)
    assert watcher.lines().count("M109 S215") == 1


def test_a_nozzle_reheated_by_the_user_no_longer_counts_as_cooled() -> None:
    watcher = Patience().after(COLD_S, Command.LINE, "M109 S200").after(COLD_S + 100.0, Command.RESUME)
    watcher.run(PROGRAM)
    assert watcher.shown_at(COLD_S + 95.0).message == ""
    assert len([line for line in back_of(watcher) if line.startswith("G1 E")]) == 1


def test_a_heater_switched_off_by_the_user_in_a_pause_heats_again_on_resume() -> None:
    watcher = Patience().after(60.0, Command.LINE, "M104 S0").after(300.0, Command.RESUME)
    assert not watcher.run(PROGRAM).cancelled
    assert watcher.shown_at(295.0).temperature.nozzle_target_c == 0.0
    assert is_exact(watcher)


@pytest.mark.parametrize("own", ["M117 I switch nothing", "M104 S0"])
def test_filament_is_not_pushed_through_a_cold_nozzle_for_a_firmware_would_end_the_print(own: str) -> None:
    watcher = Patience(profile_of("klipper")).after(5.0, Command.LINE, own).after(COLD_S, Command.LINE, "G1 E20 F300")
    assert not watcher.after(COLD_S + 60.0, Command.RESUME).run(PROGRAM).cancelled
    assert re.fullmatch(
        r"not sent: 'G1 E20 F300': the nozzle has only \d\d °C: heat it first \(M109\)",
        watcher.shown_at(COLD_S + 5.0).message,
    )
    assert "G1 E20 F300" not in watcher.lines()


def test_filament_is_pushed_after_the_user_has_heated_the_nozzle() -> None:
    watcher = Patience().after(COLD_S, Command.LINE, "M109 S200").after(COLD_S, Command.LINE, "G1 E20 F300")
    assert not watcher.after(COLD_S + 100.0, Command.RESUME).run(PROGRAM).cancelled
    assert "G1 E20 F300" in watcher.lines()
    assert is_exact(watcher)


def test_a_cancel_of_a_cooled_pause_leaves_the_tip_where_it_waits() -> None:
    watcher = Patience().after(COLD_S, Command.CANCEL)
    outcome = watcher.run(PROGRAM)
    assert (outcome.cancelled, outcome.heaters_off) == (True, True)
    assert "G91" not in watcher.lines()


def test_an_emergency_stop_works_while_a_cooled_nozzle_is_heated_again() -> None:
    watcher = Patience().after(COLD_S, Command.RESUME).after(COLD_S + 5.0, Command.EMERGENCY_STOP)
    with pytest.raises(FirmwareError, match="emergency stop: the printer has halted"):
        watcher.run(PROGRAM)
    assert watcher.shown_at(COLD_S + 4.0).state == "resuming"


def test_a_cancel_during_the_return_lifts_the_tip_again() -> None:
    watcher = Patience().after(60.0, Command.RESUME)
    watcher.when["resuming"] = lambda: None
    profile, printer = watcher.profile, watcher.printer
    low = {"seen": False}

    def see(progress: PrintStatus) -> None:
        Patience.see(watcher, progress)
        if progress.state == "resuming" and printer.firmware.board.motion.at(printer.now_s)[2] < 65.0 and not low["seen"]:
            low["seen"] = True
            watcher.control.ask(Command.CANCEL)

    outcome: Outcome = print_lines(
        PROGRAM, PATH, on_progress=see, control=watcher.control, profile=profile, medium=printer.medium
    )
    assert (outcome.cancelled, low["seen"]) == (True, True)
    assert printer.record.end[-1, 2] >= 60.0 + profile.machine.lift_mm - 1e-6


def test_the_journal_of_a_pause_records_the_parking_position_even_during_reheating(tmp_path: Path) -> None:
    (tmp_path / "p.gcode").write_text("\n".join(PROGRAM))
    watcher = Patience().after(COLD_S, Command.RESUME).after(COLD_S + 10.0, Command.CANCEL)
    heading = JournalHeading(str(tmp_path / "p.gcode"), "", "p", {})
    with Journal(tmp_path / "journal", heading) as journal:
        print_lines(
            PROGRAM, PATH, on_progress=watcher.see, control=watcher.control, profile=watcher.profile, journal=journal,
            medium=watcher.printer.medium,
        )  # fmt: skip
    last = read_journal(journal.path).last
    assert last.state is PrintState.PAUSED
    assert last.pose[:5] == pytest.approx(watcher.printer.record.end[-1, :5], abs=1e-3)


def test_a_port_that_is_lost_in_a_cooled_pause_changes_nothing() -> None:
    cut = FaultScript((Fault("disconnect", at=200, unit="line", seconds=30.0),), 1)
    watcher = Patience(build=BuildOptions(autoreport=False), faults=cut).after(COLD_S, Command.RESUME)
    assert not watcher.run(PROGRAM).cancelled
    states = list(dict.fromkeys(progress.state for progress in watcher.shown))
    assert states == ["printing", "pausing", "paused", "reconnecting", "resuming", "finishing"]
    assert is_exact(watcher)
