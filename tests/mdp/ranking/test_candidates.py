"""The disc that every plane must clear, against another library's least circle, and the planes that clear it."""

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.directions.unit_vectors import spread
from mdp.ranking.candidates import bounds_of, footprint
from profiles.profile import load
from tests.shapes import box, from_manifold

PLACES = st.lists(st.tuples(st.integers(-20, 20), st.integers(-20, 20)), min_size=1, max_size=5, unique=True)


def feet(places: list[tuple[int, int]]) -> m3.Manifold:
    """A plate 10 mm above the build plate on round feet of 1 mm at given positions."""
    legs = [m3.Manifold.cylinder(12, 0.5, 0.5, 8).translate((x, y, 0)) for x, y in places]
    return m3.Manifold.batch_boolean([m3.Manifold.cube((50, 50, 3), True).translate((0, 0, 11.5)), *legs], m3.OpType.Add)


@settings(max_examples=25)
@given(PLACES)
def test_the_disc_of_the_footprint_is_nearly_the_smallest_enclosing_circle(
    places: list[tuple[int, int]],
) -> None:
    mesh = from_manifold(feet(places))
    centre, radius = footprint(mesh)
    standing = mesh.vertices[mesh.vertices[:, 2] <= 0.3][:, :2]
    least = shapely.minimum_bounding_radius(shapely.MultiPoint(standing))
    assert (np.linalg.norm(standing - centre, axis=1) <= radius + 1e-9).all()
    assert least <= radius + 1e-9 <= 1.02 * least


def test_a_plane_that_may_cut_has_the_whole_disc_below_it() -> None:
    profile = load(settings=["search.clearance=false"])
    centre, radius = np.array([3.0, -2.0]), 8.0
    directions = spread(40, 0.1)
    limits = bounds_of(directions, box(10.0, 10.0, 10.0), profile, (centre, radius))
    angle = np.linspace(0.0, 2.0 * np.pi, 3601)
    rim = np.column_stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle), np.zeros(len(angle))])
    assert limits.least_offset_mm == pytest.approx((rim @ directions.T).max(axis=0), abs=1e-4)
    assert limits.least_volume_mm3 == pytest.approx(0.02 * 1000.0)
