"""Support stands where faces hang, on something, and out of the way."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.decomposition import Part
from mdp.pose import UP, about
from slicer.paths import Kind
from slicer.slice import slice_part
from tests.shapes import branch, from_manifold, standing, tee
from tests.slicer.hand import cut, distances_mm, of_kind, profile, section_at, whole

DISTANCE, GAP = 0.6, 0.2


def layers_with_support(sliced):
    return [layer for layer in sliced.layers if any(path.kind is Kind.SUPPORT for path in layer.paths)]


def support_points(sliced):
    return np.concatenate([path.points for path in of_kind(sliced, Kind.SUPPORT)])


def table(span):
    """Two posts and a plate across them, `span` mm apart."""
    posts = m3.Manifold.cube((5, 5, 10)) + m3.Manifold.cube((5, 5, 10)).translate((5 + span, 0, 0))
    return standing(posts + m3.Manifold.cube((10 + span, 5, 2)).translate((0, 0, 10)))


def funnel(angle):
    """A pyramid on its head whose four faces hang over by an angle from upright."""
    return standing(m3.Manifold.cylinder(6, 5, 5 + 6 * np.sqrt(2) * np.tan(np.radians(angle)), 4).rotate((0, 0, 45)))


def test_both_arms_of_a_tee_are_supported_from_the_platform_up_to_the_gap():
    sliced = slice_part(whole(tee()), profile())
    held = layers_with_support(sliced)
    assert held[0].z_mm == pytest.approx(0.2)
    assert held[-1].z_mm == pytest.approx(30.0 - GAP)
    points = support_points(sliced)
    assert points[:, 0].min() < -19
    assert points[:, 0].max() > 19
    assert sliced.unsupported_mm2 == 0.0


def test_support_keeps_its_distance_from_the_part():
    sliced = slice_part(whole(tee()), profile())
    edge = np.abs(support_points(sliced)[:, 0]).min() - 0.225
    assert edge == pytest.approx(5 + DISTANCE, abs=0.05)


def test_support_is_as_dense_as_asked():
    sliced = slice_part(whole(tee()), profile("process.support_density=0.2"))
    layer = sliced.layers[50]
    plastic = sum(layer.volume_mm3(path) for path in layer.paths if path.kind is Kind.SUPPORT) / layer.height_mm
    assert plastic / (2 * (15 - DISTANCE) * 10) == pytest.approx(0.2, abs=0.07)


def test_support_comes_first_in_a_layer():
    kinds = [path.kind for path in slice_part(whole(tee()), profile()).layers[50].paths]
    assert kinds[0] is Kind.SUPPORT
    assert Kind.SUPPORT not in kinds[kinds.index(Kind.INNER_WALL) :]


def test_none_means_none():
    assert of_kind(slice_part(whole(tee()), profile("process.support=none")), Kind.SUPPORT) == []


@pytest.mark.parametrize("angle", [40.0, 44.9, 45.0])
def test_faces_up_to_the_self_supporting_angle_need_nothing(angle):
    assert of_kind(slice_part(whole(funnel(angle)), profile()), Kind.SUPPORT) == []


@pytest.mark.parametrize("angle", [47.0, 60.0, 80.0])
def test_flatter_faces_are_supported(angle):
    assert len(of_kind(slice_part(whole(funnel(angle)), profile()), Kind.SUPPORT)) > 10


def test_a_short_bridge_needs_no_support_and_a_long_one_does():
    assert of_kind(slice_part(whole(table(5)), profile()), Kind.SUPPORT) == []
    assert len(of_kind(slice_part(whole(table(12)), profile()), Kind.SUPPORT)) > 10


@pytest.mark.parametrize(("turn", "expected"), [(0, 0), (90, 90), (30, 30)])
def test_the_lines_of_a_bridge_run_from_bank_to_bank(turn, expected):
    spanned = table(5).moved(about(UP, np.radians(turn)))
    layer = slice_part(whole(spanned), profile()).layers[50]
    along = max((p for p in layer.paths if p.kind is Kind.BRIDGE), key=lambda p: p.length_mm).points
    steps = np.diff(along, axis=0)
    longest = steps[np.argmax(np.hypot(*steps.T))]
    assert np.degrees(np.arctan2(*longest[::-1])) % 180 == pytest.approx(expected, abs=0.1)


def test_a_widening_part_on_plastic_hangs_nowhere_at_its_base():
    base, top = cut(funnel(30.0), ((0, 0, 1), 3.0))
    sliced = slice_part(top, profile(), [base])
    assert sliced.unsupported_mm2 == 0.0
    assert of_kind(sliced, Kind.SUPPORT) == []


def test_a_tiny_overhang_needs_no_support():
    nose = m3.Manifold.cube((10, 10, 10)) + m3.Manifold.cube((0.6, 0.6, 1)).translate((10, 4, 5))
    assert of_kind(slice_part(whole(standing(nose)), profile()), Kind.SUPPORT) == []


def test_support_on_the_part_itself_leaves_the_gap_above_it_too():
    hook = m3.Manifold.cube((20, 8, 3)) + m3.Manifold.cube((5, 8, 20)) + m3.Manifold.cube((20, 8, 3)).translate((0, 0, 17))
    held = layers_with_support(slice_part(whole(standing(hook)), profile()))
    assert held[0].z_mm - held[0].height_mm == pytest.approx(3.0 + GAP)
    assert held[-1].z_mm == pytest.approx(17.0 - GAP)


def test_a_plate_wider_than_the_plastic_beneath_it_cannot_be_supported():
    base, plate = cut(tee(), ((0, 0, 1), 30.0))
    sliced = slice_part(plate, profile(), [base])
    assert sliced.unsupported_mm2 == pytest.approx(300.0, abs=5)
    assert of_kind(sliced, Kind.SUPPORT) == []


def test_support_of_a_later_part_roots_on_earlier_plastic():
    slab = m3.Manifold.cube((40, 10, 10)) + m3.Manifold.cube((8, 10, 30)) + m3.Manifold.cube((30, 10, 5)).translate((0, 0, 30))
    base, top = cut(standing(slab), ((0, 0, 1), 10.0))
    sliced = slice_part(top, profile(), [base])
    assert sliced.unsupported_mm2 == 0.0
    assert layers_with_support(sliced)[0].z_mm < 0.6


def test_support_stays_out_of_the_place_of_a_later_part():
    part = whole(tee())
    guest = from_manifold(m3.Manifold.cube((4, 10, 6)).translate((10, -5, 8)))
    later = Part(2, guest, part.base, part.pose, part.rotation, guest.volume_mm3, 0.0)
    sliced = slice_part(part, profile(), later=[later])
    inside = [p for p in support_points(sliced) if 10 - DISTANCE < p[0] < 14 + DISTANCE]
    assert inside == []
    assert sliced.unsupported_mm2 == pytest.approx((4 + 2 * DISTANCE) * 10, rel=0.1)


def test_support_of_a_leaning_arm_never_touches_the_part():
    mesh = branch()
    sliced = slice_part(whole(mesh), profile())
    for layer in sliced.layers[5:150:12]:
        points = [path.points for path in layer.paths if path.kind is Kind.SUPPORT]
        section = section_at(mesh, layer.z_mm - 0.5 * layer.height_mm)
        if points:
            assert distances_mm(section, np.concatenate(points)).max() < -(DISTANCE + 0.2)
