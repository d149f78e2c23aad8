"""Fuzzy skin: rough only where the settings request it and by their amount, and smooth where parts meet."""

import manifold3d as m3
import numpy as np
import pytest

from mdp.mesh import Floats
from slicer.paths import Kind, Layer, SlicedPart
from slicer.slice import slice_part
from tests.shapes import box, standing
from tests.slicer.hand import SOLID, content, cut, profile, whole

FUZZY = (*SOLID, "process.fuzzy_skin=external", "process.fuzzy_skin_thickness_mm=0.3")
DISTANT = "process.fuzzy_skin_point_distance_mm=5"
SIDE = 10.0 - 0.225  # distance of the outer wall's centreline from the axis of a block of 20 mm


def off_mm(sliced: SlicedPart, layer: int, kind: Kind = Kind.OUTER_WALL) -> Floats:
    """Distance of wall points outside their line in a smooth block."""
    paths = [path for path in sliced.layers[layer].paths if path.kind is kind]
    return np.concatenate([np.abs(path.points).max(axis=1) for path in paths]) - SIDE


def test_points_of_a_fuzzy_wall_are_within_the_thickness_on_both_sides() -> None:
    sliced = slice_part(whole(box(20, 20, 4)), profile(*FUZZY))
    off = np.concatenate([off_mm(sliced, layer) for layer in range(1, 20)])
    assert off.max() == pytest.approx(0.3, abs=0.02)
    assert np.abs(off).mean() == pytest.approx(0.15, abs=0.03)
    assert np.abs(off_mm(sliced, 0)).max() < 0.3 * 0.1


def test_a_rough_wall_begins_and_ends_where_the_even_one_does() -> None:
    even, rough = (slice_part(whole(box(20, 20, 4)), profile(*keys)) for keys in (SOLID, FUZZY))
    for layer in range(1, 20):
        ends = [
            next(path.points[[0, -1]] for path in sliced.layers[layer].paths if path.kind is Kind.OUTER_WALL)
            for sliced in (even, rough)
        ]
        assert ends[1] == pytest.approx(ends[0], abs=1e-6)


def test_points_of_a_fuzzy_wall_have_the_distance_that_is_set() -> None:
    sliced = slice_part(whole(box(20, 20, 4)), profile(*FUZZY, "process.fuzzy_skin_point_distance_mm=2"))
    counts = [sum(len(p.points) for p in layer.paths if p.kind is Kind.OUTER_WALL) for layer in sliced.layers[1:]]
    assert np.mean(counts) == pytest.approx(4 * 2 * SIDE / 2, rel=0.1)


@pytest.mark.parametrize(
    ("walls", "holes", "inner"), [("external", False, False), ("all", True, False), ("allwalls", True, True)]
)
def test_the_setting_says_which_walls_are_rough(walls: str, holes: bool, inner: bool) -> None:
    """The frame has an outer outline and a hole, each with two inner walls."""
    frame = standing(m3.Manifold.cube((20, 20, 2), True) - m3.Manifold.cube((10, 10, 9), True))
    even, rough = (slice_part(whole(frame), profile(*SOLID, f"process.fuzzy_skin={name}")).layers[4] for name in ("none", walls))
    changed = {kind: len(points_of(rough, kind) - points_of(even, kind)) for kind in (Kind.OUTER_WALL, Kind.INNER_WALL)}
    assert changed[Kind.OUTER_WALL] == pytest.approx((80 + 40 * holes) / 0.8, rel=0.15)
    assert (changed[Kind.INNER_WALL] > 0) == inner


def points_of(layer: Layer, kind: Kind) -> set[tuple[float, ...]]:
    return {tuple(point) for path in layer.paths if path.kind is kind for point in np.round(path.points, 6).tolist()}


def test_walls_at_a_cut_stay_even_and_the_same_input_gives_the_same_walls() -> None:
    """The last layer below a cut and the first above it."""
    below, above = cut(box(20, 20, 8), ((0, 0, 1), 4.0))
    lower, even = (slice_part(below, profile(*keys), (), [above]) for keys in (FUZZY, SOLID))
    upper, upper_even = (slice_part(above, profile(*keys), [below]) for keys in (FUZZY, SOLID))
    assert points_of(lower.layers[-1], Kind.OUTER_WALL) == points_of(even.layers[-1], Kind.OUTER_WALL)
    assert points_of(upper.layers[0], Kind.OUTER_WALL) == points_of(upper_even.layers[0], Kind.OUTER_WALL)
    assert np.abs(off_mm(lower, -4)).max() > 0.1
    assert content(lower) == content(slice_part(below, profile(*FUZZY), (), [above]))


def test_the_face_of_a_cut_stays_even_in_all_layers() -> None:
    """The lower part of a block cut at 45 degrees: points on the slope lie on the cut, all others do not."""
    below, above = cut(box(20, 20, 20), ((1, 0, 1), 10.0 * 2**0.5))
    sliced = slice_part(below, profile(*FUZZY), (), [above])
    layer = sliced.layers[60]
    points = np.concatenate([path.points for path in layer.paths if path.kind is Kind.OUTER_WALL])
    face = 20.0 - layer.z_mm + 0.1  # x of the cut in the middle of the layer
    on_face = points[(points[:, 0] > face - 1.0) & (np.abs(points[:, 1]) < 8.5)]
    assert on_face[:, 0] == pytest.approx(face - 0.225, abs=1e-6)
    assert len(points) > 40


def test_a_pin_too_thin_for_the_distance_of_points_keeps_its_wall() -> None:
    pin = whole(box(2, 2, 4))
    even, rough = (slice_part(pin, profile(*SOLID, f"process.fuzzy_skin={name}", DISTANT)) for name in ("none", "external"))
    for layer in range(1, 20):
        assert off_mm(rough, layer) == pytest.approx(off_mm(even, layer))
