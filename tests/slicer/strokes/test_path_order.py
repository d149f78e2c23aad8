"""Path orders against brute force."""

from collections.abc import Iterable
from itertools import permutations, product

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from mdp.mesh import Floats
from slicer.strokes.path_order import order_paths

NO_GOAL, ORIGIN = np.zeros((0, 3)), np.zeros(3)
CHANGE_MM = 3.0  # travel that a change of speed is worth


def paths(seed: int, count: int) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Starts and ends with their speeds, and whether they are fixed, of random paths."""
    random = np.random.default_rng(seed)
    starts = random.uniform(0, 50, (count, 2))
    ends = starts + random.uniform(-15, 15, (count, 2))
    begin, end = random.choice([0.0, 60.0], (2, count))
    return np.c_[starts, begin], np.c_[ends, end], random.random(count) < 0.4


def way(a: Floats, b: Floats) -> Floats:
    """Travel between points, plus the travel that a change of speed is worth."""
    apart: Floats = np.hypot(b[..., 0] - a[..., 0], b[..., 1] - a[..., 1]) + CHANGE_MM * (a[..., 2] != b[..., 2])
    return apart


def nearest_first(starts: Floats, ends: Floats, fixed: NDArray[np.bool_]) -> tuple[list[int], list[bool]]:
    """The order and reversals of a nearest-neighbour tour from the origin."""
    order, flips, at, far = list[int](), list[bool](), ORIGIN, np.zeros(len(starts))
    while len(order) < len(starts):
        to_start = way(at, starts) + far
        to_end = np.where(fixed, np.inf, way(at, ends)) + far
        flip = bool(to_end.min() < to_start.min())
        k = int((to_end if flip else to_start).argmin())
        order, flips, at = [*order, k], [*flips, flip], starts[k] if flip else ends[k]
        far[k] = np.inf
    return order, flips


def travel(starts: Floats, ends: Floats, order: Iterable[int], flips: Iterable[bool], goal: Floats = NO_GOAL) -> float:
    """Length of all travels of an order from the origin, plus the travel that its changes of speed are worth."""
    runs = [(ends[k], starts[k]) if flip else (starts[k], ends[k]) for k, flip in zip(order, flips, strict=True)]
    stops = [ORIGIN, *(point for run in runs for point in run), *goal]
    return sum(float(way(a, b)) for a, b in zip(stops[::2], stops[1::2], strict=False))


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 5), st.booleans())
def test_an_order_of_few_paths_is_close_to_the_shortest_there_is(seed: int, count: int, goal: bool) -> None:
    starts, ends, fixed = paths(seed, count)
    target = np.array([[25.0, 25.0, 60.0]]) if goal else NO_GOAL
    order, flips = order_paths(starts, ends, fixed, ORIGIN, target)
    reversals = product(*([False] if still else [False, True] for still in fixed))
    every = ((p, [flipped[k] for k in p]) for flipped in reversals for p in permutations(range(count)))
    best = min(travel(starts, ends, p, chosen, target) for p, chosen in every)
    assert travel(starts, ends, order, flips, target) <= 1.3 * best + 1e-9


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.integers(1, 80))
def test_an_order_has_each_path_once_and_is_never_longer_than_the_greedy_one(seed: int, count: int) -> None:
    starts, ends, fixed = paths(seed, count)
    order, flips = order_paths(starts, ends, fixed, ORIGIN, NO_GOAL)
    assert sorted(order) == list(range(count))
    assert not (flips & fixed[order]).any()
    assert travel(starts, ends, order, flips) <= travel(starts, ends, *nearest_first(starts, ends, fixed)) + 1e-6


def test_exchanges_save_a_tenth_of_the_travel_between_many_short_lines() -> None:
    starts, ends, _ = paths(3, 3000)
    ends = starts + 0.05 * (ends - starts)
    starts[:, 2] = ends[:, 2] = 0.0
    loose = np.zeros(3000, dtype=bool)
    shorter = travel(starts, ends, *order_paths(starts, ends, loose, ORIGIN, NO_GOAL))
    assert shorter < 0.92 * travel(starts, ends, *nearest_first(starts, ends, loose))


def in_turn(step_mm: float) -> tuple[list[int], list[bool]]:
    """The order of eight short paths in a row with alternating speeds, as indices in the row."""
    row, speeds = step_mm * np.arange(8.0), np.tile([25.0, 60.0], 4)
    starts, ends = np.c_[row, np.zeros(8), speeds], np.c_[row, np.ones(8), speeds]
    order, _ = order_paths(starts, ends, np.zeros(8, dtype=bool), np.array([0.0, 0.0, 25.0]), NO_GOAL)
    return order.tolist(), (speeds[order] == 25.0).tolist()


def test_close_paths_of_one_speed_are_printed_together() -> None:
    _, slow = in_turn(1.0)  # going back along the row once takes 7 mm, its seven changes of speed are worth 21
    assert slow == [True] * 4 + [False] * 4


def test_distant_paths_of_one_speed_are_not_grouped() -> None:
    order, _ = in_turn(50.0)  # going back takes 350 mm
    assert order == list(range(8))
