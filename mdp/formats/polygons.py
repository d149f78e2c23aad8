"""Polygons of a file as triangles that do not cross the polygon's outline."""

from pathlib import Path

import manifold3d as m3
import numpy as np

from mdp.directions.frame import frame_across
from mdp.formats.surface import Surface, check_surface, check_vertices
from mdp.mesh import Floats, Indices
from profiles.errors import MeshError, counted


def polygon_surface(path: Path, vertices: Floats, polygons: list[list[int]] | Indices, colours: Indices | None = None) -> Surface:
    """The surface of (n, 3) vertices and polygons, given as lists of corners or as (m, 3) triangles; triangles in their order.

    colours: (m,) of the polygons, None: not known.

    Raises MeshError for a coordinate that is not finite, too few corners and an index out of range.
    """
    if isinstance(polygons, np.ndarray):
        return check_surface(path, vertices, polygons, colours)
    if all(len(polygon) == 3 for polygon in polygons):
        return check_surface(path, vertices, np.array(polygons, dtype=np.int64), colours)
    check_vertices(path, vertices)
    triangles: list[Indices] = []
    for number, polygon in enumerate(polygons, 1):
        corners = np.array(polygon, dtype=np.int64)
        if len(corners) < 3:
            raise MeshError(
                f"{path}: face {number} of {len(polygons)} has {counted(len(corners), 'corner')}, at least 3 are needed"
            )
        if corners.min() < 0 or corners.max() >= len(vertices):
            worst = next(corner for corner in polygon if not 0 <= corner < len(vertices))
            raise MeshError(f"{path}: face {number} names vertex {worst} (counted from 0) of {len(vertices)} vertices")
        triangles.append(corners[triangulate(vertices[corners])])
    if colours is not None:
        colours = np.repeat(colours, [len(triangle) for triangle in triangles])
    return check_surface(path, vertices, np.concatenate(triangles), colours)


def triangulate(points: Floats) -> Indices:
    """(n - 2, 3) triangles over the (n, 3) corners of a polygon in space, wound like it.

    A fan about the first corner where it turns the same way everywhere, as that of a convex polygon does. Else the triangles of
    the polygon's projection along its normal; they keep every edge of the outline even where it touches or crosses itself.
    """
    spokes = points[1:] - points[0]
    crosses = np.cross(spokes[:-1], spokes[1:])
    normal = crosses.sum(axis=0)
    if (crosses @ normal >= 0).all() or not 0 < normal @ normal < np.inf:
        return np.array([(0, after, after + 1) for after in range(1, len(points) - 1)], dtype=np.int64)
    flat = (points - points[0]) @ frame_across(normal / np.linalg.norm(normal)).T
    triangles: Indices = np.asarray(m3.triangulate([flat])).astype(np.int64)
    return triangles
