"""Beads in gaps lie in the middle of their gap and fill it with its area times height of plastic."""

from collections.abc import Sequence
from dataclasses import replace

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st

from slicer.bead import Bead
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import length_mm
from slicer.overhangs import find_overhangs
from slicer.paths import Kind, bead_area_mm2
from slicer.sectioning import section_part
from slicer.shells import build_shells, lay_beads
from slicer.strokes.strokes import in_pieces, strokes_of
from slicer.support.support import own_supports
from slicer.walls.walls import LEAST_GAP, MOST_WIDER, gaps
from tests.shapes import bowl
from tests.slicer.hand import SOLID, as_shapely, profile, rows_of, whole

WIDTH, HEIGHT = 0.45, 0.2


def strips(beads: Sequence[Bead]) -> list[tuple[shapely.LineString, float]]:
    """The centreline of every piece as it is printed, and its cross-section area over the height, mm: the width of gap that it
    fills."""
    placed = [bead if bead.course is None else replace(bead, points=bead.course[:, :2]) for bead in beads]
    pieces = in_pieces(strokes_of(placed, np.zeros(len(beads), np.bool_), {}, 0.0), HEIGHT)
    return [(shapely.LineString(row.points), bead_area_mm2(row.width_mm, HEIGHT) / HEIGHT) for row in rows_of(pieces)]


def plastic_mm2(beads: Sequence[Bead]) -> float:
    return sum(line.length * across for line, across in strips(beads))


def covered(beads: Sequence[Bead]) -> shapely.Geometry:
    return shapely.union_all([line.buffer(0.5 * across) for line, across in strips(beads)])


@pytest.mark.parametrize("thickness", [0.06, 0.1, 0.2, 0.4, 0.6])
def test_a_slit_gets_one_line_in_its_middle_with_its_plastic(thickness: float) -> None:
    (bead,) = gaps([Polygons.square((20.0, thickness))], WIDTH, HEIGHT)
    assert bead.kind is Kind.GAP
    assert bead.points[:, 1] == pytest.approx(0.5 * thickness, abs=1e-3)
    assert bead_area_mm2(bead.width_mm, HEIGHT) / HEIGHT == pytest.approx(thickness, rel=0.07)
    assert plastic_mm2([bead]) == pytest.approx(20.0 * thickness, rel=0.005)


@pytest.mark.parametrize("thickness", np.arange(0.1, 3.0, 0.23).round(2).tolist())
def test_a_slot_is_filled_from_side_to_side(thickness: float) -> None:
    middle = shapely.box(3, 0, 9, thickness)
    beads = gaps([Polygons.square((12.0, thickness))], WIDTH, HEIGHT)
    assert covered(beads).intersection(middle).area > 0.99 * middle.area


def test_a_gap_narrower_than_the_least_one_stays_empty() -> None:
    assert gaps([Polygons.square((20.0, 0.4 * LEAST_GAP * WIDTH))], WIDTH, HEIGHT) == []
    assert gaps([Polygons()], WIDTH, HEIGHT) == []


@settings(max_examples=25, deadline=None)
@example(3.0, 0.5, 0.5, 0.0)  # all centres of the triangles at an end coincide
@given(st.floats(3.0, 15.0), st.floats(0.15, 0.55), st.floats(0.15, 0.55), st.floats(0.0, 180.0))
def test_the_line_in_a_wedge_runs_in_its_middle_and_is_as_wide_as_it(
    length: float, start: float, end: float, turn: float
) -> None:
    wedge = Polygons([np.array([[0, -start / 2], [length, -end / 2], [length, end / 2], [0, start / 2]])])
    beads = gaps([wedge.rotate(turn)], WIDTH, HEIGHT)
    back = np.radians(turn)
    for line, wide in strips(beads):
        along, across = (shapely.get_coordinates(line) @ [[np.cos(back), -np.sin(back)], [np.sin(back), np.cos(back)]]).T
        assert across == pytest.approx(0.0, abs=0.03)
        wedge_width = start + (end - start) * 0.5 * (along.min() + along.max()) / length
        assert wide == pytest.approx(wedge_width, rel=0.25, abs=0.05)
    assert plastic_mm2(beads) == pytest.approx(wedge.area(), rel=0.05)


def test_a_ring_gets_a_line_that_runs_round() -> None:
    (bead,) = gaps([Polygons.circle(5, 64) - Polygons.circle(4.7, 64)], WIDTH, HEIGHT)
    assert bead.closed
    assert np.hypot(*bead.points.T) == pytest.approx(4.85, abs=0.02)
    assert bead_area_mm2(bead.width_mm, HEIGHT) / HEIGHT == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("diameter", [0.5, 0.7, 1.0, 1.5, 2.5])
def test_a_round_place_is_filled_by_rings(diameter: float) -> None:
    disc = Polygons.circle(0.5 * diameter, 48)
    beads = gaps([disc], WIDTH, HEIGHT)
    assert covered(beads).intersection(as_shapely(disc)).area > 0.75 * disc.area()
    assert plastic_mm2(beads) == pytest.approx(disc.area(), rel=0.1)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.floats(-4, 4), st.floats(-4, 4)), min_size=4, max_size=9), st.floats(0.3, 2.0), st.floats(0.0, 1.5))
def test_beads_in_any_place_hold_no_more_than_it_and_keep_to_it(
    points: list[tuple[float, float]], hole: float, aside: float
) -> None:
    area = m3.CrossSection.hull_points(np.array(points)) - Polygons.circle(hole, 16).translate((aside, 0))
    beads = gaps([area], WIDTH, HEIGHT)
    assert plastic_mm2(beads) < 1.005 * area.area() + 1e-6
    assert all(length_mm(bead.points) > 0.25 * WIDTH for bead in beads)
    assert all(bead.width_mm <= 2.0 * WIDTH + 1e-9 for bead in beads)
    wider = 0.5 * (MOST_WIDER - 1.0) * 2.0 * WIDTH + 0.05 * WIDTH
    assert covered(beads).difference(as_shapely(area).buffer(wider)).area < 1e-6


def test_gap_fill_shorter_than_the_setting_is_left_out() -> None:
    sections = section_part(whole(bowl()), profile(*SOLID))
    overhangs = find_overhangs(sections)
    shells = build_shells(own_supports(sections, overhangs), overhangs)
    strict = [replace(shell, process=shell.process.model_copy(update={"gap_least_mm": 2.0})) for shell in shells.layers]
    left_out = 0
    for k in range(0, len(strict), 10):
        of_all, of_long = (
            [bead.length_mm for bead in lay_beads(some, k)[0] if bead.kind is Kind.GAP]
            for some in (shells, replace(shells, layers=strict))
        )
        assert of_long == pytest.approx([length for length in of_all if length >= 2.0], abs=0.05)
        left_out += len(of_all) - len(of_long)
    assert left_out > 0
