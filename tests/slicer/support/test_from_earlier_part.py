"""Support from an earlier part: it rests on earlier plastic, stays below every later base plane, and holds its overhang."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import manifold3d as m3
import numpy as np
import pytest
import shapely

from mdp.decomposition import Part
from mdp.mesh import Floats
from mdp.plane import Plane
from mdp.pose import unit
from slicer.geometry.polygons import Polygons
from slicer.interface.interface import frame_change
from slicer.overhangs import find_overhangs
from slicer.paths import Kind
from slicer.sectioning import section_part
from slicer.slice import slice_parts
from slicer.support.from_earlier_part import plan_supports, up_to
from slicer.support.support import Supports, own_supports
from tests.shapes import box, from_manifold, standing, tee
from tests.slicer.hand import as_shapely, cut, of_kind, profile, sections_at

STANDS_MM = 0.55  # a layer, a step of a slope and the space beside a line
ROUNDING_MM = 0.03
PROPS = (Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
LOW = (0.0, 0.0, 1.0)
# Shapes with an arm over air only, and the planes that cut them: level, tilted, upright, one below the other.
ARM = m3.Manifold.cube((8, 8, 40)) + m3.Manifold.cube((30, 8, 5)).translate((0, 0, 32))
HIGH = (
    m3.Manifold.cube((8, 8, 70))
    + m3.Manifold.cube((30, 8, 5)).translate((0, 0, 62))
    + m3.Manifold.cube((4, 20, 5)).translate((26, 0, 62))
)
CASES = {
    "level": (tee(), ((LOW, 30.0),)),
    "above the plane": (standing(ARM), ((LOW, 20.0),)),
    "tilted": (tee(), (((0.5, 0.0, 0.86), 30.0),)),
    "upright": (standing(HIGH), (((1.0, 0.0, 0.0), 4.0),)),
    "through two parts": (tee(), ((LOW, 30.0), (LOW, 14.0))),
    "two directions": (tee(), (((0.35, 0.0, 0.94), 27.0), ((-0.35, 0.0, 0.94), 20.0))),
}


@cache
def own(name: str) -> list[Supports]:
    mesh, planes = CASES[name]
    parts = cut(mesh, *planes)
    sections = [section_part(part, profile(), parts[:k], parts[k + 1 :]) for k, part in enumerate(parts)]
    return [own_supports(layers, find_overhangs(layers)) for layers in sections]


@cache
def planned(name: str) -> list[Supports]:
    return plan_supports(own(name))


def own_missed_mm2(name: str) -> float:
    return sum(supports.unsupported_mm2 for supports in own(name))


@pytest.mark.parametrize("name", CASES)
def test_support_without_its_own_base_continues_in_earlier_parts(name: str) -> None:
    assert sum(supports.unsupported_mm2 for supports in planned(name)) <= 0.02 * own_missed_mm2(name)


@pytest.mark.parametrize("name", ["level", "tilted", "through two parts", "two directions"])
def test_the_example_has_support_that_continues_in_earlier_parts(name: str) -> None:
    assert own_missed_mm2(name) > 50.0


@pytest.mark.parametrize("name", CASES)
def test_no_support_is_above_a_later_base_plane(name: str) -> None:
    for supports in planned(name):
        for later in supports.sections.later:
            turn, shift = frame_change(supports.sections.part, later)
            for points in corners(supports):
                assert (points @ turn[2] + shift[2]).max() < ROUNDING_MM


@pytest.mark.parametrize("name", CASES)
def test_support_keeps_its_distance_from_the_part_printed_with_it(name: str) -> None:
    for supports in planned(name):
        for area, outline in zip(supports.areas, supports.sections.outlines, strict=True):
            if not area.is_empty() and not outline.is_empty():
                gap_mm = supports.sections.process.support_distance_mm
                assert as_shapely(area).distance(as_shapely(outline)) > gap_mm - ROUNDING_MM


@pytest.mark.parametrize("name", CASES)
def test_every_support_on_a_base_plane_has_plastic_of_an_earlier_part_or_its_support_beneath(name: str) -> None:
    every = planned(name)
    for k, supports in enumerate(every[1:], 1):
        foot = supports.areas[0]
        if foot.is_empty():
            continue
        points = np.array([(p.x, p.y) for p in lattice(as_shapely(foot).buffer(-0.3))])
        held = np.zeros(len(points), dtype=bool)
        for below in every[:k]:
            turn, shift = frame_change(below.sections.part, supports.sections.part)
            held |= [stands_on(point, below) for point in (np.insert(points, 2, 0.0, axis=1) - shift) @ turn]
        assert held.mean() > 0.97


@pytest.mark.parametrize("name", CASES)
def test_every_layer_of_support_is_on_the_one_below(name: str) -> None:
    for supports in planned(name):
        sections = supports.sections
        lean_mm = sections.process.layer_height_mm + ROUNDING_MM
        for m in np.flatnonzero([not area.is_empty() for area in supports.areas]).tolist():
            ground = [as_shapely(supports.areas[m - 1]).buffer(lean_mm)] if m else []
            ground += [as_shapely(sections.outlines[j]).buffer(0.6) for j in range(max(m - 3, 0), m)]
            beneath = as_shapely(sections.plastic_below).buffer(0.6) if sections.plastic_below is not None else None
            if m and (m > 2 or beneath is None):
                assert (as_shapely(supports.areas[m]) - shapely.union_all(ground)).buffer(-ROUNDING_MM).area < 0.02


def test_support_of_the_first_part_ends_at_the_plane() -> None:
    mesh, planes = CASES["tilted"]
    sliced = slice_parts(cut(mesh, *planes), profile())
    assert sum(piece.unsupported_mm2 for piece in sliced) < 1.0
    assert all(of_kind(piece, *PROPS) for piece in sliced)


def test_a_process_without_support_hands_nothing_down() -> None:
    parts = cut(*CASES["level"][:1], *CASES["level"][1])
    assert [of_kind(piece, *PROPS) for piece in slice_parts(parts, profile("process.support=none"))] == [[], []]


def test_an_overhang_without_support_is_reported_with_the_obstructing_part() -> None:
    part = cut(tee())[0]
    guest = from_manifold(m3.Manifold.cube((4, 4, 4)).translate((30, 0, 30)))
    base = Plane(unit((0.5, 0.0, 0.86)), float(unit((0.5, 0.0, 0.86)) @ (14.0, 0.0, 24.0)))
    first, _ = slice_parts([part, Part(2, guest, base, part.pose, part.rotation, 64.0, 0.0)], profile())
    unsupported = first.unsupported[0]
    assert unsupported.mm2 > 10.0
    assert first.layers[unsupported.layer - 1].z_mm == pytest.approx(30.2)
    assert unsupported.reason == "support would stand where the head prints part 2"


@pytest.mark.parametrize("gap_mm", [0.2, 0.4, 0.5, 0.6])
def test_a_place_too_close_above_an_earlier_part_for_support_is_as_good_as_held(gap_mm: float) -> None:
    plate = m3.Manifold.cube((24, 20, 2), True).translate((0, 0, 6 + gap_mm))
    stem = m3.Manifold.cube((6, 20, 1 + gap_mm), True).translate((0, 0, 4.5 + 0.5 * gap_mm))
    model = standing(m3.Manifold.cube((24, 20, 5), True).translate((0, 0, 2.5)) + stem + plate)
    assert [piece.unsupported for piece in slice_parts(cut(model, ((0, 0, 1), 5.0)), profile())] == [(), ()]


def corners(supports: Supports) -> list[Floats]:
    """(n, 3) corners of every layer's support, at its top and bottom."""
    heights, points = supports.sections.heights, []
    for m, area in enumerate(supports.areas):
        for loop in area.to_polygons():
            for z in (heights.tip_mm[m], heights.bottom_mm[m]):
                points.append(np.column_stack([loop, np.full(len(loop), z)]))
    return points


def lattice(area: shapely.Geometry) -> Sequence[shapely.Point]:
    x0, y0, x1, y1 = area.bounds
    points = [shapely.Point(x, y) for x in np.arange(x0, x1, 0.7) for y in np.arange(y0, y1, 0.7)]
    return [point for point in points if area.contains(point)]


def stands_on(point: Floats, below: Supports) -> bool:
    """Whether a point of a part's frame has plastic of that part or its support closely beneath it."""
    x, y, z = point
    heights = below.sections.heights
    near = np.flatnonzero((heights.tip_mm > z - STANDS_MM) & (heights.bottom_mm < z + 0.2))
    at = shapely.Point(x, y).buffer(0.4)
    return any(as_shapely(layers[m]).intersects(at) for m in near for layers in (below.areas, below.sections.outlines))


def test_layers_added_on_top_have_what_later_parts_have_there() -> None:
    beside, above = [Polygons.square((k, k)) for k in (1, 2)], [Polygons.square((k, k)) for k in (3, 4, 5)]
    sections = replace(sections_at(box(10, 10, 1), np.array([0.1, 0.3])), beside=beside, above=above)
    higher = up_to(sections, 0.8)
    assert [area.area() for area in higher.beside] == pytest.approx([1.0, 4.0, 9.0, 16.0])
    assert [area.area() for area in higher.above] == pytest.approx([25.0, 0.0, 0.0])
