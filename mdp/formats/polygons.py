"""Polygons of a file as triangles, without crossing their own outline."""

from pathlib import Path

import numpy as np

from mdp.loop import fan_is_sound, filled
from mdp.mesh import Floats
from mdp.surface import Indices
from profiles.errors import MeshError


def triangulated(path: Path, vertices: Floats, polygons: list[list[int]] | Indices) -> Indices:
    """(m, 3) triangles in the order of the polygons; raises MeshError for too few corners and an index out of range.

    A convex polygon becomes a fan about its first corner, any other the triangulation of least area.
    """
    if isinstance(polygons, np.ndarray):
        return polygons
    if not polygons:
        return np.zeros((0, 3), dtype=np.int64)
    sizes = np.array([len(polygon) for polygon in polygons])
    if (sizes == 3).all():
        return np.array(polygons, dtype=np.int64)
    triangles: list[Indices] = []
    for number, polygon in enumerate(polygons, 1):
        corners = np.array(polygon, dtype=np.int64)
        if len(corners) < 3:
            raise MeshError(f"{path}: face {number} of {len(polygons)} has {len(corners)} corners, at least 3 are needed")
        if corners.min() < 0 or corners.max() >= len(vertices):
            raise MeshError(f"{path}: face {number} names vertex {corners.max()} (counted from 0) of {len(vertices)} vertices")
        if len(corners) == 3:
            triangles.append(corners[None])
            continue
        points = vertices[corners]
        local = fan(len(corners)) if fan_is_sound(points) else filled(points)
        triangles.append(corners[local])
    return np.concatenate(triangles)


def fan(corners: int) -> Indices:
    """(corners - 2, 3) triangles about corner 0."""
    after = np.arange(1, corners - 1, dtype=np.int64)
    return np.stack([np.zeros_like(after), after, after + 1], axis=1)
