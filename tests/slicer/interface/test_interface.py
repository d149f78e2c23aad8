"""Frames, sections and edges between the parts of a model: the parts fill it without overlap, and points keep their position."""

from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.decomposition import Part
from mdp.mesh import Floats
from mdp.topology.cross_section import cross_sections
from slicer.bead import OUTSIDE, Bead
from slicer.geometry.polygons import Polygons, clean
from slicer.interface.interface import (
    frame_change,
    near_parts,
    plane_in_frame_of,
    plastic_below,
    sections_of,
    visible_wall_beside,
)
from slicer.paths import Kind, Layer
from slicer.sectioning import section_part
from slicer.shells import joined, nearest_areas
from slicer.slice import begin_inside, slice_part
from tests.mdp.solids import random_direction, random_solid
from tests.shapes import box
from tests.slicer.hand import as_shapely, cut, profile

seeds = st.integers(0, 40)
LEANING = (0.5, -0.2, 0.8)
NOTHING = Polygons()


def in_workpiece(part: Part, points: Floats) -> Floats:
    """Points of a part's frame in that of the workpiece."""
    return (points + np.array([0.0, 0.0, part.base.offset_mm])) @ part.rotation


def stacked() -> list[Part]:
    return cut(box(20, 20, 40), ((0.0, 0.0, 1.0), 30.0), (LEANING, 12.0))


def test_a_point_is_the_same_in_the_workpiece_from_whichever_part_s_frame_it_is_seen() -> None:
    points = np.random.default_rng(1).uniform(-30.0, 30.0, (20, 3))
    for part in stacked():
        for to in stacked():
            turn, shift = frame_change(part, to)
            assert in_workpiece(to, points @ turn.T + shift) == pytest.approx(in_workpiece(part, points))


@settings(max_examples=20)
@given(st.integers(1, 999), st.integers(1, 999), st.floats(-20.0, 20.0))
def test_a_plane_holds_the_same_points_in_a_part_s_frame(height: int, around: int, offset: float) -> None:
    normal = random_direction(height, around)
    for part in stacked():
        x, y, z, distance = plane_in_frame_of(part, normal, offset)
        points = np.random.default_rng(height).uniform(-30.0, 30.0, (20, 3))
        assert points @ (x, y, z) - distance == pytest.approx(in_workpiece(part, points) @ normal - offset)


@settings(max_examples=8)
@given(seeds, st.floats(4.0, 8.0))
def test_the_sections_of_a_part_and_of_the_others_are_the_model_s(seed: int, offset: float) -> None:
    mesh = random_solid(seed)
    lower, upper = cut(mesh, (LEANING, offset))
    cuts = np.arange(0.55, float(mesh.bounds_mm[1, 2]), 1.7)
    own = [clean(loops, 0.0) for loops in cross_sections(lower.in_part_frame(), cuts)]
    whole = [clean(loops, 0.0) for loops in cross_sections(mesh, cuts)]
    for mine, others, model in zip(own, sections_of([upper], lower, cuts), whole, strict=True):
        assert mine.area() + others.area() == pytest.approx(model.area(), rel=0.002, abs=0.1)
        assert as_shapely(mine).intersection(as_shapely(others)).area < 0.1
    assert [area.is_empty() for area in sections_of([], lower, cuts)] == [True] * len(cuts)


def test_parts_touch_that_come_as_near_as_that() -> None:
    low, middle, high = cut(box(20, 20, 40), ((0.0, 0.0, 1.0), 30.0), ((0.0, 0.0, 1.0), 10.0))
    assert near_parts(low, [middle, high], 0.5) == [middle]
    assert near_parts(low, [middle, high], 20.5) == [middle, high]
    assert near_parts(middle, [low, high], 0.5) == [low, high]


def test_a_part_is_on_the_sections_of_earlier_ones_and_the_first_on_nothing() -> None:
    low, middle, _ = stacked()
    section = Polygons.square((3.0, 3.0))
    assert plastic_below(low, [], section) is None
    assert plastic_below(middle, [], section) is section
    below = plastic_below(middle, [low], section)
    assert below is not None
    expected = clean(cross_sections(middle.in_part_frame(), np.array([0.02]))[0]).area()
    assert below.area() == pytest.approx(expected, rel=0.02)


def test_the_edges_of_an_interface_run_once_round_it_for_the_part_below_and_for_the_one_above() -> None:
    low, high = cut(box(20, 20, 40), (LEANING, 12.0))
    normal = high.base.normal
    # the cut of a square prism along z: its outline, seen from above the square, each side lengthened by the slope along it
    round_mm = sum(2 * 20.0 * np.hypot(1.0, normal[axis] / normal[2]) for axis in (0, 1))
    for part, sections in (
        (low, section_part(low, profile(), [], [high])),
        (high, section_part(high, profile(), [low], [])),
    ):
        edges = sections.joints
        assert np.linalg.norm(edges[:, 3:] - edges[:, :3], axis=1).sum() == pytest.approx(round_mm, rel=0.01)
        ends = in_workpiece(part, edges[:, :3])
        assert np.abs(high.base.heights_mm(ends)).max() < 0.15
    assert section_part(low, profile()).joints.shape == (0, 6)


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.integers(1, 4))
def test_a_place_is_shared_out_to_the_least_of_linear_functions(seed: int, count: int) -> None:
    functions = [f * (1.0, 1.0, 8.0) for f in np.random.default_rng(seed).normal(size=(count, 3))]
    ring = Polygons.square((20.0, 20.0), True) - Polygons.circle(4.0, 64)
    x, y = (np.arange(-9.95, 10.0, 0.1) for _ in range(2))
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    points = points[shapely.contains_xy(as_shapely(ring), points)]
    least = np.argmin([points @ f[:2] + f[2] for f in functions], axis=0)
    areas = nearest_areas(ring, functions, [None] * count)
    assert areas == pytest.approx(0.01 * np.bincount(least, minlength=count), abs=1.5)
    assert sum(areas) == pytest.approx(ring.area())


def test_the_plane_of_a_limb_has_joints_only_beside_the_limb() -> None:
    square, left = Polygons.square((10.0, 10.0), True), Polygons.square((4.0, 10.0)).translate((-5.0, -5.0))
    functions = [np.array([0.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])]
    assert nearest_areas(square, functions, [None, left]) == pytest.approx([60.0, 40.0])
    assert nearest_areas(square, functions[1:], [left]) == pytest.approx([40.0])


@pytest.mark.parametrize(
    ("beside", "area_mm2"),
    [
        (Polygons.square((5.0, 10.0)).translate((10.0, 0.0)), 150.0),
        (Polygons.square((5.0, 10.0)).translate((10.01, 0.0)), 150.1),  # a closed slit
        (Polygons.square((5.0, 10.0)).translate((11.0, 0.0)), None),
        (NOTHING, None),
        (Polygons.square((5.0, 10.0)).translate((10.0, 0.0)) + Polygons.square((5.0, 5.0)).translate((40.0, 0.0)), 150.0),
    ],
)
def test_the_islands_of_the_model_are_those_that_hold_some_of_a_section(beside: Polygons, area_mm2: float | None) -> None:
    own = Polygons.square((10.0, 10.0))
    model = joined(own, own, beside)
    assert (None if model is own else pytest.approx(model.area(), abs=0.02)) == area_mm2


def test_a_section_that_lost_grooves_belongs_to_the_one_it_had_before() -> None:
    before = Polygons.square((10.0, 10.0))
    assert joined(before, before - Polygons.square((2.0, 2.0)), NOTHING) is before
    assert joined(NOTHING, NOTHING, before) is NOTHING


def bead(kind: Kind, length: float, rank: int = 3) -> Bead:
    return Bead(kind, np.array([(0.0, 0.0), (length, 0.0)]), 0.45, rank)


@pytest.mark.parametrize(
    ("beads", "first"),
    [
        ([bead(Kind.OUTER_WALL, 40), bead(Kind.SKIN, 30), bead(Kind.INFILL, 3), bead(Kind.INFILL, 5)], 3),
        ([bead(Kind.OUTER_WALL, 40), bead(Kind.SKIN, 30), bead(Kind.SKIN, 30)], 1),
        ([bead(Kind.OUTER_WALL, 40)], 0),
        ([bead(Kind.OUTER_WALL, 40), bead(Kind.INFILL, 5), bead(Kind.SUPPORT, 5, OUTSIDE)], 0),
        ([], None),
    ],
)
def test_a_layer_on_plastic_begins_with_its_longest_line_inside_unless_it_has_support(
    beads: list[Bead], first: int | None
) -> None:
    begun = begin_inside(beads)
    assert [b.length_mm for b in begun] == [b.length_mm for b in sorted(beads, key=lambda b: beads.index(b) != first)]
    assert first is None or begun[0].points is beads[first].points
    assert first in (0, None) or begun[0].rank == OUTSIDE


@settings(max_examples=20)
@given(seeds)
def test_the_outer_wall_near_an_edge_in_space_is_part_of_its_skin(seed: int) -> None:
    random, process = np.random.default_rng(seed), profile().process
    square, z_mm = Polygons.square((20.0, 20.0)), 3.0
    edge = np.array([[0.0, *random.uniform((0, 0), (20, 6)), 0.0, *random.uniform((0, 0), (20, 6))]])
    skin = as_shapely(visible_wall_beside(edge, square, z_mm, process))
    a, b = edge[0, :3], edge[0, 3:]
    for y in np.linspace(0.5, 19.5, 39):
        place = np.array([0.1, y, z_mm])
        share = np.clip((place - a) @ (b - a) / max((b - a) @ (b - a), 1e-9), 0.0, 1.0)
        away = float(np.linalg.norm(place - a - share * (b - a)))
        covered = skin.contains(shapely.Point(0.1, y))
        assert covered or away > process.interface_seam_mm
        assert not covered or away < 2.0**0.5 * process.interface_seam_mm + 0.01
    assert not skin.intersects(shapely.box(0.37, 0.37, 19.63, 19.63))


def test_outer_walls_at_a_joint_are_continuous_on_faces_upright_in_both_parts() -> None:
    lower, upper = cut(box(20, 20, 40), ((0.5, 0.0, 0.8), 15.0))  # the faces at y = -10 and 10 are parallel to both directions
    above, below = slice_part(upper, profile(), (lower,)), slice_part(lower, profile(), (), (upper,))
    for part, layers in ((upper, above.layers[:1]), (lower, below.layers[-40:-20])):
        assert _edges_along_y(part, layers) == pytest.approx((-10.0, 10.0), abs=0.05)


def _edges_along_y(part: Part, layers: Sequence[Layer]) -> tuple[float, float]:
    """The least and the greatest y, in the workpiece, of the outer edges of outer walls."""
    walls = [(path, layer.z_mm) for layer in layers for path in layer.paths if path.kind is Kind.OUTER_WALL]
    y = [(in_workpiece(part, np.insert(path.points, 2, z, axis=1))[:, 1], 0.5 * path.width_mm) for path, z in walls]
    return min(float(at.min()) - half for at, half in y), max(float(at.max()) + half for at, half in y)
