"""User zones on a part, in its layers: where no seam begins, and where no support is printed."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.zone import AnyZone, Grown, Marked, MeshVolume, Zone
from profiles.frozen import Vector
from slicer.estimate.estimate import estimate
from slicer.heights import Heights
from slicer.paths import Kind, SlicedPart
from slicer.sectioning import marked_areas, no_seam_segments
from slicer.slice import slice_part, slice_parts
from slicer.support.reachable import unwanted_areas
from tests.shapes import box, standing, tee
from tests.slicer.hand import BARE, cut, of_kind, profile, sections_at, volume_mm3, whole

BACK = Grown((0.0, 10.0, 5.0), 1.0)
BACK_BOX = Zone((-20.0, 8.0, -1.0), (20.0, 12.0, 30.0))
SUPPORTED = profile("process.skirt_loops=0", "process.support=auto", "process.layer_height_mm=0.3")
LEANING = ((0.8, 0.36, 0.48), (-0.6, 0.48, 0.64), (0.0, -0.8, 0.6))  # rows of a rotation
RIGHT_ARM = Zone((4.5, -10.0, -1.0), (25.0, 10.0, 35.0))
RIGHT_MESH = MeshVolume(Path("arm.stl"), box(20.5, 20.0, 36.0).transform(np.eye(3), (14.75, 0.0, -1.0)))


def without_seam(part: Part, *zones: AnyZone) -> Part:
    return replace(part, no_seam=Marked.of(part.mesh, zones))


def bare(part: Part) -> Part:
    """A part that is supported nowhere."""
    return replace(part, no_support=Marked((Zone((-99.0, -99.0, -1.0), (99.0, 99.0, 99.0)),)))


def begins(sliced: SlicedPart) -> Floats:
    return np.array([path.points[0] for path in of_kind(sliced, Kind.OUTER_WALL)])


def leaning_out() -> Mesh:
    """A wedge 10 mm wide on the build plate and 26 mm at a height of 10 mm, 12 mm deep: its sides are 38.7 deg from upright."""
    return standing(m3.CrossSection([[(-5, 0), (5, 0), (13, 10), (-13, 10)]]).extrude(12).rotate((90, 0, 0)))


def support_x_mm(sliced: SlicedPart) -> Floats:
    strokes = of_kind(sliced, Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
    return np.concatenate([path.points[:, 0] for path in strokes])


@pytest.mark.parametrize("zone", [BACK, BACK_BOX])
def test_layers_begin_at_the_rear_unless_no_seam_is_wanted_there(zone: AnyZone) -> None:
    part = whole(box(20.0, 20.0, 4.0))
    free, without = (slice_part(sliced, profile(*BARE)) for sliced in (part, without_seam(part, zone)))
    assert begins(free)[:, 1].min() > 9.0
    assert begins(without)[:, 1].max() < 9.5
    assert len(begins(free)) == len(begins(without))


@pytest.mark.parametrize("axes", [None, LEANING])
def test_boxes_that_share_a_leaning_part_share_its_walls(axes: tuple[Vector, Vector, Vector] | None) -> None:
    leaning = cut(tee(), ((0.6, 0.0, 0.8), 33.0))[1]
    cuts_mm = np.arange(0.1, 9.0, 0.2)

    def wall_mm(zone: Marked) -> Floats:
        """Length of no_seam segments in every layer, all of it in the zone's box, if it has one."""
        segments = no_seam_segments(replace(leaning, no_seam=zone), leaning.in_part_frame(), cuts_mm)
        layers = [chords.reshape(-1, 2, 3) for chords in segments]
        for within in zone.volumes:
            spots = (np.concatenate(layers) + np.array([0.0, 0.0, leaning.base.offset_mm])) @ leaning.rotation
            assert (within.along(spots) >= np.array(within.min_mm) - 1e-9).all()
            assert (within.along(spots) <= np.array(within.max_mm) + 1e-9).all()
        return np.array([np.linalg.norm(chords[:, 1] - chords[:, 0], axis=1).sum() for chords in layers])

    left, right = Zone((-50.0, -50.0, -50.0), (50.0, 1.0, 50.0), axes), Zone((-50.0, 1.0, -50.0), (50.0, 50.0, 50.0), axes)
    whole_mm = wall_mm(Marked(faces=np.ones(len(leaning.mesh.faces), dtype=np.bool_)))
    np.testing.assert_allclose(wall_mm(Marked((left,))) + wall_mm(Marked((right,))), whole_mm, rtol=1e-9)
    assert whole_mm.min() > 20.0


def test_a_wall_on_which_no_seam_is_wanted_anywhere_begins_inside() -> None:
    part = whole(box(20.0, 20.0, 4.0))
    without = slice_part(without_seam(part, Zone((-15.0, -15.0, -1.0), (15.0, 15.0, 9.0))), profile(*BARE))
    assert np.abs(begins(without)).max(axis=1).max() < 9.6


@cache
def supported_tee() -> SlicedPart:
    """The tee with support under both arms, sliced once for all tests."""
    return slice_parts([whole(tee())], SUPPORTED)[0]


@pytest.mark.parametrize("zone", [RIGHT_ARM, RIGHT_MESH, Grown((12.0, 0.0, 30.0), 1.0)])
def test_a_zone_without_support_has_none_and_the_rest_has_its_own(zone: AnyZone) -> None:
    part, free = whole(tee()), supported_tee()
    (without,) = slice_parts([replace(part, no_support=Marked.of(part.mesh, [zone]))], SUPPORTED)
    assert support_x_mm(free).max() > 15.0
    assert support_x_mm(without).max() < 6.0
    assert support_x_mm(without).min() == pytest.approx(support_x_mm(free).min(), abs=0.5)
    ((mm2, why),) = [(missed.mm2, missed.reason) for missed in without.unsupported]
    assert (why, mm2) == ("no support is wanted there", pytest.approx(150.0, rel=0.05))
    assert volume_mm3(without, Kind.SUPPORT) == pytest.approx(0.5 * volume_mm3(free, Kind.SUPPORT), rel=0.1)


def test_a_model_without_support_is_estimated_without_it() -> None:
    part = whole(tee())
    counted = [estimate(variant, SUPPORTED).support_mm3 for variant in (part, bare(part))]
    assert (counted[0] > 0, counted[1]) == (True, 0)


def test_no_support_is_on_a_marked_top_even_with_thin_layers() -> None:
    block, tips_mm = whole(box(20.0, 20.0, 4.0)), 0.08 * np.arange(1, 101)
    marked = replace(block, no_support=Marked.of(block.mesh, [Grown((0.0, 0.0, 4.0), 1.0)]))
    heights = Heights(tips_mm, np.full(100, 0.08), tips_mm - 0.04)
    sections = sections_at(block.mesh, heights.cut_mm, "process.layer_height_mm=0.3", "process.support_bottom_gap_mm=0.3")
    unwanted = marked_areas(marked.no_support, marked, block.mesh, heights.cut_mm)
    stands = int(np.searchsorted(heights.bottom_mm, 4.3))  # the first layer of support on top of it
    shut = unwanted_areas(replace(sections, part=marked, heights=heights, no_support=unwanted))
    assert (shut[stands].area(), shut[-1].area()) == (pytest.approx(400.0, rel=0.01), 0.0)


def test_a_tilted_box_excludes_its_section_of_each_layer() -> None:
    part, half = whole(box(20.0, 20.0, 20.0)), 0.5**0.5
    leaning = Zone((-5.0, -10.0, -5.0), (5.0, 10.0, 5.0), ((half, 0.0, -half), (0.0, 1.0, 0.0), (half, 0.0, half)))
    leaning = leaning.transform(np.eye(3), np.array([0.0, 0.0, 10.0]))
    shut = marked_areas(Marked((leaning,)), part, part.mesh, np.array([2.0, 6.0, 10.0]))
    assert shut[-1].area() == pytest.approx(20.0 * 10.0 * 2.0**0.5)  # as wide as the diagonal of its side at half height


LEFT = Zone((-30.0, -30.0, -1.0), (0.0, 30.0, 40.0))


@pytest.mark.parametrize("zone", [LEFT, Grown((-9.0, 0.0, 5.0), 1.0)])
def test_a_self_supporting_slope_is_supported_where_the_user_marks_it(zone: AnyZone) -> None:
    wedge = whole(leaning_out())
    assert volume_mm3(slice_part(wedge, SUPPORTED), Kind.SUPPORT) == 0.0
    marked = replace(wedge, support=Marked.of(wedge.mesh, (zone,)))
    for which in ("process.support=auto", "process.support=enforced"):
        sliced = slice_part(marked, profile("process.skirt_loops=0", which))
        assert -18.0 < support_x_mm(sliced).min() < -11.0
        assert support_x_mm(sliced).max() < 0.0
        assert sliced.unsupported_mm2 == 0.0


def test_enforced_holds_up_nothing_else_and_a_place_without_support_comes_first() -> None:
    enforced = profile("process.skirt_loops=0", "process.support=enforced", "process.layer_height_mm=0.3")
    assert not of_kind(slice_part(whole(tee()), enforced), Kind.SUPPORT)
    right = replace(whole(tee()), support=Marked((RIGHT_ARM,)))
    assert support_x_mm(slice_part(right, enforced)).min() > 0.0
    assert not of_kind(slice_part(replace(right, no_support=Marked((RIGHT_ARM,))), enforced), Kind.SUPPORT)
