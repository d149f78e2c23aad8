"""Compensated sections, against shapely's offsets and against edges that must not move."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.topology.cross_section import cross_sections
from profiles.process import Process
from slicer.geometry.polygons import MITRE, Polygons, clean, half_plane, offset
from slicer.interface.interface import sections_of
from slicer.sectioning import compensate, compensate_elephant_foot, compensated, reach_mm
from tests.shapes import box
from tests.slicer.hand import as_shapely, cut, profile

seeds = st.integers(0, 10**6)
NOTHING = Polygons()


def process(outline_mm: float, hole_mm: float) -> Process:
    return profile(f"process.outline_compensation_mm={outline_mm}", f"process.hole_compensation_mm={hole_mm}").process


def blocks(seed: int) -> Polygons:
    """Random rectangles united, with random holes: all corners are right angles, where every mitred offset is exact."""
    rng = np.random.default_rng(seed)
    rectangles = [Polygons.square(tuple(rng.uniform(2, 15, 2))).translate(tuple(rng.uniform(-10, 10, 2))) for _ in range(9)]
    return sum(rectangles[1:6], rectangles[0]) - sum(rectangles[7:], rectangles[6])


def plate(hole_mm: float = 4.0) -> Polygons:
    """A square of 20 mm with a square hole in its middle."""
    return Polygons.square((20.0, 20.0), True) - Polygons.square((hole_mm, hole_mm), True)


@settings(max_examples=20)
@given(seeds, st.sampled_from((-0.2, -0.05, 0.1, 0.25)), st.sampled_from((-0.1, 0.0, 0.3)))
def test_outsides_and_holes_have_their_own_offsets(seed: int, outline_mm: float, hole_mm: float) -> None:
    section = blocks(seed)
    expected = shapely.union_all(
        [
            shapely.Polygon(island.exterior).buffer(outline_mm, join_style="mitre", mitre_limit=MITRE)
            - shapely.MultiPolygon([shapely.Polygon(hole) for hole in island.interiors]).buffer(
                hole_mm, join_style="mitre", mitre_limit=MITRE
            )
            for island in shapely.get_parts(as_shapely(section))
        ]
    )
    difference = as_shapely(compensated(section, NOTHING, (), process=process(outline_mm, hole_mm))) ^ expected
    assert difference.area < 0.01


@pytest.mark.parametrize(("outline_mm", "hole_mm"), [(0.2, 0.0), (-0.2, 0.0), (0.2, 0.3), (-0.1, -0.3), (0.0, 0.25)])
def test_contact_faces_of_parts_are_not_offset_and_parts_do_not_overlap(outline_mm: float, hole_mm: float) -> None:
    whole, right_half = plate(), Polygons.square((20.0, 40.0)).translate((0.0, -20.0))
    right, left = whole ^ right_half, whole - right_half
    asked = process(outline_mm, hole_mm)
    own, neighbour = (
        as_shapely(compensated(part, rest, [below], process=asked))
        for part, rest, below in ((left, right, (-1.0, 0.0, 0.0)), (right, left, (1.0, 0.0, 0.0)))
    )
    assert own.intersection(neighbour).area == pytest.approx(0.0, abs=1e-6)
    assert own.union(neighbour).symmetric_difference(as_shapely(compensated(whole, NOTHING, (), process=asked))).area < 0.05
    assert own.intersection(as_shapely(right)).area == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("asked_mm", [0.1, 0.3])
def test_no_layer_reaches_over_the_base_plane_of_a_later_part(asked_mm: float) -> None:
    low, high = cut(box(20, 20, 40), ((0.6, 0.2, 0.8), 14.0))
    cuts = np.arange(0.1, 25.0, 0.2)
    outlines = [clean(loops, 0.0) for loops in cross_sections(low.in_part_frame(), cuts)]
    beside = sections_of([high], low, cuts)
    grown = compensate(outlines, low, [high], beside, cuts, process(asked_mm, 0.0))
    square = shapely.box(-10.0, -10.0, 10.0, 10.0).buffer(asked_mm, join_style="mitre")
    normal = high.base.normal
    for z, area in zip(cuts.tolist(), grown, strict=True):
        below = as_shapely(
            half_plane(Polygons.square((30.0, 30.0), True), -normal[0], -normal[1], high.base.offset_mm - z * normal[2])
        )
        assert as_shapely(area).difference(below.buffer(1e-6)).area < 1e-6
        assert as_shapely(area).symmetric_difference(square & below).area < 0.02 + asked_mm**2  # corners too sharp for a mitre


def test_a_section_with_no_compensation_is_itself_and_of_nothing_there_is_nothing() -> None:
    assert (compensated(plate(), NOTHING, (), process=process(0.0, 0.0)) - plate()).area() == pytest.approx(0.0, abs=1e-9)
    assert compensated(plate(), NOTHING, (), process=process(0.0, 0.0)).area() == pytest.approx(400.0 - 16.0)
    assert compensated(NOTHING, plate(), (), process=process(0.1, 0.1)).is_empty()


@pytest.mark.parametrize(("outline_mm", "hole_mm", "reach"), [(0.2, 0.1, 0.2), (-0.2, -0.3, 0.3), (-0.2, 0.3, 0.0)])
def test_plastic_outside_a_model_is_within_the_compensation(outline_mm: float, hole_mm: float, reach: float) -> None:
    asked = process(outline_mm, hole_mm)
    assert reach_mm(asked) == reach
    grown = as_shapely(compensated(plate(), NOTHING, (), process=asked))
    assert grown.hausdorff_distance(as_shapely(plate())) <= 2**0.5 * max(abs(outline_mm), abs(hole_mm)) + 1e-6
    assert as_shapely(plate()).buffer(reach + 1e-6, join_style="mitre").covers(grown)


@settings(max_examples=20)
@given(seeds, st.floats(0.05, 0.4))
def test_a_first_layer_is_smaller_all_round_but_where_a_line_would_not_fit(seed: int, foot_mm: float) -> None:
    outline = blocks(seed)
    less, area = as_shapely(compensate_elephant_foot(outline, foot_mm, 0.45)), as_shapely(outline)
    assert area.buffer(1e-6).covers(less)
    assert less.buffer(1e-6).covers(as_shapely(offset(outline, -foot_mm)))
    wide = as_shapely(offset(offset(outline, -foot_mm - 0.225), foot_mm + 0.225))
    rim = area - area.buffer(-foot_mm, join_style="mitre", mitre_limit=MITRE)
    assert (less & rim & wide).area < 0.02 * rim.area


def test_no_elephants_foot_leaves_the_outline() -> None:
    assert compensate_elephant_foot(plate(), 0.0, 0.45).area() == pytest.approx(384.0)
