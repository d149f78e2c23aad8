"""The shell of a cut model: complete outside, thin on cut faces, and a floor under every later part."""

from functools import cache

import manifold3d as m3
import numpy as np
import pytest

from mdp.decomposition import Part
from mdp.mesh import Floats
from slicer.geometry.polygons import Polygons, contours, offset, strips
from slicer.overhangs import find_overhangs
from slicer.paths import Kind, SlicedPart
from slicer.sectioning import Sections, section_part
from slicer.shells import Shells, build_shells, interface_mm3
from slicer.slice import slice_part
from slicer.support.support import own_supports
from tests.shapes import from_manifold
from tests.slicer.hand import BARE, cut, of_kind, profile

SIDE, HEIGHT = 24.0, 30.0
STRAIGHT, TILTED, STEEP = (0.0, 0.0, 1.0), (0.0, 0.5, 0.8), (0.9, 0.1, 0.3)
PLAIN = (*BARE, "process.interface_walls=1", "process.interface_top_layers=2")
# Three walls of 0.45 mm are 1.24 mm deep, four layers 0.8 mm; on a slope where both are equally near, the shell is thinner.
SHELL_MM = 0.6


def model(shape: str) -> m3.Manifold:
    if shape == "cube":
        return m3.Manifold.cube((SIDE, SIDE, HEIGHT), True).translate((0, 0, 0.5 * HEIGHT))
    return m3.Manifold.cylinder(HEIGHT, 0.5 * SIDE, circular_segments=128)


def depth_mm(shape: str, points: Floats) -> Floats:
    """How deep points of the model's frame lie under its surface."""
    x, y, z = points.T
    aside = np.maximum(abs(x), abs(y)) if shape == "cube" else np.hypot(x, y) / np.cos(np.pi / 128)
    depth: Floats = np.minimum(0.5 * SIDE - aside, np.minimum(z, HEIGHT - z))
    return depth


@cache
def parts(shape: str, normal: tuple[float, ...]) -> list[Part]:
    return cut(from_manifold(model(shape)), (normal, float(np.array([0, 0, 0.5 * HEIGHT]) @ normal / np.linalg.norm(normal))))


@cache
def shells(shape: str, normal: tuple[float, ...], *settings: str) -> list[Shells]:
    both, keys = parts(shape, normal), profile(*PLAIN, *settings)
    return [shells_of(section_part(part, keys, both[:k], both[k + 1 :])) for k, part in enumerate(both)]


def shells_of(sections: Sections) -> Shells:
    overhangs = find_overhangs(sections)
    return build_shells(own_supports(sections, overhangs), overhangs)


def in_model(part: Part, points: Floats, z_mm: float) -> Floats:
    """Points of a layer in the model's frame."""
    placed: Floats = (np.insert(points, 2, z_mm + part.base.offset_mm, axis=1)) @ part.rotation
    return placed


CASES = [("cube", STRAIGHT), ("cube", STEEP), ("cylinder", TILTED)]


@cache
def sliced_parts(shape: str, normal: tuple[float, ...]) -> list[SlicedPart]:
    both, settings = parts(shape, normal), profile(*PLAIN)
    return [slice_part(part, settings, both[:k], both[k + 1 :]) for k, part in enumerate(both)]


@pytest.mark.parametrize(("shape", "normal"), CASES)
def test_no_infill_is_sparse_within_the_shell_s_thickness_of_the_surface(shape: str, normal: tuple[float, ...]) -> None:
    seen = 0.0
    for part, layers in zip(parts(shape, normal), shells(shape, normal), strict=True):
        for shell, z_mm in zip(layers.layers, layers.sections.heights.cut_mm, strict=True):
            seen += shell.region.sparse.area()
            for loop in contours(shell.region.sparse):  # in a convex model the least depth of a polygon is at a corner
                assert depth_mm(shape, in_model(part, loop, z_mm)).min() > SHELL_MM
    assert seen > 10000


@pytest.mark.parametrize(("shape", "normal"), CASES)
def test_all_of_a_layer_is_covered_by_beads_but_for_the_infill(shape: str, normal: tuple[float, ...]) -> None:
    for sliced, layers in zip(sliced_parts(shape, normal), shells(shape, normal), strict=True):
        for at in range(1, len(sliced.layers) - 1, 6):
            lines = [path for path in sliced.layers[at].paths if path.kind is not Kind.INFILL]
            covered = Polygons()
            for path in lines:
                covered = covered + strips([path.points], 0.5 * path.width_mm)
            section = layers.sections.own[at]
            bare = section - covered - layers.layers[at].region.sparse
            # a skin stroke that would lie on nothing is left out, beside a line of infill
            assert offset(bare, -0.12).area() < 0.0025 * section.area()


@pytest.mark.parametrize(("shape", "normal"), CASES)
def test_the_first_layer_of_a_later_part_is_on_solid_plastic(shape: str, normal: tuple[float, ...]) -> None:
    (lower, upper), (under, over) = parts(shape, normal), shells(shape, normal)
    first = offset(over.sections.own[0], -0.1)
    x0, y0, x1, y1 = first.bounds()
    lattice = np.stack(np.meshgrid(np.arange(x0, x1, 0.7), np.arange(y0, y1, 0.7)), axis=-1).reshape(-1, 2)
    on_base = np.array([p for p in lattice if not (first ^ Polygons.square((0.01, 0.01)).translate(tuple(p))).is_empty()])
    assert len(on_base) > 400
    placed = in_model(upper, on_base, -0.12) @ lower.rotation.T - [0, 0, lower.base.offset_mm]
    layers = np.searchsorted(under.sections.heights.tip_mm, placed[:, 2])
    for layer, point in zip(layers.tolist(), placed, strict=True):
        if layer < len(under.layers):
            dot = Polygons.square((0.01, 0.01), True).translate((point[0], point[1]))
            assert (dot ^ under.layers[layer].region.sparse).is_empty()


def test_inner_walls_end_on_the_one_along_the_face_of_a_cut() -> None:
    settings = profile(*PLAIN)
    lower, upper = parts("cube", STEEP)
    layer = sliced_parts("cube", STEEP)[0].layers[70]
    walls = [path for path in layer.paths if path.kind in (Kind.OUTER_WALL, Kind.INNER_WALL)]
    assert [path.kind for path in walls].count(Kind.OUTER_WALL) == 1
    inner = [path for path in walls if path.kind is Kind.INNER_WALL]
    assert len(inner) == settings.process.walls - 1
    for path in inner:
        ends = in_model(lower, path.points[[0, -1]], layer.z_mm)
        assert np.allclose(upper.base.heights_mm(ends), -0.45, atol=0.4), "both ends lie beside the cut"


def test_with_equal_walls_on_a_cut_and_outside_all_are_closed() -> None:
    lower, upper = parts("cube", STEEP)
    settings = profile(*PLAIN, "process.interface_walls=3")
    assert len(of_kind(slice_part(lower, settings, (), [upper]), Kind.INNER_WALL)) > 0
    assert all(not shell.ending for shell in shells("cube", STEEP, "process.interface_walls=3")[0].layers)


def test_the_plastic_of_a_straight_cut_is_a_floor_and_a_rim() -> None:
    """A floor of two layers inside the walls, and on it a solid layer of 0.1 mm with a tenth more plastic than its volume."""
    under, over = (interface_mm3(both) for both in shells("cube", STRAIGHT))
    inside = (SIDE - 2 * 1.243) ** 2
    floor = 0.8 * 0.4 * inside
    within_wide_walls = (SIDE - 2 * 1.746) ** 2
    assert under == {2: pytest.approx(floor, rel=0.03)}
    assert over == {2: pytest.approx(0.1 * (0.8 * within_wide_walls + 0.1 * SIDE**2), rel=0.03)}


def test_the_plastic_between_two_cuts_belongs_to_the_nearer_one() -> None:
    alone = [interface_mm3(both)[2] for both in shells("cube", STRAIGHT)]
    low, middle, high = cut(from_manifold(model("cube")), (STRAIGHT, 24.0), (STRAIGHT, 11.9))
    between = shells_of(section_part(middle, profile(*PLAIN), [low], [high]))
    assert interface_mm3(between) == {
        2: pytest.approx(alone[1], rel=0.01),
        3: pytest.approx(alone[0], rel=0.01),
    }


def test_a_model_in_one_part_has_no_interface() -> None:
    (lower, _) = parts("cube", STRAIGHT)
    alone = shells_of(section_part(lower, profile(*PLAIN)))
    assert interface_mm3(alone) == {}
