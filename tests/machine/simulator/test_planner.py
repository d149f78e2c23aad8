"""The simulated planner: the dry run's times with a steady supply of lines, stops and slow moves without."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.firmware.marlin import FIRST_MOVE_DELAY_S, SIMULATED
from machine.link.protocol.framing import frame
from machine.simulator.board import BuildOptions
from machine.simulator.cable import Cable, Uart
from machine.simulator.firmware import SimulatedFirmware
from profiles.profile import load
from slicer.estimate.timing import move_times

MACHINE = load().machine


def ran(lines: list[str], until_s: float = float("inf")) -> SimulatedFirmware:
    firmware = SimulatedFirmware(MACHINE, BuildOptions(busy=False, home_start=False))
    firmware.receive("".join(f"{line}\n" for line in lines).encode())
    firmware.advance(until_s)
    return firmware


def wave(seed: int, n: int) -> list[str]:
    """Moves of 2 to 30 mm with corners of all kinds, some in Z, some of the table."""
    rng = np.random.default_rng(seed)
    at, lines = np.zeros(5), []
    for _ in range(n):
        kind = rng.integers(8)
        at[:2] = np.clip(at[:2] + rng.uniform(2, 30) * rng.normal(size=2) / 1.5, -100, 100)
        at[2] = max(0.0, at[2] + 0.2 * (kind == 0))
        at[3:] = at[3:] + 5 * (kind == 1) * rng.normal(size=2)
        words = " ".join(f"{letter}{value:.3f}" for letter, value in zip("XYZAC", at, strict=True))
        lines.append(f"G1 {words} F{rng.integers(600, 9000)}")
    return lines


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 10**6))
def test_a_well_fed_printer_takes_as_long_as_the_dry_run_says(seed: int) -> None:
    record = ran([*wave(seed, 120), "M400"]).record()
    deltas = record.end - record.start
    stop = np.zeros(len(deltas), dtype=np.bool_)
    wanted = move_times(deltas, record.feed_mm_s, stop, MACHINE)
    assert record.duration_s.sum() == pytest.approx(wanted.sum(), rel=0.01)
    assert record.underruns == 0


def test_moves_follow_each_other_without_a_gap() -> None:
    record = ran([*wave(1, 60), "M400"]).record()
    assert record.begin_s[1:] == pytest.approx(record.begin_s[:-1] + record.duration_s[:-1])


def test_every_speed_change_is_within_the_acceleration() -> None:
    """A straight line takes as long in many short moves as in one long move."""
    whole = ran(["G1 X100 F6000", "M400"]).record().duration_s.sum()
    pieces = ran([*(f"G1 X{k} F6000" for k in range(5, 101, 5)), "M400"]).record().duration_s.sum()
    assert pieces == pytest.approx(whole, rel=1e-6)


def test_the_first_move_waits_a_moment_for_others() -> None:
    assert ran(["G1 X1 F600", "M400"]).record().begin_s[0] == pytest.approx(FIRST_MOVE_DELAY_S)
    assert ran(["G1 X1 F600", "G1 X2", "G1 X3", "M400"]).record().begin_s[0] == 0.0


def test_tiny_moves_are_stretched_while_few_wait() -> None:
    firmware = ran(["G1 X0.1 F6000", "G1 X0.2", "G1 X0.3"], until_s=0.0)
    record = firmware.record()
    assert record.slowed == 1
    assert record.duration_s[2] > SIMULATED.min_segment_s


def test_a_starving_printer_stops_in_mid_stroke_and_counts_it() -> None:
    firmware = SimulatedFirmware(MACHINE, BuildOptions(busy=False, home_start=False))
    for k in range(1, 11):
        firmware.receive(b"G1 X%d F6000\n" % (k * 5))
        firmware.advance(float(k))
    record = firmware.record()
    assert record.underruns == 9
    assert record.duration_s.min() > 2 * 0.05  # each begins and ends at a standstill


def test_waits_of_the_program_are_no_underruns() -> None:
    firmware = SimulatedFirmware(MACHINE, BuildOptions(busy=False, home_start=False))
    for second, line in enumerate(["G1 X5", "G4 S1", "G1 X10", "M400", "G1 X15", "G28", "G1 X20", "M109 S60", "G1 X25"], 1):
        firmware.receive(f"{line}\n".encode())
        firmware.advance(100.0 * second)
    assert firmware.record().underruns == 0


@pytest.mark.parametrize(("baud", "starves"), [(115200, True), (1000000, False)])
def test_whether_a_line_starves_the_printer_depends_on_its_rate(baud: int, starves: bool) -> None:
    """0.15 mm at 60 mm/s needs 400 lines a second; 115200 baud carries 270 of these, 1 MBd 2,300."""
    firmware = SimulatedFirmware(MACHINE, BuildOptions(advanced_ok=False, busy=False, home_start=False))
    line = Uart(Cable(firmware, speed=1.0), baud)
    lines = b"".join(frame(1000 + k, f"G1 X{k * 0.15:.3f} Y0.000 E0.01 F3600") for k in range(1, 801))
    line.exchange(b"M302 P1\nM83\nM110 N1000\n" + lines, 0.0)
    line.exchange(b"", 60.0)
    record = firmware.record()
    assert record.moves == 800
    assert (record.slowed > 50) == starves


def test_a_halt_leaves_the_axes_where_the_ramps_had_brought_them() -> None:
    firmware = ran(["G1 X100 F6000"], until_s=FIRST_MOVE_DELAY_S + 0.02)
    firmware.board.motion.halt(FIRST_MOVE_DELAY_S + 0.02)
    record = firmware.record()
    assert record.end[-1, 0] == pytest.approx(0.5 * 1500 * 0.02**2)
    assert firmware.board.motion.position[0] == record.end[-1, 0]
    assert (record.moves, record.moving_s) == (1, pytest.approx(0.02))


def test_a_stroke_halted_before_it_moves_never_was() -> None:
    firmware = ran(["M302 P1", "M83", "G1 X10 E4 F600", "G1 X20 E4", "G1 X30 E4"], until_s=0.0)
    firmware.board.motion.halt(0.0)
    record = firmware.record()
    assert (record.moves, record.strokes, record.pushed_mm, record.moving_s, len(record.end)) == (0, 0, 0.0, 0.0, 0)


def test_a_halt_forgets_the_filament_that_was_not_pushed() -> None:
    firmware = ran(["M302 P1", "M83", "M221 S50", "G1 X10 E4 F600", "G1 X20 E4", "G1 X30 E4"], until_s=1.0)
    firmware.board.motion.halt(1.0)
    record = firmware.record()
    assert record.end[-1, 5] == pytest.approx(record.end[-1, 0] * 0.2)
    assert firmware.board.motion.position[5] == pytest.approx(2 * record.end[-1, 5])


def test_a_short_record_keeps_the_last_moves_and_all_sums() -> None:
    lines = ["M302 P1", "M83", *(f"G1 X{k % 50} E0.1 F6000" for k in range(1, 2001)), "M400"]
    long, short = ran(lines).record(), SimulatedFirmware(MACHINE, BuildOptions(busy=False, home_start=False), kept_moves=100)
    short.receive("".join(f"{line}\n" for line in lines).encode())
    short.advance()
    few = short.record()
    assert 100 <= len(few.end) <= 200
    assert few.first + len(few.end) == few.moves == long.moves == 2000
    assert few.end.tolist() == long.end[few.first :].tolist()
    assert (few.strokes, few.pushed_mm, few.moving_s) == pytest.approx((long.strokes, 200.0, long.duration_s.sum()))
