"""The neck near a plane: known in closed form, found by brute force, and absent from models without one."""

from itertools import product
from math import cos, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats, Mesh
from mdp.plane import Plane
from mdp.pose import about, unit
from mdp.search.neck import find_neck
from mdp.sweep.crossing import measure_rim, sum_chords
from tests import shapes

WAIST_MM, LENGTH_MM, ROUND = 4.0, 30.0, 40
Z = np.array([0.0, 0.0, 1.0])


def lathe(radii_mm: Floats, heights_mm: Floats, wide: float = 1.0) -> Mesh:
    """Rings of given radii at given heights, closed with caps; wide: scale along x."""
    angles = 2.0 * pi * np.arange(ROUND) / ROUND
    rings = [
        np.column_stack([wide * r * np.cos(angles), r * np.sin(angles), np.full(ROUND, z)])
        for r, z in zip(radii_mm, heights_mm, strict=True)
    ]
    vertices = np.vstack([*rings, [[0.0, 0.0, heights_mm[0]], [0.0, 0.0, heights_mm[-1]]]])
    bottom, top, k = len(vertices) - 2, len(vertices) - 1, np.arange(ROUND)
    n = (k + 1) % ROUND
    faces = [np.column_stack([np.full(ROUND, bottom), n, k])]
    for ring in range(len(radii_mm) - 1):
        low, high = ring * ROUND, (ring + 1) * ROUND
        faces += [np.column_stack([k + low, n + low, n + high]), np.column_stack([k + low, n + high, k + high])]
    faces.append(np.column_stack([np.full(ROUND, top), k + high, n + high]))
    return Mesh(vertices, np.vstack(faces))


def hourglass(wide: float = 1.0) -> Mesh:
    """A hyperboloid of one sheet, its waist a circle (or an ellipse) at z = 0."""
    z = np.linspace(-LENGTH_MM, LENGTH_MM, 61)
    return lathe(WAIST_MM * np.sqrt(1.0 + (z / 10.0) ** 2), z, wide)


def rim_mm(mesh: Mesh, plane: Plane) -> float:
    return measure_rim(mesh, np.ones(len(mesh.faces)), Plane(plane.normal, plane.offset_mm - 1e-7), 0.0).length_mm


def neck(mesh: Mesh, plane: Plane, reach_mm: float = 12.0) -> Plane | None:
    return find_neck(mesh, np.ones(len(mesh.faces)), plane, reach_mm)


@settings(max_examples=6, deadline=None)
@given(st.floats(-10.0, 10.0), st.floats(0.0, 20.0), st.floats(0.0, 360.0), st.floats(0.0, 180.0), st.floats(0.0, 360.0))
def test_the_waist_of_an_hourglass_is_found_from_nearby_planes_in_any_rotation(
    offset_mm: float, tilt_deg: float, towards_deg: float, height_deg: float, around_deg: float
) -> None:
    turned = about(unit([cos(radians(around_deg)), sin(radians(around_deg)), 0.3]), radians(height_deg))
    mesh, axis = hourglass().transform(turned), turned @ Z
    normal = turned @ about(np.array([cos(radians(towards_deg)), sin(radians(towards_deg)), 0.0]), radians(tilt_deg)) @ Z
    found = neck(mesh, Plane(normal, offset_mm * float(normal @ axis)))
    assert found is not None
    assert float(found.normal @ axis) > cos(radians(1.0))
    assert found.offset_mm == pytest.approx(0.0, abs=0.05)
    assert rim_mm(mesh, found) == pytest.approx(2.0 * pi * WAIST_MM, rel=0.01)


def test_no_plane_of_a_fine_grid_has_a_shorter_rim_at_a_waist_that_is_no_circle() -> None:
    mesh = hourglass(wide=1.6)
    found = neck(mesh, Plane(unit([0.2, -0.1, 1.0]), 5.0))
    assert found is not None
    grid = product(np.linspace(-0.4, 0.4, 9), np.linspace(-0.4, 0.4, 9), np.linspace(-9.0, 9.0, 37))
    least = min(rim_mm(mesh, Plane(unit([x, y, 1.0]), c)) for x, y, c in grid)
    assert rim_mm(mesh, found) <= least * (1.0 + 1e-5)


def test_the_thinner_of_two_necks_within_reach_is_chosen() -> None:
    z = np.linspace(0.0, 60.0, 61)
    two = lathe(6.0 + 2.0 * np.cos(2.0 * pi * z / 30.0) - 0.03 * z, z)  # waists at 15 and, thinner, 45
    assert [round(found.offset_mm) for reach in (12.0, 40.0) if (found := neck(two, Plane(Z, 20.0), reach))] == [15, 45]


@pytest.mark.parametrize("mesh", [shapes.ball(), shapes.box(), shapes.octahedron(9.0)], ids=["ball", "rod", "tip"])
def test_a_shape_that_only_tapers_has_no_neck(mesh: Mesh) -> None:
    assert neck(mesh, Plane(Z, 14.0)) is None


def test_a_plane_that_misses_the_model_is_near_no_neck() -> None:
    assert neck(hourglass(), Plane(Z, 31.0)) is None


def test_the_kernel_of_rims_is_compiled_once_for_cuts_and_necks() -> None:
    mesh, plane = hourglass(), Plane(np.array([0.0, 0.0, 1.0]), 3.0)
    rim_mm(mesh, plane)
    neck(mesh, plane)
    assert len(sum_chords.signatures) == 1
