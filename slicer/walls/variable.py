"""Variable walls: the beads of polygons, as many side by side as fit and as wide as the place (Kuipers et al. 2020).

How thick a place is, is known on its skeleton, the middle line that is as far from the boundary on one side as on the other: half
the thickness. That says how many beads lie across the place. The outer ones have their nominal width, the innermost one or two
take what is left, so widths change with the thickness, and where they would get too wide or too narrow, the count does.

    thickness in spacings:    0       1.5        2.7      3.5        4.7     5.5     (while there are walls left to lay)
    beads across:             |   1   |     2     |    3   |     4     |   5   |

         |( m )|                  1   a line m along the skeleton, as wide as the place
        |( 0 )( 0 )|              2   both sides of loop 0, each half as wide as the place
       |( 0 )( m )( 0 )|          3   loop 0 and a line between its sides
      |( 0 )( 1 )( 1 )( 0 )|      4   loops 0 and 1

The boundary is sampled and triangulated, the circumcentres of the triangles are the skeleton, every node of which gets a count
that does not flicker to and fro. Loops run round the places that have room for their level, lines along the skeleton where the
count is odd. Widths are smoothed where counts change, and lines that lie alone are kept inside the place.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import flags, longs, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices, Ints
from slicer.geometry.edge_index import EdgeIndex, depths, index_edges
from slicer.geometry.polygons import Polygons, contours
from slicer.geometry.polyline import length_mm
from slicer.geometry.triangulation import triangulate
from slicer.walls.loops import TRANSITION, corners, lay_loops, smoothed
from slicer.walls.skeleton import (
    FEATURE,
    Counts,
    Rule,
    Skeleton,
    count_beads,
    depth_of,
    loops_of,
    middle_width,
    skeleton_of,
    spacing_of,
)

STEP = 0.42  # nominal spacings: sampling of the boundary
DOT = 0.3  # of its width: a shorter line is laid as a dash, thinner by
DASH = 0.25  # of its width, and as much longer
SLACK_MM = 0.01  # by which a place may be narrower than the least bead
SHORT = 0.05  # of its width: a dash is no shorter
THIN = 4.0  # least widths: what is narrower than one and longer than this is a wall, what is shorter the tip of a corner
LOOK_MM = 0.4  # so far from a fork the directions of its branches are looked at
ABUT = 0.45  # of a bead's width: a line ends so far from the middle of a bead that runs across its end


@dataclass(frozen=True, eq=False)
class Wall:
    """course: (n, 3) x, y and width; level: 0 outermost; closed: it runs round, and its course ends where it begins.

    free: sides on which no bead lies beside it; piece: the number of the polygons that it lies in.
    """

    course: Floats
    level: int
    closed: bool
    free: int
    piece: int

    @property
    def points(self) -> Floats:
        """(n, 2) mm, of one that runs round without its first repeated."""
        return np.ascontiguousarray(self.course[: -1 if self.closed else None, :2])


def variable_walls(pieces: Sequence[Polygons], rule: Rule) -> list[Wall]:
    """All walls of polygons, each laid out by itself, piece after piece."""
    triangulation = triangulate([contours(piece) for piece in pieces], STEP * rule.inner)
    if triangulation is None:
        return []
    skeleton = skeleton_of(triangulation)
    counts = count_beads(triangulation.across, skeleton, rule)
    piece_of = triangulation.piece[triangulation.tails[::3]]
    walls: list[Wall] = []
    for level in range(rule.walls):
        courses, starts, node = lay_loops(triangulation, skeleton, counts, rule, level)
        if not len(node):
            break
        loops = zip(pairwise(starts.tolist()), piece_of[node].tolist(), strict=True)
        walls += [Wall(courses[a:b], level, True, int(level == 0), piece) for (a, b), piece in loops]
    chains = trace_chains(triangulation.across, skeleton, counts, rule)
    middle = lines_along(chains, rule, piece_of) + _dots(skeleton, counts, rule, piece_of)
    borders = {piece: index_edges(pieces[piece]) for piece in {wall.piece for wall in middle if wall.level == 0}}
    middle = [wall if wall.level else _clipped(wall, borders[wall.piece], rule) for wall in middle]
    walls += [replace(wall, course=wall.course[corners(wall.course)]) for wall in middle if len(wall.course) > 1]
    laid = [wall for wall in walls if length_mm(wall.course) > 0.0]  # points may fall on each other when they are smoothed
    return sorted(laid, key=lambda wall: wall.piece)


class Chains(NamedTuple):
    """courses: (n, 3) x, y and width; starts: (k + 1,) where each chain begins; levels: (k,) loops on both sides of it.

    ends: (k, 2) nodes; forks: (k, 2) whether more chains meet there; taken: (k, 2) mm that a loop across that end takes of it.
    """

    courses: Floats
    starts: Indices
    levels: Indices
    ends: Indices
    forks: Indices
    taken: Floats


@kernel
def trace_chains(across: Ints, skeleton: Skeleton, counts: Counts, rule: Rule) -> Chains:
    """The chains of nodes between forks and ends, then the rings."""
    size = len(skeleton.radii)
    degree, done = longs(size, 0), flags(len(across))
    for h in range(len(across)):
        if _joined(across, skeleton, counts, h):
            degree[h // 3] += 1
    room = 2 * size + 2
    ends, forks = longs(2 * room, 0).reshape(room, 2), longs(2 * room, 0).reshape(room, 2)
    out = Chains(table(2 * room, 3), longs(room, 0), longs(room, 0), ends, forks, table(room, 2))
    n = many = 0
    for rings in range(2):
        for first in range(len(across)):
            if done[first] or (rings == 0 and degree[first // 3] == 2) or not _joined(across, skeleton, counts, first):
                continue
            h = first
            n = _add(skeleton, counts, rule, h // 3, out, n)
            while True:
                done[h] = done[across[h]] = True
                back, t = across[h], across[h] // 3
                n = _add(skeleton, counts, rule, t, out, n)
                if degree[t] != 2 or t == first // 3:
                    break
                for k in range(3 * t, 3 * t + 3):
                    if k != back and _joined(across, skeleton, counts, k):
                        h = k
            out.levels[many] = loops_of(rule, counts.beads[t])
            for k in range(2):
                node = t if k else first // 3
                out.ends[many, k], out.forks[many, k] = node, int(degree[node] > 2)
                out.taken[many, k] = _taken(across, skeleton, counts, rule, node)
            many += 1
            out.starts[many] = n
    levels, ends, forks, taken = out.levels[:many], out.ends[:many], out.forks[:many], out.taken[:many]
    return Chains(out.courses[:n], out.starts[: many + 1], levels, ends, forks, taken)


@no_nrt
def _joined(across: Ints, skeleton: Skeleton, counts: Counts, h: int) -> bool:
    """Whether a line runs across an inner side."""
    if across[h] < 0 or not skeleton.central[h]:
        return False
    count = counts.beads[h // 3]
    return bool(count % 2 == 1 and counts.beads[across[h] // 3] == count)


@no_nrt
def _add(skeleton: Skeleton, counts: Counts, rule: Rule, t: int, out: Chains, n: int) -> int:
    out.courses[n, 0], out.courses[n, 1] = skeleton.centres[t, 0], skeleton.centres[t, 1]
    out.courses[n, 2] = middle_width(rule, counts.beads[t], skeleton.radii[t])
    return n + 1


@no_nrt
def _taken(across: Ints, skeleton: Skeleton, counts: Counts, rule: Rule, t: int) -> float:
    """How much of a line the loop takes that runs across its end, where more beads lie side by side beyond it."""
    taken, level = 0.0, loops_of(rule, counts.beads[t])
    for h in range(3 * t, 3 * t + 3):
        next_node = across[h] // 3
        if across[h] >= 0 and loops_of(rule, counts.beads[next_node]) > level:
            width = spacing_of(rule, counts.beads[next_node], counts.radii[next_node], level) + rule.round
            depth = depth_of(rule, counts.beads[next_node], counts.radii[next_node], level)
            beyond = np.sqrt(max(depth * depth - skeleton.radii[t] * skeleton.radii[t], 0.0))
            taken = max(taken, ABUT * width - beyond)
    return taken


def lines_along(chains: Chains, rule: Rule, piece_of: Indices) -> list[Wall]:
    """The beads along chains: at every fork the two joined that go on most straightly, the ends cut back where a bead runs across
    them."""
    courses = {k: chains.courses[a:b] for k, (a, b) in enumerate(pairwise(chains.starts))}
    ends, taken = chains.ends.copy(), chains.taken.copy()
    at: defaultdict[int, list[int]] = defaultdict(list)
    for k, side in np.argwhere(chains.forks).tolist():
        at[ends[k, side]].append(k)
    for node in sorted(at):
        members = at[node]
        if len(set(members)) == len(members):
            into, onward = _join(courses, ends, taken, node, members)
            end = ends[into, 1]
            at[end] = [into if k == onward else k for k in at[end]]
    walls = []
    for k, course in sorted(courses.items()):
        closed = bool(ends[k, 0] == ends[k, 1])
        course = course if closed else _cut_back(_cut_back(course, taken[k, 0])[::-1], taken[k, 1])[::-1]
        if len(course) > 1:
            walls.append(_along(course, int(chains.levels[k]), closed, rule, int(piece_of[ends[k, 0]])))
    return walls


def _join(courses: dict[int, Floats], ends: Indices, taken: Floats, node: int, members: list[int]) -> tuple[int, int]:
    """Join the two lines at a fork that go on most straightly, the second to the first, and tell which; the others end beside
    them."""
    for k in members:
        if ends[k, 0] != node:
            courses[k], ends[k], taken[k] = courses[k][::-1], ends[k, ::-1].copy(), taken[k, ::-1].copy()
    heading = {k: _heading(courses[k]) for k in members}
    into, onward = min(combinations(members, 2), key=lambda pair: float(heading[pair[0]] @ heading[pair[1]]))
    for k in members:
        taken[k, 0] = ABUT * float(courses[onward][0, 2])
    courses[into] = np.concatenate([courses[into][::-1], courses.pop(onward)[1:]])
    ends[into], taken[into] = (ends[into, 1], ends[onward, 1]), (taken[into, 1], taken[onward, 1])
    return into, onward


def _heading(course: Floats) -> Floats:
    """Unit vector from the first point of a line to where it is a little later."""
    steps = course[:, :2] - course[0, :2]
    away = np.hypot(*steps.T)
    far = int(np.argmax(away > LOOK_MM)) if (away > LOOK_MM).any() else len(away) - 1
    heading: Floats = steps[far] / max(float(away[far]), 1e-9)
    return heading


def _cut_back(course: Floats, taken_mm: float) -> Floats:
    """A line without what is taken of its beginning."""
    if taken_mm <= 0.0 or not len(course):
        return course
    done = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(course[:, :2], axis=0).T))])
    if done[-1] <= taken_mm:
        return course[:0]
    first = int(np.searchsorted(done, taken_mm, side="right")) - 1
    share = (taken_mm - done[first]) / (done[first + 1] - done[first])
    left = course[first:].copy()
    left[0, :2] += share * (left[1, :2] - left[0, :2])
    return left


def _along(line: Floats, level: int, closed: bool, rule: Rule, piece: int) -> Wall:
    """The bead along a line (n, 3), its way and widths smoothed."""
    course, reach_mm = np.empty_like(line), TRANSITION * rule.inner
    for column, reach in enumerate((0.5 * reach_mm, 0.5 * reach_mm, reach_mm)):
        course[:, column] = smoothed(line, np.ascontiguousarray(line[:, column]), reach, closed)
    if closed:
        course[-1] = course[0]
    else:
        course[[0, -1], :2] = line[[0, -1], :2]
        if level == 0 and length_mm(course) < DOT * course[:, 2].max():
            return _dash(course[0, :2], course[-1, :2], float(course[:, 2].mean()), rule, piece)
    return Wall(course, level, closed, 2 * int(level == 0), piece)


def _dots(skeleton: Skeleton, counts: Counts, rule: Rule, piece_of: Indices) -> list[Wall]:
    """The dashes in round places with room for a single bead."""
    dashes, last = list[Wall](), np.full(2, np.inf)
    nodes = np.flatnonzero(counts.dots)
    for t in nodes[np.argsort(piece_of[nodes], kind="stable")].tolist():
        centre, radius = skeleton.centres[t], float(skeleton.radii[t])
        if float(np.hypot(*(centre - last))) > radius:
            dashes.append(_dash(centre, centre, 2.0 * radius, rule, int(piece_of[t])))
        last = centre
    return dashes


def _dash(begin: Floats, end: Floats, width: float, rule: Rule, piece: int) -> Wall:
    """A dash in place of a dot, which no printer draws: as much thinner as it is longer."""
    thinner = max((1.0 - DASH) * width, rule.least)
    step = end - begin
    length = float(np.hypot(*step))
    way = step / length if length > 1e-6 else np.array([1.0, 0.0])
    middle, half = 0.5 * (begin + end), 0.5 * (length + max(width - thinner, SHORT * width))
    course = np.array([[*(middle - half * way), thinner], [*(middle + half * way), thinner]])
    return Wall(course, 0, False, 2, piece)


def _clipped(line: Wall, borders: EdgeIndex, rule: Rule) -> Wall:
    """A line that lies alone no wider than its place, but for the least bead, without ends where not even that fits.

    Thin walls keep ends of theirs where it nearly fits: a wall that is now thicker and now thinner than the least bead would be
    all gaps, each above another place than the one in the layer below.
    """
    course = line.course.copy()
    room = 2.0 * np.abs(depths(course, borders))
    course[:, 2] = np.maximum(np.minimum(course[:, 2], room), rule.least)
    first, last = _fitting(course[:, :2], room, rule)
    if line.closed and last >= first:
        first, last = 0, len(room) - 1
    return replace(line, course=course[first : last + 1])


def _fitting(points: Floats, room: Floats, rule: Rule) -> tuple[int, int]:
    """The first and the last point of a line (n, 2) with that much room that has its bead; last < first: none has."""
    if room.min() > rule.least - SLACK_MM:
        return 0, len(room) - 1
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    fits = np.flatnonzero(room > rule.least - SLACK_MM)
    narrow = np.flatnonzero(room <= FEATURE * rule.least - SLACK_MM)
    if not len(fits):
        ends = np.concatenate([[-1], narrow, [len(room)]])
        most = int(np.argmax(along[np.maximum(ends[1:] - 1, 0)] - along[np.minimum(ends[:-1] + 1, len(room) - 1)]))
        first, last = int(ends[most]) + 1, int(ends[most + 1]) - 1
        return (first, last) if last > first and along[last] - along[first] > THIN * rule.least else (0, -1)
    first, last = int(fits[0]), int(fits[-1])
    begin = int(narrow[narrow < first].max(initial=-1)) + 1
    end = int(narrow[narrow > last].min(initial=len(room))) - 1
    return (
        begin if along[first] - along[begin] > THIN * rule.least else first,
        end if along[end] - along[last] > THIN * rule.least else last,
    )
