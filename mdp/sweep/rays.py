"""Rays: the first face that a ray meets, and distances of points from a surface, by a tree of boxes."""

from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.kernels.threads import in_threads
from mdp.mesh import Floats, Ints, Mesh

LEAF_FACES = 4
DEPTH = 64
ANY_FACE = -2.0  # below any cosine


class TriangleTree(NamedTuple):
    """A surface's triangles in spatial order, and boxes over them: node k has the children 2k and 2k + 1, each leaf has
    LEAF_FACES faces.

    vertices (n, 3), faces (m, 3), unit normals (m, 3); least and greatest corners low and high (2 leaves, 3) of the boxes.
    """

    vertices: Floats
    faces: Ints
    normals: Floats
    low: Floats
    high: Floats


def triangle_tree(mesh: Mesh) -> TriangleTree:
    """The tree of a mesh whose faces are in spatial order."""
    leaves = 1
    while leaves * LEAF_FACES < len(mesh.faces):
        leaves *= 2
    return TriangleTree(mesh.vertices, mesh.faces, mesh.normals, *_boxes(mesh.vertices, mesh.faces, leaves))


@kernel
def _boxes(vertices: Floats, faces: Ints, leaves: int) -> tuple[Floats, Floats]:
    low, high = table(2 * leaves, 3), table(2 * leaves, 3)
    for node in range(2 * leaves):
        for axis in range(3):
            low[node, axis], high[node, axis] = np.inf, -np.inf
    for f in range(len(faces)):
        leaf = leaves + f // LEAF_FACES
        for corner in range(3):
            for axis in range(3):
                x = vertices[faces[f, corner], axis]
                low[leaf, axis], high[leaf, axis] = min(low[leaf, axis], x), max(high[leaf, axis], x)
    for node in range(leaves - 1, 0, -1):
        for axis in range(3):
            low[node, axis] = min(low[2 * node, axis], low[2 * node + 1, axis])
            high[node, axis] = max(high[2 * node, axis], high[2 * node + 1, axis])
    for node in range(2 * leaves):
        if low[node, 0] > high[node, 0]:
            for axis in range(3):
                high[node, axis] = np.inf  # an empty box that no ray enters
    return low, high


@no_nrt
def _enters(tree: TriangleTree, node: int, origin: Floats, inverse: Floats, reach: float) -> bool:
    """Whether a ray, given by the inverse of its direction, meets a node's box within reach."""
    low, high = tree.low, tree.high
    near, far = 0.0, reach
    for axis in range(3):
        a = (low[node, axis] - origin[axis]) * inverse[axis]
        b = (high[node, axis] - origin[axis]) * inverse[axis]
        near = max(near, min(a, b))
        far = min(far, max(a, b))
    return near <= far * (1.0 + 1e-9) and near < np.inf  # an empty box lies at infinity


@no_nrt
def _distance(p: Floats, q: Floats, r: Floats, origin: Floats, ray: Floats) -> float:
    """Distance along the ray to a triangle (Moeller and Trumbore, edges included), infinite for a miss."""
    e1x, e1y, e1z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    e2x, e2y, e2z = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    hx, hy, hz = ray[1] * e2z - ray[2] * e2y, ray[2] * e2x - ray[0] * e2z, ray[0] * e2y - ray[1] * e2x
    a = e1x * hx + e1y * hy + e1z * hz
    if a == 0.0:
        return np.inf
    sx, sy, sz = origin[0] - p[0], origin[1] - p[1], origin[2] - p[2]
    u = (sx * hx + sy * hy + sz * hz) / a
    qx, qy, qz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
    v = (ray[0] * qx + ray[1] * qy + ray[2] * qz) / a
    if u < -1e-9 or v < -1e-9 or u + v > 1.0 + 1e-9:
        return np.inf
    t: float = (e2x * qx + e2y * qy + e2z * qz) / a
    return t if t > 0.0 else np.inf


@helper
def first_hit(tree: TriangleTree, placed_ray: Floats, reach: float, own_vertex: int, facing: float, enough: float) -> int:
    """The first face that a ray, given by origin and unit direction (2, 3), meets within reach and whose normal has at least the
    cosine `facing` with the direction; -1 if none.

    Faces around own_vertex are ignored (-1: none). A face nearer than `enough` is returned at once, whether or not it is the
    first.
    """
    vertices, faces, normals, origin, ray = tree.vertices, tree.faces, tree.normals, placed_ray[0], placed_ray[1]
    leaves = len(tree.low) // 2
    inverse = floats(3, 0.0)
    for axis in range(3):
        inverse[axis] = 1.0 / ray[axis] if abs(ray[axis]) > 1e-300 else 1e300
    stack = ints(DEPTH, 1)
    top, hit = 1, -1
    while top > 0:
        top -= 1
        node = stack[top]
        if not _enters(tree, node, origin, inverse, reach):
            continue
        if node < leaves:
            stack[top] = 2 * node
            stack[top + 1] = 2 * node + 1
            top += 2
            continue
        first = (node - leaves) * LEAF_FACES
        for f in range(first, min(first + LEAF_FACES, len(faces))):
            if normals[f, 0] * ray[0] + normals[f, 1] * ray[1] + normals[f, 2] * ray[2] < facing:
                continue
            if own_vertex in (faces[f, 0], faces[f, 1], faces[f, 2]):
                continue
            t = _distance(vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]], origin, ray)
            if t < reach:
                reach, hit = t, f
                if reach < enough:
                    return hit
    return hit


def faces_met(tree: TriangleTree, rays: Floats, reach: float, facing: float = ANY_FACE, in_turn: bool = False) -> Ints:
    """(n,) first face that each ray, given by origin and unit direction (n, 2, 3), meets within reach and whose normal has at
    least the cosine `facing` with the direction; -1 if none.

    in_turn: on one core, for a process that has no threads.
    """
    met = np.empty(len(rays), np.int32)
    if in_turn:
        _find_met(0, len(met), tree, (rays, reach, facing), met)
    else:
        in_threads(_find_met, len(met), tree, (rays, reach, facing), met)
    return met


@kernel
def _find_met(begin: int, end: int, tree: TriangleTree, rays: tuple[Floats, float, float], met: Ints) -> None:
    placed, reach, facing = rays
    for k in range(begin, end):
        met[k] = first_hit(tree, placed[k], reach, -1, facing, 0.0)


def blocked_shares(
    tree: TriangleTree, framed_places: tuple[Floats, Floats], rays: Floats, reach_mm: float, in_turn: bool = False
) -> Floats:
    """(n,) share of rays, given in each point's frame, that meet the surface within reach. framed_places: (n, 3) points and (n,
    3, 3) frames with their axes as rows.

    in_turn: on one core, for a process that has no threads.
    """
    bundles, out = (*framed_places, rays, reach_mm), np.zeros(len(framed_places[0]))
    if in_turn:
        _find_blocked(0, len(out), tree, bundles, out)
    else:
        in_threads(_find_blocked, len(out), tree, bundles, out)
    return out


def frames_about(normals: Floats) -> Floats:
    """(n, 3, 3) a frame for each unit vector (n, 3), its third row (Duff et al. 2017)."""
    x, y, z = normals.T
    sign = np.where(z >= 0.0, 1.0, -1.0)
    a = -1.0 / (sign + z)
    b = x * y * a
    rows = [[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y], [x, y, z]]
    return np.ascontiguousarray(np.array(rows).transpose(2, 0, 1))


@kernel
def _find_blocked(begin: int, end: int, tree: TriangleTree, bundles: tuple[Floats, Floats, Floats, float], out: Floats) -> None:
    (places, frames, rays, reach), ray = bundles, table(2, 3)
    for f in range(begin, end):
        blocked, x, y, z = 0, frames[f, 0], frames[f, 1], frames[f, 2]
        for k in range(len(rays)):
            for axis in range(3):
                ray[0, axis] = places[f, axis]
                ray[1, axis] = rays[k, 0] * x[axis] + rays[k, 1] * y[axis] + rays[k, 2] * z[axis]
            blocked += int(first_hit(tree, ray, reach, -1, ANY_FACE, reach) >= 0)
        out[f] = blocked / len(rays)


def windings(surface: TriangleTree, places: Floats) -> Ints:
    """(n,) winding number of a closed surface about each point (n, 3): how many solids of it the
    point lies in. Counted along upright rays, which must not meet an edge.
    """
    counts = np.zeros(len(places), np.int32)
    in_threads(_find_windings, len(places), surface, places, counts)
    return counts


@kernel
def _find_windings(begin: int, end: int, tree: TriangleTree, places: Floats, counts: Ints) -> None:
    """Add the faces above each point that are seen from inside, and subtract those seen from outside."""
    vertices, faces, leaves = tree.vertices, tree.faces, len(tree.low) // 2
    stack, up, inverse = ints(DEPTH, 1), floats(3, 0.0), floats(3, 1e300)
    up[2], inverse[2] = 1.0, 1.0
    for k in range(begin, end):
        stack[0], top = 1, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if not _enters(tree, node, places[k], inverse, np.inf):
                continue
            if node < leaves:
                stack[top] = 2 * node
                stack[top + 1] = 2 * node + 1
                top += 2
                continue
            first = (node - leaves) * LEAF_FACES
            for f in range(first, min(first + LEAF_FACES, len(faces))):
                if _distance(vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]], places[k], up) < np.inf:
                    counts[k] += 1 if tree.normals[f, 2] > 0.0 else -1


def nearest_faces(surface: TriangleTree, places: Floats, reach_mm: float) -> tuple[Floats, Ints]:
    """(n,) distances of points (n, 3) from a surface, mm, and (n,) the nearest faces; reach_mm and face 0 for points farther
    away."""
    squares, nearest = np.full(len(places), reach_mm * reach_mm), np.zeros(len(places), np.int32)
    in_threads(_find_nearest, len(places), surface, places, squares, nearest)
    return np.sqrt(squares), nearest


@kernel
def _find_nearest(begin: int, end: int, tree: TriangleTree, places: Floats, squares: Floats, nearest: Ints) -> None:
    """Reduce the squared distances of points to those from the surface, and store the nearest faces."""
    vertices, faces, leaves = tree.vertices, tree.faces, len(tree.low) // 2
    stack = ints(DEPTH, 1)
    for k in range(begin, end):
        place, least = places[k], squares[k]
        stack[0], top = 1, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if _from_box(tree, node, place) >= least:
                continue
            if node < leaves:
                nearer = int(_from_box(tree, 2 * node + 1, place) < _from_box(tree, 2 * node, place))
                stack[top] = 2 * node + 1 - nearer
                stack[top + 1] = 2 * node + nearer
                top += 2
                continue
            first = (node - leaves) * LEAF_FACES
            for f in range(first, min(first + LEAF_FACES, len(faces))):
                square = _from_face(vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]], place)
                if square < least:
                    least, nearest[k] = square, f
        squares[k] = least


@no_nrt
def _from_box(tree: TriangleTree, node: int, place: Floats) -> float:
    """Squared distance of a point from a node's box."""
    total = 0.0
    for axis in range(3):
        off = max(0.0, tree.low[node, axis] - place[axis], place[axis] - tree.high[node, axis])
        total += off * off
    return total


@no_nrt
def _from_face(p: Floats, q: Floats, r: Floats, place: Floats) -> float:
    """Squared distance of a point from a triangle: from its plane if the point lies over it, else from its nearest edge."""
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    x, y, z = place[0] - p[0], place[1] - p[1], place[2] - p[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = nx * nx + ny * ny + nz * nz
    if size > 0.0:
        # Barycentric coordinates of the point's projection on the plane.
        b = ((y * vz - z * vy) * nx + (z * vx - x * vz) * ny + (x * vy - y * vx) * nz) / size
        c = ((uy * z - uz * y) * nx + (uz * x - ux * z) * ny + (ux * y - uy * x) * nz) / size
        if b >= 0.0 and c >= 0.0 and b + c <= 1.0:
            height = x * nx + y * ny + z * nz
            return float(height * height / size)
    return min(_from_edge(p, q, place), _from_edge(q, r, place), _from_edge(r, p, place))


@no_nrt
def _from_edge(p: Floats, q: Floats, place: Floats) -> float:
    """Squared distance of a point from the segment between two points."""
    along, length = 0.0, 0.0
    for axis in range(3):
        along += (place[axis] - p[axis]) * (q[axis] - p[axis])
        length += (q[axis] - p[axis]) * (q[axis] - p[axis])
    share = min(1.0, max(0.0, along / length)) if length > 0.0 else 0.0
    total = 0.0
    for axis in range(3):
        off = place[axis] - p[axis] - share * (q[axis] - p[axis])
        total += off * off
    return float(total)
