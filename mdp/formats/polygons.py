"""Polygon files (OBJ and OFF), and the triangulation of polygons along their outline.

OBJ files have `v` and `f` lines, whose texture coordinates, normals, groups and materials are ignored; OFF files have counts,
then one vertex and one polygon per line.
"""

from itertools import islice
from pathlib import Path

import manifold3d as m3
import numpy as np

from mdp.directions.unit_vectors import frame_across
from mdp.formats.surface import Surface, check_surface, check_vertices, parse_floats, parse_integers, text_lines
from mdp.mesh import Floats, Indices
from profiles.errors import MeshError, counted

MOST_INDEX = 2**62  # no file has that many vertices; larger numbers would not fit into an array
OFF_KINDS = ("OFF", "COFF", "NOFF", "CNOFF", "STOFF")  # the letters name columns after the position, which are ignored


def read(path: Path) -> list[Surface]:
    """The polygons of an OBJ or OFF file as triangles. Raises MeshError."""
    return [_read_off(path) if path.suffix.lower() == ".off" else _read_obj(path)]


def _read_obj(path: Path) -> Surface:
    """The polygons of an OBJ file as triangles; all objects and groups come as one surface, since they share their vertices.

    Raises MeshError for a vertex without three coordinates, and for a face without three corners or with a bad index.
    """
    positions: list[list[str]] = []
    polygons: list[list[int]] = []
    for number, line in enumerate(text_lines(path, continued="\\"), 1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        if words[0] == "v":
            if len(words) < 4:
                raise MeshError(f"{path}: the vertex in line {number} has fewer than three coordinates")
            positions.append(words[1:4])
        elif words[0] == "f":
            polygons.append(_corners(path, number, words[1:], len(positions)))
    vertices = parse_floats(path, positions, "a vertex").reshape(-1, 3)
    return polygon_surface(path, vertices, polygons)


def _corners(path: Path, number: int, words: list[str], vertices: int) -> list[int]:
    if len(words) < 3:
        raise MeshError(f"{path}: the face in line {number} has {counted(len(words), 'corner')}, at least 3 are needed")
    try:
        named = [int(word.split("/", 1)[0]) for word in words]
    except ValueError:
        raise MeshError(f"{path}: the face in line {number} is malformed: `{' '.join(words[:8])}`") from None
    if 0 in named or min(named) < -vertices or max(named) > MOST_INDEX:
        raise MeshError(f"{path}: the face in line {number} names a vertex that does not exist: `{' '.join(words[:8])}`")
    return [index - 1 if index > 0 else vertices + index for index in named]


def _read_off(path: Path) -> Surface:
    """The polygons of an OFF file as triangles; colours and normals are ignored.

    Raises MeshError for another kind of file, for missing rows and for malformed lines.
    """
    stripped = ((number, line.split("#", 1)[0].split()) for number, line in enumerate(text_lines(path), 1))
    lines = [(number, words) for number, words in stripped if words]
    if not lines or lines[0][1][0] not in OFF_KINDS:
        raise MeshError(f"{path} is not an OFF file: its first word is none of {', '.join(OFF_KINDS)}")
    counts_line, first = (lines[0][1][1:], 1) if len(lines[0][1]) > 1 else (lines[1][1] if len(lines) > 1 else [], 2)
    counts = parse_integers(path, [counts_line[:2]], "the line of counts").tolist()
    if len(counts) < 2 or min(counts) < 0:
        raise MeshError(f"{path}: its line of counts must name the vertices and the faces, got `{' '.join(counts_line)}`")
    held = len(lines) - first
    if sum(counts) > held:
        announced = f"{counted(counts[0], 'vertex', 'vertices')} and {counted(counts[1], 'face')}"
        raise MeshError(f"{path}: announces {announced} but holds only {counted(held, 'line')} of them")
    vertex_rows, face_rows = lines[first : first + counts[0]], lines[first + counts[0] : first + sum(counts)]
    short = next((number for number, words in vertex_rows if len(words) < 3), None)
    if short is not None:
        raise MeshError(f"{path}: the vertex in line {short} has fewer than three coordinates")
    vertices = parse_floats(path, [words[:3] for _, words in vertex_rows], "a vertex").reshape(-1, 3)
    return polygon_surface(path, vertices, _polygons(path, face_rows))


def _polygons(path: Path, rows: list[tuple[int, list[str]]]) -> list[list[int]] | Indices:
    if all(words[0] == "3" and len(words) >= 4 for _, words in rows):
        return parse_integers(path, [words[1:4] for _, words in rows], "a face").reshape(-1, 3)
    polygons = []
    for number, words in rows:
        corners = int(words[0]) if words[0].isdecimal() and len(words[0]) < 10 else -1
        if corners < 3 or len(words) <= corners:
            raise MeshError(f"{path}: the face in line {number} is malformed: `{' '.join(islice(words, 8))}`")
        polygons.append(parse_integers(path, [words[1 : corners + 1]], f"the face in line {number}").tolist())
    return polygons


def polygon_surface(path: Path, vertices: Floats, polygons: list[list[int]] | Indices, colours: Indices | None = None) -> Surface:
    """The surface of (n, 3) vertices and polygons, given as lists of corners or as (m, 3) triangles; triangles keep their order.

    colours: (m,) colours of the polygons; None if unknown.

    Raises MeshError for a coordinate that is not finite, a polygon with too few corners, or an index out of range.
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
    """(n - 2, 3) triangles over the (n, 3) corners of a polygon in space, wound like the polygon.

    A fan about the first corner if all its triangles face the same way, as those of a convex polygon do. Otherwise a
    triangulation of the polygon's projection along its normal, which keeps every edge of the outline even if it touches or
    crosses itself.
    """
    spokes = points[1:] - points[0]
    crosses = np.cross(spokes[:-1], spokes[1:])
    normal = crosses.sum(axis=0)
    if (crosses @ normal >= 0).all() or not 0 < normal @ normal < np.inf:
        return np.array([(0, after, after + 1) for after in range(1, len(points) - 1)], dtype=np.int64)
    flat = (points - points[0]) @ frame_across(normal / np.linalg.norm(normal)).T
    triangles: Indices = np.asarray(m3.triangulate([flat])).astype(np.int64)
    return triangles
