"""Overlap: a body that passes through itself counts the shared space twice."""

from typing import TYPE_CHECKING

import numpy as np

from mdp.mesh import Floats

if TYPE_CHECKING:
    import manifold3d as m3

SECTIONS = 23  # an overlap missed by all of them reaches over less than a 24th of the height
EXCESS = 1e-3  # of the area of all sections; folds of less are left alone, since mending them would re-triangulate the model
DEEPEST, TOGETHER = 5, 8  # halvings, and pieces that are united at once
LEAST_MOST, MOST_GROWTH = 1000, 2  # faces that a union may have, and for each face of its pieces


def overlaps_itself(solid: "m3.Manifold") -> bool:
    """Whether the horizontal sections of the solid have less area than their outlines wind around."""
    mesh = solid.to_mesh64()
    vertices, faces = np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64)
    _, _, low, _, _, high = solid.bounding_box()
    # Odd fractions of the height, since models are made in steps that even ones would hit.
    heights = (low + (np.arange(1, SECTIONS + 1) - 0.0137) * (high - low) / (SECTIONS + 1)).tolist()
    wound = sum(section_area(vertices, faces, height) for height in heights)
    return bool(wound - sum(solid.slice(height).area() for height in heights) > EXCESS * wound)


def section_area(vertices: Floats, faces: np.ndarray[tuple[int, int], np.dtype[np.int64]], height: float) -> float:
    """Area of a section at a height, every region as often as the outline winds around it: Green's theorem over the cut faces."""
    above = vertices[:, 2] > height
    sides = above[faces]
    cut = faces[sides.any(axis=1) & ~sides.all(axis=1)]
    origin = vertices.mean(axis=0)[:2]
    ends: list[Floats] = []
    for rising in (False, True):
        point = np.zeros((len(cut), 2))
        for k in range(3):
            p, q = cut[:, k], cut[:, (k + 1) % 3]
            here = (above[q] if rising else above[p]) & ~(above[p] if rising else above[q])
            run = ((height - vertices[p, 2]) / np.where(here, vertices[q, 2] - vertices[p, 2], 1.0))[:, None]
            point = np.where(here[:, None], vertices[p, :2] + run * (vertices[q, :2] - vertices[p, :2]) - origin, point)
        ends.append(point)
    start, end = ends
    return abs(0.5 * float((start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]).sum()))


def resolve_overlap(solid: "m3.Manifold") -> "m3.Manifold | None":
    """The solid with every point counted once; None for one so tangled that its union would have many times its faces.

    Halved across its longest side until no piece overlaps itself: pieces that were one body far along the surface
    are bodies of their own then, and their union counts nothing twice.
    """
    return _united(solid, 0)


def _united(solid: "m3.Manifold", depth: int) -> "m3.Manifold | None":
    import manifold3d as m3

    whole: list[m3.Manifold] = []
    for piece in solid.decompose():
        if depth == DEEPEST or not overlaps_itself(piece):
            whole.append(piece)
            continue
        box = np.array(piece.bounding_box()).reshape(2, 3)
        normal = np.eye(3)[np.argmax(box[1] - box[0])]
        for half in piece.split_by_plane(tuple(normal), float(normal @ box.mean(axis=0))):
            resolved = _united(half, depth + 1)
            if resolved is None:
                return None
            whole.append(resolved)
    most = LEAST_MOST + MOST_GROWTH * sum(piece.num_tri() for piece in whole)
    while len(whole) > 1:  # few at a time: the union of what crosses everywhere is noticed before it fills the memory
        whole = [m3.Manifold.batch_boolean(whole[k : k + TOGETHER], m3.OpType.Add) for k in range(0, len(whole), TOGETHER)]
        if sum(piece.num_tri() for piece in whole) > most:
            return None
    return whole[0] if whole else m3.Manifold()
