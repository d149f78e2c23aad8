"""A firmware that compensates for the table's rotation (G43.4): positions measured on the real one, and the workpiece frame."""

from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import MoveKind
from machine.gcode.writer import write_gcode
from machine.kinematics.table import axis_positions, workpiece_path
from machine.link.protocol.framing import command_of
from machine.simulator.board import BuildOptions
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.motion import TcpKinematics
from machine.simulator.record import Record
from mdp.mesh import Floats
from profiles.machine import Machine
from tests.machine.firmware.test_dialects import profile
from tests.machine.hand import printed

CHOSEN = profile("marlin", "workpiece")
CENTRED = {"point_mm": (100.0, 100.0, 0.0), "limits_deg": (-36000.0, 36000.0), "sign": 1}  # Rx(-A) Rz(-C)


def paths(record: Record) -> Floats:
    """Every move in the workpiece frame, mm, (n, 2, 3); a move that turns the table is a curve there, and these are its ends."""
    return np.stack([workpiece_path(record.machine, points[:, :5]) for points in (record.start, record.end)], axis=1)


def measured() -> Machine:
    """The fork's xyzac-trt with both axes through (100, 100, 0), as it was measured."""
    machine = CHOSEN.machine
    axes = {axis: getattr(machine, axis).model_copy(update=CENTRED) for axis in ("tilt", "turn")}
    roomy = {axis: getattr(machine, axis).model_copy(update={"limits_mm": (-500.0, 500.0)}) for axis in "xyz"}
    return machine.model_copy(update=axes | roomy)


def answer(firmware: SimulatedFirmware, text: str, until_s: float = inf) -> list[str]:
    firmware.receive(text.encode())
    return firmware.advance(until_s).decode().splitlines()


def counts(firmware: SimulatedFirmware) -> list[int]:
    return firmware.board.motion.counts(1e9)


def test_the_axes_go_where_the_real_firmware_s_went() -> None:
    """M=(100,100,0), A30 C90, X110 Y100 Z20: counts 8000, 8107, 8928 at 80, 80 and 400 steps a mm."""
    firmware = SimulatedFirmware(measured(), BuildOptions(home_start=False))
    answer(firmware, "G0 X100 Y100\nG43.4\nG0 A30 C90\nG0 X110 Y100 Z20\nM400\n")
    assert counts(firmware)[:3] == pytest.approx([8000, 8107, 8928], abs=1)
    assert answer(firmware, "M114\n")[0].startswith("X:110.00 Y:100.00 Z:20.00 A:30.00 C:90.00 E:0.00 Count X:8000 Y:8107 Z:8928")


def test_following_switched_at_a_turned_table_believes_the_axes_elsewhere_without_moving_them() -> None:
    firmware = SimulatedFirmware(measured(), BuildOptions(home_start=False))
    answer(firmware, "G43.4\nG0 X110 Y200 Z20\nG0 A30 C90\nM400\n")
    before, stood = counts(firmware), firmware.board.motion.at(1e9)
    answer(firmware, "G49\nM400\n")
    assert firmware.board.motion.at(1e9) == stood
    assert counts(firmware)[1] == 16000 != before[1]


@given(st.lists(st.floats(-90, 90), min_size=5, max_size=5))
def test_place_and_positions_are_each_other_s_inverse_and_agree_with_the_dry_run_s(tip: list[float]) -> None:
    tcp = TcpKinematics(CHOSEN.machine)
    positions = tcp.positions(tip)
    assert tcp.tip(positions) == pytest.approx(tip, abs=1e-9)
    assert positions[:3] == pytest.approx(axis_positions(CHOSEN.machine, np.array([tip]))[0].tolist(), abs=1e-9)


def test_a_turn_keeps_the_tip_on_the_workpiece_within_a_hair() -> None:
    firmware = SimulatedFirmware(measured(), BuildOptions(home_start=False))
    answer(firmware, "G43.4\nG0 X120 Y110 Z5\nM400\nG1 A20 C50 F3000\nM400\n")
    record = firmware.record()
    turn = paths(record)[record.begin_s > record.begin_s[0]].reshape(-1, 3)
    assert record.moves > 20
    assert np.abs(turn - turn[0]).max() < 1e-9
    assert record.end[-1, 3:5].tolist() == pytest.approx([20.0, 50.0])


def test_the_record_covers_every_move_in_the_workpiece_frame() -> None:
    firmware = SimulatedFirmware(CHOSEN.machine, BuildOptions(home_start=False))
    answer(firmware, "G0 X5 Y5\nG1 Z3\nG0 A10\nM302 P1\nM83\nG1 X7 E1\nG1 E-1\nM400\n")
    record = firmware.record()
    assert paths(record).shape == (5, 2, 3) == (record.moves, 2, 3)
    assert record.deposited()[0][0] == pytest.approx(paths(record)[3])


def test_a_whole_print_in_workpiece_coordinates_lays_what_the_reader_reads() -> None:
    lines = list(write_gcode(printed()[3], CHOSEN))
    firmware = SimulatedFirmware(CHOSEN.machine, BuildOptions(advanced_ok=False, home_start=False))
    answer(firmware, "".join(f"{command}\n" for k, line in enumerate(lines, 1) if (command := command_of(line, k, 120))))
    record, parsed = firmware.record(), parse_gcode(lines, CHOSEN.machine)
    strokes, planned = record.end[:, 5] - record.start[:, 5] > 1e-9, parsed.kind == MoveKind.EXTRUDE
    moving = strokes & (record.start[:, :5] != record.end[:, :5]).any(axis=1)
    assert record.end[moving, :5] == pytest.approx(parsed.end[planned], abs=2e-3)
    assert (record.unknown, record.clamped) == (0, 0)
