import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cut import cut, mesh_of, solid_of
from mdp.mesh import Floats, Mesh
from mdp.overhang import facing_down, risky_upright, threshold
from mdp.plane import Plane
from mdp.ranking.candidates import Reason, bounds_of, check, plate_disc
from mdp.sweep.sweep import Gains, Remainder, Sweep, gains, sweep
from profiles.profile import load
from tests import shapes
from tests.mdp.solids import area_vectors_above, random_direction, random_solid

STEP_MM = 1.3
FRAGMENT_MM = 1.5
UP = np.array([[0.0, 0.0, 1.0]])
SPHERE = st.tuples(st.integers(1, 999), st.integers(1, 999))  # no nearly level planes: manifold3d snaps them


def _sweep_one(mesh: Mesh, direction: Floats) -> Sweep:
    return sweep(Remainder(mesh, risky_upright(mesh, 45.0)), direction[None], STEP_MM, fragment_mm=FRAGMENT_MM)


def _gains_one(mesh: Mesh, direction: Floats) -> Gains:
    return gains(Remainder(mesh, risky_upright(mesh, 45.0)), direction[None], STEP_MM, threshold(45.0))


def _floating(solid: m3.Manifold) -> int:
    """Pieces off the build plate; manifold3d lists a closed void as a piece of negative volume."""
    return sum(1 for piece in solid.decompose() if piece.bounding_box()[2] > 0.3 and piece.volume() > 0)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), SPHERE)
def test_every_offset_equals_the_exact_cut(seed: int, place: tuple[int, int]) -> None:
    direction, mesh = random_direction(*place), random_solid(seed)
    solid, swept, gained = solid_of(mesh), _sweep_one(mesh, direction), _gains_one(mesh, direction)
    upright, down = risky_upright(mesh, 45.0), facing_down(mesh, direction, 45.0)
    platform_mm = float((mesh.vertices[mesh.vertices[:, 2] <= 0.3] @ direction).max())
    for column in range(seed % 3, swept.columns[0], 3):
        plane = Plane(direction, (swept.first[0] + column) * STEP_MM)
        if np.abs(plane.heights_mm(mesh.vertices)).min() < 1e-6:
            continue  # a face in the plane belongs to either side
        above, below = cut(solid, plane)
        vectors = area_vectors_above(mesh, plane)
        areas = np.linalg.norm(vectors, axis=1)
        assert swept.volume_mm3[0, column] == _near(above.volume(), mesh.volume_mm3)
        assert swept.section_mm2[0, column] == _near((vectors @ direction).sum(), mesh.areas_mm2.sum())
        assert swept.section_mm2[0, column] == _near(_interface_mm2(above, plane), mesh.areas_mm2.sum())
        assert gained.residual_mm2[0, column] == _near(areas[down].sum(), mesh.areas_mm2.sum())
        assert gained.up_mm2[0, column] == _near(areas[upright].sum(), mesh.areas_mm2.sum())
        assert swept.lowest_mm[0, column] == pytest.approx(above.bounding_box()[2], abs=1e-9)
        if plane.offset_mm > platform_mm:
            assert swept.pieces[0, column] == _floating(below)
        if swept.pieces[0, column] == 0:
            assert swept.contact_area_mm2[0, column] == _near(_least_contact_area_mm2(above, plane), mesh.areas_mm2.sum())


def _near(expected: float, scale: float) -> object:
    """Equal to 1e-9 of its value, or to the rounding of the sum of that scale that it was computed from."""
    return pytest.approx(expected, rel=1e-9, abs=1e-12 * scale)


def _interface_mm2(part: m3.Manifold, plane: Plane) -> float:
    """Area of a part's faces in its base plane."""
    mesh = mesh_of(part)
    resting = (np.abs(plane.heights_mm(mesh.vertices)) < 1e-7)[mesh.faces].all(axis=1)
    return float(mesh.areas_mm2[resting].sum())


def _least_contact_area_mm2(part: m3.Manifold, plane: Plane) -> float:
    """Least interface of the pieces at least FRAGMENT_MM high, or the part's if all of them are lower."""
    pieces = [piece for piece in part.decompose() if piece.volume() > 0]
    high = [piece for piece in pieces if plane.heights_mm(mesh_of(piece).vertices).max() >= FRAGMENT_MM]
    return min((_interface_mm2(piece, plane) for piece in high), default=_interface_mm2(part, plane))


@pytest.mark.parametrize("name", ["hollow", "bowl", "tee", "branch", "box"])
def test_voids_and_bowls_are_not_taken_for_floating_pieces(name: str) -> None:
    mesh = getattr(shapes, name)()
    for direction in np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.3, -0.9, 0.31], [1.0, 0.0, 0.0]]):
        direction = direction / np.linalg.norm(direction)
        swept = _sweep_one(mesh, direction)
        planes = [Plane(direction, (swept.first[0] + column) * STEP_MM) for column in range(swept.columns[0])]
        assert swept.pieces[0, : swept.columns[0]].tolist() == [_floating(cut(solid_of(mesh), plane)[1]) for plane in planes]


def test_a_tees_bar_is_risky_upright_and_safe_from_the_side() -> None:
    gained = _gains_one(shapes.tee(), np.array([1.0, 0.0, 0.0]))
    column = int(np.ceil(5.0 / STEP_MM)) - gained.first[0]
    share = (20.0 - (gained.first[0] + column) * STEP_MM) * 10.0
    assert gained.up_mm2[0, column] == pytest.approx(share)
    assert gained.residual_mm2[0, column] == pytest.approx(0.0, abs=1e-9)


def test_offsets_cover_the_whole_range_of_a_direction() -> None:
    swept = sweep(Remainder(shapes.box(), np.zeros(12, bool)), np.array([[0.0, 0.0, 1.0]]), 1.0)
    assert (swept.first[0], swept.columns[0]) == (1, 19)


def test_one_core_and_two_give_the_same_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    directions = np.random.default_rng(3).normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    remainder = Remainder(shapes.branch(), risky_upright(shapes.branch(), 45.0))
    runs = []
    for threads in (1, 2):
        monkeypatch.setattr("mdp.kernels.threads.THREADS", threads)
        runs.append([gains(remainder, directions, 1.0, threshold(45.0)), sweep(remainder, directions, 1.0)])
    for one, two in zip(*runs, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(one, two, strict=True))


def test_the_order_of_faces_and_vertices_in_memory_does_not_matter() -> None:
    mesh, rng = random_solid(3), np.random.default_rng(3)
    order = rng.permutation(len(mesh.vertices))
    number = np.argsort(order).astype(np.int32)
    shuffled = Mesh(mesh.vertices[order], number[mesh.faces][rng.permutation(len(mesh.faces))])
    direction = random_direction(500, 123)
    one, other = _sweep_one(mesh, direction), _sweep_one(shuffled, direction)
    assert np.array_equal(one.pieces, other.pieces)
    assert other.volume_mm3 == pytest.approx(one.volume_mm3, rel=1e-12, abs=1e-9)
    assert other.contact_area_mm2 == pytest.approx(one.contact_area_mm2, rel=1e-12, abs=1e-9)


def test_two_balls_that_touch_in_a_vertex_are_one_piece() -> None:
    """A vertex with two rings of neighbours connects the pieces on it, as in the mesh."""
    top, bottom = shapes.octahedron(5.0), shapes.octahedron(5.0)
    vertices = np.concatenate([bottom.vertices, top.vertices + np.array([0, 0, 10.0])])
    faces = np.concatenate([bottom.faces, top.faces + len(bottom.vertices)])
    lower, upper = int(np.argmax(bottom.vertices[:, 2])), len(bottom.vertices) + int(np.argmin(top.vertices[:, 2]))
    faces[faces == upper] = lower
    keep = np.delete(np.arange(len(vertices)), upper)
    mesh = Mesh(vertices[keep], np.searchsorted(keep, faces).astype(np.int32))
    swept = sweep(_remainder(mesh), UP, STEP_MM)
    assert swept.pieces[0, : swept.columns[0]].tolist() == [0] * 15


def _remainder(mesh: Mesh) -> Remainder:
    return Remainder(mesh, np.zeros(len(mesh.faces), bool))


def _contact_areas(mesh: Mesh, fragment_mm: float = 2.0) -> Floats:
    """Contact areas by offset, 1 mm apart, the first at 1 mm."""
    areas: Floats = sweep(_remainder(mesh), UP, 1.0, fragment_mm=fragment_mm).contact_area_mm2[0]
    return areas


def _two_towers(side: float, height: float) -> Mesh:
    """A block of 10 mm with a tower of 10 x 10 x 20 mm on it and a second one beside it."""
    block, tower = m3.Manifold.cube((40, 20, 10), True).translate((0, 0, 5)), m3.Manifold.cube((10, 10, 20), True)
    second = m3.Manifold.cube((side, side, height), True).translate((12, 0, 10 + height / 2))
    return shapes.standing(block + tower.translate((-10, 0, 20)) + second)


def test_the_thinnest_tower_counts_and_not_the_sum_of_the_sections() -> None:
    assert _contact_areas(_two_towers(1.5, 15))[[4, 14, 26]] == pytest.approx([800.0, 1.5 * 1.5, 100.0])


def test_a_fragment_may_have_a_small_base() -> None:
    mesh = _two_towers(1.5, 5.5)
    assert _contact_areas(mesh)[[11, 13]] == pytest.approx([2.25, 100.0])
    assert _contact_areas(mesh, 0.0)[13] == pytest.approx(2.25)


def test_a_piece_on_two_legs_has_both_as_its_base() -> None:
    legs = m3.Manifold.cube((3, 3, 20)) + m3.Manifold.cube((3, 3, 20)).translate((20, 0, 0))
    table = shapes.standing(legs + m3.Manifold.cube((23, 3, 3)).translate((0, 0, 18)))
    assert _contact_areas(table)[9] == pytest.approx(18.0)


def test_a_closed_void_above_the_plane_is_no_piece() -> None:
    solid = m3.Manifold.cube((20, 20, 20), True) - m3.Manifold.cube((6, 6, 6), True)
    assert _contact_areas(shapes.standing(solid))[[1, 9]] == pytest.approx([400.0, 400.0 - 36.0])


def test_a_part_with_a_piece_on_a_thread_is_refused() -> None:
    profile = load(settings=["search.clearance=false", "search.least_volume_share=0"])
    for side, reason in ((1.5, Reason.INTERFACE), (2.5, Reason.FEASIBLE)):
        mesh = _two_towers(side, 15)
        limits = bounds_of(UP, mesh, profile, plate_disc(mesh, profile.search))
        checked = check(_remainder(mesh), limits, profile.search.offset_step_mm, np.zeros(1, np.int32), np.array([14.0]))
        assert (checked.reason[0], checked.contact_area_mm2[0]) == (reason, pytest.approx(side**2))
