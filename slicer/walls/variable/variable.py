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

The boundary is sampled and triangulated, the circumcentres of the triangles are the skeleton (skeleton). Every node of it gets
a count that does not flicker to and fro (counts, rule). Loops run round the places that have room for their level (loops), lines
along the skeleton where the count is odd (lines). Here widths are smoothed where counts change, and lines that lie alone are kept
inside the place. What is printed are pieces of one width each (pieces).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mdp.mesh import Floats, Indices
from slicer.geometry.edge_index import EdgeIndex, depths, index_edges
from slicer.geometry.polygons import Polygons, contours
from slicer.geometry.polyline import length_mm
from slicer.geometry.triangulation import triangulate
from slicer.walls.variable.counts import Counts, count_beads
from slicer.walls.variable.course import TRANSITION, corners, smoothed
from slicer.walls.variable.lines import Line, lines_of, trace_chains
from slicer.walls.variable.loops import lay_loops
from slicer.walls.variable.rule import FEATURE, Rule
from slicer.walls.variable.skeleton import Skeleton, skeleton_of

STEP = 0.42  # nominal spacings: sampling of the boundary
DOT = 0.3  # of its width: a shorter line is laid as a dash, thinner by
DASH = 0.25  # of its width, and as much longer
SLACK_MM = 0.01  # by which a place may be narrower than the least bead
SHORT = 0.05  # of its width: a dash is no shorter
THIN = 4.0  # least widths: what is narrower than one and longer than this is a wall, what is shorter the tip of a corner


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
    lines = lines_of(trace_chains(triangulation.across, skeleton, counts, rule))
    middle = [_along(line, rule, int(piece_of[line.ends[0]])) for line in lines] + _dots(skeleton, counts, rule, piece_of)
    borders = {piece: index_edges(pieces[piece]) for piece in {wall.piece for wall in middle if wall.level == 0}}
    middle = [wall if wall.level else _clipped(wall, borders[wall.piece], rule) for wall in middle]
    walls += [_simplified(wall) for wall in middle if len(wall.course) > 1]
    laid = [wall for wall in walls if length_mm(wall.course) > 0.0]  # points may fall on each other when they are smoothed
    return sorted(laid, key=lambda wall: wall.piece)


def _along(line: Line, rule: Rule, piece: int) -> Wall:
    """The bead along a line."""
    closed, reach_mm = line.ends[0] == line.ends[1], TRANSITION * rule.inner
    course = np.empty_like(line.course)
    for column, reach in enumerate((0.5 * reach_mm, 0.5 * reach_mm, reach_mm)):
        course[:, column] = smoothed(line.course, np.ascontiguousarray(line.course[:, column]), reach, closed)
    if closed:
        course[-1] = course[0]
    else:
        course[[0, -1], :2] = line.course[[0, -1], :2]
        if line.level == 0 and length_mm(course) < DOT * course[:, 2].max():
            return _dash(course[0, :2], course[-1, :2], float(course[:, 2].mean()), rule, piece)
    return Wall(course, line.level, closed, 2 * int(line.level == 0), piece)


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


def _simplified(wall: Wall) -> Wall:
    return replace(wall, course=wall.course[corners(wall.course, wall.level)])
