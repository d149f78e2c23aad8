"""Overhangs of each layer: areas that need support, self-supporting ledges, and bridges from anchor to anchor in the direction of
least sag.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np

from mdp.kernels.arrays import floats, ints, table
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from mdp.overhang import UP, facing_down
from mdp.support_need.need import needs_support
from mdp.support_need.spans import ROUNDING_MM, TOLERATED, line_across
from profiles.process import Process
from slicer.geometry.clip import rotation_2d
from slicer.geometry.edge_index import EdgeIndex, index_edges, within
from slicer.geometry.polygons import Polygons, edges, islands, offset, opening, strips, union
from slicer.heights import SAME_MM
from slicer.sectioning import RIM_MM, Sections, faces_by_layer

LEAST_MM2 = 1e-3  # smaller areas are rounding
TURNS = 18  # directions tried over half a turn, besides those of the area's sides; the search tries fewer
SIDES = 8  # number of longest sides that are tried, along and across: lines follow a real side, not the mean of several
LEAST = 4.0  # in line widths squared: a smaller area is not a bridge but an edge
LOOSE = 2.63  # a line held at one end sags like one this much longer held at both: (384 / 8)^(1/4), beam theory
UNHELD = 10.0  # equivalent factor for a line held at no end
LINE_RIM_MM = 0.02  # overlap by which neighbouring lines unite
GAIN = 0.1  # least relative reduction of the sag over directions tried before; the area's sides come first


@dataclass(frozen=True, eq=False)
class Bridge:
    """A bridge. hanging: the bridged area; angle_deg: direction of its lines, 0 to 180.

    longest_mm: the longest span; loose: share of the lines' length that is not held at both ends.
    """

    hanging: Polygons
    angle_deg: float
    longest_mm: float
    loose: float

    def carries(self, longest_mm: float) -> bool:
        """Whether the bridge needs no support: every line reaches from anchor to anchor and none is longer than the limit."""
        return self.loose <= TOLERATED and self.longest_mm <= longest_mm + ROUNDING_MM


@dataclass(frozen=True, eq=False)
class Overhang:
    """The overhangs of one layer.

    hanging: area that needs support; bridges: spanned by lines; ledges: self-supporting, too short or wide to bridge; unwanted:
    would need support, but the user wants none there.
    """

    hanging: Polygons = field(default_factory=Polygons)
    bridges: tuple[Bridge, ...] = ()
    ledges: Polygons = field(default_factory=Polygons)
    unwanted: Polygons = field(default_factory=Polygons)


def find_overhangs(sections: Sections) -> list[Overhang]:
    """The overhangs of every layer: the part of its outline above a risky face, and floating starts.

    The first layer on the build plate has none. Areas that support themselves by the search's definition (mdp.support_need) need
    no support, nor do areas that bridge layer by layer, like arches. With support disabled, every area with an anchor is printed
    as a bridge, whatever its length. In zones where the user wants support, everything beyond the layer below needs it.
    """
    process, mesh, outlines, cuts_mm = sections.process, sections.mesh, sections.outlines, sections.heights.cut_mm
    level_mm, arch_mm = (inf, inf) if process.support != "auto" else (process.bridge_mm, process.arch_longest_mm)
    enforces = process.support != "none" and len(sections.enforced) > 0
    overhangs = [Overhang()] * len(outlines)
    risky = facing_down(mesh, UP, process.self_supporting_angle_deg)
    needing = faces_by_layer(mesh, cuts_mm, risky & needs_support(mesh, process, sections.on_plate))
    faces = faces_by_layer(mesh, cuts_mm, risky)
    for i in range(int(sections.on_plate), len(outlines)):
        below = outlines[i - 1] if i else offset(sections.plastic_below or Polygons(), RIM_MM)
        beyond, triangles = outlines[i] - below, faces.get(i, [])
        # A floating start lies entirely beyond the layer below, however steep it is, like a bell's rim that becomes thick enough
        # for a line.
        small = [piece for piece in islands(outlines[i]) if piece.area() < beyond.area() + LEAST_MM2]
        floating = union([piece for piece in small if (piece ^ below).is_empty()])
        hanging = beyond ^ offset(Polygons(triangles), 0.5 * RIM_MM) if triangles else Polygons()
        hanging = hanging if floating.is_empty() else hanging + floating
        enforced = opening(beyond ^ sections.enforced[i], ROUNDING_MM) if enforces else Polygons()
        overhang = Overhang()
        if not hanging.is_empty():
            all_need = len(needing.get(i, ())) == len(triangles)
            need = hanging if all_need else hanging ^ (offset(Polygons(needing.get(i, [])), 0.5 * RIM_MM) + floating)
            anchors = below + (outlines[i] - hanging)  # including self-supporting slopes beside it
            overhang = _sort_islands(hanging, need, anchors, process, (level_mm, min(level_mm, arch_mm)))
        if not enforced.is_empty():
            bridges = [replace(bridge, hanging=bridge.hanging - enforced) for bridge in overhang.bridges]
            left = tuple(bridge for bridge in bridges if bridge.hanging.area() >= LEAST_MM2)
            overhang = replace(overhang, hanging=overhang.hanging + enforced, bridges=left, ledges=overhang.ledges - enforced)
        if sections.no_support and not overhang.hanging.is_empty():
            wanted = overhang.hanging - sections.no_support[i]
            overhang = replace(overhang, hanging=wanted, unwanted=overhang.hanging - wanted)
        overhangs[i] = overhang
    return overhangs


def _sort_islands(
    hanging: Polygons, need: Polygons, anchors: Polygons, process: Process, longest_mm: tuple[float, float]
) -> Overhang:
    """Classify the connected pieces of an overhanging area.

    need: the part of it that needs support by the search's definition; longest_mm: greatest span of bridges without and with such
    a part.
    """
    width_mm, places = process.line_width_mm, islands(hanging)
    if all(island.area() < LEAST * width_mm**2 for island in places):
        return Overhang(need)
    held_by = index_edges(offset(anchors, 0.25 * width_mm))
    rest, bridges = [], []
    for island in places:
        bridge = find_bridge(island, held_by, width_mm, process.bridge_angle_deg)
        most_mm = longest_mm[(island ^ need).area() >= LEAST * width_mm**2]
        if bridge is not None and (most_mm == inf or bridge.carries(most_mm)):
            bridges.append(bridge)
        else:
            rest.append(island)
    left = Polygons.compose(rest) if rest else Polygons()
    return Overhang(left ^ need, tuple(bridges), left - need)


def find_bridge(hanging: Polygons, anchors: EdgeIndex, width_mm: float, angle_deg: float = 0.0) -> Bridge | None:
    """Bridge lines over one connected overhanging area in the direction of least sag; None if there is no anchor.

    anchors: edges of the area that holds lines: the layer below, grown by a quarter of a line. The mean fourth power of the spans
    is least, as beams sag, a line held at one end counting as 2.63 times its length: if all lines reach across, that is the
    direction of the shortest spans. angle_deg: configured direction, 0 for none.
    """
    if hanging.area() < LEAST * width_mm**2 or not len(anchors.edges):
        return None
    sides = edges(hanging)
    angle, longest_mm, loose, _ = _least_sag(sides, anchors, _angles(sides, angle_deg), width_mm)
    return None if np.isnan(angle) else Bridge(hanging, float(np.degrees(angle)), longest_mm, loose)


def _angles(sides: Floats, angle_deg: float) -> Floats:
    """Directions to try, radians in 0 .. pi, those of the area's sides first; only the configured one, if any."""
    if angle_deg:
        return np.array([np.radians(angle_deg % 180.0)])
    steps = sides[:, 2:] - sides[:, :2]
    longest = np.argsort(-np.hypot(*steps.T), kind="stable")[:SIDES]
    along = np.arctan2(steps[longest, 1], steps[longest, 0])
    own = np.round(np.concatenate([along, along + 0.5 * np.pi]) % np.pi, 4)
    return np.concatenate([np.unique(own), np.pi * np.arange(TURNS) / TURNS])


@kernel
def _least_sag(sides: Floats, anchors: EdgeIndex, angles: Floats, width_mm: float) -> tuple[float, float, float, float]:
    """The angle of least sag (nan if no line is held), its longest span and the loose share of its lines; and the angle with the
    greatest length of lines held at both ends.
    """
    best, least, longest_mm, loose = np.nan, np.inf, 0.0, 0.0
    holding, most_mm = 0.0, -1.0
    for angle in angles:
        lines = _lines_across(sides, anchors, angle, width_mm)
        total = sagging = free = longest = 0.0
        any_held = False
        for k in range(len(lines)):
            held, span = lines[k, 3], lines[k, 1] - lines[k, 0]
            total, longest, any_held = total + span, max(longest, span), any_held or held > 0.0
            sagging += (1.0 if held == 2.0 else LOOSE**4 if held == 1.0 else UNHELD**4) * span**4
            free += span if held < 2.0 else 0.0
        if total - free > most_mm:
            holding, most_mm = angle, total - free
        if any_held and sagging < least * (1.0 - GAIN) * total:
            best, least, longest_mm, loose = angle, sagging / total, longest, free / total
    return best, longest_mm, loose, holding


@kernel
def _lines_across(sides: Floats, anchors: EdgeIndex, angle: float, width_mm: float) -> Floats:
    """(n, 4) lines across an area, a line width apart: start, end and height in the frame turned by the angle, and the number of
    held ends.
    """
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


def bridges_of_layers(
    sections: Sections, overhangs: Sequence[Overhang], supported: Sequence[Polygons], layers: Sequence[int]
) -> list[tuple[Bridge, ...]]:
    """The bridges of some layers, given in ascending order: self-supporting ones, and the best possible ones over unsupported
    overhangs.

    Such overhangs are ledges, slots without room for support, or areas that support could not reach (reported by
    Supports.missed). supported: area of support in each layer.
    """
    process, heights, outlines = sections.process, sections.heights, sections.outlines
    width_mm = process.line_width_mm
    bridges = [overhang.bridges for overhang in overhangs] + [()] * (len(outlines) - len(overhangs))
    for i in layers[: bisect_left(layers, len(overhangs))]:
        overhang = overhangs[i]
        free, below = overhang.hanging + overhang.ledges, sections.below(i)
        if free.is_empty() or below is None:
            continue
        drop_mm = float(heights.bottom_mm[i]) - process.support_gap_mm - 2.0 * process.layer_height_mm
        lowest = int(np.searchsorted(heights.tip_mm, drop_mm - SAME_MM))
        held = union([area for area in supported[lowest:i] if not area.is_empty()])
        held = held if held.is_empty() else offset(held, 0.5 * width_mm)
        bare = opening(free - held, 0.25 * width_mm)
        if not bare.is_empty():
            slopes = outlines[i] - union([free, *(bridge.hanging for bridge in overhang.bridges)])
            carrying = union([below if i else offset(below, RIM_MM), held, slopes])
            anchors = index_edges(offset(carrying, 0.25 * width_mm))
            bridges[i] += tuple(
                span for island in islands(bare) for span in find_bridges(island, anchors, width_mm, process.bridge_angle_deg)
            )
    return bridges


def find_bridges(hanging: Polygons, anchors: EdgeIndex, width_mm: float, angle_deg: float = 0.0) -> list[Bridge]:
    """Bridges over one connected overhanging area, each piece in the direction in which most lines are held at both ends.

    If no direction holds the whole area, the part held by the best one is bridged that way, and the rest separately. angle_deg:
    as in find_bridge.
    """
    bridges: list[Bridge] = []
    left = [hanging]
    while left:
        piece = left.pop()
        bridge = find_bridge(piece, anchors, width_mm, angle_deg)
        held = None if bridge is None or bridge.loose <= TOLERATED else _held_piece(piece, anchors, width_mm, angle_deg)
        if held is None:
            bridges += [bridge] if bridge is not None else []
        else:
            bridges.append(held)
            left += islands(opening(piece - held.hanging, 0.25 * width_mm))
    return bridges


def _held_piece(hanging: Polygons, anchors: EdgeIndex, width_mm: float, angle_deg: float) -> Bridge | None:
    """The part of an area whose lines are held at both ends, in the direction with most such lines; None if it is tiny."""
    sides = edges(hanging)
    *_, angle = _least_sag(sides, anchors, _angles(sides, angle_deg), width_mm)
    lines = _lines_across(sides, anchors, angle, width_mm)
    lines = lines[lines[:, 3] == 2.0]
    if not len(lines):
        return None
    ends = lines[:, [0, 2, 1, 2]].reshape(-1, 2, 2) @ rotation_2d(float(np.degrees(angle))).T
    piece = opening(strips(list(ends), 0.5 * width_mm + LINE_RIM_MM) ^ hanging, 0.5 * width_mm)
    if piece.area() < LEAST * width_mm**2:
        return None
    return Bridge(piece, float(np.degrees(angle)), float((lines[:, 1] - lines[:, 0]).max()), 0.0)
