"""Strokes: the beads of a layer in printing order as one table, before their speed is known, and its refinements.

Strokes are split where they enter and leave an area, where they hardly lie on the layer below, and where their width changes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, floats, longs, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from profiles.process import Process
from slicer.bead import EVEN_MM, NOISE_MM, Bead, hanging_area
from slicer.geometry.clip import cut_into
from slicer.geometry.edge_index import EdgeIndex, index_edges
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import Segment, length_between, lengths_mm, nearest_share
from slicer.paths import NUMBER, Kind, bead_area_mm2, is_of

RINGS = (Kind.OUTER_WALL, Kind.INNER_WALL)
COLUMNS = ("kind", "width_mm", "flow", "overhang", "over_infill", "small", "varies", "retract", "place")
# Pieces: points (n, 3), (k + 1,) start of each, (k,) source stroke of each and whether it lies inside an area.
Buffers = tuple[Floats, Indices, Indices, Mask]
HANGING = (Kind.OUTER_WALL, Kind.INNER_WALL, Kind.GAP, Kind.OVERHANG)
ON_SUPPORT = 5  # overhang value of a wall over dense support
STEPS = (0.75, 0.5, 0.25, 0.0)  # shares of a bead's width on plastic below which it is printed more slowly
SHORTEST_HANGING = 2.0  # line widths: shortest stretch that is split off, otherwise the speed would flicker
SHORTEST_FARTHER = 6.0  # line widths: shortest stretch with a larger overhang within an overhang
MOST_OVER_MM = 0.022  # limit of a piece's width over its narrowest point: half of it extends over the section there
SHORTEST_MM = 0.2  # shortest piece that ends because widths change by EVEN_MM
MOST_SPREAD_MM, LEAST_MM = 0.1, 0.045  # unless they change by the first value: then shortest piece


@dataclass(frozen=True, eq=False)
class Strokes:
    """One row per stroke, in printing order.

    points: (n, 3) mm, x, y and the width of the bead there; starts: (k + 1,) start of each stroke's points. approach: (m, 2) via
    points of the travels to strokes; approach_starts: (k + 1,). Columns, (k,) each: kind: index in KINDS; width_mm: mean; flow,
    over_infill: as in Bead; overhang: of a wall, 0 to 4: less than all, 75, 50, 25 % of its width or nothing of it lies on
    plastic, or ON_SUPPORT; small: whether it is a closed wall no longer than process.small_wall_mm, or a piece of one of varying
    width; varies: whether the width changes along the stroke; retract: whether the travel to it retracts; place: number of the
    area with modified settings, from 1; 0 for none.
    """

    points: Floats
    starts: Indices
    kind: NDArray[np.int8]
    width_mm: Floats
    flow: Floats
    overhang: NDArray[np.int8]
    over_infill: Mask
    small: Mask
    varies: Mask
    retract: Mask
    place: NDArray[np.int16]
    approach: Floats
    approach_starts: Indices

    def __len__(self) -> int:
        return len(self.kind)

    @property
    def lengths_mm(self) -> Floats:
        """(k,) length of each stroke, mm."""
        return lengths_mm(self.points, self.starts)

    @property
    def first_points(self) -> Floats:
        """(k, 2) start of each stroke."""
        return self.points[self.starts[:-1], :2]

    @property
    def last_points(self) -> Floats:
        """(k, 2) end of each stroke."""
        return self.points[self.starts[1:] - 1, :2]

    def is_of(self, *kinds: Kind) -> Mask:
        """(k,) whether each stroke is of one of some kinds."""
        return is_of(self.kind, kinds)

    def with_points(self, points: Floats, kept: Mask) -> "Strokes":
        """The strokes with only the kept ones of (n, 3) points, which include the ends of every stroke."""
        return replace(self, points=points[kept], starts=np.append(0, np.cumsum(kept))[self.starts])

    def refined(self, points: Floats, starts: Indices, source: Indices) -> "Strokes":
        """The strokes split into pieces. source: (j,) the stroke to which each piece belongs, ascending.

        The pieces of a stroke follow each other without a travel: only the first one keeps retraction and approach.
        """
        first = np.diff(source, prepend=-1) > 0
        columns = {name: getattr(self, name)[source] for name in COLUMNS}
        approach_starts = np.append(self.approach_starts[source + ~first], len(self.approach))
        refined = replace(self, points=points, starts=starts, approach_starts=approach_starts, **columns)
        return replace(refined, retract=refined.retract & first)


def strokes_of(beads: Sequence[Bead], retract: Mask, approaches: Mapping[int, Floats], small_wall_mm: float) -> Strokes:
    """The table of beads in order, with their points (n, 2) in printing direction. approaches: by number of the stroke."""
    counts = [len(bead.points) for bead in beads]
    starts = np.cumsum([0, *counts])
    kind = np.array([NUMBER[bead.kind] for bead in beads], dtype=np.int8)
    width_mm = np.array([bead.width_mm for bead in beads])
    points = np.empty((int(starts[-1]), 3))
    points[:, :2] = np.concatenate([np.zeros((0, 2)), *(bead.points for bead in beads)])
    points[:, 2] = np.repeat(width_mm, counts)
    for k, bead in enumerate(beads):
        if bead.course is not None:
            way = points[starts[k] : starts[k + 1]]
            way[:, 2] = _widths_at(way, bead.course)
    passed = [approaches.get(k, points[:0, :2]) for k in range(len(beads))]
    return Strokes(
        points=points,
        starts=starts,
        kind=kind,
        width_mm=width_mm,
        flow=np.array([bead.flow for bead in beads]),
        overhang=np.zeros(len(beads), np.int8),
        over_infill=np.array([bead.over_infill for bead in beads], dtype=np.bool_),
        small=np.array([bead.kind in RINGS and bead.is_small(small_wall_mm) for bead in beads], dtype=np.bool_),
        varies=np.array([bead.course is not None for bead in beads], dtype=np.bool_),
        retract=retract,
        place=np.zeros(len(beads), np.int16),
        approach=np.concatenate([np.zeros((0, 2)), *passed]),
        approach_starts=np.cumsum([0, *(len(way) for way in passed)]),
    )


@kernel
def _widths_at(places: Floats, course: Floats) -> Floats:
    """(n,) widths at points (n, 2 or 3) on a course (k, 3); each search starts at the step nearest to the previous point."""
    out: Floats = floats(len(places), 0.0)
    steps, at = len(course) - 1, 0
    for i in range(len(places)):
        least = np.inf
        for tried in range(steps):
            k = (at + tried) % steps
            side = Segment(course[k, 0], course[k, 1], course[k + 1, 0], course[k + 1, 1])
            share = nearest_share(side, places[i, 0], places[i, 1])
            x, y = side.x0 + share * (side.x1 - side.x0), side.y0 + share * (side.y1 - side.y0)
            away = (x - places[i, 0]) ** 2 + (y - places[i, 1]) ** 2
            if away < least:
                least, nearest = away, k
                out[i] = course[k, 2] + share * (course[k + 1, 2] - course[k, 2])
                if away < 1e-16:
                    break
        at = nearest
    return out


def split(strokes: Strokes, area: Polygons, wanted: Mask, shortest_mm: float, within_mm: float = 0.0) -> tuple[Strokes, Mask]:
    """The strokes in order, with the wanted ones (k,) in pieces, and (j,) whether each piece lies inside the area.

    No piece is shorter than shortest_mm, and none inside the area between two outside is shorter than within_mm.
    """
    index = index_edges(area)
    count, room = -1, 2 * len(strokes.points) + 64
    while count < 0:
        out = np.empty((room, 3)), np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room, np.bool_)
        count = _split(strokes.points, strokes.starts, wanted, index, (shortest_mm, max(shortest_mm, within_mm)), out)
        room *= 4
    points, starts, source, within = out
    pieces = strokes.refined(points[: starts[count]].copy(), starts[: count + 1].copy(), source[:count])
    is_whole = np.bincount(source[:count], minlength=len(strokes))[source[:count]] == 1
    return replace(pieces, small=pieces.small & (is_whole | pieces.varies)), within[:count].copy()


@kernel
def _split(points: Floats, starts: Indices, wanted: Mask, area: EdgeIndex, shortest_mm: tuple[float, float], out: Buffers) -> int:
    """Fill in the pieces; returns their number, -1 if the arrays are too small."""
    out_points, begins, source, is_within = out
    room = len(out_points)
    cut, within = table(room, 3), flags(room)
    count = n = begins[0] = 0
    for k in range(len(starts) - 1):
        a, b = starts[k], starts[k + 1]
        size = 0
        if wanted[k]:
            size = cut_into(points[a:b], area, cut, within)
            if size < 0:
                return -1
            _steady(cut, within, size, shortest_mm)
        whole = True
        for i in range(1, size - 1):
            whole = whole and within[i] == within[0]
        if n + (b - a if whole else 2 * size) > room or count + max(size, 1) >= room:
            return -1
        if whole:
            n = _append(out_points, n, points, a, b)
            source[count], is_within[count], begins[count + 1] = k, size > 1 and within[0], n
            count += 1
            continue
        begin = 0
        for i in range(size - 1):
            if i + 2 < size and within[i + 1] == within[begin]:
                continue
            n = _append(out_points, n, cut, begin, i + 2)
            source[count], is_within[count], begins[count + 1] = k, within[begin], n
            count, begin = count + 1, i + 1
    return count


@no_nrt
def _append(out: Floats, n: int, points: Floats, first: int, end: int) -> int:
    """Append the points first .. end - 1 at row n; returns the new n."""
    for i in range(first, end):
        for axis in range(3):
            out[n, axis] = points[i, axis]
        n += 1
    return n


@helper
def _steady(points: Floats, within: Mask, size: int, shortest_mm: tuple[float, float]) -> None:
    """Merge runs of steps that are too short into their neighbours, runs inside last, so that none is split by a gap.
    shortest_mm: of runs outside and inside; within: whether each step between the first `size` points is inside. A single run has
    no neighbours.
    """
    for inner in range(2):
        a = 0
        while a < size - 1:
            b, length_mm = a, 0.0
            while b < size - 1 and within[b] == within[a]:
                length_mm += np.hypot(points[b + 1, 0] - points[b, 0], points[b + 1, 1] - points[b, 1])
                b += 1
            if a == 0 and b == size - 1:
                return
            if within[a] == (inner > 0) and length_mm < shortest_mm[inner]:
                for step in range(a, b):
                    within[step] = inner == 0
            a = b


def split_overhangs(
    strokes: Strokes, section: Polygons, below: Polygons | None, process: Process, support: Polygons | None = None
) -> Strokes:
    """The strokes of a layer with its walls and gap lines split by the share of their width that lies on plastic.

    below: plastic under the layer, None for the build plate. A bead of width w whose centreline runs d outside it has the share
    1/2 - d/w of its width on it; it overhangs if that is less than process.overhang_share. support: dense support right under the
    layer: over it, an overhanging wall sags no farther than the gap, however little of it lies on plastic.
    """
    if below is None or process.overhang_share <= 0.0:
        return strokes
    width_mm, shortest_mm = process.line_width_mm, SHORTEST_HANGING * process.line_width_mm
    beyond = hanging_area(section, below, 0.5, width_mm)
    if beyond.area() < shortest_mm * NOISE_MM:
        return strokes  # the section barely overhangs, so no centreline, half a line inside it, can
    for share in sorted({*STEPS, process.overhang_share}, reverse=True):
        hanging = beyond if share == 0.5 else hanging_area(section, below, share, width_mm)
        if hanging.area() < shortest_mm * NOISE_MM:
            break
        kinds = HANGING if share <= 0.5 else (Kind.OUTER_WALL,)  # inner walls lie a line width farther in
        within_mm = 0.0 if hanging is beyond else SHORTEST_FARTHER * width_mm
        strokes, within = split(strokes, hanging, strokes.is_of(*kinds), shortest_mm, within_mm)
        kind, overhang = strokes.kind, np.where(within, sum(step >= share for step in STEPS), strokes.overhang)
        if share <= process.overhang_share:
            kind = np.where(within, NUMBER[Kind.OVERHANG], kind)
        strokes = replace(strokes, kind=kind.astype(np.int8), overhang=overhang.astype(np.int8))
    held = Polygons() if support is None or support.is_empty() else beyond ^ support
    if not held.is_empty():
        strokes, within = split(strokes, held, strokes.is_of(Kind.OVERHANG), shortest_mm)
        strokes = replace(strokes, overhang=np.where(within, ON_SUPPORT, strokes.overhang).astype(np.int8))
    return strokes


def in_pieces(strokes: Strokes, height_mm: float) -> Strokes:
    """The strokes in order, those of varying width split into pieces with the mean width of their stretches. height_mm: of the
    layer; the pieces together hold the plastic of the whole.
    """
    if not strokes.varies.any():
        return strokes
    # Points are added where the width changes by more than EVEN_MM between two points.
    points, starts = strokes.points, strokes.starts
    after = np.concatenate([points[1:], points[-1:]])
    many = np.maximum(np.ceil(np.abs(after[:, 2] - points[:, 2]) / EVEN_MM), 1.0).astype(np.int64)
    many[~np.repeat(strokes.varies, np.diff(starts))] = many[starts[1:] - 1] = 1
    which, ends = np.repeat(np.arange(len(points)), many), np.cumsum(many)
    share = (np.arange(len(which)) - (ends - many)[which]) / many[which]
    points, starts = points[which] + share[:, None] * (after - points)[which], np.append(0, ends)[starts]
    points, starts, source, width_mm = _part(points, starts, strokes.varies, strokes.width_mm)
    out = strokes.refined(points, starts, source)
    whole, own = bead_area_mm2(out.width_mm, height_mm), bead_area_mm2(width_mm, height_mm)
    flow = np.where(out.varies, 1.0 + (out.flow - 1.0) * whole / own, out.flow)
    return replace(out, width_mm=width_mm, flow=flow)


@kernel
def _part(points: Floats, starts: Indices, varies: Mask, width_mm: Floats) -> tuple[Floats, Indices, Indices, Floats]:
    """The pieces: points (n, 3), (k + 1,) start of each, (k,) source stroke and width of each."""
    room = 2 * len(points)
    out, begins, source, widths = table(room, 3), longs(room, 0), longs(room, 0), floats(room, 0.0)
    count = n = 0
    for k in range(len(starts) - 1):
        a, b = starts[k], starts[k + 1]
        if not varies[k]:
            n = _append(out, n, points, a, b)
            source[count], widths[count], begins[count + 1] = k, width_mm[k], n
            count += 1
            continue
        line = points[a:b]
        ends = _ends(line)
        begin = 0
        for end in range(1, len(line)):
            if not ends[end]:
                continue
            least, total, weights = line[begin, 2], 0.0, 0.0
            for i in range(begin, end):
                step = max(np.hypot(line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1]), 1e-9)
                total, weights = total + 0.5 * (line[i + 1, 2] + line[i, 2]) * step, weights + step
                least = min(least, line[i + 1, 2])
            n = _append(out, n, line, begin, end + 1)
            source[count], widths[count], begins[count + 1] = k, min(total / weights, least + MOST_OVER_MM), n
            count, begin = count + 1, end
    return out[:n].copy(), begins[: count + 1].copy(), source[:count].copy(), widths[:count].copy()


@helper
def _ends(line: Floats) -> Mask:
    """(n,) whether a piece ends at each point of a line (n, 3); pieces are as long as the widths allow."""
    ends = flags(len(line))
    length, left = 0.0, length_between(line, 0, len(line))
    low = high = 0.5 * (line[1, 2] + line[0, 2])
    for i in range(len(line) - 1):
        step = np.hypot(line[i + 1, 0] - line[i, 0], line[i + 1, 1] - line[i, 1])
        width = 0.5 * (line[i + 1, 2] + line[i, 2])
        spread = max(high, width) - min(low, width)
        least_mm = LEAST_MM if spread > MOST_SPREAD_MM else SHORTEST_MM
        if spread > EVEN_MM and length >= least_mm and left >= least_mm:
            ends[i] = True
            length, low, high = 0.0, width, width
        length, left = length + step, left - step
        low, high = min(low, width), max(high, width)
    ends[len(line) - 1] = True
    return ends
