"""Durations of strokes and travels, by the formulas of uniform acceleration and by the dry run."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.bead import Bead
from slicer.estimate.timing import line_s, strokes_s
from slicer.paths import Kind
from slicer.strokes.strokes import strokes_of
from tests.slicer.hand import profile

PROFILE = profile("process.lift_mm=0", "material.wipe_mm=0")
SQUARE = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0], [0.0, 0.0]])
TIP = np.zeros(2)


def seconds(*lines: Floats, retracts: bool = False, speed: float = 50.0, tip: Floats = TIP) -> float:
    """Seconds of walls along lines (n, 2), without the rise to their layer."""
    placed = [Bead(Kind.OUTER_WALL, line, 0.45, 0) for line in lines]
    strokes = strokes_of(placed, np.full(len(lines), retracts), {}, 0.0)
    return strokes_s(strokes, np.full(len(lines), speed), tip, PROFILE, False) - RISE_S


RISE_S = line_s(0.2, PROFILE.process.lift_speed_mm_s, PROFILE.machine.z.acceleration_mm_s2)


def test_a_long_line_loses_the_time_of_one_acceleration() -> None:
    assert line_s(10.0, 50.0, 1000.0) == pytest.approx(10.0 / 50.0 + 50.0 / 1000.0)


def test_a_short_line_never_reaches_its_speed() -> None:
    assert line_s(1.0, 50.0, 1000.0) == pytest.approx(2.0 * (1.0 / 1000.0) ** 0.5)


def test_a_square_is_slowed_at_its_corners_to_the_junction_speed() -> None:
    ramp, junction = PROFILE.machine.x.acceleration_mm_s2, PROFILE.machine.junction_speed_mm_s
    slow = (50.0 - junction) / ramp
    ends = 2.0 * (50.0 / ramp + (20.0 - 0.5 * 50.0**2 / ramp - 0.5 * (50.0**2 - junction**2) / ramp) / 50.0 + slow)
    between = 2.0 * (2.0 * slow + (20.0 - (50.0**2 - junction**2) / ramp) / 50.0)
    assert seconds(SQUARE) == pytest.approx(ends + between, rel=1e-6)


def test_a_travel_takes_its_time_plus_that_of_its_retraction() -> None:
    line = np.array([[0.0, 0.0], [10.0, 0.0]])
    ramp, travel = PROFILE.machine.x.acceleration_mm_s2, PROFILE.process.travel_speed_mm_s
    apart = line + np.array([40.0, 0.0])
    alone, standing = seconds(line), seconds(line, apart, retracts=True)
    material, machine = PROFILE.material, PROFILE.machine
    pulled_s = line_s(material.retract_mm, material.retract_speed_mm_s, machine.extruder_acceleration_mm_s2)
    twice_s = 2.0 * pulled_s  # both travels retract, the first one on the spot
    assert standing - 2.0 * alone == pytest.approx(line_s(30.0, travel, ramp) + 2.0 * twice_s)
    assert seconds(line, apart) < standing - 2.0 * twice_s


def test_the_travel_from_the_layer_below_counts() -> None:
    line = np.array([[0.0, 0.0], [0.0, 10.0]])
    assert seconds(line, tip=np.array([-30.0, 0.0])) > seconds(line) + 30.0 / PROFILE.process.travel_speed_mm_s


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.floats(1.0, 10.0), st.floats(5.0, 200.0))
def test_a_loop_takes_as_long_as_a_body_that_is_everywhere_as_fast_as_it_may(seed: int, size: float, speed: float) -> None:
    rng = np.random.default_rng(seed)
    loop = rng.uniform(0.0, size, (int(rng.integers(3, 12)), 2))
    points = np.vstack([loop, loop[:1]])
    sides = np.diff(points, axis=0)
    heads = sides / np.hypot(*sides.T)[:, None]
    turns = np.abs(np.diff(heads, axis=0)).max(axis=1)
    corners = np.array([0.0, *(PROFILE.machine.junction_speed_mm_s / turns), 0.0])
    expected = integrated_s(points, speed, PROFILE.machine.x.acceleration_mm_s2, corners)
    assert seconds(points, speed=speed, tip=points[0]) == pytest.approx(expected, rel=0.01)


def integrated_s(points: Floats, speed: float, acceleration: float, corners_mm_s: Floats) -> float:
    """Seconds along a line (n, 2) with limited speeds at its corners, summed over 40,000 short steps: everywhere the highest
    speed that the limit, and acceleration from and braking to every corner, allow."""
    sides = np.diff(points, axis=0)
    lengths = np.hypot(*sides.T)
    ramps = acceleration * lengths / np.abs(sides).max(axis=1)  # the axis that moves most reaches the acceleration limit
    at, energy = np.concatenate([[0.0], np.cumsum(lengths)]), np.concatenate([[0.0], np.cumsum(2.0 * ramps * lengths)])
    places = (np.arange(40_000) + 0.5) / 40_000 * at[-1]
    between = np.abs(np.interp(places, at, energy)[:, None] - energy)
    fastest = np.sqrt((corners_mm_s**2 + between).min(axis=1))
    return float((at[-1] / 40_000 / np.minimum(speed, fastest)).sum())
