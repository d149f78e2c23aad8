"""Beads split at the border of a region: the inner pieces agree with shapely, and no length is lost."""

from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.bead import Bead
from slicer.geometry.clip import cut_line
from slicer.geometry.polygons import Polygons, of_contours
from slicer.paths import NUMBER, Kind
from slicer.strokes.strokes import Strokes, split, strokes_of
from tests.slicer.hand import Row, as_shapely, ragged, rows_of

seeds = st.integers(0, 10**6)
INSIDE = Kind.INNER_WALL


def walk(seed: int, steps: int = 30) -> Floats:
    """A line that wanders into and out of a ragged section."""
    return np.cumsum(np.random.default_rng(seed).normal(0.0, 5.0, (steps, 2)), axis=0)


def placed(points: Floats, kind: Kind = Kind.OUTER_WALL) -> Strokes:
    return strokes_of([Bead(kind, points, 0.45, 0)], np.array([True]), {0: np.array([(7.0, 7.0)])}, 0.0)


def parted(line: Strokes, area: Polygons, shortest_mm: float) -> list[Row]:
    pieces, within = split(line, area, line.is_of(Kind.OUTER_WALL), shortest_mm)
    return rows_of(replace(pieces, kind=np.where(within, NUMBER[INSIDE], pieces.kind)))


def length_mm(points: Floats) -> float:
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


@settings(max_examples=40)
@given(seeds)
def test_the_part_of_a_line_inside_a_region_is_marked(seed: int) -> None:
    area, line = ragged(seed), walk(seed)
    pieces = parted(placed(line), area, 0.0)
    inside = sum(length_mm(piece.points) for piece in pieces if piece.kind is INSIDE)
    assert inside == pytest.approx(shapely.LineString(line).intersection(as_shapely(area)).length, abs=1e-6)
    kinds = [piece.kind for piece in pieces]
    assert all(a is not b for a, b in pairwise(kinds))


@settings(max_examples=30)
@given(seeds, st.floats(0.0, 8.0))
def test_the_pieces_of_a_line_add_up_to_it_and_none_is_too_short(seed: int, shortest_mm: float) -> None:
    line = walk(seed)
    pieces = parted(placed(line), ragged(seed), shortest_mm)
    ends = [(piece.points[0].tolist(), piece.points[-1].tolist()) for piece in pieces]
    assert [begin for begin, _ in ends[1:]] == [end for _, end in ends[:-1]]
    assert (ends[0][0], ends[-1][1]) == (line[0].tolist(), line[-1].tolist())
    assert sum(length_mm(piece.points) for piece in pieces) == pytest.approx(length_mm(line))
    assert {piece.width_mm for piece in pieces} == {0.45}
    assert len(pieces) == 1 or min(length_mm(piece.points) for piece in pieces) >= shortest_mm - 1e-9
    assert [(piece.retract, len(piece.approach)) for piece in pieces] == [(True, 1)] + [(False, 0)] * (len(pieces) - 1)


@pytest.mark.parametrize(("reach_mm", "lengths_mm"), [(1.5, [20.0]), (2.5, [10.0, 2.5, 7.5])])
def test_a_line_is_not_split_for_a_shorter_piece_than_set(reach_mm: float, lengths_mm: list[float]) -> None:
    area, line = Polygons.square((reach_mm, 2.0)).translate((10.0, -1.0)), placed(np.array([[0.0, 0.0], [20.0, 0.0]]))
    pieces, _ = split(line, area, line.is_of(Kind.OUTER_WALL), 1.0, 2.0)
    assert [length_mm(piece.points) for piece in rows_of(pieces)] == pytest.approx(lengths_mm)


@settings(max_examples=40)
@given(seeds)
def test_every_step_of_a_split_line_is_on_the_side_of_its_middle(seed: int) -> None:
    area = as_shapely(ragged(seed))
    points, within = cut_line(walk(seed), ragged(seed))
    middles = 0.5 * (points[1:] + points[:-1])
    clear = shapely.distance(area.boundary, shapely.points(middles)) > 1e-6
    assert np.array_equal(within[clear], shapely.contains_xy(area, middles)[clear])


SQUARE = Polygons.square((10.0, 10.0))


@pytest.mark.parametrize(
    ("corners", "kinds"),
    [
        ([(-5, 5), (15, 5)], [Kind.OUTER_WALL, INSIDE, Kind.OUTER_WALL]),
        ([(2, 5), (8, 5)], [INSIDE]),
        ([(-9, 5), (-1, 5)], [Kind.OUTER_WALL]),
        ([(-5, 5), (0, 5), (5, 5)], [Kind.OUTER_WALL, INSIDE]),  # a corner on the border
        ([(-3, 9.5), (0.5, 13)], [Kind.OUTER_WALL]),  # past a corner of the region
        ([(-0.5, 5), (9, 5)], [INSIDE]),  # a millimetre outside is too short for a piece
        ([(-5, 5), (0.5, 5)], [Kind.OUTER_WALL]),
    ],
)
def test_lines_over_a_square(corners: list[tuple[float, float]], kinds: list[Kind]) -> None:
    pieces = parted(placed(np.array(corners, np.float64)), SQUARE, 1.0)
    assert [piece.kind for piece in pieces] == kinds


def test_bars_close_together_that_are_each_too_short_are_one_piece_with_the_gap_between_them() -> None:
    bars = Polygons.square((0.8, 4.0)) + Polygons.square((0.8, 4.0)).translate((1.6, 0.0))
    pieces = parted(placed(np.array([(-5.0, 2.0), (9.0, 2.0)])), bars, 1.0)
    assert [piece.kind for piece in pieces] == [Kind.OUTER_WALL, INSIDE, Kind.OUTER_WALL]
    assert [length_mm(piece.points) for piece in pieces] == pytest.approx([5.0, 2.4, 6.6])


def test_beads_of_other_kinds_are_left_alone() -> None:
    skin = placed(np.array([(-5.0, 5.0), (15.0, 5.0)]), Kind.INFILL)
    left, within = split(skin, SQUARE, skin.is_of(Kind.OUTER_WALL), 0.0)
    assert all(np.array_equal(getattr(left, column.name), getattr(skin, column.name)) for column in fields(Strokes))
    assert within.tolist() == [False]


def test_a_line_that_leaves_a_region_at_one_of_its_points_is_outside_from_there() -> None:
    corner = [3.307692304253578, 4.615384608507156]
    place = of_contours([np.array([[6.0, 4.0], [4.0, 6.0], corner, [6.0, 3.0]])])
    _, within = cut_line(np.array([[6.0, 4.0], corner, [1.3415410790929447, 3.2335858933747845]]), place)
    assert within.tolist() == [True, False]
