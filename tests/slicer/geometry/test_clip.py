"""Lines clipped to polygons, against shapely: polylines of any kind."""

from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from slicer.geometry.clip import NO_PIECES, Pieces, clip_lines, merge_pieces
from slicer.geometry.edge_index import index_edges
from slicer.geometry.polygons import Polygons, contours
from tests.slicer.hand import as_shapely, ragged

FAR = 60.0  # lines begin and end outside all shapes
seeds = st.integers(0, 10**6)
few = settings(deadline=None, max_examples=30)


def wandering(seed: int, count: int = 6) -> list[Floats]:
    """Polylines from left of all shapes to their right, back and forth in between."""
    random = np.random.default_rng(seed)
    inner = random.uniform(-30.0, 30.0, (count, 5, 2))
    ends = random.uniform(-30.0, 30.0, (count, 2))
    return [np.vstack([[-FAR, a], line, [FAR, b]]) for line, (a, b) in zip(inner, ends, strict=True)]


def lines_of(pieces: Pieces) -> list[Floats]:
    return [pieces.points[a:b] for a, b in pairwise(pieces.starts)]


def clipped(lines: list[Floats], area: Polygons) -> Pieces:
    starts = np.cumsum([0, *(len(line) for line in lines[:-1])])
    return clip_lines(np.concatenate(lines), starts, index_edges(area))


@few
@given(seeds)
def test_clipped_lines_equal_the_intersection_of_shapely(seed: int) -> None:
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
    border, pieces = index_edges(area), clipped(wandering(seed), area)
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
    assert merge_pieces([]).starts.tolist() == NO_PIECES.starts.tolist()


def test_clipping_by_an_empty_polygon_leaves_nothing() -> None:
    assert len(clipped(wandering(1), Polygons()).ends) == 0
    assert len(clip_lines(np.zeros((0, 2)), np.zeros(0, np.int64), index_edges(Polygons.square((1.0, 1.0)))).ends) == 0


@few
@given(seeds)
def test_a_border_has_its_contours_one_after_the_other(seed: int) -> None:
    area = ragged(seed)
    border = index_edges(area)
    for (a, b), loop in zip(pairwise(border.begins.tolist()), contours(area), strict=True):
        assert (border.edges[a:b, :2] == loop).all()
        assert (border.edges[a:b, 2:] == np.roll(loop, -1, axis=0)).all()
