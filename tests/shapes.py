"""Named small shapes for tests."""

import manifold3d as m3
import numpy as np

from mdp.mesh import Mesh


def from_manifold(solid: m3.Manifold) -> Mesh:
    """The mesh of a manifold3d solid."""
    mesh = solid.to_mesh64()
    return Mesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def standing(solid: m3.Manifold) -> Mesh:
    """The solid moved onto z = 0 and centred about the z axis."""
    x0, y0, z0, x1, y1, _ = solid.bounding_box()
    return from_manifold(solid.translate((-(x0 + x1) / 2, -(y0 + y1) / 2, -z0)))


def box(x: float = 20.0, y: float = 20.0, z: float = 20.0) -> Mesh:
    """A box on the build plate."""
    return standing(m3.Manifold.cube((x, y, z)))


def tee(stem: float = 10.0, arm: float = 40.0, height: float = 40.0) -> Mesh:
    """A T: a square stem and a bar across its top; the bar's undersides need support when printed straight up."""
    bar = m3.Manifold.cube((arm, stem, stem), True).translate((0, 0, height - stem / 2))
    return standing(m3.Manifold.cube((stem, stem, height), True).translate((0, 0, height / 2)) + bar)


def branch(tilt_deg: float = 60.0) -> Mesh:
    """A vertical post with one round arm leaning by tilt_deg from upright towards +x."""
    arm = m3.Manifold.cylinder(35, 5, 5, 48).rotate((0, tilt_deg, 0)).translate((0, 0, 25))
    return standing(m3.Manifold.cylinder(40, 8, 8, 48) + arm)


def hollow() -> Mesh:
    """A 20 mm cube with a closed 10 mm cubic void inside."""
    return standing(m3.Manifold.cube((20, 20, 20), True) - m3.Manifold.cube((10, 10, 10), True))


def hollow_tee() -> Mesh:
    """The tee with a closed 4 mm cubic void in each arm."""
    solid = m3.Manifold.cube((10, 10, 40), True).translate((0, 0, 20)) + m3.Manifold.cube((40, 10, 10), True).translate(
        (0, 0, 35)
    )
    voids = [m3.Manifold.cube((4, 4, 4), True).translate((x, 0, 35)) for x in (-14, 14)]
    return standing(solid - voids[0] - voids[1])


def bowl() -> Mesh:
    """A cup: its inner floor is a local minimum of the surface with solid beneath."""
    return standing(m3.Manifold.cylinder(20, 15, 15, 48) - m3.Manifold.cylinder(20, 12, 12, 48).translate((0, 0, 4)))


def ball(radius: float = 10.0, segments: int = 48) -> Mesh:
    """A sphere touching the build plate in one point."""
    return standing(m3.Manifold.sphere(radius, segments))


def octahedron(radius: float = 5.0) -> Mesh:
    """A double pyramid standing on its tip."""
    points = [(radius, 0, 0), (0, radius, 0), (-radius, 0, 0), (0, -radius, 0), (0, 0, radius), (0, 0, -radius)]
    return standing(m3.Manifold.hull_points(points))


def bar_beside_a_tower(gap: float = 12.0) -> Mesh:
    """A plate with a post that carries a bar, 41 mm long, over it, and a taller tower at a distance beside the bar."""
    plate = m3.Manifold.cube((80, 80, 4)).translate((-40, -40, 0))
    post = m3.Manifold.cube((12, 12, 60)).translate((-25, -6, 0))
    bar = m3.Manifold.cube((41, 12, 12)).translate((-14, -6, 48))
    return from_manifold(plate + post + bar + m3.Manifold.cube((12, 12, 75)).translate((-6, 6 + gap, 0)))
