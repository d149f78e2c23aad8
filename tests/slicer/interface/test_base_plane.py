"""The base plane of a later part as an earlier part sees it, checked in the workpiece frame point by point."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.decomposition import Part
from mdp.mesh import Floats
from mdp.plane import PLATFORM, Plane
from mdp.pose import Pose, unit
from profiles.frozen import Vector
from slicer.geometry.polygons import Polygons
from slicer.heights import Heights
from slicer.interface.interface import BasePlane, frame_change, plane_in_frame_of
from tests.shapes import box
from tests.slicer.hand import as_shapely

MESH = box(4.0, 4.0, 4.0)
TIPS_MM = 0.2 * np.arange(1, 101)
HEIGHTS = Heights(TIPS_MM, np.full(100, 0.2), TIPS_MM - 0.1)
FAR_MM = 60.0
UP, LEVEL = (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)
directions = st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.1, 1.0))


def part(index: int, direction: Vector, through: Vector) -> Part:
    """A part with a base plane normal to its direction through a point of the workpiece frame."""
    normal = unit(direction)
    across = unit(np.cross((0.3, 1.0, 0.2), normal))
    rotation = np.array([across, np.cross(normal, across), normal])
    base = PLATFORM if index == 1 else Plane(normal, float(normal @ through))
    return Part(index, MESH, base, Pose(0.0, 0.0), rotation, 64.0, 0.0)


def in_workpiece(of: Part, points: Floats) -> Floats:
    """(n, 3) points of a part's frame in the workpiece frame."""
    moved: Floats = (points + np.array([0.0, 0.0, of.base.offset_mm])) @ of.rotation
    return moved


def plane_of(earlier: Part, later: Part) -> BasePlane:
    return BasePlane(*frame_change(earlier, later), HEIGHTS, FAR_MM)


def lattice(z_mm: float) -> Floats:
    """(n, 3) points at a height, chosen to avoid borders."""
    x, y = np.meshgrid(np.arange(-20.13, 20.0, 3.7), np.arange(-20.29, 20.0, 3.7))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z_mm)])


def holds(area: Polygons, points: Floats) -> list[bool]:
    dots = (Polygons.square((1e-4, 1e-4), True).translate((x, y)) for x, y in points[:, :2])
    return [not (area ^ dot).is_empty() for dot in dots]


@given(directions, directions)
def test_a_point_and_a_plane_are_the_same_in_either_frame(first: Vector, second: Vector) -> None:
    earlier, later = part(2, first, (1.0, -2.0, 5.0)), part(3, second, (3.0, 1.0, 9.0))
    points = np.random.default_rng(1).uniform(-20.0, 20.0, (20, 3))
    turn, shift = frame_change(earlier, later)
    assert in_workpiece(later, points @ turn.T + shift) == pytest.approx(in_workpiece(earlier, points), abs=1e-9)
    *normal, offset = plane_in_frame_of(earlier, later.base.normal, later.base.offset_mm)
    assert points @ normal - offset == pytest.approx(later.base.heights_mm(in_workpiece(earlier, points)), abs=1e-9)


@given(directions, st.integers(0, 99), st.floats(-6.0, 2.0), st.floats(0.5, 8.0))
def test_a_band_is_the_region_between_two_heights_above_the_plane(
    direction: Vector, layer: int, low_mm: float, wide_mm: float
) -> None:
    earlier, later = part(1, UP, (0.0, 0.0, 0.0)), part(2, direction, (0.0, 0.0, 10.0))
    plane = plane_of(earlier, later)
    points = lattice(plane.z_mm(layer))
    above_mm = later.base.heights_mm(in_workpiece(earlier, points))
    inside = (above_mm > low_mm) & (above_mm < low_mm + wide_mm)
    clear = (np.abs(above_mm - low_mm) > 1e-3) & (np.abs(above_mm - low_mm - wide_mm) > 1e-3)
    assert np.array(holds(plane.band(layer, low_mm, low_mm + wide_mm), points))[clear].tolist() == inside[clear].tolist()


@pytest.mark.parametrize(("direction", "layer"), [(UP, 49), ((0.4, 0.1, 0.9), 49), ((-0.8, 0.5, 0.3), 30), ((0.0, 1.0, 0.2), 70)])
def test_projection_onto_the_plane_is_invertible_and_fixes_the_intersection_with_the_layer(direction: Vector, layer: int) -> None:
    plane = plane_of(part(1, UP, (0.0, 0.0, 0.0)), part(2, direction, (0.0, 0.0, 10.0)))
    area = Polygons.square((3.0, 2.0), True).rotate(20.0).translate((4.0, -3.0))
    there_and_back = as_shapely(plane.shadow(plane.project(area, layer), layer))
    assert there_and_back.symmetric_difference(as_shapely(area)).area < 1e-6
    on_plane = plane.points_mm(np.array([[x, y] for x in (-8.0, 0.0, 8.0) for y in (-8.0, 0.0, 8.0)]))
    meeting = on_plane[np.argmin(np.abs(on_plane[:, 2] - plane.z_mm(layer)))]
    projected = plane.turn @ np.array([*meeting[:2], plane.z_mm(layer)]) + plane.shift
    dot = Polygons.square((0.2, 0.2), True).translate((float(meeting[0]), float(meeting[1])))
    (x0, y0, x1, y1), reach = plane.project(dot, layer).bounds(), 0.2 + abs(float(projected[2]))
    assert np.hypot(0.5 * (x0 + x1) - projected[0], 0.5 * (y0 + y1) - projected[1]) < reach


@given(directions, st.floats(0.0, 5.0))
def test_the_layers_near_a_place_are_those_that_a_column_below_it_meets(direction: Vector, deep_mm: float) -> None:
    plane = plane_of(part(1, UP, (0.0, 0.0, 0.0)), part(2, direction, (0.0, 0.0, 10.0)))
    corners = np.array([[-2.0, -1.0], [2.0, -1.0], [2.0, 1.0], [-2.0, 1.0]])
    column = np.concatenate([plane.points_mm(corners), plane.points_mm(corners) - deep_mm * plane.turn[2]])
    low, high = column[:, 2].min(), column[:, 2].max()
    met = np.flatnonzero((HEIGHTS.tip_mm >= low) & (HEIGHTS.bottom_mm < high))
    near = plane.layers_near(Polygons([corners]), deep_mm)
    assert list(near) == met.tolist()


def test_near_nothing_is_no_layer() -> None:
    plane = plane_of(part(1, UP, (0.0, 0.0, 0.0)), part(2, LEVEL, (0.0, 0.0, 10.0)))
    assert list(plane.layers_near(Polygons(), 1.0)) == []
