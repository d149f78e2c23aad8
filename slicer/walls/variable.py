"""Variable walls: beads whose number and width follow the thickness of polygons (Kuipers et al. 2020).

The thickness is known on the skeleton (medial axis), whose points are equally far from the boundary on both sides: half the
thickness. It determines the number of beads across. The outer ones have their nominal width, the innermost one or two take the
rest, so widths change with the thickness, and where they would become too wide or too narrow, the count changes.

    thickness in spacings:    0       1.5        2.7      3.5        4.7     5.5     (while there are walls left to lay)
    beads across:             |   1   |     2     |    3   |     4     |   5   |

         |( m )|                  1   a line m along the skeleton, as wide as the polygon
        |( 0 )( 0 )|              2   both sides of loop 0, each half as wide as the polygon
       |( 0 )( m )( 0 )|          3   loop 0 and a line between its sides
      |( 0 )( 1 )( 1 )( 0 )|      4   loops 0 and 1

The boundary is sampled and triangulated; the circumcentres of the triangles are the skeleton, whose nodes get a count with
hysteresis. Loops run around the regions with room for their level: the triangles there form areas of the triangulation, and going
around an area from corner to corner, a loop lies on the rib of each, at the depth of its level. Where this path turns back at the
axis, the loop crosses it: so it is closed for any shape (this replaces the stitching of section 3.4). Lines run along the
skeleton where the count is odd. Widths are smoothed where counts change, and single lines are kept inside the polygon.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from mdp.kernels.arrays import flags, floats, longs, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices, Ints
from mdp.overhang import Mask
from slicer.geometry.edge_index import EdgeIndex, depths, index_edges
from slicer.geometry.polygons import RESOLUTION_MM, Polygons, close_loop, contours
from slicer.geometry.polyline import Segment, along_mm, length_mm, nearest_share
from slicer.geometry.triangulation import Triangulation, after, before, triangulate
from slicer.walls.skeleton import FEATURE, Rule, Skeleton, depth_of, loops_of, middle_widths, skeleton_of, spacing_of

MITRE = 100.0  # deg: the loop is cut off around a sharper corner of a hole
SMOOTH = 0.05  # radians: smaller turns get no mitre
PER_CORNER = 3  # greatest number of points per corner of a triangle: one on its rib, and two of a mitre
WIDTH_STEP_MM = 0.004  # a point whose width is this close to the interpolated width is dropped
REACH, DEPTH, SPACING = 4, 5, 6  # columns of a table of ribs, after foot and direction
SHORTEST = 1.0  # nominal spacings: shorter loops are dropped
TRANSITION = 0.7  # nominal spacings to both sides over which widths are smoothed
STEP = 0.42  # nominal spacings: sampling of the boundary
DOT = 0.3  # share of a line's width: a shorter line is laid as a short thin segment
DASH = 0.25  # share of a line's width, by which that segment is thinner and longer
SLACK_MM = 0.01  # by which a region may be narrower than the least bead
SHORT = 0.05  # share of a line's width: least length of such a segment
THIN = 4.0  # least widths: a region narrower than one and longer than this is a wall, a shorter one the tip of a corner
LOOK_MM = 0.4  # distance from a fork at which the directions of its branches are measured
ABUT = 0.45  # share of a bead's width: distance at which a line ends from the centre of a crossing bead


@dataclass(frozen=True, eq=False)
class Wall:
    """A wall whose width may vary.

    course: (n, 3) x, y and width, mm; level: 0 for the outermost wall, 1 for the next one inside; closed: whether the wall is a
    loop, whose course repeats its first point at its end; free: number of sides, 0 to 2, on which no bead adjoins; piece: index
    of the polygons that the wall belongs to.
    """

    course: Floats
    level: int
    closed: bool
    free: int
    piece: int

    @property
    def points(self) -> Floats:
        """(n, 2) points of the course, mm; a loop does not repeat its first point."""
        return np.ascontiguousarray(self.course[: -1 if self.closed else None, :2])


def variable_walls(pieces: Sequence[Polygons], rule: Rule) -> list[Wall]:
    """The walls of polygons, computed for each piece separately."""
    triangulation = triangulate([contours(piece) for piece in pieces], STEP * rule.inner)
    if triangulation is None:
        return []
    skeleton = skeleton_of(triangulation, rule)
    piece_of = triangulation.piece[triangulation.tails[::3]]
    walls: list[Wall] = []
    for level in range(rule.walls):
        ribs, starts, node = trace_loops(triangulation, skeleton, rule, level)
        loops = [(_loop(ribs[a:b], rule, level), piece) for (a, b), piece in zip(pairwise(starts), piece_of[node], strict=True)]
        kept = [Wall(course, level, True, int(level == 0), int(piece)) for course, piece in loops if len(course)]
        if not kept:
            break
        walls += kept
    middle = lines_along(skeleton, rule, piece_of) + _point_segments(skeleton, rule, piece_of)
    borders = {piece: index_edges(pieces[piece]) for piece in {wall.piece for wall in middle if wall.level == 0}}
    middle = [wall if wall.level else _clipped(wall, borders[wall.piece], rule) for wall in middle]
    walls += [replace(wall, course=wall.course[corners(wall.course)]) for wall in middle if len(wall.course) > 1]
    laid = [wall for wall in walls if length_mm(wall.course) > 0.0]  # smoothing can make points coincide
    return sorted(laid, key=lambda wall: wall.piece)


def _loop(ribs: Floats, rule: Rule, level: int) -> Floats:
    """The course (n, 3) of a loop, its widths smoothed where counts change; empty if it is too short."""
    feet, ways, (reach, depth, spacing) = ribs[:, :2], ribs[:, 2:4], ribs[:, REACH:].T.copy()
    line, reach_mm = feet + ways * depth[:, None], TRANSITION * rule.inner
    if length_mm(close_loop(line)) < SHORTEST * rule.inner:
        return np.zeros((0, 3))
    deep = np.minimum(smoothed(line, depth, reach_mm, True), reach)
    width = smoothed(line, spacing, reach_mm, True) + rule.round if level else 2.0 * deep
    course: Floats = close_loop(np.column_stack([feet + ways * deep[:, None], width]))
    return np.asarray(course[corners(course)])


@kernel
def trace_loops(triangulation: Triangulation, skeleton: Skeleton, rule: Rule, level: int) -> tuple[Floats, Indices, Indices]:
    """The loops of a level, 0 outermost, as the ribs that they cross.

    Returns ribs (n, 7): x and y of the foot, its direction per mm of depth, half the thickness, and depth and spacing of the loop
    there; the start of each loop (k + 1,) and its first triangle (k,).
    """
    across, radii = triangulation.across, skeleton.radii
    depth, active, seen = floats(len(radii), 0.0), flags(len(radii)), flags(3 * len(radii))
    room = 0
    for t in range(len(radii)):
        if loops_of(rule, skeleton.beads[t]) > level:
            depth[t] = depth_of(rule, skeleton.beads[t], skeleton.thick[t], level)
            active[t] = radii[t] > depth[t]
            room += 3 * PER_CORNER if active[t] else 0
    ribs, starts, node = table(room, 7), longs(room + 1, 0), longs(room, 0)
    n = loops = 0
    for start in range(3 * len(radii)):
        if seen[start] or not active[start // 3]:
            continue
        h = start
        while not seen[h]:
            seen[h] = True
            t, twin, begun = h // 3, across[h], n
            n = _rib(triangulation, skeleton, h, ribs, n)
            if twin >= 0 and active[twin // 3]:
                n = _turn(triangulation, skeleton, (h, after(twin)), ribs, n)
                h = after(twin)
            else:
                if twin >= 0:
                    room_there = loops_of(rule, skeleton.beads[twin // 3]) > level
                    n = _cross(skeleton, (t, twin // 3), depth[t], room_there, ribs, n)
                h = after(h)
            for k in range(begun, n):
                ribs[k, DEPTH], ribs[k, SPACING] = depth[t], spacing_of(rule, skeleton.beads[t], skeleton.thick[t], level)
        node[loops] = start // 3
        loops += 1
        starts[loops] = n
    return ribs[:n], starts[: loops + 1], node[:loops]


@no_nrt
def _add(ribs: Floats, n: int, foot: tuple[float, float], way: tuple[float, float], reach: float) -> int:
    ribs[n, 0], ribs[n, 1] = foot
    ribs[n, 2], ribs[n, 3] = way
    ribs[n, REACH] = reach
    return n + 1


@no_nrt
def _rib(triangulation: Triangulation, skeleton: Skeleton, h: int, ribs: Floats, n: int) -> int:
    """Add the rib of a corner; in a triangle at a corner of the polygon, the rib on its bisector."""
    points, tails, across, _ = triangulation
    x, y = skeleton.centres[h // 3, 0], skeleton.centres[h // 3, 1]
    fx, fy, reach = skeleton.feet[h, 0], skeleton.feet[h, 1], skeleton.radii[h // 3]
    if across[h] < 0 and across[before(h)] < 0:
        fx, fy = points[tails[h], 0], points[tails[h], 1]
        return _add(ribs, n, (fx, fy), ((x - fx) / reach, (y - fy) / reach), reach)
    long = np.hypot(x - fx, y - fy)
    return _add(ribs, n, (fx, fy), ((x - fx) / long, (y - fy) / long), long)


@no_nrt
def _turn(triangulation: Triangulation, skeleton: Skeleton, corners: tuple[int, int], ribs: Floats, n: int) -> int:
    """Add the mitre between two ribs from one point, where the polygon's outline turns into it."""
    points, tails, _, _ = triangulation
    a, b = corners
    p = tails[b]
    ax, ay = skeleton.centres[a // 3, 0] - skeleton.feet[a, 0], skeleton.centres[a // 3, 1] - skeleton.feet[a, 1]
    bx, by = skeleton.centres[b // 3, 0] - skeleton.feet[b, 0], skeleton.centres[b // 3, 1] - skeleton.feet[b, 1]
    cross, along = ax * by - ay * bx, ax * bx + ay * by
    if cross > 0.0 or np.arctan2(cross, along) > -SMOOTH:
        return n
    turn = np.arctan2(cross, along)
    reach = min(np.hypot(ax, ay), np.hypot(bx, by))
    begin = np.arctan2(ay, ax)
    many = int(np.ceil(abs(np.degrees(turn)) / MITRE))
    for k in range(many):
        angle = begin + turn * (k + 0.5) / many
        stretch = 1.0 / np.cos(0.5 * turn / many)
        n = _add(ribs, n, (points[p, 0], points[p, 1]), (stretch * np.cos(angle), stretch * np.sin(angle)), reach / stretch)
    return n


@no_nrt
def _cross(skeleton: Skeleton, nodes: tuple[int, int], depth: float, room_there: bool, ribs: Floats, n: int) -> int:
    """Add the point at which the loop crosses the axis towards a node beyond it."""
    t, beyond = nodes
    here, there = skeleton.radii[t], skeleton.radii[beyond]
    x, y = skeleton.centres[beyond, 0], skeleton.centres[beyond, 1]
    back_x, back_y = skeleton.centres[t, 0] - x, skeleton.centres[t, 1] - y
    share = 0.0 if there >= depth else (depth - there) / (here - there)
    if not room_there:  # halfway, but no farther than the loop is deep, since a node may lie on the other side of a wide region
        away = np.hypot(back_x, back_y)
        share = max(share, 0.5 if away <= 2.0 * depth else depth / away)
    return _add(ribs, n, (x + share * back_x, y + share * back_y), (0.0, 0.0), there + share * (here - there))


@kernel
def _trace_chains(across: Ints, joined: Mask, degree: Indices) -> tuple[Indices, Indices]:
    """The nodes of all chains between forks and ends, then of the rings, and the start of each chain (k + 1,). joined: (3 m,)
    inner sides that a line crosses; degree: (m,) number of such sides of a node.
    """
    done, nodes, starts = flags(len(across)), longs(2 * len(across) + 2, 0), longs(len(across) + 1, 0)
    n = count = 0
    for rings in range(2):
        for first in range(len(across)):
            if done[first] or (rings == 0 and degree[first // 3] == 2) or not joined[first]:
                continue
            h, nodes[n] = first, first // 3
            n += 1
            while True:
                done[h] = done[across[h]] = True
                back, t = across[h], across[h] // 3
                nodes[n] = t
                n += 1
                if degree[t] != 2 or t == first // 3:
                    break
                for k in range(3 * t, 3 * t + 3):
                    if k != back and joined[k]:
                        h = k
            count += 1
            starts[count] = n
    return nodes[:n], starts[: count + 1]


@kernel
def _taken(skeleton: Skeleton, rule: Rule, nodes: Indices) -> Floats:
    """(k,) length, mm, by which a line is shortened at its end node because a loop crosses it there, where more beads lie side by
    side beyond.
    """
    taken: Floats = floats(len(nodes), 0.0)
    for k in range(len(nodes)):
        t = nodes[k]
        level = loops_of(rule, skeleton.beads[t])
        for h in range(3 * t, 3 * t + 3):
            beyond = skeleton.across[h] // 3
            if beyond >= 0 and loops_of(rule, skeleton.beads[beyond]) > level:
                width = spacing_of(rule, skeleton.beads[beyond], skeleton.thick[beyond], level) + rule.round
                depth = depth_of(rule, skeleton.beads[beyond], skeleton.thick[beyond], level)
                aside = np.sqrt(max(depth * depth - skeleton.radii[t] * skeleton.radii[t], 0.0))
                taken[k] = max(taken[k], ABUT * width - aside)
    return taken


def lines_along(skeleton: Skeleton, rule: Rule, piece_of: Indices) -> list[Wall]:
    """The beads along the skeleton where the count is odd: at every fork the two straightest lines are joined, and ends are cut
    back where a bead crosses them.
    """
    count, beyond = np.repeat(skeleton.beads, 3), skeleton.across // 3
    joined = (beyond >= 0) & skeleton.central & (count % 2 == 1) & (skeleton.beads[beyond] == count)
    degree = np.bincount(np.flatnonzero(joined) // 3, minlength=len(skeleton.beads))
    nodes, starts = _trace_chains(skeleton.across, joined, degree)
    points = np.column_stack([skeleton.centres, middle_widths(skeleton, rule)])
    courses = {k: points[nodes[a:b]] for k, (a, b) in enumerate(pairwise(starts))}
    ends = np.column_stack([nodes[starts[:-1]], nodes[starts[1:] - 1]])
    levels = np.minimum(skeleton.beads[ends[:, 1]] // 2, rule.walls)
    taken = _taken(skeleton, rule, ends.ravel()).reshape(-1, 2)
    at: defaultdict[int, list[int]] = defaultdict(list)
    for k, side in np.argwhere(degree[ends] > 2).tolist():
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
            walls.append(_along(course, int(levels[k]), closed, rule, int(piece_of[ends[k, 0]])))
    return walls


def _join(courses: dict[int, Floats], ends: Indices, taken: Floats, node: int, members: list[int]) -> tuple[int, int]:
    """Join the two straightest lines at a fork, the second to the first, and return them; the others end beside them."""
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
    """Unit vector from the first point of a line to a point a little further along."""
    steps = course[:, :2] - course[0, :2]
    away = np.hypot(*steps.T)
    far = int(np.argmax(away > LOOK_MM)) if (away > LOOK_MM).any() else len(away) - 1
    heading: Floats = steps[far] / max(float(away[far]), 1e-9)
    return heading


def _cut_back(course: Floats, taken_mm: float) -> Floats:
    """A line shortened at its start."""
    if taken_mm <= 0.0 or not len(course):
        return course
    done = along_mm(course)
    if done[-1] <= taken_mm:
        return course[:0]
    first = int(np.searchsorted(done, taken_mm, side="right")) - 1
    share = (taken_mm - done[first]) / (done[first + 1] - done[first])
    left = course[first:].copy()
    left[0, :2] += share * (left[1, :2] - left[0, :2])
    return left


def _along(line: Floats, level: int, closed: bool, rule: Rule, piece: int) -> Wall:
    """The bead along a line (n, 3), its path and widths smoothed."""
    course, reach_mm = np.empty_like(line), TRANSITION * rule.inner
    for column, reach in enumerate((0.5 * reach_mm, 0.5 * reach_mm, reach_mm)):
        course[:, column] = smoothed(line, np.ascontiguousarray(line[:, column]), reach, closed)
    if closed:
        course[-1] = course[0]
    else:
        course[[0, -1], :2] = line[[0, -1], :2]
        if level == 0 and length_mm(course) < DOT * course[:, 2].max():
            return _short_segment(course[0, :2], course[-1, :2], float(course[:, 2].mean()), rule, piece)
    return Wall(course, level, closed, 2 * int(level == 0), piece)


def _point_segments(skeleton: Skeleton, rule: Rule, piece_of: Indices) -> list[Wall]:
    """Short segments for round regions with room for a single bead."""
    dashes, last = list[Wall](), np.full(2, np.inf)
    nodes = np.flatnonzero(skeleton.dots)
    for t in nodes[np.argsort(piece_of[nodes], kind="stable")].tolist():
        centre, radius = skeleton.centres[t], float(skeleton.radii[t])
        if float(np.hypot(*(centre - last))) > radius:
            dashes.append(_short_segment(centre, centre, 2.0 * radius, rule, int(piece_of[t])))
        last = centre
    return dashes


def _short_segment(begin: Floats, end: Floats, width: float, rule: Rule, piece: int) -> Wall:
    """Replace a point bead by a short segment of the same volume, as much thinner as it is longer."""
    thinner = max((1.0 - DASH) * width, rule.least)
    step = end - begin
    length = float(np.hypot(*step))
    way = step / length if length > 1e-6 else np.array([1.0, 0.0])
    middle, half = 0.5 * (begin + end), 0.5 * (length + max(width - thinner, SHORT * width))
    course = np.array([[*(middle - half * way), thinner], [*(middle + half * way), thinner]])
    return Wall(course, 0, False, 2, piece)


def _clipped(line: Wall, borders: EdgeIndex, rule: Rule) -> Wall:
    """Limit a single line to the width of its region, but not below the least bead, and drop ends where not even that fits.

    Thin walls keep ends where the least bead nearly fits: a wall whose thickness varies around the least bead would otherwise be
    full of gaps, at different positions in every layer.
    """
    course = line.course.copy()
    room = 2.0 * np.abs(depths(course, borders))
    course[:, 2] = np.maximum(np.minimum(course[:, 2], room), rule.least)
    first, last = _fitting(course[:, :2], room, rule)
    if line.closed and last >= first:
        first, last = 0, len(room) - 1
    return replace(line, course=course[first : last + 1])


def _fitting(points: Floats, room: Floats, rule: Rule) -> tuple[int, int]:
    """The first and the last point of a line (n, 2) whose room fits a bead; last < first if there is none."""
    if room.min() > rule.least - SLACK_MM:
        return 0, len(room) - 1
    along = along_mm(points)
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


@kernel
def smoothed(points: Floats, values: Floats, reach_mm: float, closed: bool) -> Floats:
    """(n,) means of values along a polyline (n, 2) within a reach on both sides. closed: continue at the ends."""
    out, n = values.copy(), len(points)
    low, high = values[0], values[0]
    for k in range(n):
        low, high = min(low, values[k]), max(high, values[k])
    if high - low < 1e-6:
        return out
    steps = floats(n, 0.0)  # from each point to the next
    for k in range(n):
        after = (k + 1) % n
        steps[k] = np.hypot(points[after, 0] - points[k, 0], points[after, 1] - points[k, 1])
    for k in range(n):
        total, weight = 0.0, 0.0
        for sense in (-1, 1):
            left, i = reach_mm, k
            for _ in range(n):
                j = i + sense
                if j < 0 or j >= n:
                    if not closed:
                        break
                    j = (j + n) % n
                step = steps[i] if sense > 0 else steps[j]
                part = min(step, left)
                share = part / step if step > 0.0 else 0.0
                total += part * (values[i] + 0.5 * share * (values[j] - values[i]))
                weight += part
                left -= part
                i = j
                if left <= 0.0:
                    break
        out[k] = total / weight if weight > 0.0 else values[k]
    return out


@kernel
def corners(course: Floats) -> Mask:
    """(n,) points of a course (n, 3) that a wall keeps when it is simplified in position and width (Douglas and Peucker 1973)."""
    keep = flags(len(course))
    keep[0], keep[len(course) - 1] = True, True
    stack = [(0, len(course) - 1)]
    while len(stack):
        a, b = stack.pop()
        chord = Segment(course[a, 0], course[a, 1], course[b, 0], course[b, 1])
        worst, at = 1.0, -1
        for k in range(a + 1, b):
            x, y = course[k, 0], course[k, 1]
            share = nearest_share(chord, x, y)
            dx, dy = x - chord.x0 - share * (chord.x1 - chord.x0), y - chord.y0 - share * (chord.y1 - chord.y0)
            wider = (course[a, 2] + share * (course[b, 2] - course[a, 2]) - course[k, 2]) / WIDTH_STEP_MM
            far = max((dx * dx + dy * dy) / (RESOLUTION_MM * RESOLUTION_MM), wider * wider)
            if far > worst:
                worst, at = far, k
        if at >= 0:
            keep[at] = True
            stack.append((a, at))
            stack.append((at, b))
    return keep
