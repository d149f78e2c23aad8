"""Patches: connected overhangs along a direction, the sides of their rims that anchor bridging lines, and whether they support
themselves (numba kernels).

A patch supports itself if it is negligibly small, if no point of it is further than two line widths from its anchors, or if
parallel lines of limited length reach from anchor to anchor; not if it is a floating start, a local minimum. All criteria depend
on the shape and not on its triangulation.

A side is anchored where the solid beside it continues downward far enough to hold a line, or less far to the underside of
something that is itself held by an anchor: a ledge beneath the end of a deck does not hide a pillar.
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
CARRIES_ITSELF, NEEDS_SUPPORT, UNSUPPORTABLE = 0, 1, 2  # classes of faces, in ascending cost
NARROW = 2.0  # line widths from an anchor within which lines hold on to their neighbours
UNNUMBERED = -1  # faces that are not in a patch yet
ROUNDING_MM, ROUNDING_MM2 = 1e-6, 1e-6  # tolerances on the height and area of a patch
STEP_MM = 0.5  # between the sample points of a side
END_MM = 0.01  # distance of the first and the last sample point from the ends of a side
SHORT_MM = 0.1  # a side up to this length has a single sample point
HALVINGS = 6  # bisection steps to locate the end of an anchor between two sample points
UNKNOWN, HELD, UNHELD = 0, 1, 2  # what is known of a patch


class Limits(NamedTuple):
    """Limits of self-supporting overhangs. risky_below: cosine of normal and direction below which a face overhangs; base_mm:
    height along the direction up to which the surface rests on something; level_mm: greatest height of a level bridge, higher
    patches are arches; bridge_mm, arch_mm: greatest spans of both; width_mm: line width; least_mm2: a smaller patch, projected
    along the direction, supports itself.
    """

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
    """For each of k directions, with the frame across it, set the class (k, m) of self-supporting faces to CARRIES_ITSELF."""
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
    """List the faces that overhang and rest on nothing and mark them UNNUMBERED, all others SAFE; returns their number."""
    many = 0
    for f in range(len(under.cosines)):
        under.number[f] = SAFE
        if under.cosines[f] < risky_below and not _rests(under, f):
            under.number[f], risky[many] = UNNUMBERED, f
            many += 1
    return many


@no_nrt
def _find_patches(under: Underside, risky: Ints) -> int:
    """Number the overhanging faces by connected patch; returns the number of patches."""
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
    """Area of a patch projected along the direction, its height, and the length of its rim."""
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
        return False  # the rim is too short for every point of such an area to lie near it, or for lines of that length
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
    """Whether no point of a patch lies further than reach_mm from the nearest anchor."""
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
    """Whether the edge that begins at a corner of a patch's face is a rim edge."""
    g = under.surface.neighbours[f, corner]
    return bool(g < 0 or under.number[g] == SAFE)


@helper
def _seen_along(under: Underside, v: int) -> tuple[float, float]:
    """A vertex projected along the direction."""
    vertices, frame = under.surface.vertices, under.frame
    x: float = vertices[0, v] * frame[0, 0] + vertices[1, v] * frame[0, 1] + vertices[2, v] * frame[0, 2]
    y: float = vertices[0, v] * frame[1, 0] + vertices[1, v] * frame[1, 1] + vertices[2, v] * frame[1, 2]
    return x, y


@helper
def _find_sides(under: Underside, own: int, at_best: bool) -> Sides:
    """The sides of a patch projected along the direction, split where anchors end. at_best: a side counts as anchored if the
    solid goes down beside it at all; this is fast, and already excludes most patches.
    """
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
    """Number of sample points on a rim edge: its ends, and points at most STEP_MM apart."""
    g = under.surface.neighbours[f, corner]
    if not _may_anchor(under, f, corner) or _rests(under, g):
        return 1
    length_mm = _length(under, f, corner)
    return 1 if length_mm <= SHORT_MM else int(np.ceil(length_mm / STEP_MM)) + 1


@helper
def _share(under: Underside, f: int, corner: int, k: int, samples: int) -> float:
    """Position of sample point k as a share of an edge; those at the ends lie slightly inside."""
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
    """Whether the surface beyond a rim edge of a patch goes down from it or rests on the base."""
    surface, g = under.surface, under.surface.neighbours[f, corner]
    if g < 0:
        return False
    down = outflow(under, g, corner_of(surface, g, surface.faces[f, (corner + 1) % 3])) < 0.0
    return bool(down or _rests(under, g))


@helper
def _find_change(under: Underside, f: int, corner: int, low: float, high: float) -> float:
    """The share of an edge, between two sample points, at which an anchor ends or begins."""
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
    """Whether a point on a patch's rim is an anchor."""
    end = _look_down(under, f, corner, share)
    return end == ANCHORED or (end > 0 and _is_held(under, end))


@helper
def _look_down(under: Underside, f: int, corner: int, share: float) -> int:
    """Verdict on the descent beyond a point on a patch's rim."""
    if not _may_anchor(under, f, corner):
        return LOOSE
    surface, g = under.surface, under.surface.neighbours[f, corner]
    if _rests(under, g):
        return ANCHORED
    return descend(under, g, corner_of(surface, g, surface.faces[f, (corner + 1) % 3]), 1.0 - share, under.number[f])


@helper
def _is_held(under: Underside, start: int) -> bool:
    """Whether a patch has an anchor somewhere, or rests on a patch that has one."""
    if under.held[start] == UNKNOWN:
        under.waiting[0], under.held[start] = start, UNHELD
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
        for k in range(count if held else 0):  # the others stay unknown, since none of their visits was completed
            under.held[under.waiting[k]] = UNKNOWN
        under.held[start] = HELD if held else UNHELD
    return bool(under.held[start] == HELD)
