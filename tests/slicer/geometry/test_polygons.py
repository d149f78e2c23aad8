"""Pieces of polygons keep their holes, offsets their inside."""

import numpy as np
import pytest
import shapely

from slicer.geometry.polygons import Polygons, contours, islands, offset, offset_round, opening

# a section of a thin curved shell without its infill: the hole touches the outline in two corners, to 1e-8 mm
OUTLINE = [
    (-7.61836115, 68.88669977), (-10.77783701, 72.16484606), (-13.81933971, 70.4981398), (-16.24925241, 57.79847275),
    (-16.40994936, 55.98709728), (-16.2319522, 54.25942789), (-16.05534578, 53.72724398),
]  # fmt: skip
HOLE = [
    (-16.4050434, 56.04239728), (-16.2492524, 57.7984728), (-13.81933971, 70.49813979), (-11.72465853, 71.64599944),
    (-10.77783701, 72.16484606), (-8.1398312, 69.42775632), (-15.70857212, 55.82834867),
]  # fmt: skip
RING = Polygons([np.array(OUTLINE)]) - Polygons([np.array(HOLE)[::-1]])


def test_a_hole_that_touches_the_outline_stays_a_hole() -> None:
    pieces = islands(RING)
    assert [piece.area() for piece in pieces] == [pytest.approx(RING.area(), abs=1e-6)]


def test_every_piece_has_its_own_holes() -> None:
    square = Polygons.square((4.0, 4.0), True)
    frame = square - offset(square, -1.0)
    two = Polygons.compose([frame, frame.translate((10.0, 0.0)), Polygons.square((1.0, 1.0), True)])
    assert sorted(piece.area() for piece in islands(two)) == [pytest.approx(area) for area in (1.0, 12.0, 12.0)]


def disc(count: int, radius_mm: float, x_mm: float = 0.0, y_mm: float = 0.0) -> Polygons:
    turns = 2.0 * np.pi * np.arange(count) / count
    return Polygons([np.stack([x_mm + radius_mm * np.cos(turns), y_mm + radius_mm * np.sin(turns)], axis=1)])


@pytest.mark.parametrize("hole", [(60, 24.0, -8.0, -6.0), (30, 23.0, -8.0, -2.0)])
@pytest.mark.parametrize("distance_mm", [-0.1, 0.1])
def test_a_hole_that_touches_the_outline_at_its_farthest_point_is_not_taken_for_an_outline(
    hole: tuple[int, float, float, float], distance_mm: float
) -> None:
    whole = disc(33, 30.0)
    crescent = whole - offset(disc(*hole) ^ whole, 0.45)
    solid = whole - opening(crescent, 0.45)
    assert offset(solid, distance_mm).area() == pytest.approx(grown_mm2(solid, distance_mm), rel=0.01)
    assert offset_round(solid, distance_mm).area() == pytest.approx(grown_mm2(solid, distance_mm), rel=0.01)


def grown_mm2(polygons: Polygons, distance_mm: float) -> float:
    """The same by shapely."""
    loops = [shapely.Polygon(loop) for loop in contours(polygons)]
    whole = loops[0].difference(shapely.union_all(loops[1:]))
    return float(whole.buffer(distance_mm).area)
