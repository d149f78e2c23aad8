"""Repair of small shapes with one known defect each, checked by closed formulas and by manifold3d."""

from collections.abc import Callable

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.formats import readers
from mdp.formats.surface import Surface
from mdp.mesh import Floats, Mesh
from mdp.model_file import locate
from mdp.repair.repair import repair, resolve_overlap
from mdp.repair.shells import solid_of, surface_of, volume_of
from profiles.errors import MeshError
from tests.checks import assert_closed
from tests.mdp.files import both, inside_out, placed, plus, without
from tests.shapes import ball, bowl, box, branch, from_manifold, hollow, tee


def soup(mesh: Mesh) -> Surface:
    """The mesh as an STL file holds it: every face has three vertices of its own."""
    return Surface(mesh.vertices[mesh.faces.ravel()], np.arange(mesh.faces.size).reshape(-1, 3))


def mended(*meshes: Mesh) -> tuple[Mesh, list[str]]:
    """The repaired solid, which manifold3d accepts with the same volume."""
    surface, notes = repair([soup(mesh) for mesh in meshes])
    mesh = Mesh(surface.vertices, surface.faces.astype(np.int32))
    assert_closed(mesh)
    solid = m3.Manifold(m3.Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))
    assert solid.status() == m3.Error.NoError
    assert solid.volume() == pytest.approx(mesh.volume_mm3)
    assert len(np.unique(mesh.faces)) == len(mesh.vertices)
    return mesh, notes


def refusal(*meshes: Mesh) -> str:
    with pytest.raises(MeshError) as caught:
        repair([soup(mesh) for mesh in meshes])
    return str(caught.value)


@pytest.mark.parametrize("shape", [box, tee, branch, hollow, bowl, ball])
def test_a_sound_shape_comes_back_face_by_face(shape: Callable[[], Mesh]) -> None:
    mesh, notes = mended(shape())
    assert notes == []
    assert np.array_equal(mesh.vertices[mesh.faces], shape().vertices[shape().faces])


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_faces_turned_at_random_are_wound_outwards_again(seed: int) -> None:
    turned = np.random.default_rng(seed).random(len(ball(10, 12).faces)) < 0.4
    faces = np.where(turned[:, None], ball(10, 12).faces[:, ::-1], ball(10, 12).faces)
    mesh, _ = mended(Mesh(ball(10, 12).vertices, faces))
    assert mesh.volume_mm3 == pytest.approx(ball(10, 12).volume_mm3)


def test_a_shell_inside_out_is_turned_with_its_void() -> None:
    mesh, notes = mended(inside_out(hollow()))
    assert mesh.volume_mm3 == pytest.approx(20**3 - 10**3)
    assert notes == ["turned 2 of 2 shells the right side out"]


def test_a_void_stays_and_an_inverted_body_beside_it_is_flipped() -> None:
    mesh, notes = mended(both(hollow(), inside_out(placed(5, 5, 5, (30, 0, 0)))))
    assert mesh.volume_mm3 == pytest.approx(20**3 - 10**3 + 5**3)
    assert notes == ["turned 1 of 3 shells the right side out"]


def test_a_body_wound_outwards_within_another_is_part_of_it() -> None:
    mesh, notes = mended(both(placed(20, 20, 20), placed(5, 5, 5, (5, 5, 5))))
    assert mesh.volume_mm3 == pytest.approx(20**3)
    assert notes == ["united 2 bodies that overlap or touch"]


@settings(max_examples=30, deadline=None)
@given(st.tuples(*[st.floats(-25, 25, width=32)] * 3))
def test_two_boxes_anywhere_enclose_the_volume_of_their_union(shift: tuple[float, float, float]) -> None:
    mesh, _ = mended(both(placed(10, 12, 14), placed(12, 10, 8, shift)))
    overlap = [max(0.0, min(a, s + b) - max(0.0, s)) for a, b, s in zip((10, 12, 14), (12, 10, 8), shift, strict=True)]
    assert mesh.volume_mm3 == pytest.approx(1680 + 960 - np.prod(overlap), rel=1e-6)


def test_bodies_that_stay_apart_keep_their_triangles() -> None:
    mesh, notes = mended(both(placed(10, 10, 10), placed(10, 10, 10, (10.5, 0, 0))))
    assert (len(mesh.faces), notes) == (24, [])


def test_bodies_with_a_common_wall_become_one() -> None:
    mesh, _ = mended(both(placed(10, 10, 10), placed(10, 10, 10, (10, 0, 0))))
    assert mesh.volume_mm3 == pytest.approx(2000)
    assert mesh.areas_mm2.sum() == pytest.approx(1000)


def test_bodies_that_touch_in_an_edge_are_closed_each() -> None:
    mesh, _ = mended(both(placed(10, 10, 10), placed(10, 10, 10, (10, 10, 0))))
    assert mesh.volume_mm3 == pytest.approx(2000)
    assert mesh.areas_mm2.sum() == pytest.approx(1200)


def test_an_edge_of_four_connected_faces_gets_its_own_vertex() -> None:
    arch = m3.Manifold.cube((30, 10, 10)) + m3.Manifold.cube((10, 10, 20)) + m3.Manifold.cube((10, 10, 20)).translate((20, 0, 0))
    touching = (
        arch + m3.Manifold.cube((10, 10, 10)).translate((10, 0, 20)) + m3.Manifold.cube((10, 10, 30)).translate((10, 10, 0))
    )
    mesh, _ = mended(from_manifold(touching))
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1].tolist()) == {2}
    assert mesh.volume_mm3 == pytest.approx(3000 + 2000 + 1000 + 3000)


def test_objects_of_a_file_that_are_open_each_close_together() -> None:
    lower, upper = without(box(), *range(6, 12)), without(box(), *range(6))
    mesh, notes = mended(lower, upper)
    assert (mesh.volume_mm3, notes) == (pytest.approx(8000), [])


def test_every_face_three_times_is_there_once() -> None:
    mesh, notes = mended(plus(plus(box(), box().faces), box().faces))
    assert (mesh.volume_mm3, len(mesh.faces), notes) == (pytest.approx(8000), 12, ["left out 24 duplicate faces"])


def test_every_face_for_both_sides_is_a_solid() -> None:
    mesh, notes = mended(plus(tee(), tee().faces[:, ::-1]))
    assert mesh.volume_mm3 == pytest.approx(tee().volume_mm3)
    assert notes[0] == f"left out {len(tee().faces)} duplicate faces"


def test_a_double_sided_sheet_is_left_out() -> None:
    corners = placed(4, 4, 4, (8, 8, 8)).vertices[:3]
    mesh, notes = mended(both(placed(20, 20, 20), Mesh(corners, np.array([[0, 1, 2], [2, 1, 0]]))))
    assert (mesh.volume_mm3, notes) == (pytest.approx(8000), ["left out 2 duplicate faces"])


def test_a_fin_on_an_edge_is_left_out() -> None:
    vertices = np.concatenate([box().vertices, [[0.0, 0.0, 18.0]]])
    edge = box().faces[0, :2].tolist()
    mesh, notes = mended(Mesh(vertices, np.concatenate([box().faces, [[*edge, 8]]])))
    assert mesh.volume_mm3 == pytest.approx(8000)
    assert notes == ["left out 1 face of loose sheets"]


def test_a_wall_across_the_inside_is_left_out() -> None:
    halves = both(placed(10, 10, 10), placed(10, 10, 10, (10, 0, 0)))
    wall = [k for k, face in enumerate(halves.vertices[halves.faces]) if (face[:, 0] == 10).all()]
    mesh, notes = mended(without(halves, *wall[:2]))
    assert mesh.volume_mm3 == pytest.approx(2000)
    assert notes[0] == "left out 2 faces of loose sheets"


def test_a_missing_facet_is_filled_and_reported() -> None:
    mesh, notes = mended(without(ball(), 17))
    assert mesh.volume_mm3 == pytest.approx(ball().volume_mm3)
    assert notes[0].startswith("filled 1 small hole (longest rim ")


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_small_holes_change_the_volume_by_next_to_nothing(seed: int) -> None:
    gone = np.random.default_rng(seed).choice(len(ball().faces), 12, replace=False)
    mesh, _ = mended(without(ball(), *gone))
    assert mesh.volume_mm3 == pytest.approx(ball().volume_mm3, rel=5e-3)


def test_an_open_cup_is_refused_with_the_count_and_a_place() -> None:
    lid = [k for k, face in enumerate(box().vertices[box().faces]) if (face[:, 2] == 20).all()]
    sentence = refusal(without(box(), *lid))
    assert "4 open edges around 1 hole, one with a 80 mm rim through (" in sentence
    assert ", 20)" in sentence


def test_a_cylinder_without_its_lids_is_refused() -> None:
    tube = from_manifold(m3.Manifold.cylinder(100, 5, 5, 64))
    lids = [k for k, face in enumerate(tube.vertices[tube.faces]) if np.ptp(face[:, 2]) == 0]
    assert "128 open edges around 2 holes" in refusal(without(tube, *lids))


def test_triangles_without_neighbours_are_refused() -> None:
    scattered = np.random.default_rng(1).random((100, 3, 3)).reshape(-1, 3) * 10
    assert "300 open edges around 100 holes" in refusal(Mesh(scattered, np.arange(300).reshape(-1, 3)))


def test_a_one_sided_surface_is_refused() -> None:
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    arm = np.stack([np.cos(turn / 2) * np.cos(turn), np.cos(turn / 2) * np.sin(turn), np.sin(turn / 2)], axis=1)
    middle = 10 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    vertices = np.concatenate([middle - arm, middle + arm])
    quads = [(k, (k + 1) % 24 + (24 if k == 23 else 0), k + 24, (k + 1) % 24 + (0 if k == 23 else 24)) for k in range(24)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (b, d, c))]
    assert "is not orientable: 48 faces form a one-sided sheet" in refusal(Mesh(vertices, np.array(faces)))


def test_flat_faces_enclose_no_volume() -> None:
    flat = Mesh(box().vertices * [1, 1, 0], box().faces)
    assert "encloses no volume: its faces lie in one plane or on each other; give it a thickness" in refusal(flat)
    sheet = placed(20, 0.5, 20)
    doubled = Mesh(sheet.vertices[:3], np.array([[0, 1, 2], [2, 1, 0]]))
    assert "give it a thickness" in refusal(doubled)
    assert "lie in one point (0, 0, 0)" in refusal(Mesh(box().vertices * 0, box().faces))


def test_a_gap_as_wide_as_rounding_is_closed_but_a_wide_one_is_not() -> None:
    surface = soup(ball())
    shaken = Surface(surface.vertices + np.random.default_rng(2).uniform(-2e-5, 2e-5, surface.vertices.shape), surface.faces)
    solid, notes = repair([shaken])
    assert len(solid.faces) == len(ball().faces)
    assert "merged" in notes[0]
    with pytest.raises(MeshError, match="is not closed"):
        repair([Surface(surface.vertices + np.random.default_rng(2).uniform(-0.2, 0.2, surface.vertices.shape), surface.faces)])


@pytest.mark.parametrize("lean_deg", [0, 37, 90])
def test_a_body_that_passes_through_itself_counts_once(lean_deg: int) -> None:
    ring = m3.Manifold.extrude(m3.CrossSection.square((10, 10)), 180).refine(36)

    def bent(points: Floats) -> Floats:  # once and a quarter around: the last quarter overlaps the first
        turn = points[:, 2] * np.radians(450) / 180
        radius = 10 + points[:, 0]
        return np.stack([radius * np.cos(turn), radius * np.sin(turn), -points[:, 1]], axis=1)

    mesh, notes = mended(from_manifold(ring.warp_batch(bent).rotate((lean_deg, 0, 0))))
    assert mesh.volume_mm3 == pytest.approx(np.pi * (20**2 - 10**2) * 10, rel=0.02)
    assert notes[0].startswith("resolved a self-intersecting body")


def test_a_speck_is_left_out() -> None:
    mesh, notes = mended(both(placed(20, 20, 20), placed(0.01, 0.01, 0.01, (20.05, 5, 5))))
    assert (mesh.volume_mm3, notes) == (pytest.approx(8000), ["left out 1 shell with next to no volume"])


def test_a_repair_that_would_shrink_the_bounding_box_is_refused() -> None:
    far = placed(0.01, 0.01, 0.01, (5, 5, 40))
    assert "lacks 20 mm of its extent of 40" in refusal(both(placed(20, 20, 20), far))


def test_unused_vertices_are_dropped_and_the_order_of_the_others_stays() -> None:
    vertices = np.concatenate([[[500.0, 0, 0]], tee().vertices])
    solid, notes = repair([Surface(vertices, tee().faces.astype(np.int64) + 1)])
    assert (len(solid.vertices), notes) == (len(tee().vertices), [])


@pytest.mark.parametrize(("grid", "change_percent"), [(78, "-0.05"), (22, "+0.696")])
def test_folds_of_a_coarsely_rounded_model_are_removed_and_reported(grid: int, change_percent: str) -> None:
    fine = readers.READERS[".ply"](locate("demo:lattice"), None).objects[0].volumes[0][0]
    step_mm = np.ptp(fine.vertices, axis=0).max() / grid
    surface, notes = repair([Surface(np.round(fine.vertices / step_mm) * step_mm, fine.faces)])
    read_back = surface_of(solid_of(surface))
    assert volume_of(read_back) == pytest.approx(volume_of(surface), rel=1e-5)
    assert notes[-1].startswith("left out folds where more than two faces share an edge")
    assert change_percent in notes[-1]


def test_a_model_rounded_to_another_shape_is_refused_with_what_to_do() -> None:
    fine = readers.READERS[".ply"](locate("demo:lattice"), None).objects[0].volumes[0][0]
    step_mm = np.ptp(fine.vertices, axis=0).max() / 18
    with pytest.raises(
        MeshError, match=r"enclose 7530 mm³.* the closest valid solid has 7660 mm³.*make it manifold in another program first"
    ):
        repair([Surface(np.round(fine.vertices / step_mm) * step_mm, fine.faces)])


def test_a_body_tangled_everywhere_is_given_up_before_its_union_fills_the_memory() -> None:
    mesh = m3.Manifold.sphere(10.0, 48).to_mesh()
    vertices = np.random.default_rng(0).permutation(np.array(mesh.vert_properties[:, :3], float))
    assert resolve_overlap(m3.Manifold(m3.Mesh64(vertices, np.array(mesh.tri_verts, np.uint64)))) is None


def test_a_body_that_does_not_pass_through_itself_stays() -> None:
    block = m3.Manifold.cube((10.0, 20.0, 30.0))
    resolved = resolve_overlap(block)
    assert resolved is not None
    assert (resolved.num_tri(), resolved.volume()) == (12, 6000.0)
