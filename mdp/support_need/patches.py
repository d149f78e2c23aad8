"""Patches: the connected places that overhang along a direction, and which of them carry themselves (numba kernels).

A rim is banked where the solid goes on downward beside it, and far enough to hold a line. A patch carries itself when it is
too small to matter, when it nowhere reaches further than two line widths from its banks, or when lines over it reach from bank
to bank, all in one direction and short enough; not so where it begins in mid-air, at a local minimum.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import floats, int_table, ints, table
from mdp.kernels.kernel import kernel, part, vector_part
from mdp.mesh import Floats, Ints
from mdp.support_need.linked_faces import LinkedFaces
from mdp.support_need.spans import Sides, spans

Classes = NDArray[np.uint8]
CARRIES_ITSELF, NEEDS_SUPPORT, UNSUPPORTABLE = 0, 1, 2
BANK_MM = 1.0  # a ridge that goes down less than this is no bank: it hangs in the air itself
NARROW = 2.0  # line widths from a bank that lines hold on to their neighbours
UNNUMBERED, SAFE = -1, 0  # faces that belong to no patch yet, and those that belong to none
UNKNOWN = HELD = -1
LEVEL_SLOPE = 0.01  # an edge that rises less is level: a plateau, which may be a bottom as a whole


class Limits(NamedTuple):
    """risky_below: cosine of normal and direction below which a face overhangs; ground_mm: height along the direction up to which
    the surface rests on something; level_mm: a patch no higher than this is a level bridge, others are arches; how far these
    reach; width_mm of a line; least_mm2: a smaller patch, seen along the direction, holds itself."""

    risky_below: float
    ground_mm: float
    level_mm: float
    bridge_mm: float
    arch_mm: float
    width_mm: float
    least_mm2: float


class Descent(NamedTuple):
    """Of every vertex: its height along the direction, its lowest neighbour, itself at a bottom, UNKNOWN until it is asked for;
    and room to unite level places in."""

    heights: Floats
    below: Ints
    root: Ints


class Patch(NamedTuple):
    """A patch: its faces (k,), the frame (2, 3) across the direction, its area seen along the direction and how high it is."""

    faces: Ints
    frame: Floats
    area_mm2: float
    rise_mm: float


@kernel
def classify(begin_row: int, end_row: int, surface: LinkedFaces, directions: Floats, limits: Limits, out: Classes) -> None:
    """For each of (k, 3) directions put CARRIES_ITSELF where it holds among the classes of the faces, (k, m)."""
    count, size = surface.normals.shape[1], surface.vertices.shape[1]
    cosines, number = floats(count, 0.0), ints(count, 0)
    risky, queue = ints(count + 1, 0), ints(count, 0)
    descent = Descent(floats(size, 0.0), ints(size, 0), ints(size, 0))
    for row in range(begin_row, end_row):
        d = directions[row]
        _find_heights(surface.vertices[0], surface.vertices[1], surface.vertices[2], d, descent)
        _find_cosines(surface.normals[0], surface.normals[1], surface.normals[2], d, cosines)
        many = _find_risky(surface, cosines, descent.heights, limits, number, risky)
        seeds = 0
        for k in range(many):
            if number[risky[k]] == UNNUMBERED:
                seeds += 1
                faces = queue[: _flood(surface, risky[k], seeds, number, queue)]
                patch = _measure(surface, d, descent.heights, faces, cosines)
                if _carries_itself(surface, patch, number, descent, limits):
                    for f in patch.faces:
                        out[row, f] = CARRIES_ITSELF


@vector_part
def _find_heights(x: Floats, y: Floats, z: Floats, d: Floats, descent: Descent) -> None:
    d0, d1, d2 = d[0], d[1], d[2]
    for v in range(len(x)):
        descent.heights[v] = x[v] * d0 + y[v] * d1 + z[v] * d2
        descent.below[v] = UNKNOWN


@part
def _lowest(surface: LinkedFaces, descent: Descent, v: int) -> int:
    """The lowest neighbour of a vertex, or itself."""
    if descent.below[v] == UNKNOWN:
        w: int = v
        for at in range(surface.starts[v], surface.starts[v + 1]):
            w = surface.around[at] if descent.heights[surface.around[at]] < descent.heights[w] else w
        descent.below[v] = w
    return int(descent.below[v])


@vector_part
def _find_cosines(x: Floats, y: Floats, z: Floats, d: Floats, cosines: Floats) -> None:
    d0, d1, d2 = d[0], d[1], d[2]
    for f in range(len(x)):
        cosines[f] = x[f] * d0 + y[f] * d1 + z[f] * d2


@part
def _find_risky(surface: LinkedFaces, cosines: Floats, heights: Floats, limits: Limits, number: Ints, risky: Ints) -> int:
    """List the faces that overhang and rest on nothing, UNNUMBERED, all others SAFE; how many there are."""
    many = 0
    for f in range(len(cosines)):
        risky[many] = f
        many += int(cosines[f] < limits.risky_below)
        number[f] = SAFE
    resting = 0
    for k in range(many):
        f = risky[k]
        risky[k - resting] = f
        if _rests(surface.faces, heights, f, limits.ground_mm):
            resting += 1
        else:
            number[f] = UNNUMBERED
    return many - resting


@part
def _rests(faces: Ints, heights: Floats, f: int, ground_mm: float) -> bool:
    """Whether all of a face lies on the ground."""
    return bool(max(heights[faces[f, 0]], heights[faces[f, 1]], heights[faces[f, 2]]) <= ground_mm)


@part
def _flood(surface: LinkedFaces, seed: int, own: int, number: Ints, queue: Ints) -> int:
    """Number all overhanging faces that hang together with one; they come into the queue, their count is returned."""
    queue[0], number[seed] = seed, own
    size, at = 1, 0
    while at < size:
        for k in range(3):
            g = surface.neighbours[queue[at], k]
            if g >= 0 and number[g] == UNNUMBERED:
                queue[size], number[g] = g, own
                size += 1
        at += 1
    return size


@part
def _measure(surface: LinkedFaces, d: Floats, heights: Floats, faces: Ints, cosines: Floats) -> Patch:
    """A patch along a direction."""
    area, low, high = 0.0, np.inf, -np.inf
    for f in faces:
        area -= surface.areas_mm2[f] * cosines[f]
        for corner in range(3):
            height = heights[surface.faces[f, corner]]
            low, high = min(low, height), max(high, height)
    return Patch(faces, frame_across(d), area, high - low)


@part
def frame_across(d: Floats) -> Floats:
    """(2, 3) unit vectors across a direction and each other."""
    frame, least = table(2, 3), 0
    for axis in range(1, 3):
        least = axis if abs(d[axis]) < abs(d[least]) else least
    p, q = (least + 1) % 3, (least + 2) % 3
    size = np.sqrt(d[p] * d[p] + d[q] * d[q])
    frame[0, p], frame[0, q] = -d[q] / size, d[p] / size
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        frame[1, axis] = d[a] * frame[0, b] - d[b] * frame[0, a]
    return frame


@part
def _carries_itself(surface: LinkedFaces, patch: Patch, number: Ints, descent: Descent, limits: Limits) -> bool:
    if patch.area_mm2 < limits.least_mm2:
        return True
    sides, around_mm = _rim(surface, patch, number)
    reach_mm = NARROW * limits.width_mm
    longest_mm = limits.bridge_mm if patch.rise_mm <= limits.level_mm else limits.arch_mm
    if patch.area_mm2 > max(reach_mm, 0.5 * longest_mm) * around_mm:
        return False  # no rim is long enough for a place of that size to lie near it, or for lines that short
    _find_banks(surface, sides, descent, limits.ground_mm)
    if not _is_narrow(surface, patch, sides, reach_mm) and not spans(sides, patch.area_mm2, longest_mm, limits.width_mm):
        return False
    return not _begins_in_air(surface, patch.faces, descent, limits.ground_mm)


@part
def _begins_in_air(surface: LinkedFaces, patch: Ints, descent: Descent, ground_mm: float) -> bool:
    """Whether a vertex of a patch, or a level place as a whole, has neither a lower neighbour nor lies on the ground."""
    root, heights = descent.root, descent.heights
    for f in patch:
        for k in range(3):
            root[surface.faces[f, k]] = surface.faces[f, k]
    for f in patch:
        for k in range(3):
            a, b = surface.faces[f, k], surface.faces[f, (k + 1) % 3]
            if _is_level(surface.vertices, heights, a, b):
                a, b = _root(root, a), _root(root, b)
                root[max(a, b)] = min(a, b)
    for f in patch:  # what is held holds the whole place: its root becomes HELD
        for k in range(3):
            v = surface.faces[f, k]
            w = _lowest(surface, descent, v)
            if heights[v] <= ground_mm or not _is_level(surface.vertices, heights, v, w):
                at = _root(root, v)
                if at != HELD:
                    root[at] = HELD
    for f in patch:
        for k in range(3):
            if _root(root, surface.faces[f, k]) != HELD:
                return True
    return False


@part
def _is_level(vertices: Floats, heights: Floats, v: int, w: int) -> bool:
    """Whether the way from one vertex to another rises less than LEVEL_SLOPE."""
    x, y, z = vertices[0, v] - vertices[0, w], vertices[1, v] - vertices[1, w], vertices[2, v] - vertices[2, w]
    return bool((heights[v] - heights[w]) ** 2 <= LEVEL_SLOPE**2 * (x * x + y * y + z * z))


@part
def _root(root: Ints, v: int) -> int:
    """The vertex that stands for a level place, HELD where something holds it."""
    while v != HELD and root[v] != v:
        v = root[v]
    return v


@part
def _rim(surface: LinkedFaces, patch: Patch, number: Ints) -> tuple[Sides, float]:
    """The sides of a patch seen along the direction, their banks not looked for yet, and how long they are together."""
    faces, count = patch.faces, 0
    for f in faces:
        for corner in range(3):
            g = surface.neighbours[f, corner]
            count += int(g < 0 or number[g] == SAFE)
    ends, edges, banked = table(count, 4), int_table(count, 2), ints(count, 0)
    count, around_mm = 0, 0.0
    for f in faces:
        for corner in range(3):
            g = surface.neighbours[f, corner]
            if g < 0 or number[g] == SAFE:
                ax, ay = _place(surface.vertices, surface.faces[f, corner], patch.frame)
                bx, by = _place(surface.vertices, surface.faces[f, (corner + 1) % 3], patch.frame)
                ends[count, 0], ends[count, 1], ends[count, 2], ends[count, 3] = ax, ay, bx, by
                edges[count, 0], edges[count, 1] = f, corner
                around_mm += np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
                count += 1
    return Sides(ends, banked, edges), around_mm


@part
def _find_banks(surface: LinkedFaces, sides: Sides, descent: Descent, ground_mm: float) -> None:
    for e in range(len(sides.banked)):
        f, corner = sides.edges[e, 0], sides.edges[e, 1]
        g, a, b = surface.neighbours[f, corner], surface.faces[f, corner], surface.faces[f, (corner + 1) % 3]
        sides.banked[e] = int(g >= 0 and _is_bank(surface, descent, g, a, b, ground_mm))


@part
def _place(vertices: Floats, v: int, frame: Floats) -> tuple[float, float]:
    """A vertex seen along the direction."""
    x: float = vertices[0, v] * frame[0, 0] + vertices[1, v] * frame[0, 1] + vertices[2, v] * frame[0, 2]
    y: float = vertices[0, v] * frame[1, 0] + vertices[1, v] * frame[1, 1] + vertices[2, v] * frame[1, 2]
    return x, y


@part
def _is_bank(surface: LinkedFaces, descent: Descent, g: int, a: int, b: int, ground_mm: float) -> bool:
    """Whether the face g beyond the edge a b goes down from it, and what is below it BANK_MM deep or down to the ground."""
    vertices, heights = surface.vertices, descent.heights
    if _rests(surface.faces, heights, g, ground_mm):
        return True
    v = surface.faces[g, 0]
    for k in range(1, 3):
        v = v if v not in (a, b) else surface.faces[g, k]
    along, length = 0.0, 0.0
    for axis in range(3):
        step = vertices[axis, b] - vertices[axis, a]
        along += (vertices[axis, v] - vertices[axis, a]) * step
        length += step * step
    share = along / length if length > 0.0 else 0.0
    if heights[v] >= heights[a] + share * (heights[b] - heights[a]):
        return False
    deep = 0.5 * (heights[a] + heights[b]) - BANK_MM
    deep = max(deep, ground_mm)
    while heights[v] > deep and _lowest(surface, descent, v) != v:
        v = descent.below[v]
    return bool(heights[v] <= deep)


@part
def _is_narrow(surface: LinkedFaces, patch: Patch, sides: Sides, reach_mm: float) -> bool:
    """Whether no corner, middle of an edge or middle of a face lies further than that from the nearest bank."""
    x, y, nearest = floats(3, 0.0), floats(3, 0.0), 0
    for k in range(len(patch.faces)):
        for corner in range(3):
            x[corner], y[corner] = _place(surface.vertices, surface.faces[patch.faces[k], corner], patch.frame)
        for a in range(3):
            for b in range(a, 3):
                nearest = _near_bank(sides, 0.5 * (x[a] + x[b]), 0.5 * (y[a] + y[b]), reach_mm, nearest)
                if nearest < 0:
                    return False
        nearest = _near_bank(sides, (x[0] + x[1] + x[2]) / 3.0, (y[0] + y[1] + y[2]) / 3.0, reach_mm, nearest)
        if nearest < 0:
            return False
    return True


@part
def _near_bank(sides: Sides, x: float, y: float, reach_mm: float, first: int) -> int:
    """A banked side within reach of a place, looked for from a side on; -1: none."""
    ends, count = sides.ends, len(sides.banked)
    for k in range(count):
        e = (first + k) % count
        if sides.banked[e] == 0:
            continue
        ax, ay, bx, by = ends[e, 0], ends[e, 1], ends[e, 2] - ends[e, 0], ends[e, 3] - ends[e, 1]
        length = bx * bx + by * by
        share = ((x - ax) * bx + (y - ay) * by) / length if length > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        if (x - ax - share * bx) ** 2 + (y - ay - share * by) ** 2 <= reach_mm * reach_mm:
            return e
    return -1
