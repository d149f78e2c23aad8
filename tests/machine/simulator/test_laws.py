"""Invariants of a simulated printer under any commands, at any times, of any family, on any line."""

import random
from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.simulator.board import BuildOptions
from machine.simulator.cable import Cable, Uart
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.motion import HARD_MM
from machine.simulator.record import Record
from profiles.machine import Machine
from tests.machine.firmware.test_dialects import profile
from tests.machine.virtual_printer import random_script

MACHINES = [profile(dialect).machine for dialect in ("marlin", "klipper", "klipper_steppers", "reprapfirmware")]
MACHINES.append(profile("marlin", "workpiece").machine)
PLAIN = """G4 P100|G28|G28 X|G43.4|G49|G90|G91|M0 S1|M18|M82|M83|M104 S200|M109 S50|M190 S40|M105|M106|M107|M108|M110 N5|
M112|M114|M115|M118 A1 q|M119|M140 S50|M154 S1|M155 S1|M201 X100|M203 X5|M204 S100|M205 X1|M211 S0|M220 S50|M221 S0|
M302 P1|M400|M410|M81|M876|S000|G20|G21|M116|MANUAL_STEPPER STEPPER=stepper_a MOVE=9 SPEED=5"""
ORDERS = [order.strip() for order in PLAIN.split("|")]


def session(seed: int) -> tuple[Machine, Record]:
    """Forty bursts of up to five lines, seconds or nothing between them, over a line with faults."""
    rng = random.Random(seed)
    machine = rng.choice(MACHINES)
    build = BuildOptions(*(rng.random() < 0.5 for _ in range(4)), rx_ring=128 if rng.random() < 0.5 else None)
    firmware = SimulatedFirmware(machine, build)
    cable = Cable(firmware, random_script(seed, rng.randint(0, 4), range(1, 60)), rng.choice([1.0, 7.0, inf]))
    line = Uart(cable, rng.choice([9600, 115200])) if rng.random() < 0.5 else cable
    now_s = 0.0
    for _ in range(40):
        line.exchange("".join(f"{_order(rng)}\n" for _ in range(rng.randint(0, 5))).encode(), now_s)
        now_s += rng.choice([0.0, 0.01, 0.5, 3.0])
    return machine, firmware.record()


def _order(rng: random.Random) -> str:
    if rng.random() < 0.5:
        return rng.choice(ORDERS)
    words = " ".join(f"{letter}{rng.uniform(-200, 200):.2f}" for letter in rng.sample("XYZACEFIJR", rng.randint(0, 4)))
    return f"{rng.choice(['G0', 'G1', 'G1', 'G2', 'G92'])} {words}"


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6))
def test_moves_follow_each_other_in_time_and_place_within_the_machine(seed: int) -> None:
    machine, record = session(seed)
    ends_s = record.begin_s + record.duration_s
    assert (record.begin_s[1:] >= ends_s[:-1] - 1e-9).all()
    assert (record.duration_s >= 0).all()
    assert record.start[1:, 5] == pytest.approx(record.end[:-1, 5], abs=1e-9)
    jumps = int((np.abs(record.start[1:, :5] - record.end[:-1, :5]).max(axis=1) > 1e-9).sum()) if record.moves else 0
    assert jumps <= sum(what.startswith(("homed", "motors off")) for _, what in record.events)
    axes = [machine.x.limits_mm, machine.y.limits_mm, machine.z.limits_mm, machine.tilt.limits_deg, machine.turn.limits_deg]
    for axis, (low, high) in enumerate(axes):
        assert ((record.end[:, axis] >= low - HARD_MM) & (record.end[:, axis] <= high + HARD_MM)).all()
    assert (record.moves, record.moving_s) == (len(record.end), pytest.approx(record.duration_s.sum()))
