"""Support, compensation and plastic of decompositions whose limbs are printed beside standing plastic."""

from dataclasses import replace

import manifold3d as m3
import numpy as np
import pytest

from mdp.decomposition import Decomposition
from mdp.plane import Plane
from profiles.profile import load
from slicer.heights import Heights
from slicer.interface.interface import AROUND_MM, shadow_of
from slicer.paths import Kind, SlicedPart
from slicer.sectioning import section_part
from slicer.slice import slice_parts
from slicer.support.reachable import above_base_planes, head_room
from tests.limbs import decomposed, limb, posts
from tests.shapes import from_manifold

MACHINE = load().machine
BASE_MM = 8.0


def bars() -> Decomposition:
    """Three posts with bars on their tops, up to 24 mm; the right one is printed last from 8 mm up."""
    mesh = posts(-40.0, 0.0, 40.0, bar_mm=16.0)
    return decomposed(mesh, load(), limb(mesh, [(48.0, 0.0, 24.0)], (0.0, 0.0, BASE_MM)))


def support_points(piece: SlicedPart) -> np.ndarray:
    """(n, 3) points of a part's support, in its frame."""
    points = [
        np.column_stack([path.points, np.full(len(path.points), layer.z_mm)])
        for layer in piece.layers
        for path in layer.paths
        if path.kind in (Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
    ]
    return np.concatenate([np.zeros((0, 3)), *points])


def test_support_of_earlier_limbs_extends_above_the_base_plane_of_a_later_one() -> None:
    decomposition = bars()
    first, last = slice_parts(decomposition.parts, load(settings=["process.infill_density=0.1"]))
    standing, own = support_points(first), support_points(last)
    assert first.unsupported == last.unsupported == ()
    left, middle, right = (standing[np.abs(standing[:, 0] - x) < 10.0] for x in (-40.0, 0.0, 40.0))
    assert left[:, 2].max() == pytest.approx(19.8, abs=0.3)  # a gap below the bar's underside at 20 mm
    assert middle[:, 2].max() == pytest.approx(19.8, abs=0.3)
    assert right[:, 2].max(initial=0.0) <= BASE_MM
    assert own[:, 0].min() >= 32.0 - AROUND_MM


def test_support_of_a_part_keeps_off_the_head_that_prints_a_limb_and_no_farther() -> None:
    first, last = bars().parts
    tips = np.array([7.0, 8.5, 11.0, 23.0])
    blocked = above_base_planes(first, [last], Heights(tips, np.full(4, 0.2), tips - 0.1), 0.3, 100.0, MACHINE)
    left = [-area.bounds()[0] if not area.is_empty() else None for area in blocked]
    edge_mm = -32.0 + AROUND_MM + MACHINE.clearance_mm  # of the limb's space, at x = 27 on the left, with the clearance
    assert left[0] is None
    expected = [2.5, 11.5, 15.0]  # radii of the silhouette of the head at 2, 4.5 and 16 mm above the tip
    assert left[1:] == pytest.approx([edge_mm + radius for radius in expected], abs=0.05)


def test_a_plane_without_a_limb_still_blocks_all_that_is_above_it() -> None:
    first, last = bars().parts
    tips = np.array([7.0, 9.0])
    heights = Heights(tips, np.full(2, 0.2), tips - 0.1)
    whole = replace(last, base=Plane(last.base.normal, last.base.offset_mm))
    low, high = above_base_planes(first, [whole], heights, 0.3, 100.0, MACHINE)
    assert low.is_empty()
    assert high.area() == pytest.approx(200.0**2)


def test_the_swept_volume_of_the_head_over_a_limb_widens_with_the_head() -> None:
    _, last = bars().parts
    assert shadow_of(last).bounds() == pytest.approx((32.0, -4.0, 48.0, 4.0))
    levels = head_room(last, MACHINE, 0.3)
    rings = levels[: len(MACHINE.head.silhouette_mm)]
    assert [low_mm for low_mm, _ in rings] == pytest.approx([-0.3, -0.3, 1.0, 2.0, 3.5])
    assert [48.0 + AROUND_MM + 1.0 + radius for radius in (0.6, 2.5, 5.0, 11.5, 15.0)] == pytest.approx(
        [area.bounds()[2] for _, area in rings]
    )


def tower_beside_a_bar() -> Decomposition:
    """A post with a bar from -24 to 0 mm and a tower of 40 mm from 19.5 mm; the bar's post is printed last from 10 mm up."""
    solid = m3.Manifold.cube((90.0, 30.0, 4.0), True).translate((0.0, 0.0, 2.0))
    solid += m3.Manifold.cube((8.0, 8.0, 22.0), True).translate((-12.0, 0.0, 13.0))
    solid += m3.Manifold.cube((24.0, 8.0, 4.0), True).translate((-12.0, 0.0, 24.0))
    solid += m3.Manifold.cube((8.0, 8.0, 38.0), True).translate((23.5, 0.0, 21.0))
    mesh = from_manifold(solid)
    return decomposed(mesh, load(), limb(mesh, [(-24.0, -4.0, 26.0)], (0.0, 0.0, 10.0)))


def test_support_of_a_limb_is_only_where_the_head_passes_its_neighbours() -> None:
    decomposition = tower_beside_a_bar()
    _, last = slice_parts(decomposition.parts, load(settings=["process.infill_density=0.1"]))
    points = support_points(last)
    assert points[:, 2].max() > 5.0
    aside_mm = 19.5 - points[:, 0]
    radii, heights = np.array(MACHINE.head.silhouette_mm).T
    under = np.where(aside_mm > radii[-1], np.inf, np.interp(aside_mm, radii, heights))
    assert (10.0 + points[:, 2] + under >= 40.0).all()


def test_neighbours_of_a_limb_are_compensated_above_its_base_plane() -> None:
    first, last = bars().parts
    sections = section_part(first, load(settings=["process.outline_compensation_mm=0.2"]), (), (last,))
    layer = int(np.searchsorted(sections.heights.cut_mm, 15.0))
    assert sections.outlines[layer].area() == pytest.approx(2 * 8.4 * 8.4, abs=0.05)
