import manifold3d as m3
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mdp.cut import cut, mesh_of, solid_of
from mdp.mesh import Floats, Mesh
from mdp.overhang import facing_down, risky_upright, threshold
from mdp.plane import Plane
from mdp.sweep.limbs import LimbGrid, find_limbs, limb_faces, limb_reach, sum_limbs
from mdp.sweep.sweep import Remainder
from tests import shapes
from tests.mdp.solids import area_vectors_above, random_direction, random_solid

ANGLE_DEG, STEP_MM = 45.0, 1.3
SPHERE = st.tuples(st.integers(1, 999), st.integers(1, 999))


def _remainder(mesh: Mesh) -> Remainder:
    return Remainder(mesh, risky_upright(mesh, ANGLE_DEG))


def _grid(directions: Floats, least_gain_mm2: float = 1.0, keep_mm: Floats | None = None) -> LimbGrid:
    """A grid without restrictions: seams and cuts cost nothing, no limb is too small."""
    count = len(directions)
    return LimbGrid(
        directions=directions,
        step_mm=STEP_MM,
        least_height_mm=np.full(count, -1e9),
        keep_mm=np.zeros((count, 0, 2)) if keep_mm is None else keep_mm,
        seam_mm=0.0,
        cut_mm2=0.0,
        least_gain_mm2=least_gain_mm2,
        least_volume_mm3=0.0,
        least_interface_mm2=1e-6,
        fragment=0.0,
    )


def _found(mesh: Mesh, direction: Floats) -> tuple[Remainder, list[Plane]]:
    """A solid and the planes of limbs with any gain along a direction."""
    remainder = _remainder(mesh)
    found = find_limbs(remainder, _grid(direction[None]), threshold(ANGLE_DEG))
    vertices = remainder.facets.mesh.vertices
    rows = zip(found.offset_mm, found.tops, strict=True)
    return remainder, [Plane(direction, float(offset), vertices[tops[tops >= 0]]) for offset, tops in rows]


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), SPHERE)
def test_forecasts_of_limbs_equal_measurements_of_the_cut_pieces(seed: int, place: tuple[int, int]) -> None:
    mesh, direction = random_solid(seed), random_direction(*place)
    remainder, planes = _found(mesh, direction)
    assume(planes)
    sums, solid = sum_limbs(remainder, planes, threshold(ANGLE_DEG), 0.0), solid_of(mesh)
    for row, plane in enumerate(planes):
        if np.abs(plane.heights_mm(mesh.vertices)).min() < 1e-6:
            continue  # a face in the plane belongs to either side
        limbs, rest = cut(solid, plane)
        piece = mesh_of(limbs)
        vectors = area_vectors_above(piece, Plane(direction, plane.offset_mm - 1.0))
        areas = np.linalg.norm(vectors, axis=1)
        base = np.all(plane.heights_mm(piece.vertices)[piece.faces] < 1e-7, axis=1)
        down = facing_down(piece, direction, ANGLE_DEG) & ~base
        assert limbs.volume() + rest.volume() == pytest.approx(solid.volume(), rel=1e-9)
        assert sums.volume_mm3[row] == pytest.approx(limbs.volume(), abs=1e-6 * mesh.volume_mm3)
        if len(limbs.decompose()) == 1:
            assert sums.contact_mm2[row] == pytest.approx(areas[base].sum(), abs=1e-6 * mesh.areas_mm2.sum())
        assert sums.residual_mm2[row] == pytest.approx(areas[down].sum(), abs=1e-6 * mesh.areas_mm2.sum())
        assert sums.lowest_mm[row] == pytest.approx(piece.vertices[:, 2].min(), abs=1e-6)
        assert not sums.alone[row]


def two_posts() -> Mesh:
    """A plate with two posts, 20 and 30 mm high, each with a bar on top: it overhangs by 10 x 4 mm2 on either side."""
    posts = [m3.Manifold.cube((4, 4, high), True).translate((x, 0, high / 2)) for x, high in ((-15, 20), (15, 30))]
    bars = [m3.Manifold.cube((24, 4, 4), True).translate((x, 0, high - 2)) for x, high in ((-15, 20), (15, 30))]
    solid = m3.Manifold.cube((60, 20, 2), True).translate((0, 0, 1))
    return shapes.standing(solid + posts[0] + posts[1] + bars[0] + bars[1])


def test_each_post_is_a_separate_limb() -> None:
    mesh = two_posts()
    left = Plane(np.array([0.0, 0.0, 1.0]), 10.0, np.array([[-27.0, -2.0, 20.0]]))
    limbs, rest = cut(solid_of(mesh), left)
    assert limbs.volume() == pytest.approx(4 * 4 * 6 + 24 * 4 * 4)
    assert rest.volume() == pytest.approx(mesh.volume_mm3 - limbs.volume())
    assert len(rest.decompose()) == 1


def test_a_void_belongs_to_the_limb_around_it() -> None:
    hollow = shapes.standing(
        m3.Manifold.cube((60, 20, 2), True).translate((0, 0, 1))
        + m3.Manifold.cube((10, 10, 30), True).translate((-20, 0, 15))
        + m3.Manifold.cube((10, 10, 30), True).translate((20, 0, 15))
        - m3.Manifold.cube((6, 6, 6), True).translate((20, 0, 20))
    )
    plane = Plane(np.array([0.0, 0.0, 1.0]), 10.0, np.array([[15.0, -5.0, 30.0]]))
    limbs, _ = cut(solid_of(hollow), plane)
    assert limbs.volume() == pytest.approx(10 * 10 * 20 - 6**3)
    assert sum_limbs(_remainder(hollow), [plane], threshold(ANGLE_DEG), 0.0).volume_mm3[0] == pytest.approx(limbs.volume())


def test_a_plane_reaches_its_limb_and_faces_below_it_but_not_the_other_limb() -> None:
    mesh, plane = two_posts(), Plane(np.array([0.0, 0.0, 1.0]), 10.0, np.array([[-27.0, -2.0, 20.0]]))
    remainder = _remainder(mesh)
    cut_off, reached = limb_faces(remainder, plane), limb_reach(remainder, plane)
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    assert middles[cut_off, 0].max() < 0.0
    assert not (reached & (middles[:, 0] > 0.0) & (middles[:, 2] > 2.0)).any()
    assert (reached | ~cut_off).all()


def test_planes_that_pass_through_a_zone_offer_no_limb() -> None:
    up = np.array([[0.0, 0.0, 1.0]])
    keep_mm = np.array([[[-100.0, 100.0]]])
    free, kept = (find_limbs(_remainder(two_posts()), _grid(up, -100.0, zone), threshold(ANGLE_DEG)) for zone in (None, keep_mm))
    assert len(free.offset_mm) > 0
    assert len(kept.offset_mm) == 0
