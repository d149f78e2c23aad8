"""Lines clipped to polygons, against shapely: polylines of any kind, and level lines."""

from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.geometry.clip import NO_PIECES, Pieces, border_of, clip_lines, merge_pieces, rotation_2d
from slicer.geometry.polygons import Polygons, contours, edges, offset
from slicer.geometry.scanlines import join_lines, scan_lines
from tests.slicer.hand import as_shapely, ragged

FAR = 60.0  # lines begin and end outside of all shapes
seeds = st.integers(0, 10**6)
few = settings(deadline=None, max_examples=30)


def wandering(seed: int, count: int = 6) -> list[Floats]:
    """Polylines from the left of everything to its right, back and forth in between."""
    random = np.random.default_rng(seed)
    inner = random.uniform(-30.0, 30.0, (count, 5, 2))
    ends = random.uniform(-30.0, 30.0, (count, 2))
    return [np.vstack([[-FAR, a], line, [FAR, b]]) for line, (a, b) in zip(inner, ends, strict=True)]


def lines_of(pieces: Pieces) -> list[Floats]:
    return [pieces.points[a:b] for a, b in pairwise(pieces.starts)]


def clipped(lines: list[Floats], area: Polygons) -> Pieces:
    starts = np.cumsum([0, *(len(line) for line in lines[:-1])])
    return clip_lines(np.concatenate(lines), starts, border_of(area).edges)


@few
@given(seeds)
def test_what_is_left_of_lines_is_shapely_s_intersection(seed: int) -> None:
    area, lines = ragged(seed), wandering(seed)
    pieces = lines_of(clipped(lines, area))
    expected = as_shapely(area).intersection(shapely.MultiLineString(lines))
    assert sum(shapely.LineString(piece).length for piece in pieces) == pytest.approx(
        sum(as_shapely(area).intersection(shapely.LineString(line)).length for line in lines), rel=1e-9
    )
    assert shapely.MultiLineString(pieces).buffer(1e-6).covers(expected)


@few
@given(seeds)
def test_every_piece_ends_on_the_edges_that_it_names(seed: int) -> None:
    area = ragged(seed)
    border, pieces = border_of(area), clipped(wandering(seed), area)
    for line, ends in zip(lines_of(pieces), pieces.ends, strict=True):
        for point, edge in zip(line[[0, -1]], ends, strict=True):
            side = shapely.LineString(border.edges[edge].reshape(2, 2))
            assert side.distance(shapely.Point(point)) < 1e-9


def test_several_bundles_become_one() -> None:
    square = Polygons.square((4.0, 4.0), True)
    level, upright = (
        clipped([line], square) for line in (np.array([[-9.0, 1.0], [9.0, 1.0]]), np.array([[1.0, -9.0], [1.0, 9.0]]))
    )
    both = merge_pieces([level, upright])
    assert [line.tolist() for line in lines_of(both)] == [[[-2, 1], [2, 1]], [[1, -2], [1, 2]]]
    assert both.ends.tolist() == [*level.ends.tolist(), *upright.ends.tolist()]
    assert merge_pieces([]) is NO_PIECES


def test_nothing_is_left_of_nothing() -> None:
    assert len(clipped(wandering(1), Polygons()).ends) == 0
    assert len(clip_lines(np.zeros((0, 2)), np.zeros(0, np.int64), edges(Polygons.square((1.0, 1.0)))).ends) == 0


@few
@given(seeds)
def test_a_border_has_its_contours_one_after_the_other_and_turns_as_a_whole(seed: int) -> None:
    area = ragged(seed)
    border = border_of(area)
    for (a, b), loop in zip(pairwise(border.offsets.tolist()), contours(area), strict=True):
        assert (border.edges[a:b, :2] == loop).all()
        assert (border.edges[a:b, 2:] == np.roll(loop, -1, axis=0)).all()
    turned = border.turned(30.0).reshape(-1, 2) @ rotation_2d(-30.0)
    assert turned == pytest.approx(border.edges.reshape(-1, 2))


@few
@given(seeds, st.floats(0.3, 4.0))
def test_level_lines_are_cut_as_shapely_cuts_them(seed: int, apart_mm: float) -> None:
    area = ragged(seed)
    heights = np.arange(-31.0, 31.0, apart_mm)
    rows = scan_lines(edges(area), heights)
    for k, y in enumerate(heights.tolist()):
        cut = as_shapely(area).intersection(shapely.LineString([(-FAR, y), (FAR, y)]))
        assert float((rows[rows[:, 3] == k][:, 1] - rows[rows[:, 3] == k][:, 0]).sum()) == pytest.approx(cut.length, abs=1e-9)
    assert (rows[:, 1] >= rows[:, 0]).all()
    assert (rows[:, 2] == heights[rows[:, 3].astype(int)]).all()


@few
@given(seeds, st.floats(0.5, 3.0), st.floats(0.0, 9.0))
def test_joined_lines_have_every_line_once_and_no_joint_is_long_or_crosses_the_fence(
    seed: int, apart_mm: float, reach_mm: float
) -> None:
    area = ragged(seed)
    rows = scan_lines(edges(area), np.arange(-31.0, 31.0, apart_mm))
    fence = offset(area, 0.05)
    points, starts = join_lines(rows, edges(fence), reach_mm)
    drawn = sorted(tuple(sorted((a, b))) for a, b in points.reshape(-1, 2, 2)[:, :, 0].tolist())
    assert drawn == sorted(tuple(row) for row in rows[:, :2].tolist())
    for line in np.split(points, starts[1:]):
        for a, b in line[1:-1].reshape(-1, 2, 2):
            assert np.hypot(*(b - a)) < reach_mm
            assert as_shapely(fence).contains(shapely.LineString([a, b]))
