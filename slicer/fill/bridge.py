"""Bridges: hanging places whose lines can span from anchor to anchor, and the direction in which they sag least."""

from dataclasses import dataclass, replace

import numpy as np

from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from mdp.support_need.spans import ROUNDING_MM, TOLERATED, line_across
from slicer.bead import Bead
from slicer.fill.skin import SolidLines, skin_beads
from slicer.geometry.clip import rotation_2d
from slicer.geometry.edge_index import EdgeIndex, within
from slicer.geometry.polygons import Polygons, edges, islands, offset, opening, strips
from slicer.paths import Kind

TURNS = 18  # directions tried over half a turn, besides those of the place's own sides; the search tries fewer
SIDES = 8  # of its longest sides are tried, along and across: lines follow a real side, not the mean of several
LEAST = 4.0  # in line widths squared: a smaller place is no bridge but an edge
NARROW = 4.0  # line widths: narrower strips of skin over sparse infill are no bridges
REACH = 2.0  # line widths that the lines of a bridge reach over its anchors
LOOSE = 2.63  # a line held at one end sags like one this much longer held at both: (384 / 8)^(1/4), beam theory
ADRIFT = 10.0  # and one held nowhere like this
RIM_MM = 0.02  # neighbouring lines overlap by this so that they unite
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


def find_bridge(hanging: Polygons, anchors: EdgeIndex, width_mm: float) -> Bridge | None:
    """Lines over one connected hanging place in the direction that sags least; None where there is nothing to hold on to.

    anchors: edges of what may hold lines: the layer below, grown by a quarter of a line. The sum of squared spans is
    least, a line held at one end counting as 2.63 times its length: where all lines reach over, that is the direction of the
    shortest spans.
    """
    if hanging.area() < LEAST * width_mm**2 or not len(anchors.edges):
        return None
    sides = edges(hanging)
    angle, longest_mm, loose, _ = _least_sag(sides, anchors, _angles(sides), width_mm)
    return None if np.isnan(angle) else Bridge(hanging, float(np.degrees(angle)), longest_mm, loose)


def find_bridges(hanging: Polygons, anchors: EdgeIndex, width_mm: float) -> list[Bridge]:
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


def _held_piece(hanging: Polygons, anchors: EdgeIndex, width_mm: float) -> Bridge | None:
    """What of a place has lines held at both ends in the direction that has most of them; None where that is next to nothing."""
    sides = edges(hanging)
    *_, angle = _least_sag(sides, anchors, _angles(sides), width_mm)
    lines = _lines_across(sides, anchors, angle, width_mm)
    lines = lines[lines[:, 3] == 2.0]
    if not len(lines):
        return None
    ends = lines[:, [0, 2, 1, 2]].reshape(-1, 2, 2) @ rotation_2d(float(np.degrees(angle))).T
    piece = opening(strips(list(ends), 0.5 * width_mm + RIM_MM) ^ hanging, 0.5 * width_mm)
    if piece.area() < LEAST * width_mm**2:
        return None
    return Bridge(piece, float(np.degrees(angle)), float((lines[:, 1] - lines[:, 0]).max()), 0.0)


def _angles(sides: Floats) -> Floats:
    """Directions worth trying, radians in 0 .. pi, those of the place's sides first."""
    steps = sides[:, 2:] - sides[:, :2]
    longest = np.argsort(-np.hypot(*steps.T), kind="stable")[:SIDES]
    along = np.arctan2(steps[longest, 1], steps[longest, 0])
    own = np.round(np.concatenate([along, along + 0.5 * np.pi]) % np.pi, 4)
    return np.concatenate([np.unique(own), np.pi * np.arange(TURNS) / TURNS])


@kernel
def _lines_across(sides: Floats, anchors: EdgeIndex, angle: float, width_mm: float) -> Floats:
    """(n, 4) lines of a width across a place: begin, end and height in the frame turned by the angle; how many ends are held."""
    cos, sin, low, high, room = np.cos(angle), np.sin(angle), np.inf, -np.inf, 1
    for e in range(len(sides)):
        y, after = sides[e, 1] * cos - sides[e, 0] * sin, sides[e, 3] * cos - sides[e, 2] * sin
        low, high, room = min(low, y), max(high, y), room + int(abs(after - y) / width_mm) + 1
    out, places, crossed = table(room // 2, 4), floats(len(sides), 0.0), ints(len(sides), 0)
    n = 0
    for line in range(int(np.ceil((high - low) / width_mm - 0.5))):
        y = low + (line + 0.5) * width_mm
        for c in range(0, line_across(sides, (cos, sin), y, places, crossed) - 1, 2):
            for end in range(2):
                x = places[c + end]
                out[n, end] = x
                out[n, 3] += int(within(anchors, cos * x - sin * y, sin * x + cos * y))
            out[n, 2] = y
            n += 1
    return out[:n]


@kernel
def _least_sag(sides: Floats, anchors: EdgeIndex, angles: Floats, width_mm: float) -> tuple[float, float, float, float]:
    """The angle at which lines sag least (nan: none is held), its longest span and the loose share of its lines; and the angle
    with the greatest length of lines held at both ends."""
    best, least, longest_mm, loose = np.nan, np.inf, 0.0, 0.0
    holding, most_mm = 0.0, -1.0
    for angle in angles:
        lines = _lines_across(sides, anchors, angle, width_mm)
        total = sagging = free = longest = 0.0
        any_held = False
        for k in range(len(lines)):
            held, span = lines[k, 3], lines[k, 1] - lines[k, 0]
            total, longest, any_held = total + span, max(longest, span), any_held or held > 0.0
            sagging += (1.0 if held == 2.0 else LOOSE**2 if held == 1.0 else ADRIFT**2) * span * span
            free += span if held < 2.0 else 0.0
        if total - free > most_mm:
            holding, most_mm = angle, total - free
        if any_held and sagging < least * (1.0 - GAIN) * total:
            best, least, longest_mm, loose = angle, sagging / total, longest, free / total
    return best, longest_mm, loose, holding


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
