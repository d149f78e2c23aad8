"""Starting points of lines without a seam."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.geometry.polyline import length_mm
from slicer.strokes.path_order import AS_IT_IS, CLOSED, OPEN, order_lines

SQUARE = np.array([[0, 0], [10, 0], [10, 10], [0, 10], [0, 0]], dtype=float)
THERE_AND_BACK = np.array([[50, 0], [25, 0], [0, 0], [0, 2], [25, 2], [50, 2]], dtype=float)
NO_GOAL = np.zeros((0, 3))


def in_order(lines: list[Floats], freedom: list[int], tip: tuple[float, float]) -> list[tuple[int, list[Floats]]]:
    fixed = np.array([free == CLOSED for free in freedom])
    return order_lines(lines, np.zeros((len(lines), 2)), fixed, freedom, np.array([*tip, 0.0]), NO_GOAL)


def test_a_ring_begins_at_the_corner_nearest_to_the_tip() -> None:
    ((_, (ring,)),) = in_order([SQUARE], [CLOSED], (12.0, 11.0))
    assert ring.tolist() == [[10, 10], [0, 10], [0, 0], [10, 0], [10, 10]]


def test_a_double_line_is_split_to_begin_near_the_tip() -> None:
    ((_, pieces),) = in_order([THERE_AND_BACK], [OPEN], (0.0, 1.0))
    assert [piece.tolist() for piece in pieces] == [[[0, 0], [0, 2], [25, 2], [50, 2]], [[50, 0], [25, 0], [0, 0]]]


def test_a_line_is_not_taken_in_two_for_little() -> None:
    ((_, pieces),) = in_order([THERE_AND_BACK], [OPEN], (48.0, 1.0))
    assert len(pieces) == 1


def test_a_line_without_freedom_stays_as_it_is() -> None:
    ((_, pieces),) = in_order([SQUARE], [AS_IT_IS], (12.0, 11.0))
    assert (pieces[0] == SQUARE).all()


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6))
def test_every_line_is_printed_once_and_whole(seed: int) -> None:
    random = np.random.default_rng(seed)
    lines = [random.uniform(-30, 30, (random.integers(2, 9), 2)) for _ in range(random.integers(1, 8))]
    freedom = [int(free) for free in random.choice([OPEN, AS_IT_IS, CLOSED], len(lines))]
    lines = [np.vstack([line, line[:1]]) if free == CLOSED else line for line, free in zip(lines, freedom, strict=True)]
    runs = in_order(lines, freedom, (0.0, 0.0))
    assert sorted(number for number, _ in runs) == list(range(len(lines)))
    for number, pieces in runs:
        assert np.isclose(sum(length_mm(piece) for piece in pieces), length_mm(lines[number]))
        assert all(len(piece) > 1 for piece in pieces)
