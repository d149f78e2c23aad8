"""Adaptive layers: their cusps on cones, spheres and real models, and their upper ends."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Mesh
from profiles.errors import ProfileError
from profiles.profile import Profile
from slicer.heights import layer_heights
from slicer.slice import slice_part
from tests.shapes import box, from_manifold, standing
from tests.slicer.hand import BARE, SOLID, profile, shared, whole

CUSP, LEAST, MOST = 0.08, 0.06, 0.3


def adaptive(cusp: float = CUSP, least: float = LEAST, most: float = MOST) -> Profile:
    keys = {"adaptive_cusp": cusp, "least_layer_height": least, "most_layer_height": most}
    return profile(*(f"process.{key}_mm={value}" for key, value in keys.items()))


def cone(slope_deg: float) -> Mesh:
    """A cone whose side rises by an angle from the horizontal."""
    return standing(m3.Manifold.cylinder(12, 12 / np.tan(np.radians(slope_deg)) + 3, 3, 256))


def test_layers_of_a_cone_are_as_high_as_its_slope_allows() -> None:
    at = layer_heights(cone(30), adaptive(), True)
    assert at.height_mm[1:-1] == pytest.approx(CUSP / np.cos(np.radians(30)), rel=1e-3)
    assert at.tip_mm[-1] == pytest.approx(12)


@pytest.mark.parametrize(("slope", "expected"), [(90, MOST), (89, MOST), (5, 0.0803), (75, MOST)])
def test_steep_sides_get_the_most_and_shallow_ones_the_least(slope: float, expected: float) -> None:
    mesh = box(9, 9, 12) if slope == 90 else cone(slope)
    assert np.median(layer_heights(mesh, adaptive(), True).height_mm) == pytest.approx(expected, rel=0.01)


@settings(max_examples=15, deadline=None)
@given(st.floats(3, 30), st.floats(0.03, 0.2), st.booleans())
def test_no_step_of_a_sphere_is_deeper_than_set(radius: float, cusp: float, on_plate: bool) -> None:
    ball = standing(m3.Manifold.sphere(radius, 64))
    at = layer_heights(ball, adaptive(cusp), on_plate)
    low = np.maximum(at.tip_mm - at.height_mm, 0)
    away = np.maximum(np.abs(low - radius), np.abs(np.minimum(at.tip_mm, 2 * radius) - radius))
    free = at.height_mm[1:] >= 2 * LEAST
    facets = np.cos(np.pi / 64)  # the normals of a tessellated sphere deviate by half a facet
    assert (at.height_mm[1:] * np.maximum(away[1:] / radius - 2 * (1 - facets) - np.pi / 64, 0))[free].max(initial=0) <= cusp
    assert at.height_mm[1:].min() >= LEAST - 1e-9
    assert at.height_mm[1:].max() <= MOST + 1e-9
    assert at.tip_mm[-1] == pytest.approx(2 * radius)


def test_every_step_of_a_real_model_is_bounded_face_by_face() -> None:
    mesh = shared("org_kitten", 40.0)
    at = layer_heights(mesh, adaptive(), True)
    low = at.tip_mm - at.height_mm
    leaning, z = np.abs(mesh.normals[:, 2]), mesh.vertices[mesh.faces][:, :, 2]
    for k in range(1, len(low)):
        touching = (z.max(axis=1) > low[k] + 1e-9) & (z.min(axis=1) < at.tip_mm[k] - 1e-9) & (leaning < 0.9998)
        assert at.height_mm[k] * leaning[touching].max() <= CUSP + 1e-9 or at.height_mm[k] < 2 * LEAST
    assert len(low) < 40.0 / CUSP


def test_layers_end_at_level_surfaces() -> None:
    stairs = m3.Manifold.cube((30, 10, 1.03)) + m3.Manifold.cube((20, 10, 2.47)) + m3.Manifold.cube((10, 10, 5.11))
    tips = layer_heights(from_manifold(stairs), adaptive(), True).tip_mm
    for level in (1.03, 2.47, 5.11):
        assert np.abs(tips - level).min() < 1e-9


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.floats(0.03, 2.0), min_size=1, max_size=5),
    st.floats(0.02, 0.15),
    st.floats(1.0, 3.0),
    st.sampled_from([0.02, 0.2]),
)
def test_no_layer_of_any_stairs_is_thinner_than_the_least_or_thicker_than_the_most(
    rises: list[float], least: float, ratio: float, cusp: float
) -> None:
    most, tops = min(max(0.2, least * ratio), 0.4), np.cumsum(rises)
    stairs = sum((m3.Manifold.cube((10 * (len(rises) - k), 10, top)) for k, top in enumerate(tops)), m3.Manifold())
    at = layer_heights(from_manifold(stairs), adaptive(cusp, least, most), True)
    assert at.height_mm.min() >= least - 1e-9
    few = len(at.tip_mm) <= 3  # too few to divide a rise between `least` and `most`: then the nozzle is the limit
    assert at.height_mm.max() <= (0.4 if few else max(most, 0.25)) + 1e-9
    assert at.tip_mm[-1] == pytest.approx(max(tops[-1], least))


def test_a_solid_part_of_adaptive_layers_extrudes_its_volume() -> None:
    mesh = cone(40)
    sliced = slice_part(whole(mesh), profile(*SOLID, "process.adaptive_cusp_mm=0.1"))
    assert sliced.volume_mm3 == pytest.approx(mesh.volume_mm3, rel=0.015)
    assert len({round(layer.height_mm, 6) for layer in sliced.layers}) > 1


def test_finer_than_equal_layers_only_where_it_pays() -> None:
    sliced = slice_part(whole(standing(m3.Manifold.sphere(8, 64))), profile(*BARE, "process.adaptive_cusp_mm=0.1"))
    heights = np.array([layer.height_mm for layer in sliced.layers[1:]])
    middle = len(heights) // 2
    assert heights[middle] == pytest.approx(0.28)
    assert heights[:5].max() < 0.13
    assert heights[-5:].max() < 0.13


def test_least_above_most_is_refused() -> None:
    with pytest.raises(ProfileError, match=r"least_layer_height_mm is 0.3 mm: at most most_layer_height_mm \(0.2 mm\)"):
        adaptive(least=0.3, most=0.2)
