"""A new firmware needs one file and one table line to be written, dry-run, streamed, simulated, identified and calibrated."""

import numpy as np
import pytest

from machine import firmware
from machine.dryrun.dryrun import dry_run
from machine.firmware import dialects, identify
from machine.gcode.modes import ModalState, axes_of
from machine.gcode.reader.parsed import MoveKind
from machine.gcode.writer import write_gcode
from machine.link.protocol.connection import Connection
from machine.link.stream import print_lines
from machine.setup.calibration.program import calibration_lines, plan_touches
from machine.simulator.firmware import SimulatedFirmware
from profiles.machine import FOLLOWS_TABLE
from profiles.profile import Profile
from tests.machine.firmware.made_up import MADE_UP
from tests.machine.hand import printed, text
from tests.machine.virtual_printer import PATH, VirtualPrinter


@pytest.fixture
def profile(monkeypatch: pytest.MonkeyPatch) -> Profile:
    """A machine with the invented firmware, which is registered in the table."""
    monkeypatch.setattr(firmware, "FIRMWARES", (*firmware.FIRMWARES, MADE_UP))
    usual = printed()[0]
    return usual.model_copy(update={"machine": usual.machine.model_copy(update={"dialect": "made_up"})})


def test_its_words_are_written(profile: Profile) -> None:
    lines = list(write_gcode(printed()[3], profile))
    assert {"M106 S1", "M117 part 1", "M117 part 2"} <= set(lines)
    assert "\nG90\nG21\nM83\n" in "\n".join(lines)


def test_the_dry_run_reads_its_text_as_the_same_print_as_marlin_s(profile: Profile) -> None:
    marlin, made_up = dry_run(text(), printed()[0]), dry_run(list(write_gcode(printed()[3], profile)), profile)
    assert made_up.program.ignored == {}
    assert np.abs(made_up.program.end - marlin.program.end).max() < 1e-9
    assert [finding.code for finding in made_up.findings] == [finding.code for finding in marlin.findings]


def test_its_program_is_streamed_to_its_simulated_printer(profile: Profile) -> None:
    lines = list(write_gcode(printed()[3], profile))
    printer = VirtualPrinter(profile.machine)
    outcome = print_lines(lines, PATH, medium=printer.medium, profile=profile)
    record, program = printer.record, dry_run(lines, profile).program
    strokes = record.end[record.end[:, 5] > record.start[:, 5]]
    assert (outcome.firmware, record.unknown) == ("Made-up 1.0", 0)
    assert strokes[-1, :5] == pytest.approx(program.end[program.kind == MoveKind.EXTRUDE][-1], abs=1e-3)
    assert np.ptp(record.end[:, 3]) > 80.0


def test_its_simulated_printer_answers_with_its_own_messages(profile: Profile) -> None:
    simulated = SimulatedFirmware(profile.machine)
    simulated.receive(b"G2 X1\n")
    assert simulated.advance() == b"what is G2 X1?\nok\n"


def test_its_name_selects_its_line_rules_in_the_sender(profile: Profile) -> None:
    assert identify("FIRMWARE_NAME:Made-Up 1.1 by somebody") is MADE_UP
    connection = Connection()
    connection.receive(b"FIRMWARE_NAME:Made-up 1.0\n", 0.0)
    assert connection.greeting.firmware.line.last_number == 9_900


def test_its_words_for_following_the_table_are_remembered_for_a_resume(profile: Profile) -> None:
    state = ModalState(axes_of(profile.machine))
    state.take("M430")
    assert (state.follows, state.lines()[-1]) == (True, "M430")
    state.take("M431")
    assert not state.follows


def test_its_calibration_waits_for_the_user_with_its_own_command(profile: Profile) -> None:
    lines = list(calibration_lines(profile, plan_touches(profile.machine, 20.0)))
    first = next(k for k, line in enumerate(lines) if line.startswith("M118 touch 1 "))
    assert lines[first + 1] == "M1"


def test_every_name_that_a_profile_may_give_is_written_and_follows_the_table_as_the_profile_believes() -> None:
    assert {name: bool(dialect.follow_on) for name, dialect in dialects().items()} == FOLLOWS_TABLE


def test_every_firmware_that_takes_lines_has_a_name_on_the_line_and_a_simulation() -> None:
    serial = [family for family in firmware.FIRMWARES if any(dialect.serial for dialect in family.dialects.values())]
    assert len(serial) >= 3
    assert [family.name for family in serial if not (family.signs and family.simulated)] == []
