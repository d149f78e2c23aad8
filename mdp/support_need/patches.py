"""Patches: the connected places that overhang along a direction, and which of them carry themselves (numba kernels).

A patch carries itself when it is too small to matter, when it nowhere reaches further than two line widths from its anchors, or
when lines over it reach from anchor to anchor, all in one direction and short enough; not so where it begins in mid-air, at a
local minimum. All that is asked of the shape, never of its triangles: however a surface is cut into faces, it needs the same.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.directions.frame import FramedDirections
from mdp.kernels.arrays import dot, floats, ints, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Ints
from mdp.support_need.descent import SAFE, UNSEEN, Pool, View, begins_in_air
from mdp.support_need.sides import UNKNOWN, Patches, find_sides, is_rim, rests, seen_along
from mdp.support_need.spans import DEEP, Sides, is_near_anchors, spans
from mdp.support_need.spans import ROUNDING_MM as SPAN_ROUNDING_MM
from mdp.topology.edges import LinkedFaces

Classes = NDArray[np.uint8]
CARRIES_ITSELF, NEEDS_SUPPORT, UNSUPPORTABLE = 0, 1, 2  # classes of faces, the dearer the higher
NARROW = 2.0  # line widths from an anchor that lines hold on to their neighbours
UNNUMBERED = -1  # faces that belong to no patch yet
ROUNDING_MM, ROUNDING_MM2 = 1e-6, 1e-6  # of a patch just as high or as large as it may be


class Limits(NamedTuple):
    """risky_below: cosine of normal and direction below which a face overhangs; base_mm: height along the direction up to which
    the surface rests on something; level_mm: a patch no higher than this is a level bridge, others are arches; how far these
    reach; width_mm of a line; least_mm2: a smaller patch, seen along the direction, holds itself."""

    risky_below: float
    base_mm: float
    level_mm: float
    bridge_mm: float
    arch_mm: float
    width_mm: float
    least_mm2: float


class Patch(NamedTuple):
    """A patch: its number, its faces (k,), the frame (2, 3) across the direction, its area seen along the direction, how high it
    is and how long its rim."""

    number: int
    faces: Ints
    frame: Floats
    area_mm2: float
    rise_mm: float
    around_mm: float


@kernel
def classify(begin_row: int, end_row: int, surface: LinkedFaces, along: FramedDirections, limits: Limits, out: Classes) -> None:
    """For each of k directions put CARRIES_ITSELF where it holds among the classes of the faces, (k, m)."""
    count, size = surface.normals.shape[1], surface.vertices.shape[1]
    risky, point = ints(count + 1, 0), floats(3, 0.0)
    patches = Patches(ints(count, 0), ints(count + 2, 0), ints(count + 2, 0), ints(count + 2, 0))
    pool = Pool(ints(size, 0), ints(size, 0))
    heights, cosines, number = floats(size, 0.0), floats(count, 0.0), ints(count, 0)
    for row in range(begin_row, end_row):
        d = along.directions[row]
        view = View(surface, d, heights, cosines, number, limits.base_mm, point)
        dot(surface.vertices[0], surface.vertices[1], surface.vertices[2], d, heights)
        dot(surface.normals[0], surface.normals[1], surface.normals[2], d, cosines)
        for v in range(size):
            pool.seen[v] = UNSEEN
        many = _find_risky(view, limits.risky_below, risky)
        for own in range(1, _find_patches(view, risky[:many], patches) + 1):
            patch = _measure(view, patches, own, along.frames[row])
            if _carries_itself(view, patches, patch, pool, limits):
                for f in patch.faces:
                    out[row, f] = CARRIES_ITSELF


@no_nrt
def _find_risky(view: View, risky_below: float, risky: Ints) -> int:
    """List the faces that overhang and rest on nothing, UNNUMBERED, all others SAFE; how many there are."""
    faces, heights, cosines, number, many = view.surface.faces, view.heights, view.cosines, view.number, 0
    for f in range(len(cosines)):
        risky[many] = f
        many += int(cosines[f] < risky_below)
        number[f] = SAFE
    resting = 0
    for k in range(many):
        f = risky[k]
        risky[k - resting] = f
        if rests(faces, heights, f, view.base_mm):
            resting += 1
        else:
            number[f] = UNNUMBERED
    return many - resting


@no_nrt
def _find_patches(view: View, risky: Ints, patches: Patches) -> int:
    """Number all overhanging faces, those alike that hang together; how many patches there are."""
    neighbours, number, faces, own, size, at = view.surface.neighbours, view.number, patches.faces, 0, 0, 0
    for seed in risky:
        if number[seed] == UNNUMBERED:
            own += 1
            faces[size], number[seed] = seed, own
            patches.starts[own], patches.held[own] = size, UNKNOWN
            size += 1
        while at < size:
            for k in range(3):
                g = neighbours[faces[at], k]
                if g >= 0 and number[g] == UNNUMBERED:
                    faces[size], number[g] = g, own
                    size += 1
            at += 1
    patches.starts[own + 1] = size
    return own


@helper
def _measure(view: View, patches: Patches, own: int, frame: Floats) -> Patch:
    """A patch along the direction."""
    vertices, corners, neighbours = view.surface.vertices, view.surface.faces, view.surface.neighbours
    areas, heights, cosines, number = view.surface.areas_mm2, view.heights, view.cosines, view.number
    faces = patches.faces[patches.starts[own] : patches.starts[own + 1]]
    area, low, high, around = 0.0, np.inf, -np.inf, 0.0
    for f in faces:
        area -= areas[f] * cosines[f]
        for corner in range(3):
            height = heights[corners[f, corner]]
            low, high = min(low, height), max(high, height)
            if is_rim(neighbours, number, f, corner):
                ax, ay = seen_along(vertices, corners[f, corner], frame)
                bx, by = seen_along(vertices, corners[f, (corner + 1) % 3], frame)
                around += np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    return Patch(own, faces, frame, area, high - low, around)


@helper
def _carries_itself(view: View, patches: Patches, patch: Patch, pool: Pool, limits: Limits) -> bool:
    if patch.area_mm2 < limits.least_mm2 - ROUNDING_MM2:
        return True
    reach_mm = NARROW * limits.width_mm
    longest_mm = limits.bridge_mm if patch.rise_mm <= limits.level_mm + ROUNDING_MM else limits.arch_mm
    if patch.area_mm2 > max(reach_mm, 0.5 * (longest_mm + SPAN_ROUNDING_MM)) * patch.around_mm + ROUNDING_MM2:
        return False  # no rim is long enough for a place of that size to lie near it, or for lines that short
    for at_best in (True, False):
        if not at_best and begins_in_air(view.surface, view.heights, patch.faces, pool, view.base_mm):
            return False
        sides = find_sides(view, patches, patch.number, patch.frame, at_best)
        if not _is_held(view, patch, sides, longest_mm, limits.width_mm):
            return False
    return True


@helper
def _is_held(view: View, patch: Patch, sides: Sides, longest_mm: float, width_mm: float) -> bool:
    """Whether a patch is narrow or lines span it."""
    reach_mm = NARROW * width_mm
    if patch.area_mm2 <= reach_mm * patch.around_mm + ROUNDING_MM2 and _is_narrow(view.surface, patch, sides, reach_mm):
        return True
    return spans(sides, patch.area_mm2, longest_mm, width_mm)


@helper
def _is_narrow(surface: LinkedFaces, patch: Patch, sides: Sides, reach_mm: float) -> bool:
    """Whether no place of a patch lies further than that from the nearest anchor."""
    todo, triangle, nearest = table(DEEP, 6), floats(6, 0.0), 0
    for f in patch.faces:
        for corner in range(3):
            x, y = seen_along(surface.vertices, surface.faces[f, corner], patch.frame)
            triangle[2 * corner], triangle[2 * corner + 1] = x, y
        nearest = is_near_anchors(sides, reach_mm, triangle, todo, nearest)
        if nearest < 0:
            return False
    return True
