import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.cut import cut, mesh_of, solid_of
from mdp.mesh import Floats, Mesh
from mdp.overhang import facing_down, risky_upright, threshold
from mdp.plane import Plane
from mdp.sweep import Gains, Remainder, Sweep, gains, sweep
from tests import shapes

STEP_MM = 1.3
SPHERE = st.tuples(st.integers(1, 999), st.integers(1, 999))  # no nearly level planes: manifold3d snaps them


def _sweep_one(mesh: Mesh, direction: Floats) -> Sweep:
    return sweep(Remainder(mesh, risky_upright(mesh, 45.0)), direction[None], STEP_MM)


def _gains_one(mesh: Mesh, direction: Floats) -> Gains:
    return gains(Remainder(mesh, risky_upright(mesh, 45.0)), direction[None], STEP_MM, threshold(45.0))


def _direction(height: int, around: int) -> Floats:
    z, angle = height / 1000.0, around / 1000.0 * 2.0 * np.pi
    return np.array([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])


def _floating(solid: m3.Manifold) -> int:
    """Pieces off the platform; manifold3d lists a closed void as a piece of negative volume."""
    return sum(1 for piece in solid.decompose() if piece.bounding_box()[2] > 0.3 and piece.volume() > 0)


def _random_solid(seed: int) -> Mesh:
    """Overlapping random boxes and balls on a base plate, some of them cut out: bowls, handles and voids appear."""
    rng = np.random.default_rng(seed)
    solid = m3.Manifold.cube((30, 30, 3), True).translate((0, 0, 1.5))
    for k in range(6):
        piece = m3.Manifold.sphere(rng.uniform(3, 8), 16) if k % 2 else m3.Manifold.cube(tuple(rng.uniform(3, 16, 3)), True)
        piece = piece.rotate(tuple(rng.uniform(0, 90, 3))).translate(tuple(rng.uniform((-9, -9, 2), (9, 9, 18))))
        solid = solid - piece if k == 5 else solid + piece
    biggest = max(solid.decompose(), key=lambda piece: piece.volume())
    return mesh_of(biggest.translate((0, 0, -biggest.bounding_box()[2])))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), SPHERE)
def test_every_offset_equals_the_exact_cut(seed: int, place: tuple[int, int]) -> None:
    direction = _direction(*place)
    mesh = _random_solid(seed)
    solid, swept, gained = solid_of(mesh), _sweep_one(mesh, direction), _gains_one(mesh, direction)
    platform_mm = float((mesh.vertices[mesh.vertices[:, 2] <= 0.3] @ direction).max())
    for column in range(swept.count[0]):
        plane = Plane(direction, (swept.first[0] + column) * STEP_MM)
        if np.abs(plane.heights_mm(mesh.vertices)).min() < 1e-6:
            continue  # a face in the plane belongs to either side
        above, below = cut(solid, plane)
        part = mesh_of(above)
        surface = ~(np.abs(plane.heights_mm(part.vertices)) < 1e-7)[part.faces].all(axis=1)
        down = facing_down(part, direction, 45.0) & surface
        assert swept.volume_mm3[0, column] == pytest.approx(above.volume(), abs=1e-9 * mesh.volume_mm3)
        assert swept.section_mm2[0, column] == pytest.approx(part.areas_mm2[~surface].sum(), abs=1e-7 * mesh.areas_mm2.sum())
        assert gained.residual_mm2[0, column] == pytest.approx(part.areas_mm2[down].sum(), abs=1e-7 * mesh.areas_mm2.sum())
        assert swept.lowest_mm[0, column] == pytest.approx(part.bounds_mm[0, 2], abs=1e-9)
        if plane.offset_mm > platform_mm:
            assert swept.pieces[0, column] == _floating(below)


@pytest.mark.parametrize("name", ["hollow", "bowl", "tee", "branch", "box"])
def test_voids_and_bowls_are_not_taken_for_floating_pieces(name: str) -> None:
    mesh = getattr(shapes, name)()
    for direction in np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.3, -0.9, 0.31], [1.0, 0.0, 0.0]]):
        direction = direction / np.linalg.norm(direction)
        swept = _sweep_one(mesh, direction)
        planes = [Plane(direction, (swept.first[0] + column) * STEP_MM) for column in range(swept.count[0])]
        assert swept.pieces[0, : swept.count[0]].tolist() == [_floating(cut(solid_of(mesh), plane)[1]) for plane in planes]


def test_a_tees_bar_is_risky_upright_and_safe_from_the_side() -> None:
    gained = _gains_one(shapes.tee(), np.array([1.0, 0.0, 0.0]))
    column = int(np.ceil(5.0 / STEP_MM)) - gained.first[0]
    share = (20.0 - (gained.first[0] + column) * STEP_MM) * 10.0
    assert gained.up_mm2[0, column] == pytest.approx(share)
    assert gained.residual_mm2[0, column] == pytest.approx(0.0, abs=1e-9)


def test_offsets_cover_the_whole_range_of_a_direction() -> None:
    swept = sweep(Remainder(shapes.box(), np.zeros(12, bool)), np.array([[0.0, 0.0, 1.0]]), 1.0)
    assert (swept.first[0], swept.count[0]) == (1, 19)


def test_one_core_and_two_give_the_same_numbers() -> None:
    import numba

    mesh = shapes.branch()
    directions = np.random.default_rng(3).normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    remainder = Remainder(mesh, risky_upright(mesh, 45.0))
    many = [gains(remainder, directions, 1.0, threshold(45.0)), sweep(remainder, directions, 1.0)]
    numba.set_num_threads(1)
    try:
        one = [gains(remainder, directions, 1.0, threshold(45.0)), sweep(remainder, directions, 1.0)]
    finally:
        numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    for a, b in zip(many, one, strict=True):
        assert all(np.array_equal(vars(a)[key], vars(b)[key]) for key in vars(a))
