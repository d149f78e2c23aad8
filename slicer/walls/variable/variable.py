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

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mdp.mesh import Floats
from slicer.bead import Course
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
    """course: its way and widths; level: 0 outermost; closed: it runs round, and its course ends where it begins.

    free: sides on which no bead lies beside it.
    """

    course: Course
    level: int
    closed: bool
    free: int

    @property
    def points(self) -> Floats:
        """(n, 2) mm, of one that runs round without its first repeated."""
        return self.course.points[:-1] if self.closed else self.course.points


def variable_walls(polygons: Polygons, rule: Rule) -> list[Wall]:
    """All walls of polygons."""
    triangulation = triangulate(contours(polygons), STEP * rule.inner)
    if triangulation is None:
        return []
    skeleton = skeleton_of(triangulation)
    counts = count_beads(triangulation.across, skeleton, rule)
    walls: list[Wall] = []
    for level in range(rule.walls):
        points, widths, starts = lay_loops(triangulation, skeleton, counts, rule, level)
        loops = [Course(points[a:b], widths[a:b]) for a, b in pairwise(starts.tolist())]
        if not loops:
            break
        walls += [Wall(loop, level, True, int(level == 0)) for loop in loops]
    lines = [_along(line, rule) for line in lines_of(trace_chains(triangulation.across, skeleton, counts, rule))]
    lines += [_dash(*dot, rule) for dot in _dots(skeleton, counts)]
    borders = index_edges(polygons if any(line.level == 0 for line in lines) else Polygons())
    clipped = (_clipped(line, borders, rule) for line in lines)
    walls += [_simplified(line) for line in clipped if len(line.points) > 1]
    return [wall for wall in walls if length_mm(wall.course.points) > 0.0]  # points may fall on each other when they are smoothed


def _along(line: Line, rule: Rule) -> Wall:
    """The bead along a line."""
    closed = line.ends[0] == line.ends[1]
    widths = smoothed(line.points, line.widths, TRANSITION * rule.inner, closed)
    x, y = (smoothed(line.points, np.ascontiguousarray(row), 0.5 * TRANSITION * rule.inner, closed) for row in line.points.T)
    points, free = np.column_stack([x, y]), 2 * int(line.level == 0)
    if closed:
        points[-1], widths[-1] = points[0], widths[0]
    else:
        points[0], points[-1] = line.points[0], line.points[-1]
        if line.level == 0 and length_mm(points) < DOT * widths.max():
            return _dash(points[0], points[-1], float(widths.mean()), rule)
    return Wall(Course(points, widths), line.level, closed, free)


def _dots(skeleton: Skeleton, counts: Counts) -> Iterator[tuple[Floats, Floats, float]]:
    """Begin, end and width of round places with room for a single bead."""
    last = np.full(2, np.inf)
    for t in np.flatnonzero(counts.dots):
        centre, radius = skeleton.centres[t], float(skeleton.radii[t])
        if float(np.hypot(*(centre - last))) > radius:
            yield centre, centre, 2.0 * radius
        last = centre


def _dash(begin: Floats, end: Floats, width: float, rule: Rule) -> Wall:
    """A dash in place of a dot, which no printer draws: as much thinner as it is longer."""
    thinner = max((1.0 - DASH) * width, rule.least)
    step = end - begin
    length = float(np.hypot(*step))
    way = step / length if length > 1e-6 else np.array([1.0, 0.0])
    middle, half = 0.5 * (begin + end), 0.5 * (length + max(width - thinner, SHORT * width))
    return Wall(Course(np.array([middle - half * way, middle + half * way]), np.full(2, thinner)), 0, False, 2)


def _clipped(line: Wall, borders: EdgeIndex, rule: Rule) -> Wall:
    """A line that lies alone no wider than its place, but for the least bead, without ends where not even that fits.

    Thin walls keep ends of theirs where it nearly fits: a wall that is now thicker and now thinner than the least bead would be
    all gaps, each above another place than the one in the layer below.
    """
    if line.level > 0:
        return line
    points = line.course.points
    room = 2.0 * np.abs(depths(points, borders))
    widths = np.maximum(np.minimum(line.course.widths, room), rule.least)
    first, last = _fitting(points, room, rule)
    if line.closed and last >= first:
        first, last = 0, len(room) - 1
    return replace(line, course=Course(points[first : last + 1], widths[first : last + 1]))


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
    keep = corners(wall.course.points, wall.course.widths, wall.level)
    return replace(wall, course=Course(wall.course.points[keep], wall.course.widths[keep]))
