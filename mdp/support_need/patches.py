"""Patches: the connected places that overhang along a direction, which sides of their rims anchor a line over them, and which of
them carry themselves (numba kernels).

A patch carries itself when it is too small to matter, when it nowhere reaches further than two line widths from its anchors, or
when lines over it reach from anchor to anchor, all in one direction and short enough; not so where it begins in mid-air, at a
local minimum. All that is asked of the shape, never of its triangles: however a surface is cut into faces, it needs the same.

A side is anchored where the solid goes down beside it, far enough to hold a line, or less far to the underside of something that
is itself held by an anchor: a ledge beneath the end of a deck hides no pillar.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import dot, floats, ints, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Ints
from mdp.support_need.descent import (
    ANCHORED,
    LOOSE,
    SAFE,
    UNSEEN,
    Pool,
    Underside,
    begins_in_air,
    corner_of,
    descend,
    outflow,
)
from mdp.support_need.spans import DEEP, Sides, is_near_anchors, spans
from mdp.support_need.spans import ROUNDING_MM as SPAN_ROUNDING_MM
from mdp.topology.edges import LinkedFaces

Classes = NDArray[np.uint8]
CARRIES_ITSELF, NEEDS_SUPPORT, UNSUPPORTABLE = 0, 1, 2  # classes of faces, the dearer the higher
NARROW = 2.0  # line widths from an anchor that lines hold on to their neighbours
UNNUMBERED = -1  # faces that belong to no patch yet
ROUNDING_MM, ROUNDING_MM2 = 1e-6, 1e-6  # of a patch just as high or as large as it may be
STEP_MM = 0.5  # between the places of a side at which one looks down
END_MM = 0.01  # of a side, within which the first and the last of them lie
SHORT_MM = 0.1  # a side no longer has only one
HALVINGS = 6  # until the end of an anchor between two of them is found
UNKNOWN, HELD, UNHELD = 0, 1, 2  # what is known of a patch


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


@kernel
def classify(
    begin_row: int, end_row: int, surface: LinkedFaces, framed: tuple[Floats, Floats], limits: Limits, out: Classes
) -> None:
    """For each of k directions, with the frames across them, put CARRIES_ITSELF where it holds among the classes of the faces,
    (k, m)."""
    (directions, frames), count, size = framed, surface.normals.shape[1], surface.vertices.shape[1]
    number, faces, starts, held, waiting = (
        ints(count, 0),
        ints(count, 0),
        ints(count + 2, 0),
        ints(count + 2, 0),
        ints(count + 2, 0),
    )
    heights, cosines, risky, point = floats(size, 0.0), floats(count, 0.0), ints(count + 1, 0), floats(3, 0.0)
    pool, base_mm = (ints(size, 0), ints(size, 0)), limits.base_mm
    for row in range(begin_row, end_row):
        d, frame = directions[row], frames[row]
        under = Underside(surface, d, frame, heights, cosines, base_mm, number, faces, starts, held, waiting, point)
        dot(surface.vertices[0], surface.vertices[1], surface.vertices[2], d, heights)
        dot(surface.normals[0], surface.normals[1], surface.normals[2], d, cosines)
        for v in range(size):
            pool[0][v] = UNSEEN
        many = _find_risky(under, limits.risky_below, risky)
        for own in range(1, _find_patches(under, risky[:many]) + 1):
            if _carries_itself(under, own, pool, limits):
                for at in range(starts[own], starts[own + 1]):
                    out[row, faces[at]] = CARRIES_ITSELF


@no_nrt
def _find_risky(under: Underside, risky_below: float, risky: Ints) -> int:
    """List the faces that overhang and rest on nothing, UNNUMBERED, all others SAFE; how many there are."""
    many = 0
    for f in range(len(under.cosines)):
        under.number[f] = SAFE
        if under.cosines[f] < risky_below and not _rests(under, f):
            under.number[f], risky[many] = UNNUMBERED, f
            many += 1
    return many


@no_nrt
def _find_patches(under: Underside, risky: Ints) -> int:
    """Number all overhanging faces, those alike that hang together; how many patches there are."""
    neighbours, number, faces, own, size, at = under.surface.neighbours, under.number, under.faces, 0, 0, 0
    for seed in risky:
        if number[seed] == UNNUMBERED:
            own += 1
            faces[size], number[seed] = seed, own
            under.starts[own], under.held[own] = size, UNKNOWN
            size += 1
        while at < size:
            for k in range(3):
                g = neighbours[faces[at], k]
                if g >= 0 and number[g] == UNNUMBERED:
                    faces[size], number[g] = g, own
                    size += 1
            at += 1
    under.starts[own + 1] = size
    return own


@helper
def _measure(under: Underside, own: int) -> tuple[float, float, float]:
    """The area of a patch seen along the direction, how high it is and how long its rim."""
    corners, heights = under.surface.faces, under.heights
    area, low, high, around = 0.0, np.inf, -np.inf, 0.0
    for f in under.faces[under.starts[own] : under.starts[own + 1]]:
        area -= under.surface.areas_mm2[f] * under.cosines[f]
        for corner in range(3):
            height = heights[corners[f, corner]]
            low, high = min(low, height), max(high, height)
            if _is_rim(under, f, corner):
                ax, ay = _seen_along(under, corners[f, corner])
                bx, by = _seen_along(under, corners[f, (corner + 1) % 3])
                around += np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    return area, high - low, around


@helper
def _carries_itself(under: Underside, own: int, pool: Pool, limits: Limits) -> bool:
    area_mm2, rise_mm, around_mm = _measure(under, own)
    if area_mm2 < limits.least_mm2 - ROUNDING_MM2:
        return True
    reach_mm = NARROW * limits.width_mm
    longest_mm = limits.bridge_mm if rise_mm <= limits.level_mm + ROUNDING_MM else limits.arch_mm
    if area_mm2 > max(reach_mm, 0.5 * (longest_mm + SPAN_ROUNDING_MM)) * around_mm + ROUNDING_MM2:
        return False  # no rim is long enough for a place of that size to lie near it, or for lines that short
    patch, may_be_narrow = under.faces[under.starts[own] : under.starts[own + 1]], area_mm2 <= reach_mm * around_mm + ROUNDING_MM2
    for at_best in (True, False):
        if not at_best and begins_in_air(under.surface, under.heights, patch, pool, under.base_mm):
            return False
        sides = _find_sides(under, own, at_best)
        narrow = may_be_narrow and _is_narrow(under, patch, sides, reach_mm)
        if not narrow and not spans(sides, area_mm2, longest_mm, limits.width_mm):
            return False
    return True


@helper
def _is_narrow(under: Underside, patch: Ints, sides: Sides, reach_mm: float) -> bool:
    """Whether no place of a patch lies further than that from the nearest anchor."""
    todo, triangle, nearest = table(DEEP, 6), floats(6, 0.0), 0
    for f in patch:
        for corner in range(3):
            triangle[2 * corner], triangle[2 * corner + 1] = _seen_along(under, under.surface.faces[f, corner])
        nearest = is_near_anchors(sides, reach_mm, triangle, todo, nearest)
        if nearest < 0:
            return False
    return True


@no_nrt
def _is_rim(under: Underside, f: int, corner: int) -> bool:
    """Whether a patch ends at the edge of its face that begins at a corner."""
    g = under.surface.neighbours[f, corner]
    return bool(g < 0 or under.number[g] == SAFE)


@helper
def _seen_along(under: Underside, v: int) -> tuple[float, float]:
    """A vertex seen along the direction."""
    vertices, frame = under.surface.vertices, under.frame
    x: float = vertices[0, v] * frame[0, 0] + vertices[1, v] * frame[0, 1] + vertices[2, v] * frame[0, 2]
    y: float = vertices[0, v] * frame[1, 0] + vertices[1, v] * frame[1, 1] + vertices[2, v] * frame[1, 2]
    return x, y


@helper
def _find_sides(under: Underside, own: int, at_best: bool) -> Sides:
    """The sides of a patch seen along the direction, cut where anchors end. at_best: anchored wherever the solid goes down beside
    them at all: found at once, and most patches cannot do with these either."""
    faces, count = under.faces[under.starts[own] : under.starts[own + 1]], 0
    for f in faces:
        for corner in range(3):
            if _is_rim(under, f, corner):
                count += 1 if at_best else _count_samples(under, f, corner)
    ends, anchored, line, count = table(count, 4), ints(count, 0), floats(4, 0.0), 0
    for f in faces:
        for corner in range(3):
            if not _is_rim(under, f, corner):
                continue
            line[0], line[1] = _seen_along(under, under.surface.faces[f, corner])
            line[2], line[3] = _seen_along(under, under.surface.faces[f, (corner + 1) % 3])
            begin, samples = 0.0, 1 if at_best else _count_samples(under, f, corner)
            first = _share(under, f, corner, 0, samples)
            state = _may_anchor(under, f, corner) if at_best else _is_anchored(under, f, corner, first)
            for k in range(1, samples + 1):
                after, end = state, 1.0
                if k < samples:
                    share = _share(under, f, corner, k, samples)
                    after = _is_anchored(under, f, corner, share)
                    if after == state:
                        continue
                    end = _find_change(under, f, corner, _share(under, f, corner, k - 1, samples), share)
                anchored[count] = int(state)
                for axis in range(2):
                    step = line[2 + axis] - line[axis]
                    ends[count, axis], ends[count, 2 + axis] = line[axis] + begin * step, line[axis] + end * step
                count, begin, state = count + 1, end, after
    return Sides(ends[:count], anchored[:count])


@helper
def _length(under: Underside, f: int, corner: int) -> float:
    """The length of an edge, mm."""
    a, b, squared = under.surface.faces[f, corner], under.surface.faces[f, (corner + 1) % 3], 0.0
    for axis in range(3):
        squared += (under.surface.vertices[axis, b] - under.surface.vertices[axis, a]) ** 2
    return float(np.sqrt(squared))


@helper
def _count_samples(under: Underside, f: int, corner: int) -> int:
    """At how many places of an edge of the rim one looks down: both its ends and no further than STEP_MM apart."""
    g = under.surface.neighbours[f, corner]
    if not _may_anchor(under, f, corner) or _rests(under, g):
        return 1
    length_mm = _length(under, f, corner)
    return 1 if length_mm <= SHORT_MM else int(np.ceil(length_mm / STEP_MM)) + 1


@helper
def _share(under: Underside, f: int, corner: int, k: int, samples: int) -> float:
    """Where on an edge the place k lies at which one looks down; those at its ends a little within it."""
    if samples == 1:
        return 0.5
    inside = END_MM / _length(under, f, corner)
    return min(max(k / (samples - 1), inside), 1.0 - inside)


@no_nrt
def _rests(under: Underside, f: int) -> bool:
    """Whether all of a face lies on the base."""
    faces, heights = under.surface.faces, under.heights
    return bool(max(heights[faces[f, 0]], heights[faces[f, 1]], heights[faces[f, 2]]) <= under.base_mm)


@helper
def _may_anchor(under: Underside, f: int, corner: int) -> bool:
    """Whether the surface beyond an edge of a patch's rim goes down from it or rests on the base."""
    surface, g = under.surface, under.surface.neighbours[f, corner]
    if g < 0:
        return False
    down = outflow(under, g, corner_of(surface, g, surface.faces[f, (corner + 1) % 3])) < 0.0
    return bool(down or _rests(under, g))


@helper
def _find_change(under: Underside, f: int, corner: int, low: float, high: float) -> float:
    """Where between two places of an edge an anchor ends or begins."""
    first = _is_anchored(under, f, corner, low)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _is_anchored(under, f, corner, middle) == first:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@helper
def _is_anchored(under: Underside, f: int, corner: int, share: float) -> bool:
    """Whether a place of a patch's rim is an anchor."""
    end = _look_down(under, f, corner, share)
    return end == ANCHORED or (end > 0 and _is_held(under, end))


@helper
def _look_down(under: Underside, f: int, corner: int, share: float) -> int:
    """What the way down beyond a place of a patch's rim comes to."""
    if not _may_anchor(under, f, corner):
        return LOOSE
    surface, g = under.surface, under.surface.neighbours[f, corner]
    if _rests(under, g):
        return ANCHORED
    return descend(under, g, corner_of(surface, g, surface.faces[f, (corner + 1) % 3]), 1.0 - share, under.number[f])


@helper
def _is_held(under: Underside, asked: int) -> bool:
    """Whether a patch has an anchor somewhere, or rests on another one that has."""
    if under.held[asked] == UNKNOWN:
        under.waiting[0], under.held[asked] = asked, UNHELD
        at, count, held = 0, 1, False
        while at < count and not held:
            patch = under.waiting[at]
            for k in range(under.starts[patch], under.starts[patch + 1]):
                f = under.faces[k]
                for corner in range(3):
                    samples = _count_samples(under, f, corner) if _is_rim(under, f, corner) and not held else 0
                    for sample in range(samples):
                        end = _look_down(under, f, corner, _share(under, f, corner, sample, samples))
                        if end == ANCHORED or (end > 0 and under.held[end] == HELD):
                            held = True
                            break
                        if end > 0 and under.held[end] == UNKNOWN:
                            under.waiting[count], under.held[end] = end, UNHELD
                            count += 1
            at += 1
        for k in range(count if held else 0):  # the others stay unknown: the visit of none of them was finished
            under.held[under.waiting[k]] = UNKNOWN
        under.held[asked] = HELD if held else UNHELD
    return bool(under.held[asked] == HELD)
