"""Random solids for property tests, and the solid above a plane computed face by face."""

from itertools import pairwise

import manifold3d as m3
import numpy as np

from mdp.cut import mesh_of
from mdp.mesh import Floats, Mesh
from mdp.plane import Plane


def random_solid(seed: int) -> Mesh:
    """Random overlapping boxes and balls on a base plate, drilled and hollowed: bowls, handles and closed voids appear."""
    rng = np.random.default_rng(seed)
    solid = m3.Manifold.cube((30, 30, 3), True).translate((0, 0, 1.5))
    for k in range(6):
        piece = m3.Manifold.sphere(rng.uniform(3, 8), 16) if k % 2 else m3.Manifold.cube(tuple(rng.uniform(3, 16, 3)), True)
        piece = piece.rotate(tuple(rng.uniform(0, 90, 3))).translate(tuple(rng.uniform((-9, -9, 2), (9, 9, 18))))
        solid = solid - piece if k == 5 else solid + piece
    for _ in range(int(rng.integers(0, 3))):
        drill = m3.Manifold.cylinder(60, 1.2, 1.2, 8, True).rotate(tuple(rng.uniform(0, 180, 3)))
        solid = solid - drill.translate(tuple(rng.uniform((-6, -6, 4), (6, 6, 14))))
    for _ in range(int(rng.integers(0, 4))):
        solid = solid - m3.Manifold.sphere(rng.uniform(0.8, 2.5), 10).translate(tuple(rng.uniform((-6, -6, 2), (6, 6, 14))))
    pieces = solid.decompose()
    whole = max(pieces, key=lambda piece: piece.volume())
    for void in (piece for piece in pieces if piece.volume() < 0):
        whole = whole - m3.Manifold.hull(void)
    return mesh_of(whole.translate((0, 0, -whole.bounding_box()[2])))


def random_direction(height: int, around: int) -> Floats:
    """A unit direction from two integers of 1 to 999: its z and its azimuth in thousandths."""
    z, angle = height / 1000.0, around / 1000.0 * 2.0 * np.pi
    return np.array([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z])


def area_vectors_above(mesh: Mesh, plane: Plane) -> Floats:
    """(m, 3) area times normal of the part of each face above the plane, each face clipped corner by corner."""
    vectors = np.zeros((len(mesh.faces), 3))
    for f, corners in enumerate(mesh.vertices[mesh.faces]):
        heights = plane.heights_mm(corners)
        polygon = []
        for k in range(3):
            a, b, low, high = corners[k], corners[(k + 1) % 3], heights[k], heights[(k + 1) % 3]
            if low > 0:
                polygon.append(a)
            if (low > 0) != (high > 0):
                polygon.append(a + (b - a) * (low / (low - high)))
        for p, q in pairwise(polygon[1:]):
            vectors[f] += 0.5 * np.cross(p - polygon[0], q - polygon[0])
    return vectors
