"""Space for support: the layers within gaps counted one by one, later parts' planes point by point."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.decomposition import Part
from mdp.plane import Plane
from slicer.bead import spacing_mm, support_cell_mm
from slicer.geometry.polygons import Polygons, union
from slicer.heights import Heights
from slicer.paths import Kind
from slicer.sectioning import section_part
from slicer.support.beads import support_beads
from slicer.support.reachable import ReachableAreas, above_base_planes
from tests.mdp.solids import random_direction
from tests.shapes import box
from tests.slicer.hand import as_shapely, profile, ragged, whole


def areas(*settings_: str) -> ReachableAreas:
    """Reachable areas of a box 20 mm high in layers of 0.2 mm, with nothing cached yet."""
    sections = section_part(whole(box(10, 10, 20)), profile(*settings_))
    return ReachableAreas(sections, 0.2 * np.ones(100), (), ())


GAPS = ("process.support_gap_mm=0.4", "process.support_bottom_gap_mm=0.6", "process.support_distance_mm=0.3")


@pytest.mark.parametrize("layer", [0, 1, 2, 3, 4, 50, 99])
def test_support_keeps_its_gaps_to_the_layers_above_and_below(layer: int) -> None:
    room = areas(*GAPS)
    top, bottom, count = room.heights.tip_mm, room.heights.bottom_mm, len(room.heights.tip_mm)
    above = [k for k in range(count) if k > layer and bottom[k] >= top[layer] + 0.4 - 1e-6]
    assert room.next_above(layer) == min(above, default=count)
    assert room.next_below(layer) == sum(top[j] <= bottom[layer] - 0.6 + 1e-6 for j in range(layer))
    carrying = list(room.carrying_layers(layer))
    fitting = [m for m in range(count) if top[m] <= bottom[layer] - 0.4 + 1e-6]
    assert carrying[:1] == fitting[-1:]
    slack_mm = 0.3  # equal to the horizontal distance at a slope of 45 degrees
    assert set(carrying[1:]) == {m for m in fitting[:-1] if top[m] >= bottom[layer] - 0.4 - slack_mm - 1e-6}


@settings(max_examples=25)
@given(st.integers(1, 999), st.integers(1, 999), st.floats(-5.0, 25.0), st.floats(0.0, 1.0), st.booleans())
def test_a_layer_is_blocked_near_the_base_plane_of_a_later_part(
    height: int, around: int, offset: float, gap: float, downward: bool
) -> None:
    part, tips = whole(box()), np.arange(1, 21) * 1.0
    normal = random_direction(height, around) * (1.0, 1.0, -1.0 if downward else 1.0)
    later = Part(2, part.mesh, Plane(normal, offset), part.pose, part.rotation, 0.0, 0.0)
    blocked = above_base_planes(part, [later], Heights(tips, np.ones(20), tips - 0.5), gap, 40.0, profile().machine)
    points = np.random.default_rng(height).uniform(-39.0, 39.0, (300, 2))
    for area, tip in zip(blocked, tips, strict=True):
        highest = np.maximum(*(points @ normal[:2] + normal[2] * z for z in (tip - 1.0, tip))) - (offset - gap)
        clear = np.abs(highest) > 1e-3
        assert np.array_equal(shapely.contains_xy(as_shapely(area), points)[clear], highest[clear] > 0.0)


def test_without_later_parts_nothing_is_blocked() -> None:
    heights = Heights(np.ones(1), np.ones(1), np.ones(1))
    assert [area.is_empty() for area in above_base_planes(whole(box()), [], heights, 0.2, 40.0, profile().machine)]


@settings(max_examples=15)
@given(st.integers(0, 10**6), st.floats(0.2, 0.6), st.sampled_from(("lines", "grid")))
def test_support_has_the_set_density_inside_its_walls(seed: int, density: float, pattern: str) -> None:
    process = profile(
        f"process.support_density={density}", f"process.support_pattern={pattern}", "process.support_walls=0"
    ).process
    area = Polygons.square((60.0, 50.0)) - ragged(seed).translate((80.0, 0.0))
    beads = support_beads(area, Polygons(), Polygons(), process, 0.2, False)
    plastic_mm2 = sum(bead.length_mm for bead in beads) * spacing_mm(process.line_width_mm, 0.2)
    assert plastic_mm2 / area.area() == pytest.approx(density, rel=0.2)
    assert {bead.kind for bead in beads} == {Kind.SUPPORT}


def test_every_bead_of_support_is_in_its_region() -> None:
    process, area = profile("process.support_walls=1").process, ragged(5)
    dense = area ^ Polygons.square((30.0, 60.0)).translate((0.0, -30.0))
    beads = support_beads(area, dense, Polygons(), process, 0.2, False)
    for room, kind in ((area, None), (dense, Kind.SUPPORT_INTERFACE)):
        lines = [shapely.LineString(bead.points) for bead in beads if kind in (None, bead.kind)]
        assert lines
        assert as_shapely(room).buffer(0.01).covers(shapely.union_all(lines))
    assert support_beads(Polygons(), dense, Polygons(), process, 0.2, False) == []


def test_dense_places_nearer_than_sparse_lines_are_filled_as_one() -> None:
    process = profile("process.support_walls=0", "process.support_density=0.2").process
    bars = union([Polygons.square((0.8, 20.0)).translate((1.7 * k, 0.0)) for k in range(12)])
    beads = support_beads(Polygons.square((19.5, 20.0)), bars, Polygons(), process, 0.2, False)
    assert {bead.kind for bead in beads} == {Kind.SUPPORT_INTERFACE}


@pytest.mark.parametrize(("pattern", "cell"), [("lines", 1.0), ("grid", 2.0)])
def test_sparse_lines_leave_cells_of_their_distance(pattern: str, cell: float) -> None:
    process = profile(f"process.support_pattern={pattern}", "process.support_density=0.2").process
    assert support_cell_mm(process) == pytest.approx(cell * spacing_mm(process.line_width_mm, 0.2) / 0.2)


def test_a_place_too_small_for_a_grid_gets_its_outline_once() -> None:
    process = profile("process.support_pattern=grid", "process.support_walls=0", "process.support_density=0.1").process
    place = Polygons.square((1.0, 1.0)).translate((0.5, 0.5)).rotate(-process.infill_angle_deg)
    (bead,) = support_beads(place, Polygons(), Polygons(), process, 0.2, False)
    assert bead.length_mm == pytest.approx(4.0 * (1.0 - process.line_width_mm))
