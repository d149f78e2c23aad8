"""Sides: the rim of a hanging place, and which of its sides anchor a line over it (numba kernels).

A side is anchored where the solid goes down beside it, far enough to hold a line, or less far to the underside of something that
is itself held by an anchor: a ledge beneath the end of a deck hides no pillar.
"""

from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import helper, no_nrt
from mdp.mesh import Floats, Ints
from mdp.support_need.descent import ANCHORED, LOOSE, SAFE, View, corner_of, descend, outflow
from mdp.support_need.spans import Sides

STEP_MM = 0.5  # between the places of a side at which one looks down
END_MM = 0.01  # of a side, within which the first and the last of them lie
SHORT_MM = 0.1  # a side no longer has only one
HALVINGS = 6  # until the end of an anchor between two of them is found
UNKNOWN, HELD, UNHELD = 0, 1, 2  # what is known of a patch


class Patches(NamedTuple):
    """All patches of a direction, numbered from 1: the faces of patch p are faces[starts[p] : starts[p + 1]]; held (k,): whether
    an anchor holds it, UNKNOWN until it is asked for; waiting (k,): room for patches to look at."""

    faces: Ints
    starts: Ints
    held: Ints
    waiting: Ints


@no_nrt
def is_rim(neighbours: Ints, number: Ints, f: int, corner: int) -> bool:
    """Whether a patch ends at the edge of its face that begins at a corner."""
    g = neighbours[f, corner]
    return bool(g < 0 or number[g] == SAFE)


@helper
def seen_along(vertices: Floats, v: int, frame: Floats) -> tuple[float, float]:
    """A vertex seen along the direction."""
    x: float = vertices[0, v] * frame[0, 0] + vertices[1, v] * frame[0, 1] + vertices[2, v] * frame[0, 2]
    y: float = vertices[0, v] * frame[1, 0] + vertices[1, v] * frame[1, 1] + vertices[2, v] * frame[1, 2]
    return x, y


@helper
def find_sides(view: View, patches: Patches, own: int, frame: Floats, at_best: bool) -> Sides:
    """The sides of a patch seen along the direction, cut where anchors end. at_best: anchored wherever the solid goes down beside
    them at all: found at once, and most patches cannot do with these either."""
    faces, neighbours, count = patches.faces[patches.starts[own] : patches.starts[own + 1]], view.surface.neighbours, 0
    for f in faces:
        for corner in range(3):
            if is_rim(neighbours, view.number, f, corner):
                count += 1 if at_best else _count_samples(view, f, corner)
    ends, anchored, line, count = table(count, 4), ints(count, 0), floats(4, 0.0), 0
    for f in faces:
        for corner in range(3):
            if not is_rim(neighbours, view.number, f, corner):
                continue
            _see_edge(view, f, corner, frame, line)
            begin, samples, state = 0.0, 1, at_best and _may_anchor(view, f, corner)
            if not at_best:
                samples = _count_samples(view, f, corner)
                state = _is_anchored(view, patches, f, corner, _share(view, f, corner, 0, samples))
            for k in range(1, samples):
                share = _share(view, f, corner, k, samples)
                after = _is_anchored(view, patches, f, corner, share)
                if after != state:
                    end = _find_change(view, patches, f, corner, _share(view, f, corner, k - 1, samples), share)
                    anchored[count] = int(state)
                    count = _add(ends, count, line, begin, end)
                    begin, state = end, after
            anchored[count], end = int(state), 1.0
            count = _add(ends, count, line, begin, end)
    return Sides(ends[:count], anchored[:count])


@helper
def _see_edge(view: View, f: int, corner: int, frame: Floats, line: Floats) -> None:
    """An edge seen along the direction, x, y, x, y."""
    vertices, faces = view.surface.vertices, view.surface.faces
    line[0], line[1] = seen_along(vertices, faces[f, corner], frame)
    line[2], line[3] = seen_along(vertices, faces[f, (corner + 1) % 3], frame)


@helper
def _add(ends: Floats, count: int, line: Floats, begin: float, end: float) -> int:
    """Add the piece of a line between two shares of it; how many there are then."""
    for axis in range(2):
        step = line[2 + axis] - line[axis]
        ends[count, axis], ends[count, 2 + axis] = line[axis] + begin * step, line[axis] + end * step
    return count + 1


@helper
def _length(view: View, f: int, corner: int) -> float:
    """The length of an edge, mm."""
    a, b, squared = view.surface.faces[f, corner], view.surface.faces[f, (corner + 1) % 3], 0.0
    for axis in range(3):
        squared += (view.surface.vertices[axis, b] - view.surface.vertices[axis, a]) ** 2
    return float(np.sqrt(squared))


@helper
def _count_samples(view: View, f: int, corner: int) -> int:
    """At how many places of an edge of the rim one looks down: both its ends and no further than STEP_MM apart."""
    g = view.surface.neighbours[f, corner]
    if not _may_anchor(view, f, corner) or rests(view.surface.faces, view.heights, g, view.base_mm):
        return 1
    length_mm = _length(view, f, corner)
    return 1 if length_mm <= SHORT_MM else int(np.ceil(length_mm / STEP_MM)) + 1


@helper
def _share(view: View, f: int, corner: int, k: int, samples: int) -> float:
    """Where on an edge the place k lies at which one looks down; those at its ends a little within it."""
    if samples == 1:
        return 0.5
    inside = END_MM / _length(view, f, corner)
    return min(max(k / (samples - 1), inside), 1.0 - inside)


@no_nrt
def rests(faces: Ints, heights: Floats, f: int, base_mm: float) -> bool:
    """Whether all of a face lies on the base."""
    return bool(max(heights[faces[f, 0]], heights[faces[f, 1]], heights[faces[f, 2]]) <= base_mm)


@helper
def _may_anchor(view: View, f: int, corner: int) -> bool:
    """Whether the surface beyond an edge of a patch's rim goes down from it or rests on the base."""
    surface, g = view.surface, view.surface.neighbours[f, corner]
    if g < 0:
        return False
    down = outflow(view, g, corner_of(surface, g, surface.faces[f, (corner + 1) % 3])) < 0.0
    return bool(down or rests(surface.faces, view.heights, g, view.base_mm))


@helper
def _find_change(view: View, patches: Patches, f: int, corner: int, low: float, high: float) -> float:
    """Where between two places of an edge an anchor ends or begins."""
    first = _is_anchored(view, patches, f, corner, low)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _is_anchored(view, patches, f, corner, middle) == first:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@helper
def _is_anchored(view: View, patches: Patches, f: int, corner: int, share: float) -> bool:
    """Whether a place of a patch's rim is an anchor."""
    end = _look_down(view, f, corner, share)
    return end == ANCHORED or (end > 0 and _is_held(view, patches, end))


@helper
def _look_down(view: View, f: int, corner: int, share: float) -> int:
    """What the way down beyond a place of a patch's rim comes to."""
    if not _may_anchor(view, f, corner):
        return LOOSE
    surface, g = view.surface, view.surface.neighbours[f, corner]
    if rests(surface.faces, view.heights, g, view.base_mm):
        return ANCHORED
    return descend(view, g, corner_of(surface, g, surface.faces[f, (corner + 1) % 3]), 1.0 - share, view.number[f])


@helper
def _is_held(view: View, patches: Patches, asked: int) -> bool:
    """Whether a patch has an anchor somewhere, or rests on another one that has."""
    if patches.held[asked] == UNKNOWN:
        patches.waiting[0], patches.held[asked] = asked, UNHELD
        at, count, held, neighbours = 0, 1, False, view.surface.neighbours
        while at < count and not held:
            patch = patches.waiting[at]
            for k in range(patches.starts[patch], patches.starts[patch + 1]):
                f = patches.faces[k]
                for corner in range(3):
                    samples = _count_samples(view, f, corner) if is_rim(neighbours, view.number, f, corner) and not held else 0
                    for sample in range(samples):
                        end = _look_down(view, f, corner, _share(view, f, corner, sample, samples))
                        if end == ANCHORED or (end > 0 and patches.held[end] == HELD):
                            held = True
                            break
                        if end > 0 and patches.held[end] == UNKNOWN:
                            patches.waiting[count], patches.held[end] = end, UNHELD
                            count += 1
            at += 1
        for k in range(count if held else 0):  # the others stay unasked, none of them was looked at to its end
            patches.held[patches.waiting[k]] = UNKNOWN
        patches.held[asked] = HELD if held else UNHELD
    return bool(patches.held[asked] == HELD)
