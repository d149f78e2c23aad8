"""Loops: the closed beads of one level, by walking round the places of a skeleton where so many beads lie side by side.

The triangles where a loop has room make areas of the triangulation; walking round an area from corner to corner, the loop lies on
the rib of each, at the depth of its level. Where the walk turns back at the axis, the loop crosses it: it is closed whatever the
shape (the walk takes the place of the stitching of Kuipers et al. 2020, section 3.4).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, floats, longs, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Indices
from slicer.geometry.polygons import RESOLUTION_MM
from slicer.geometry.polyline import Segment, length_between, nearest_share
from slicer.geometry.triangulation import Triangulation
from slicer.walls.skeleton import Counts, Rule, Skeleton, after, before, depth_of, loops_of, spacing_of

MITRE = 100.0  # deg: round a sharper corner of a hole the loop is cut off
SMOOTH = 0.05  # radians: no mitre for less
PER_CORNER = 3  # points that a corner of a triangle gives at most: that on its rib, and two of a mitre
SHORTEST = 1.0  # nominal spacings: a shorter loop is none
TRANSITION = 0.7  # nominal spacings to both sides over which widths are smoothed
WIDTH_STEP_MM = 0.004  # a point whose width is that near to the one between its neighbours says nothing


class _Ribs(NamedTuple):
    """Points of loops. feet: (n, 2); ways: (n, 2) what is added to a foot for every mm of depth; reach: (n,) half thickness.

    depth, spacing: (n,) of the loop there; starts: (k + 1,) where each loop begins; node: (k,) the first triangle of each.
    """

    feet: Floats
    ways: Floats
    reach: Floats
    depth: Floats
    spacing: Floats
    starts: Indices
    node: Indices


@kernel
def lay_loops(
    triangulation: Triangulation, skeleton: Skeleton, counts: Counts, rule: Rule, level: int
) -> tuple[Floats, Indices, Indices]:
    """All loops of a level, 0 outermost, their widths smoothed where counts change.

    Returns courses (n, 3) of x, y and width, the first point of each loop repeated at its end, where each loop begins (k + 1,)
    and one of its triangles (k,).
    """
    ribs = _trace(triangulation, skeleton, counts, rule, level)
    loops, reach_mm = len(ribs.starts) - 1, TRANSITION * rule.inner
    courses, starts, node = table(len(ribs.reach) + loops, 3), longs(loops + 1, 0), longs(loops, 0)
    n = count = 0
    for loop in range(loops):
        a, size = ribs.starts[loop], ribs.starts[loop + 1] - ribs.starts[loop]
        way = table(size + 1, 3)
        for k in range(size + 1):
            i = a + k % size
            for axis in range(2):
                way[k, axis] = ribs.feet[i, axis] + ribs.ways[i, axis] * ribs.depth[i]
        if length_between(way, 0, size + 1) < SHORTEST * rule.inner:
            continue
        depth = smoothed(way[:size], ribs.depth[a : a + size], reach_mm, True)
        spacing = smoothed(way[:size], ribs.spacing[a : a + size], reach_mm, True)
        for k in range(size + 1):
            i = a + k % size
            deep = min(depth[k % size], ribs.reach[i])
            way[k, 2] = spacing[k % size] + rule.round if level else 2.0 * deep
            for axis in range(2):
                way[k, axis] = ribs.feet[i, axis] + ribs.ways[i, axis] * deep
        keep = corners(way)
        for k in range(size + 1):
            if keep[k]:
                for axis in range(3):
                    courses[n, axis] = way[k, axis]
                n += 1
        node[count] = ribs.node[loop]
        count += 1
        starts[count] = n
    return courses[:n].copy(), starts[: count + 1].copy(), node[:count].copy()


@helper
def _trace(triangulation: Triangulation, skeleton: Skeleton, counts: Counts, rule: Rule, level: int) -> _Ribs:
    """The ribs of all loops of a level."""
    across = triangulation.across
    many = len(skeleton.radii)
    depth, active, seen = floats(many, 0.0), flags(many), flags(3 * many)
    room = 0
    for t in range(many):
        if loops_of(rule, counts.beads[t]) > level:
            depth[t] = depth_of(rule, counts.beads[t], counts.radii[t], level)
            active[t] = skeleton.radii[t] > depth[t]
            room += 3 * PER_CORNER if active[t] else 0
    feet, ways, reach = table(room, 2), table(room, 2), floats(room, 0.0)
    out = _Ribs(feet, ways, reach, floats(room, 0.0), floats(room, 0.0), longs(room + 1, 0), longs(room, 0))
    n = loops = 0
    for start in range(3 * many):
        if seen[start] or not active[start // 3]:
            continue
        h = start
        while not seen[h]:
            seen[h] = True
            t = h // 3
            spacing = spacing_of(rule, counts.beads[t], counts.radii[t], level)
            begun = n
            n = _rib(triangulation, skeleton, h, out, n)
            twin = across[h]
            if twin >= 0 and active[twin // 3]:
                n = _turn(triangulation, skeleton, (h, after(twin)), out, n)
                h = after(twin)
            else:
                if twin >= 0:
                    room_there = loops_of(rule, counts.beads[twin // 3]) > level
                    n = _cross(skeleton, (t, twin // 3), depth[t], room_there, out, n)
                h = after(h)
            for k in range(begun, n):
                out.depth[k], out.spacing[k] = depth[t], spacing
        out.node[loops] = start // 3
        loops += 1
        out.starts[loops] = n
    starts, node = out.starts[: loops + 1], out.node[:loops]
    return _Ribs(out.feet[:n], out.ways[:n], out.reach[:n], out.depth[:n], out.spacing[:n], starts, node)


@no_nrt
def _add(out: _Ribs, n: int, foot: tuple[float, float], way: tuple[float, float], reach: float) -> int:
    out.feet[n, 0], out.feet[n, 1] = foot
    out.ways[n, 0], out.ways[n, 1] = way
    out.reach[n] = reach
    return n + 1


@no_nrt
def _rib(triangulation: Triangulation, skeleton: Skeleton, h: int, out: _Ribs, n: int) -> int:
    """Adds the place on the rib of a corner; in the tip of a triangle in a corner of the polygon, that on its bisector."""
    points, tails, across, _ = triangulation
    x, y = skeleton.centres[h // 3, 0], skeleton.centres[h // 3, 1]
    fx, fy, reach = skeleton.feet[h, 0], skeleton.feet[h, 1], skeleton.radii[h // 3]
    if across[h] < 0 and across[before(h)] < 0:
        fx, fy = points[tails[h], 0], points[tails[h], 1]
        return _add(out, n, (fx, fy), ((x - fx) / reach, (y - fy) / reach), reach)
    long = np.hypot(x - fx, y - fy)
    return _add(out, n, (fx, fy), ((x - fx) / long, (y - fy) / long), long)


@no_nrt
def _turn(triangulation: Triangulation, skeleton: Skeleton, corners: tuple[int, int], out: _Ribs, n: int) -> int:
    """Adds the mitre between two ribs from one point, where the polygon's outline turns into it."""
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
        n = _add(out, n, (points[p, 0], points[p, 1]), (stretch * np.cos(angle), stretch * np.sin(angle)), reach / stretch)
    return n


@no_nrt
def _cross(skeleton: Skeleton, nodes: tuple[int, int], depth: float, room_there: bool, out: _Ribs, n: int) -> int:
    """Adds the place where the loop crosses the axis on the way to a node beyond it."""
    t, beyond = nodes
    here, there = skeleton.radii[t], skeleton.radii[beyond]
    share = 0.0 if there >= depth else (depth - there) / (here - there)
    if not room_there:  # halfway, but no farther than the loop is deep: a node may lie on the other side of a hall
        away = np.hypot(
            skeleton.centres[t, 0] - skeleton.centres[beyond, 0], skeleton.centres[t, 1] - skeleton.centres[beyond, 1]
        )
        share = max(share, 0.5 if away <= 2.0 * depth else depth / away)
    x = skeleton.centres[beyond, 0] + share * (skeleton.centres[t, 0] - skeleton.centres[beyond, 0])
    y = skeleton.centres[beyond, 1] + share * (skeleton.centres[t, 1] - skeleton.centres[beyond, 1])
    return _add(out, n, (x, y), (0.0, 0.0), there + share * (here - there))


@kernel
def smoothed(points: Floats, values: Floats, reach_mm: float, closed: bool) -> Floats:
    """(n,) means of values over all of a polyline (n, 2) within the reach on both sides; closed: it goes on from its end."""
    n = len(points)
    out = floats(n, 0.0)
    low, high = values[0], values[0]
    for k in range(n):
        low, high = min(low, values[k]), max(high, values[k])
    if high - low < 1e-6:
        for k in range(n):
            out[k] = values[k]
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
def corners(course: Floats) -> NDArray[np.bool_]:
    """(n,) points of a course (n, 3) that a wall keeps when it is simplified (Douglas and Peucker 1973), in place
    and in width."""
    keep = flags(len(course))
    keep[0], keep[len(course) - 1] = True, True
    stack = longs(2 * len(course), 0)
    stack[1], waiting = len(course) - 1, 2
    while waiting > 0:
        waiting -= 2
        a, b = stack[waiting], stack[waiting + 1]
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
            stack[waiting], stack[waiting + 1], stack[waiting + 2], stack[waiting + 3] = a, at, at, b
            waiting += 4
    return keep
