"""Other triangulations of a shape: edges and faces split, diagonals of flat quadrilaterals flipped, all edges short."""

import manifold3d as m3
import numpy as np

from mdp.mesh import Floats, Mesh
from tests.shapes import from_manifold

FLAT = 1.0 - 1e-9  # cosine of the normals of two faces in one plane
LEAST_MM2 = 1e-3  # twice the least area of a face made by a flip

Face = tuple[int, int, int]


def refined(mesh: Mesh, length_mm: float) -> Mesh:
    """A mesh refined until no edge is longer than length_mm."""
    solid = m3.Manifold(m3.Mesh64(mesh.vertices.copy(), mesh.faces.astype(np.uint64)))
    return from_manifold(solid.refine_to_length(length_mm))


def edited(mesh: Mesh, seed: int, edits: int) -> Mesh:
    """A number of random edits, each a split face, a split edge or a flipped diagonal; faces in random order."""
    random = np.random.default_rng(seed)
    vertices, faces = list(mesh.vertices), [(int(a), int(b), int(c)) for a, b, c in mesh.faces]
    for _ in range(edits):
        f, corner, kind = int(random.integers(len(faces))), int(random.integers(3)), int(random.integers(3))
        if kind == 0:
            _split_face(vertices, faces, f, random.dirichlet((2.0, 2.0, 2.0)))
        elif kind == 1:
            _split_edge(vertices, faces, f, corner, float(random.uniform(0.1, 0.9)))
        else:
            _flip_edge(vertices, faces, f, corner)
    return Mesh(np.array(vertices), np.array(faces, np.int32)[random.permutation(len(faces))])


def _split_face(vertices: list[Floats], faces: list[Face], f: int, weights: Floats) -> None:
    a, b, c = faces[f]
    vertices.append(weights[0] * vertices[a] + weights[1] * vertices[b] + weights[2] * vertices[c])
    new = len(vertices) - 1
    faces[f] = (a, b, new)
    faces += [(b, c, new), (c, a, new)]


def _split_edge(vertices: list[Floats], faces: list[Face], f: int, corner: int, share: float) -> None:
    g, (a, b, c, d) = _quadrangle(faces, f, corner)
    vertices.append((1.0 - share) * vertices[a] + share * vertices[b])
    new = len(vertices) - 1
    faces[f], faces[g] = (a, new, c), (b, new, d)
    faces += [(new, b, c), (new, a, d)]


def _flip_edge(vertices: list[Floats], faces: list[Face], f: int, corner: int) -> None:
    """Flip the edge if its two faces form a flat and convex quadrilateral."""
    g, (a, b, c, d) = _quadrangle(faces, f, corner)
    normals = [
        np.cross(vertices[q] - vertices[p], vertices[r] - vertices[p]) for p, q, r in ((a, b, c), (b, a, d), (c, a, d), (d, b, c))
    ]
    sizes = [float(np.linalg.norm(normal)) for normal in normals]
    if min(sizes) > LEAST_MM2 and all(normals[0] @ n > FLAT * sizes[0] * size for n, size in zip(normals, sizes, strict=True)):
        faces[f], faces[g] = (c, a, d), (d, b, c)


def _quadrangle(faces: list[Face], f: int, corner: int) -> tuple[int, tuple[int, int, int, int]]:
    """The face beyond an edge; the ends of the edge and the opposite corners in both faces."""
    a, b, c = (faces[f][(corner + k) % 3] for k in range(3))
    g = next(g for g, face in enumerate(faces) if (b, a) in zip(face, (*face[1:], face[0]), strict=True))
    return g, (a, b, c, next(v for v in faces[g] if v not in (a, b)))
