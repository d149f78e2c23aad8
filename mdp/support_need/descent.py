"""Steepest descent on a surface, and how it ends (numba kernels).

The path follows the steepest slope through faces, along edges where both sides slope towards them, and from vertex to vertex: it
depends on the shape but not on its triangulation. So does the verdict whether a patch is a floating start, which it is if it
contains a local minimum deeper than DIP_MM below all paths out of it.
"""

from typing import NamedTuple

import numpy as np

from mdp.kernels.kernel import helper, no_nrt
from mdp.mesh import Floats, Ints
from mdp.topology.edges import LinkedFaces

ANCHOR_MM = 1.0  # a ridge that goes down less than this is not an anchor but an overhang
ROUNDING_MM = 1e-6  # tolerance on the depth of a descent, and on the height of minima
ANCHORED, LOOSE = 0, -1  # verdicts on a descent; a positive verdict is the number of the patch that it ends on
SAFE = 0  # number of faces that belong to no patch
LEVEL = 1e-6  # slope below which a face counts as level
ASIDE = 1e-9  # a path that leaves an edge by less runs along it
END = 1e-7  # share of an edge that counts as its end
MOST_STEPS = 1000  # over faces, around a vertex or down; never reached on a valid mesh
DIP_MM = 0.05  # a quarter of a usual layer: invisible in a print
UNSEEN = -1  # no vertex
Pool = tuple[Ints, Ints]  # for each vertex, the minimum with a way out from which it was visited, or UNSEEN; and a queue (n,)
Vector = tuple[float, float, float]


class Underside(NamedTuple):
    """The overhanging faces of a surface along a direction (3,), with a frame across it (2, 3).

    heights (n,) of the vertices; cosines (m,) of the faces' normals with the direction; base_mm, the height up to which the
    surface rests on something. Connected overhanging faces are a patch, numbered from 1: number (m,) is that of each face, the
    faces of patch p are faces[starts[p] : starts[p + 1]]; held (k,): whether an anchor holds a patch, UNKNOWN until computed;
    waiting (k,): a queue of patches. point: (3,) mm, the current point of the descent.
    """

    surface: LinkedFaces
    direction: Floats
    frame: Floats
    heights: Floats
    cosines: Floats
    base_mm: float
    number: Ints
    faces: Ints
    starts: Ints
    held: Ints
    waiting: Ints
    point: Floats


@helper
def descend(under: Underside, f: int, corner: int, share: float, own: int) -> int:
    """Steepest descent on a face from a point on its edge: ANCHORED if it goes ANCHOR_MM deep, to the base or to solid beneath;
    the number of the patch on which it ends before, LOOSE if that is the patch `own` or none.
    """
    surface, heights = under.surface, under.heights
    height = _put(under, f, corner, share)
    deep = max(height - ANCHOR_MM + ROUNDING_MM, under.base_mm)
    for _ in range(MOST_STEPS):
        if height <= deep:
            return ANCHORED
        if under.cosines[f] ** 2 >= 1.0 - LEVEL**2:
            if under.cosines[f] > 0.0:
                return ANCHORED
            return int(under.number[f]) if _is_others(under, f, own) else LOOSE
        corner, share = _leave(surface, under.direction, under.point, f)
        if corner >= 0 and END < share < 1.0 - END:
            height = _put(under, f, corner, share)
            g = surface.neighbours[f, corner]
            if g >= 0 and outflow(under, g, corner_of(surface, g, surface.faces[f, (corner + 1) % 3])) <= ASIDE:
                f = g
                continue
        v = _lower_end(under, f, corner, share)
        g = f
        while g >= 0 and heights[v] > deep:  # from vertex to vertex, while edges are steeper than faces
            f = g
            g, w = _steepest(under, f, v)
            if g < 0:
                return _end_at_vertex(under, f, v, own)
            if w == v:
                break
            v = w
        f, height = g, heights[v]
        for axis in range(3):
            under.point[axis] = surface.vertices[axis, v]
    return LOOSE


@no_nrt
def corner_of(surface: LinkedFaces, f: int, v: int) -> int:
    """The corner of a face at a vertex."""
    return 0 if surface.faces[f, 0] == v else (1 if surface.faces[f, 1] == v else 2)


@helper
def outflow(under: Underside, f: int, corner: int) -> float:
    """Flow of water on a face out over the edge that begins at a corner; negative if away from the edge."""
    vertices, faces, normals, d = under.surface.vertices, under.surface.faces, under.surface.normals, under.direction
    a, b = faces[f, corner], faces[f, (corner + 1) % 3]
    x, y, z = vertices[0, b] - vertices[0, a], vertices[1, b] - vertices[1, a], vertices[2, b] - vertices[2, a]
    p, q, r = _across((x, y, z), (normals[0, f], normals[1, f], normals[2, f]))
    size = p * p + q * q + r * r
    # at right angles to the normal, so the direction itself can be used
    return -(d[0] * p + d[1] * q + d[2] * r) / np.sqrt(size) if size > 0.0 else 0.0


@no_nrt
def _across(edge: Vector, normal: Vector) -> Vector:
    """The vector in a face's plane that is square to an edge and points out of the face."""
    (x, y, z), (nx, ny, nz) = edge, normal
    return y * nz - z * ny, z * nx - x * nz, x * ny - y * nx


@no_nrt
def _put(under: Underside, f: int, corner: int, share: float) -> float:
    """Move to a point on the edge that begins at a corner; returns its height."""
    a, b = under.surface.faces[f, corner], under.surface.faces[f, (corner + 1) % 3]
    for axis in range(3):
        begin = under.surface.vertices[axis, a]
        under.point[axis] = begin + share * (under.surface.vertices[axis, b] - begin)
    return float(under.heights[a] + share * (under.heights[b] - under.heights[a]))


@helper
def _leave(surface: LinkedFaces, d: Floats, point: Floats, f: int) -> tuple[int, float]:
    """The edge, by its first corner, over which the descent from a point leaves a face, and the share of the edge there; -1 if
    there is none.
    """
    vertices, faces, normals = surface.vertices, surface.faces, surface.normals
    nx, ny, nz = normals[0, f], normals[1, f], normals[2, f]
    cosine = nx * d[0] + ny * d[1] + nz * d[2]
    nearest, way_out, share = np.inf, -1, 0.0
    for corner in range(3):
        a, b = faces[f, corner], faces[f, (corner + 1) % 3]
        ax, ay, az = vertices[0, a], vertices[1, a], vertices[2, a]
        x, y, z = vertices[0, b] - ax, vertices[1, b] - ay, vertices[2, b] - az
        p, q, r = _across((x, y, z), (nx, ny, nz))
        out = -(d[0] * p + d[1] * q + d[2] * r)
        if out > ASIDE * np.sqrt(p * p + q * q + r * r):
            way = ((ax - point[0]) * p + (ay - point[1]) * q + (az - point[2]) * r) / out
            if way < nearest:
                fx, fy, fz = cosine * nx - d[0], cosine * ny - d[1], cosine * nz - d[2]
                along = (point[0] + way * fx - ax) * x + (point[1] + way * fy - ay) * y + (point[2] + way * fz - az) * z
                nearest, way_out, share = way, corner, along / (x * x + y * y + z * z)
    return way_out, min(max(share, 0.0), 1.0)


@no_nrt
def _lower_end(under: Underside, f: int, corner: int, share: float) -> int:
    """The next vertex of the path: the end of an edge at which it is, or else the lower end; for a face without an exit, its
    lowest corner.
    """
    faces, heights = under.surface.faces, under.heights
    if corner < 0:
        v = faces[f, 0]
        for k in range(1, 3):
            v = faces[f, k] if heights[faces[f, k]] < heights[v] else v
        return int(v)
    a, b = faces[f, corner], faces[f, (corner + 1) % 3]
    if share <= END or share >= 1.0 - END:
        return int(a if share <= END else b)
    return int(a if heights[a] <= heights[b] else b)


@helper
def _turn(surface: LinkedFaces, first: int, f: int, v: int, forward: bool) -> tuple[int, bool]:
    """The next face around a vertex, -1 after the last; at an open edge the direction is reversed from the first face."""
    corner = corner_of(surface, f, v)
    g = surface.neighbours[f, corner if forward else (corner + 2) % 3]
    if g < 0 and forward:
        corner, forward = corner_of(surface, first, v), False
        g = surface.neighbours[first, (corner + 2) % 3]
    return (int(g), forward) if g >= 0 and g != first else (-1, forward)


@helper
def _steepest(under: Underside, first: int, v: int) -> tuple[int, int]:
    """The steepest exit from a vertex: a face and the vertex itself, or a face and the other end of its edge; -1 if there is
    none.
    """
    surface, best, way, end = under.surface, LEVEL, -1, v
    f, forward = first, True
    for _ in range(MOST_STEPS):
        corner = corner_of(surface, f, v)
        for k in range(1, 3):
            w = surface.faces[f, (corner + k) % 3]
            slope = _slope(under, v, w)
            if slope > best:
                best, way, end = slope, f, w
        slope = np.sqrt(max(1.0 - under.cosines[f] ** 2, 0.0))
        within = outflow(under, f, corner) <= ASIDE and outflow(under, f, (corner + 2) % 3) <= ASIDE
        if slope >= best and within and surface.areas_mm2[f] > 0.0:
            best, way, end = slope, f, v
        f, forward = _turn(surface, first, f, v, forward)
        if f < 0:
            break
    return way, end


@no_nrt
def _slope(under: Underside, v: int, w: int) -> float:
    """Downward slope from one vertex to another."""
    length = 0.0
    for axis in range(3):
        length += (under.surface.vertices[axis, w] - under.surface.vertices[axis, v]) ** 2
    return float((under.heights[v] - under.heights[w]) / np.sqrt(length)) if length > 0.0 else 0.0


@no_nrt
def _is_others(under: Underside, f: int, own: int) -> bool:
    """Whether a face belongs to another patch."""
    return bool(under.number[f] != SAFE and under.number[f] != own)


@no_nrt
def _end_at_vertex(under: Underside, first: int, v: int, own: int) -> int:
    """Verdict for a path that ends at a vertex: the number of a patch around it, or else ANCHORED above a pit."""
    f, forward, pit = first, True, False
    for _ in range(MOST_STEPS):
        if _is_others(under, f, own):
            return int(under.number[f])
        pit = pit or under.cosines[f] > 0.0
        f, forward = _turn(under.surface, first, f, v, forward)
        if f < 0:
            break
    return ANCHORED if pit else LOOSE


@no_nrt
def begins_in_air(surface: LinkedFaces, heights: Floats, patch: Ints, pool: Pool, base_mm: float) -> bool:
    """Whether a patch is a floating start: it contains a local minimum above the base."""
    for f in patch:
        for k in range(3):
            v = surface.faces[f, k]
            candidate = pool[0][v] == UNSEEN and heights[v] > base_mm and _is_bottom(surface, heights, v)
            if candidate and not _has_way_out(surface, heights, v, pool, base_mm):
                return True
    return False


@no_nrt
def _is_bottom(surface: LinkedFaces, heights: Floats, v: int) -> bool:
    """Whether a vertex is a local minimum: no neighbour lies lower."""
    at, end = surface.starts[v], surface.starts[v + 1]
    while at < end and heights[surface.around[at]] >= heights[v]:
        at += 1
    return bool(at == end)


@no_nrt
def _has_way_out(surface: LinkedFaces, heights: Floats, bottom: int, pool: Pool, base_mm: float) -> bool:
    """Whether the region connected with a minimum, up to DIP_MM above it, continues below it or to the base. If so, its vertices
    are marked as visited, as far as they were searched.
    """
    seen, queue = pool
    low = heights[bottom] - ROUNDING_MM
    seen[bottom], queue[0] = bottom, bottom
    at, count = 0, 1
    while at < count:
        v = queue[at]
        for k in range(surface.starts[v], surface.starts[v + 1]):
            w = surface.around[k]
            other = seen[w]  # another equally low minimum, which has a way out
            known = other != UNSEEN and other != bottom and abs(heights[other] - heights[bottom]) <= ROUNDING_MM
            if known or heights[w] < low or heights[w] <= base_mm:
                return True
            if seen[w] != bottom and heights[w] <= heights[bottom] + DIP_MM:
                seen[w], queue[count] = bottom, w
                count += 1
        at += 1
    for k in range(count):
        seen[queue[k]] = UNSEEN
    return False
