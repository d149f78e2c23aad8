"""The simulated printer executes the special commands of each serial dialect."""

from math import inf

import numpy as np
import pytest

from machine.firmware import dialects
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind
from machine.gcode.writer import write_gcode
from machine.link.protocol.framing import command_of
from machine.printing.checks import check_dialect
from machine.simulator.board import BuildOptions
from machine.simulator.firmware import SimulatedFirmware
from profiles.errors import PrinterError
from tests.machine.firmware.test_dialects import profile
from tests.machine.hand import printed

SERIAL = [name for name, dialect in dialects().items() if dialect.serial]


def said(firmware: SimulatedFirmware, *lines: str) -> str:
    return "".join([_reply(firmware, line) for line in lines])


def _reply(firmware: SimulatedFirmware, line: str) -> str:
    firmware.receive(f"{line}\n".encode())
    return firmware.advance(inf).decode()


@pytest.mark.parametrize("dialect", SERIAL)
def test_a_whole_print_moves_it_as_the_reader_says_and_nothing_is_unknown(dialect: str) -> None:
    chosen = profile(dialect)
    lines = list(write_gcode(printed()[3], chosen))
    firmware = SimulatedFirmware(chosen.machine, BuildOptions(advanced_ok=False))
    assert "nknown" not in said(firmware, *[command for k, line in enumerate(lines, 1) if (command := command_of(line, k, 120))])
    record, parsed = firmware.record(), parse_gcode(lines, chosen.machine)
    strokes, planned = record.end[record.end[:, 5] > record.start[:, 5]], parsed.kind == MoveKind.EXTRUDE
    assert strokes[-1, :5] == pytest.approx(parsed.end[planned][-1], abs=1e-3)
    turns = np.abs(record.end[:, 3:5] - record.start[:, 3:5]).max(axis=1) > 0
    wanted = parsed.end[parsed.kind == MoveKind.ROTATE]
    assert record.end[turns, 3:5] == pytest.approx(wanted[:, 3:], abs=1e-3)
    assert (record.unknown, record.clamped, record.nozzle_target_c, record.bed_target_c) == (0, 0, 0.0, 0.0)


def test_steppers_turn_together_for_as_long_as_the_slower_takes() -> None:
    firmware = SimulatedFirmware(profile("klipper_steppers").machine)
    said(
        firmware, "MANUAL_STEPPER STEPPER=stepper_a MOVE=30 SPEED=10 SYNC=0", "MANUAL_STEPPER STEPPER=stepper_c MOVE=60 SPEED=10"
    )
    record = firmware.record()
    assert record.end[-1, 3:5].tolist() == [30.0, 60.0]
    assert record.duration_s[-1] >= 6.0


def test_reprapfirmware_s_fans_and_tools_are_understood() -> None:
    firmware = SimulatedFirmware(profile("reprapfirmware").machine)
    said(firmware, "M106 P0 S0.5", "M568 P0 S200", "M116")
    assert (firmware.board.fan, firmware.board.nozzle.target_c) == (0.5, 200.0)
    assert firmware.board.nozzle.at(firmware.board.now_s) == pytest.approx(200.0, abs=1.5)


def test_an_unknown_stepper_is_reported() -> None:
    assert "'z9' is not valid for STEPPER" in said(
        SimulatedFirmware(profile("klipper").machine), "MANUAL_STEPPER STEPPER=z9 MOVE=1"
    )


def test_marlin_does_not_know_klipper_s_commands() -> None:
    assert "Unknown command" in said(SimulatedFirmware(profile("marlin").machine), "MANUAL_STEPPER STEPPER=stepper_a MOVE=1")


def test_firmwares_that_take_no_lines_are_refused_with_those_that_do() -> None:
    with pytest.raises(PrinterError, match=r"speaks linuxcnc, which opens files itself: use export; .* klipper_steppers$"):
        check_dialect(profile("linuxcnc").machine)
