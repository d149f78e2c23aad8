"""Travels: retractions, detours through the inside of an area (combing), and wipes, the motion over the last bead while filament
is pulled back, which leaves the drop there.

A travel may ooze inside the section, or over one piece of support. All other travels cross open air or a surface, where ooze
leaves a string or a blob on a wall. Beside the edge of an interface, where a blob would show along the joint, a travel does not
cross the outer walls either.

A detour follows the border of the area's inside from where the straight line leaves it to where it returns, the shorter way
around, and is then pulled taut. Every segment is tested against the border of the area's safe inside.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mdp.kernels.arrays import floats, longs, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats
from mdp.overhang import Mask
from profiles.process import Process
from slicer.bead import outer_wall_width_mm
from slicer.geometry.edge_index import EdgeIndex, crosses, crossings, free, index_edges, lie_within, nearest, within
from slicer.geometry.polygons import Polygons, offset
from slicer.geometry.polyline import Segment, length_between
from slicer.strokes.strokes import Strokes

SAFE = 0.4  # line widths inside the area where ooze is invisible; centrelines of outer walls lie at 0.5
BEHIND = 1.1  # detours run behind the outer wall where the area is wide enough
AMONG = 0.45  # otherwise as close to the area's border as the walls themselves
TAUT = 3.0  # limit on a detour along the border before it is pulled taut, relative to the final limit
NOWHERE = np.zeros((0, 2))
STANDING_MM = 1e-6
ROUND = 4.0  # a path longer than this many widths, whose ends are closer than its width, is a ring


def travels(
    since: Floats, to: Floats, section: Polygons, support: Polygons, process: Process, skin: Polygons | None = None
) -> tuple[Mask, dict[int, Floats]]:
    """Which of n travels, (n, 2) from and to, retract, and the detours (k, 2) of some others, by the travel's number.

    A travel no shorter than process.retract_travel_mm retracts if it leaves the inside of the section and of its support and has
    no short detour inside either. skin: visible wall beside joints; shorter travels retract as well if they would cross it,
    unless they begin or end on it.
    """
    retracts: Mask = np.hypot(*(to - since).T) >= process.retract_travel_mm
    detours: dict[int, Floats] = {}
    widths_mm = (min(process.line_width_mm, outer_wall_width_mm(process)), process.support_line_width_mm or process.line_width_mm)
    if retracts.any():
        areas = zip((section, support), widths_mm, strict=True)
        inside = [Combing(area, width) for area, width in areas if not area.is_empty()]
        for combing in inside:
            at = np.flatnonzero(retracts)
            retracts[at] = combing.leaves(since[at], to[at])
        for combing in inside if process.combing else []:
            for k in np.flatnonzero(retracts).tolist():
                detour = combing.detour(since[k], to[k], process.combing_detour_mm)
                if detour is not None:
                    retracts[k], detours[k] = False, detour
    if skin is not None and not skin.is_empty():
        combing, border = Combing(section, widths_mm[0], skin), index_edges(skin)
        for k in np.flatnonzero(~retracts & ~lie_within(border, since) & ~lie_within(border, to)).tolist():
            way = np.vstack([since[k], detours.get(k, to[:0]), to[k]])
            if not crosses(border, way[:-1], way[1:]).any():
                continue
            detours.pop(k, None)
            detour = combing.detour(since[k], to[k], process.combing_detour_mm) if process.combing else None
            if detour is None:
                retracts[k] = True
            else:
                detours[k] = detour
    return retracts, detours


@dataclass(eq=False)
class Combing:
    """Area of one layer, a section or its support, in which the tip may travel without a retraction. barred: the part of it that
    no travel crosses.
    """

    area: Polygons
    width_mm: float
    barred: Polygons | None = None
    tracks: dict[float, EdgeIndex] = field(default_factory=dict)  # lines that detours follow, by line widths inside the area

    @cached_property
    def safe(self) -> EdgeIndex:
        """The border that no travel without a retraction crosses."""
        inside = offset(self.area, -SAFE * self.width_mm)
        return index_edges(inside if self.barred is None else inside - self.barred)

    def leaves(self, since: Floats, to: Floats) -> Mask:
        """(n,) whether the travels between (n, 2) points leave the safe inside."""
        return ~lie_within(self.safe, since) | crosses(self.safe, since, to)

    def detour(self, start: Floats, end: Floats, most_mm: float) -> Floats | None:
        """Points (k, 2) between start and end of a path inside, at most most_mm longer than the straight line; None if there is
        none.
        """
        straight = Segment(float(start[0]), float(start[1]), float(end[0]), float(end[1]))
        longest = float(np.hypot(*(end - start))) + most_mm
        for widths in (BEHIND, AMONG):
            if widths not in self.tracks:
                self.tracks[widths] = index_edges(offset(self.area, -widths * self.width_mm))
            track = self.tracks[widths]
            path = np.empty((len(track.edges) + 2 * len(track.begins) + 4, 2))
            count = _comb(self.safe, track, straight, longest, 2.0 * self.width_mm, path)
            if count > 1:
                return path[1 : count - 1].copy()
        return None


@kernel
def _comb(safe: EdgeIndex, track: EdgeIndex, straight: Segment, longest: float, reach: float, path: Floats) -> int:
    """Fill in the path from end to end, both included; returns its number of points, 0 if there is none."""
    ax, ay, begins = _enter(safe, track, straight.x0, straight.y0, reach)
    if not begins:
        return 0
    bx, by, ends = _enter(safe, track, straight.x1, straight.y1, reach)
    if not ends:
        return 0
    path[0, 0], path[0, 1] = straight.x0, straight.y0
    n = _follow(track, Segment(ax, ay, bx, by), TAUT * longest, path)
    if n == 0:
        return 0
    path[n, 0], path[n, 1] = straight.x1, straight.y1
    n += 1
    for _ in range(2):
        n = _pull_taut(safe, path, n)
        if n == 0:
            return 0
    return n if length_between(path, 0, n) <= longest else 0


@helper
def _enter(safe: EdgeIndex, track: EdgeIndex, x: float, y: float, reach: float) -> tuple[float, float, bool]:
    """Where a detour from a point begins: at the point, or where it reaches the track's inside; and whether it does."""
    if within(track, x, y):
        return x, y, True
    ax, ay, side = nearest(track, x, y, reach)
    return ax + 1e-7 * (ax - x), ay + 1e-7 * (ay - y), side >= 0 and free(safe, Segment(x, y, ax, ay))


@helper
def _follow(track: EdgeIndex, straight: Segment, longest: float, path: Floats) -> int:
    """Append a straight line, with each stretch outside replaced by that of the loop through which it leaves and returns. Starts
    at row 1; returns the number of rows, 0 if there is no such path.
    """
    shares, crossed = floats(len(track.edges), 0.0), longs(len(track.edges), 0)
    many = crossings(track, straight, shares, crossed)
    x0, y0, x1, y1 = straight
    path[1, 0], path[1, 1] = x0, y0
    n, left, k = 2, longest, 0
    while k < many:
        last = k
        for j in range(k + 1, many):
            if track.loop[crossed[j]] == track.loop[crossed[k]]:
                last = j
        if last == k:  # the end lies beyond this loop, in another island
            return 0
        path[n, 0], path[n, 1] = x0 + shares[k] * (x1 - x0), y0 + shares[k] * (y1 - y0)
        back_x, back_y = x0 + shares[last] * (x1 - x0), y0 + shares[last] * (y1 - y0)
        n, length = _go_round(track, (crossed[k], crossed[last]), (back_x, back_y), left, path, n)
        if n == 0:
            return 0
        left -= length
        k = last + 1
    path[n, 0], path[n, 1] = x1, y1
    return n + 1


@helper
def _go_round(
    track: EdgeIndex, sides: tuple[int, int], end: tuple[float, float], longest: float, path: Floats, n: int
) -> tuple[int, float]:
    """Append the shorter of the two stretches of a loop at row n, from one of its sides to a point on the other. Returns the new
    number of rows, 0 if the stretch is too long, and its length.
    """
    least, shorter = np.inf, 1
    for sense in range(1, -2, -2):
        _, length = _walk(track, sides, end, longest, sense, path, n)
        if length < least:
            least, shorter = length, sense
    if least > longest:
        return 0, least
    return _walk(track, sides, end, longest, shorter, path, n)


@helper
def _walk(
    track: EdgeIndex, sides: tuple[int, int], end: tuple[float, float], longest: float, sense: int, path: Floats, n: int
) -> tuple[int, float]:
    """Append a stretch forward (1) or backward (-1) until it is too long; returns the new number of rows and the length."""
    first, after = track.begins[track.loop[sides[0]]], track.begins[track.loop[sides[0]] + 1]
    side, length, corner = sides[0], 0.0, 1 + sense
    while side != sides[1] and length <= longest:
        path[n + 1, 0], path[n + 1, 1] = track.edges[side, corner], track.edges[side, corner + 1]
        length += np.hypot(path[n + 1, 0] - path[n, 0], path[n + 1, 1] - path[n, 1])
        side = first + (side - first + sense) % (after - first)
        n += 1
    path[n + 1, 0], path[n + 1, 1] = end
    return n + 2, length + np.hypot(end[0] - path[n, 0], end[1] - path[n, 1])


@helper
def _pull_taut(safe: EdgeIndex, path: Floats, count: int) -> int:
    """Reduce a path to as few points as the border allows, in reverse order; returns their number, 0 if it crosses the border."""
    n, i, last = 1, 0, count - 1
    while i < last:
        step = last - i
        while step > 1 and not _sees(safe, path, i, i + step):
            step = step - 1 if step <= 8 else (3 * step) // 4
        if step == 1 and not _sees(safe, path, i, i + 1):
            return 0
        i += step
        path[n, 0], path[n, 1] = path[i, 0], path[i, 1]
        n += 1
    for k in range(n // 2):
        for axis in range(2):
            path[k, axis], path[n - 1 - k, axis] = path[n - 1 - k, axis], path[k, axis]
    return n


@helper
def _sees(safe: EdgeIndex, path: Floats, i: int, j: int) -> bool:
    """Whether the straight line between two points of a path crosses no border."""
    return free(safe, Segment(path[i, 0], path[i, 1], path[j, 0], path[j, 1]))


def may_wipe_over(strokes: Strokes, skin: Polygons, wipe_mm: float) -> Mask:
    """(k,) whether a wipe may pass over each stroke: not if it ends beside the skin and the wipe would lead onto it."""
    may = np.ones(len(strokes), np.bool_)
    if skin.is_empty() or not len(strokes):
        return may
    border = index_edges(skin)
    off = ~lie_within(border, strokes.last_points)
    for k in np.flatnonzero(off).tolist():
        points = np.ascontiguousarray(strokes.points[strokes.starts[k] : strokes.starts[k + 1], :2])
        way = way_of_wipe(points, float(strokes.width_mm[k]), wipe_mm)
        may[k] = len(way) < 2 or not crosses(border, way[:-1], way[1:]).any()
    return may


@kernel
def way_of_wipe(points: Floats, width_mm: float, wipe_mm: float) -> Floats:
    """The path (n, 2 or 3) of a wipe of wipe_mm after a stroke, over that stroke only."""
    return first_length(wipe_trail(points, width_mm), wipe_mm)


@helper
def wipe_trail(points: Floats, width_mm: float) -> Floats:
    """The path of a wipe after a stroke (n, 2 or 3): forward along a ring, across its seam; back along a line."""
    count, onward = len(points), runs_round(points, width_mm)
    across = 1 if onward and distance(points, 0, count - 1) > STANDING_MM else 0
    trail: Floats = table(count + across, points.shape[1])
    for i in range(len(trail)):
        k = (i - across) % count if onward else count - 1 - i
        for axis in range(points.shape[1]):
            trail[i, axis] = points[k, axis]
    return trail


@no_nrt
def runs_round(points: Floats, width_mm: float) -> bool:
    """Whether a path is a ring: it ends at, or close to, its start."""
    return bool(distance(points, 0, len(points) - 1) <= width_mm and length_between(points, 0, len(points)) > ROUND * width_mm)


@no_nrt
def distance(points: Floats, i: int, k: int) -> float:
    """Distance between two of the points (n, 2 or 3)."""
    squared = 0.0
    for axis in range(points.shape[1]):
        squared += (points[k, axis] - points[i, axis]) ** 2
    return float(np.sqrt(squared))


@helper
def first_length(way: Floats, length: float) -> Floats:
    """The first `length` mm of a polyline (n, 2 or 3), or all of it, without repeated points."""
    first: Floats = table(len(way), way.shape[1])
    count, run = 0, 0.0
    for i in range(len(way) if len(way) > 1 and length > 0.0 else 0):
        step = distance(way, i - 1, i) if i else 0.0
        if i and step <= STANDING_MM:
            continue
        run += step
        for axis in range(way.shape[1]):
            first[count, axis] = way[i, axis]
            if run >= length:
                first[count, axis] = first[count - 1, axis] + (1.0 - (run - length) / step) * (
                    way[i, axis] - first[count - 1, axis]
                )
        count += 1
        if run >= length:
            break
    return first[:count]
