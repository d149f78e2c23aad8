"""Sections against closed formulas, shapely, and the volume that they must add up to."""

from collections.abc import Sequence

import manifold3d as m3
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats, Mesh
from mdp.topology.cross_section import cross_sections, loop_edges
from profiles.errors import SliceError
from slicer.geometry.polygons import CLOSING_MM, area_mm2, clean, contours
from slicer.sectioning import faces_by_layer
from tests.shapes import ball, bowl, box, from_manifold, hollow
from tests.slicer.hand import profile, shared


def area(loops: Sequence[Floats]) -> float:
    return sum(area_mm2(loop) for loop in loops)


def test_a_box_has_its_footprint_at_every_height() -> None:
    assert [area(loops) for loops in cross_sections(box(20, 10, 5), np.array([0.1, 2.5, 4.9]))] == pytest.approx([200.0] * 3)


def test_outer_loops_run_counter_clockwise_and_holes_clockwise() -> None:
    (loops,) = cross_sections(hollow(), np.array([10.2]))
    assert sorted(area_mm2(loop) for loop in loops) == pytest.approx([-100.0, 400.0])


def test_a_plane_in_a_flat_face_takes_the_solid_below() -> None:
    assert [area(loops) for loops in cross_sections(box(20, 10, 5), np.array([0.0, 5.0]))] == pytest.approx([0.0, 200.0])


def test_planes_through_vertices_and_edges_still_give_closed_loops() -> None:
    mesh = ball(10.0, 16)
    heights = np.unique(mesh.vertices[:, 2])[1:-1]
    around = [area(loops) for loops in cross_sections(mesh, heights)]
    just_below = [area(loops) for loops in cross_sections(mesh, heights - 1e-9)]
    assert around == pytest.approx(just_below, abs=1e-4)


def test_above_and_below_the_part_there_is_nothing() -> None:
    assert cross_sections(box(), np.array([-1.0, 25.0])) == [[], []]


def test_a_ball_has_the_circles_of_its_formula() -> None:
    heights = np.array([2.0, 10.0, 17.0])
    areas = [area(loops) for loops in cross_sections(ball(10.0, 512), heights)]
    assert areas == pytest.approx(np.pi * (100 - (heights - 10) ** 2), rel=2e-3)


def test_middle_sections_times_height_add_up_to_the_volume() -> None:
    heights = np.arange(0.005, 20, 0.01)
    mesh = bowl()
    assert sum(area(loops) for loops in cross_sections(mesh, heights)) * 0.01 == pytest.approx(mesh.volume_mm3, rel=1e-3)


def test_an_edge_of_four_faces_keeps_both_solids() -> None:
    two = from_manifold(m3.Manifold.cube((5, 5, 5)))
    shift = np.array([5.0, 5.0, 0.0])  # the second cube touches the first along one vertical edge
    known = {tuple(p): i for i, p in enumerate(two.vertices)}
    vertices, renamed = [*two.vertices], []
    for point in two.vertices + shift:
        renamed.append(known.setdefault(tuple(point), len(vertices)))
        vertices += [point] * (renamed[-1] == len(vertices))
    mesh = Mesh(np.array(vertices), np.concatenate([two.faces, np.array(renamed)[two.faces]]))
    assert len(vertices) == 14
    assert area(cross_sections(mesh, np.array([2.5]))[0]) == pytest.approx(50.0)


def test_the_edges_of_loops_close_each_of_them() -> None:
    triangle, sliver = np.array([(0.0, 0.0), (3.0, 0.0), (0.0, 4.0)]), np.array([(9.0, 9.0), (9.0, 8.0)])
    assert loop_edges([triangle, sliver]).tolist() == [
        [0.0, 0.0, 3.0, 0.0],
        [3.0, 0.0, 0.0, 4.0],
        [0.0, 4.0, 0.0, 0.0],
        [9.0, 9.0, 9.0, 8.0],
        [9.0, 8.0, 9.0, 9.0],
    ]
    assert loop_edges([]).shape == (0, 4)


def test_an_open_mesh_is_refused_with_the_number_of_open_edges() -> None:
    mesh = box()
    with pytest.raises(SliceError, match="3 edges have a face on one side only"):
        cross_sections(Mesh(mesh.vertices, mesh.faces[1:]), np.array([1.0]))


def brute_force_area(mesh: Mesh, z: float) -> float:
    """Every triangle cut separately, the pieces joined by shapely."""
    pieces = []
    for triangle in mesh.vertices[mesh.faces]:
        ends = [
            a + (b - a) * (z - a[2]) / (b[2] - a[2])
            for a, b in zip(triangle, np.roll(triangle, -1, 0), strict=True)
            if (a[2] < z) != (b[2] < z)
        ]
        if len(ends) == 2:
            pieces.append(shapely.LineString(np.round(np.array(ends)[:, :2], 9)))
    return float(shapely.build_area(shapely.union_all(pieces)).area)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.3, 19.0), st.floats(-80.0, 80.0), st.floats(-80.0, 80.0))
def test_a_turned_tube_agrees_with_cutting_every_triangle_by_itself(z: float, around_x: float, around_y: float) -> None:
    tube = m3.Manifold.cylinder(30, 8, 6, 24, True) - m3.Manifold.cylinder(40, 4, 3, 24, True)
    mesh = from_manifold(tube.rotate((around_x, around_y, 0)).translate((0, 0, 10)))
    assert area(cross_sections(mesh, np.array([z]))[0]) == pytest.approx(brute_force_area(mesh, z), rel=1e-6, abs=1e-6)


def test_cleaning_keeps_the_area_of_a_real_model() -> None:
    mesh = shared("org_kitten", 40.0)
    heights = np.arange(0.1, 40.0, 0.4)
    raw = cross_sections(mesh, heights)
    assert sum(area(loops) for loops in raw) * 0.4 == pytest.approx(mesh.volume_mm3, rel=1e-3)
    assert [clean(loops).area() for loops in raw] == pytest.approx([area(loops) for loops in raw], rel=2e-3, abs=0.05)


@pytest.mark.parametrize("name", ["org_kitten", "org_deer", "mec_bracket"])
def test_every_layer_has_the_area_that_manifold_slices(name: str) -> None:
    mesh = shared(name, 40.0)
    solid = m3.Manifold(m3.Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))
    cuts = np.arange(0.1, 40.0, 0.2)
    expected = np.array([solid.slice(z).area() for z in cuts])
    exact, cleaned = ([f(loops) for loops in cross_sections(mesh, cuts)] for f in (area, lambda loops: clean(loops).area()))
    assert np.abs(exact - expected).max() < 1e-3
    assert (np.abs(cleaned - expected) < 0.05 + 2e-4 * expected).all()


@pytest.mark.parametrize("slit_mm", [0.03, 0.05, 0.09])
def test_cleaning_reaches_over_the_section_by_no_more_than_a_twentieth_of_a_line(slit_mm: float) -> None:
    block = m3.CrossSection.square((10.0, 10.0)) - m3.CrossSection.square((slit_mm, 8.0)).translate((5.0, 4.0))
    closed = m3.CrossSection(clean(contours(block)).to_polygons()).area() == pytest.approx(100.0, abs=0.01)
    assert closed == (slit_mm < 2.0 * CLOSING_MM)
    assert 0.05 * profile().process.line_width_mm >= CLOSING_MM


def test_a_level_face_in_a_cutting_plane_belongs_to_the_section_above_it() -> None:
    cap = from_manifold(m3.Manifold.cube((20.0, 20.0, 5.0)).translate((0.0, 0.0, 10.0)))
    cuts, down = np.array([8.0, 10.0, 12.0]), cap.normals[:, 2] < -0.9
    first = next(layer for layer, loops in enumerate(cross_sections(cap, cuts)) if area(loops) > 0.0)
    assert list(faces_by_layer(cap, cuts, down)) == [first] == [2]
