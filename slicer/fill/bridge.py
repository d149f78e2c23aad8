"""Bridges: hanging places whose lines can span from anchor to anchor, and the direction in which they sag least."""

from dataclasses import dataclass, replace

import numpy as np

from mdp.kernels.arrays import floats, table
from mdp.kernels.kernel import helper, kernel
from mdp.mesh import Floats
from mdp.support_need.spans import ROUNDING_MM
from slicer.bead import Bead
from slicer.fill.skin import SolidLines, skin_beads
from slicer.geometry.polygons import Polygons, edges, islands, offset, opening, strips
from slicer.geometry.scanlines import scan_lines
from slicer.geometry.segments import inside as is_inside
from slicer.paths import Kind

TURNS = 18  # directions tried over half a turn, besides those of the place's own sides
SIDES = 8  # so many of its longest sides are tried, along and across
LEAST = 4.0  # in line widths squared: a smaller place is no bridge but an edge
NARROW = 4.0  # line widths: narrower strips of skin over sparse infill are no bridges
REACH = 2.0  # line widths that the lines of a bridge reach over its anchors
LOOSE = 2.63  # a line held at one end sags like one this much longer held at both: (384 / 8)^(1/4), beam theory
ADRIFT = 10.0  # and one held nowhere like this
TOLERATED = 0.02  # share of a bridge's length that may have a loose end: corners of the place
RIM_MM = 0.02  # neighbouring lines overlap by this so that they unite
NEAR_MM = 1e-6  # more than rounding moves the end of a line off the side it lies on
GAIN = 0.01  # a direction is better only by this share, more than where the lines happen to lie; else the place's own sides win


@dataclass(frozen=True, eq=False)
class Bridge:
    """hanging: what it spans; angle_deg: direction of its lines, 0 to 180.

    longest_mm: the longest span; loose: share of the lines' length that is not held at both ends.
    """

    hanging: Polygons
    angle_deg: float
    longest_mm: float
    loose: float

    def carries(self, longest_mm: float) -> bool:
        """Whether it needs no support: every line from anchor to anchor, none longer than that."""
        return self.loose <= TOLERATED and self.longest_mm <= longest_mm + ROUNDING_MM


def find_bridge(hanging: Polygons, anchors: Floats, width_mm: float) -> Bridge | None:
    """Lines over one connected hanging place in the direction that sags least; None where there is nothing to hold on to.

    anchors: (n, 4) edges of what may hold lines: the layer below, grown by a quarter of a line. The sum of squared spans is
    least, a line held at one end counting as 2.63 times its length: where all lines reach over, that is the direction of the
    shortest spans.
    """
    if hanging.area() < LEAST * width_mm**2 or not len(anchors):
        return None
    sides = edges(hanging)
    angles = _angles(sides)
    best, longest_mm, loose, _ = _least_sag(sides, _edges_near(anchors, sides), np.array(angles), width_mm)
    return None if best < 0 else Bridge(hanging, float(np.degrees(angles[best])), longest_mm, loose)


def find_bridges(hanging: Polygons, anchors: Floats, width_mm: float) -> list[Bridge]:
    """Lines over one connected hanging place, each piece of it in the direction in which most of them are held at both ends.

    Where no direction holds all of the place, what the best one holds is bridged so, and the rest in its turn.
    """
    bridges: list[Bridge] = []
    left = [hanging]
    while left:
        piece = left.pop()
        bridge = find_bridge(piece, anchors, width_mm)
        held = None if bridge is None or bridge.loose <= TOLERATED else _held_piece(piece, anchors, width_mm)
        if held is None:
            bridges += [bridge] if bridge is not None else []
        else:
            bridges.append(held)
            left += islands(opening(piece - held.hanging, 0.25 * width_mm))
    return bridges


def _held_piece(hanging: Polygons, anchors: Floats, width_mm: float) -> Bridge | None:
    """What of a place has lines held at both ends in the direction that has most of them; None where that is next to nothing."""
    sides = edges(hanging)
    angles, near = np.array(_angles(sides)), _edges_near(anchors, sides)
    held_mm = _least_sag(sides, near, angles, width_mm)[3]
    angle = float(angles[int(np.argmax(held_mm))])
    rows = _held_rows(sides, near, angle, width_mm)
    if not len(rows):
        return None
    cos, sin = np.cos(angle), np.sin(angle)
    ends = rows[:, [0, 2, 1, 2]].reshape(-1, 2, 2) @ np.array([[cos, sin], [-sin, cos]])
    piece = opening(strips(list(ends), 0.5 * width_mm + RIM_MM) ^ hanging, 0.5 * width_mm)
    if piece.area() < LEAST * width_mm**2:
        return None
    return Bridge(piece, float(np.degrees(angle)), float((rows[:, 1] - rows[:, 0]).max()), 0.0)


def _edges_near(anchors: Floats, sides: Floats) -> Floats:
    """The edges that a ray to the right may cross from anywhere on a place with these sides."""
    x, y = sides[:, 0], sides[:, 1]
    above, below = y.min() - NEAR_MM, y.max() + NEAR_MM
    right = np.maximum(anchors[:, 0], anchors[:, 2]) > x.min() - NEAR_MM
    level = (np.maximum(anchors[:, 1], anchors[:, 3]) > above) & (np.minimum(anchors[:, 1], anchors[:, 3]) < below)
    near: Floats = anchors[right & level]
    return near


def _angles(sides: Floats) -> list[float]:
    """Directions worth trying, radians in 0 .. pi, those of the place's sides first."""
    steps = sides[:, 2:] - sides[:, :2]
    longest = np.argsort(-np.hypot(*steps.T), kind="stable")[:SIDES]
    along = np.arctan2(steps[longest, 1], steps[longest, 0])
    own = np.round(np.concatenate([along, along + 0.5 * np.pi]) % np.pi, 4)
    return [*np.unique(own).tolist(), *(np.pi * np.arange(TURNS) / TURNS).tolist()]


@helper
def _rows_at(sides: Floats, angle: float, width_mm: float) -> Floats:
    """(n, 3) lines of a width across a place at an angle, begin, end and height in the frame turned by it."""
    cos, sin = np.cos(angle), np.sin(angle)
    turned, low, high = table(len(sides), 4), np.inf, -np.inf
    for e in range(len(sides)):
        for k in range(0, 4, 2):
            x, y = sides[e, k], sides[e, k + 1]
            turned[e, k], turned[e, k + 1] = x * cos + y * sin, y * cos - x * sin
        low, high = min(low, turned[e, 1]), max(high, turned[e, 1])
    heights = floats(max(int(np.ceil((high - low) / width_mm - 0.5)), 0), 0.0)
    for k in range(len(heights)):
        heights[k] = low + (k + 0.5) * width_mm
    rows: Floats = scan_lines(turned, heights)
    return rows


@helper
def _held_ends(row: Floats, anchors: Floats, angle: float) -> int:
    """How many ends of a line lie on an anchor."""
    cos, sin, held = np.cos(angle), np.sin(angle), 0
    for end in range(2):
        held += is_inside(anchors, cos * row[end] - sin * row[2], sin * row[end] + cos * row[2])
    return held


@kernel
def _least_sag(sides: Floats, anchors: Floats, angles: Floats, width_mm: float) -> tuple[int, float, float, Floats]:
    """Which angle sags least (-1: none is held), its longest span and the share of its lines that is loose; of every angle the
    length of its lines that are held at both ends."""
    best, least, longest_mm, loose = -1, np.inf, 0.0, 0.0
    sag_of, held_mm = np.array([ADRIFT**2, LOOSE**2, 1.0]), floats(len(angles), 0.0)
    for a in range(len(angles)):
        rows = _rows_at(sides, angles[a], width_mm)
        total = sagging = free = longest = 0.0
        any_held = False
        for r in range(len(rows)):
            held = _held_ends(rows[r], anchors, angles[a])
            span = rows[r, 1] - rows[r, 0]
            total, longest, any_held = total + span, max(longest, span), any_held or held > 0
            sagging += sag_of[held] * span * span
            free += span if held < 2 else 0.0
        held_mm[a] = total - free
        if any_held and sagging < least * (1.0 - GAIN) * total:
            best, least, longest_mm, loose = a, sagging / total, longest, free / total
    return best, longest_mm, loose, held_mm


@kernel
def _held_rows(sides: Floats, anchors: Floats, angle: float, width_mm: float) -> Floats:
    """(n, 3) the lines at an angle that are held at both ends, as _rows_at."""
    rows = _rows_at(sides, angle, width_mm)
    n = 0
    for r in range(len(rows)):
        if _held_ends(rows[r], anchors, angle) == 2:
            for k in range(3):
                rows[n, k] = rows[r, k]
            n += 1
    return rows[:n].copy()


def bridge_area(span: Bridge, inside: Polygons, width_mm: float) -> Polygons:
    """Where the lines of a bridge run: over what hangs of a layer's inside, and onto the anchors as far as the inside reaches."""
    wide = opening(span.hanging ^ inside, 0.5 * width_mm)
    return wide if wide.is_empty() else offset(wide, REACH * width_mm) ^ inside


def bridge_beads(area: Polygons, lines: SolidLines, flow: float, over_infill: bool = False) -> list[Bead]:
    """The lines of a bridge with its own flow. over_infill: the first solid ones over sparse infill, across the lines below
    wherever those have one direction."""
    return [replace(bead, flow=bead.flow * flow, over_infill=over_infill) for bead in skin_beads(area, Kind.BRIDGE, lines)]


def infill_bridge_area(solid: Polygons, sparse_below: Polygons, width_mm: float) -> Polygons:
    """Where solid lines span the sparse infill of the layer below, and as far beyond as they hold on to what is solid there.

    Strips narrower than NARROW lines are left out: the skin beside them carries their lines.
    """
    if solid.is_empty() or sparse_below.is_empty():
        return Polygons()
    spanned = solid ^ sparse_below
    if spanned.area() < (NARROW * width_mm) ** 2:
        return Polygons()
    wide = opening(spanned, 0.5 * NARROW * width_mm)
    return wide if wide.is_empty() else offset(wide, REACH * width_mm) ^ solid
