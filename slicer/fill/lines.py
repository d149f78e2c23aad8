"""Lines: open lines over a box in a rotated frame, clipped to an area, and joined along its border or to zigzags.

Consecutive ends on the border are joined by ascending distance, unless that would close a ring or the distance exceeds a limit; a
single end gets a short run along the border, towards the side with more room. Where a line of a solid fill meets the border at an
angle, a wedge stays open outside the sharp bend, between it and the next line: the joint extends into it.
"""

from collections.abc import Callable
from math import ceil

import numpy as np

from mdp.kernels.arrays import flags, floats, longs
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.kernels.sorting import argsort
from mdp.mesh import Floats, Indices
from mdp.topology.components import join, root, singletons
from slicer.geometry.clip import NO_PIECES, Pieces, clip_lines, rotation_2d
from slicer.geometry.edge_index import EdgeIndex
from slicer.geometry.polygons import Polygons, close_loop, contours, offset

Box = tuple[float, float, float, float]
Lines = tuple[Floats, Indices]  # points (n, 2) mm and the start of each line
Draw = Callable[[Box], Lines]  # draws the lines of a box x0 y0 x1 y1
LinePattern = tuple[float, Draw]  # angle of the pattern's frame, deg, and its function
# A border, (m + 1,) distance along all its contours to each edge, (k, 2) edges on which pieces end, and (2 k,) distance to each
# end.
BorderEnds = tuple[EdgeIndex, Floats, Indices, Floats]
MARGIN_MM = 0.1  # lines begin and end this far outside the box
WEDGE = 0.65  # share of the open wedge beside a sharp bend, along the border: beyond it the wedge is too narrow for a bead
LEAST_WEDGE, MOST_WEDGE = 0.1, 3.0  # spacings: a smaller wedge stays open
LEAST_RUN = 0.5  # spacings: shortest run of a line around a corner
FLAT = 0.05  # sine of the angle between line and border below which they hardly separate
BEND = 0.6  # spacings before the border at which a line bends into its wedge
TIE_MM = 1e-6  # distances that differ less are equal: rounding must not choose between the sides of a zigzag


def clip_pattern(border: EdgeIndex, angle_deg: float, draw: Draw) -> Pieces:
    """The part of a pattern inside a border, in the border's frame. The pattern is drawn in a frame turned by its angle."""
    if not len(border.edges):
        return NO_PIECES
    turn = rotation_2d(angle_deg)
    corners = border.edges[:, :2] @ turn
    (x0, y0), (x1, y1) = corners.min(axis=0) - MARGIN_MM, corners.max(axis=0) + MARGIN_MM
    points, starts = draw((x0, y0, x1, y1))
    return clip_lines(points @ turn.T, starts, border)


def parallel_lines(angle_deg: float, apart_mm: float, shift_mm: float = 0.0) -> LinePattern:
    """Straight lines at an angle, on a grid fixed for all layers except for a shift across the lines."""

    def draw(box: Box) -> Lines:
        return horizontal_lines((grid_numbers(box[1] - shift_mm, box[3] - shift_mm, apart_mm) + 0.5) * apart_mm + shift_mm, box)

    return angle_deg, draw


def grid_numbers(low: float, high: float, apart_mm: float) -> Floats:
    """Integers k for which (k + 1/2) apart lies between low and high: a grid that is fixed for all layers."""
    return np.arange(ceil(low / apart_mm - 0.5), ceil(high / apart_mm - 0.5), dtype=np.float64)


def concentric_lines(area: Polygons, apart_mm: float) -> list[Floats]:
    """The outlines of an area and of its successive insets by a distance; all closed."""
    lines = list[Floats]()
    while not area.is_empty():
        lines += [close_loop(loop) for loop in contours(area)]
        area = offset(area, -apart_mm)
    return lines


def horizontal_lines(heights: Floats, box: Box) -> Lines:
    """Horizontal lines across a box."""
    points = np.empty((len(heights), 2, 2))
    points[:, 0, 0], points[:, 1, 0] = box[0], box[2]
    points[:, :, 1] = heights[:, None]
    return points.reshape(-1, 2), 2 * np.arange(len(heights))


def anchor_lines(
    pieces: Pieces,
    border: EdgeIndex,
    limits_mm: tuple[float, float, float],
    solid_mm: tuple[float, float] = (0.0, 0.0),
    group: Indices | None = None,
) -> tuple[list[Floats], Indices]:
    """Join pieces to long lines (n, 2), within one group (k,), where ends are near along the border, otherwise end them with
    hooks; returns lines and their groups. limits_mm: greatest joint, length of a hook, and its distance from the next end or
    hook, for which it may be shortened. solid_mm: for straight pieces of a solid fill, their spacing and the inset of their ends,
    else zeros.
    """
    group = np.zeros(len(pieces.ends), np.int64) if group is None else group
    if not len(pieces.ends):
        return [], group
    out = np.empty((len(pieces.points) + 3 * len(border.edges) + 8 * len(pieces.ends) + 8, 2))
    starts, of = np.empty((2, len(pieces.ends)), np.int64)
    n, count = _lay_lines(pieces, border, group, limits_mm, solid_mm, (out, starts, of))
    return np.split(out[:n].copy(), starts[1:count]), of[:count]


@kernel
def _lay_lines(
    pieces: Pieces,
    border: EdgeIndex,
    group: Indices,
    limits_mm: tuple[float, float, float],
    solid_mm: tuple[float, float],
    filled: tuple[Floats, Indices, Indices],
) -> tuple[int, int]:
    """Fill in the lines, their starts and groups; returns the number of points and of lines."""
    most_mm, hook_mm, apart_mm = limits_mm
    out, starts, of = filled
    way = _way(border.edges)
    along_border = _ways_along_border(pieces, border.edges, way)
    after, gap = _next_ends(along_border, pieces.ends, border, way)
    partner, sense = _join_ends(after, gap, group, most_mm)
    runs = _runs(sense, after, gap, hook_mm, apart_mm)
    wedges = _wedges(pieces, border.edges, sense, after, gap, runs, solid_mm)
    done, border_ends = flags(len(pieces.ends)), (border, way, pieces.ends, along_border)
    n = count = 0
    for seed in range(len(pieces.ends)):
        if done[seed]:
            continue
        end = 2 * seed
        while partner[end] >= 0:
            end = partner[end] ^ 1
        starts[count], of[count] = n, group[seed]
        count += 1
        if runs[end] != 0.0:
            first, n = n, _append_run(out, n, end, runs[end], border_ends)
            _reverse(out, first, n)
        elif wedges[end] != 0.0:
            n = _append_tip(out, n, end, wedges[end], border_ends)
        while True:
            done[end // 2] = True
            first, n = n, _append_piece(out, n, pieces, end)
            _bend(out, first, first + 1, wedges[end], solid_mm[0])
            end ^= 1
            if wedges[end] != 0.0:
                meets = out[n - 1, 0], out[n - 1, 1]
                _bend(out, n - 1, n - 2, wedges[end], solid_mm[0])
                n = _append_tip(out, n, end, wedges[end], border_ends)
                if partner[end] >= 0:
                    out[n, 0], out[n, 1] = meets
                    n += 1
            if runs[end] != 0.0:
                n = _append_run(out, n, end, runs[end], border_ends)
            if partner[end] < 0:
                break
            end = partner[end]
            if wedges[end] != 0.0:
                n = _append_tip(out, n, end, wedges[end], border_ends)
            else:
                n -= 1  # the run's last point is the partner itself
    return n, count


@helper
def _way(edges: Floats) -> Floats:
    """(m + 1,) distance along all contours to the start of each edge, mm."""
    way: Floats = floats(len(edges) + 1, 0.0)
    for e in range(len(edges)):
        way[e + 1] = way[e] + np.hypot(edges[e, 2] - edges[e, 0], edges[e, 3] - edges[e, 1])
    return way


@helper
def _ways_along_border(pieces: Pieces, edges: Floats, way: Floats) -> Floats:
    """(2 k,) distance along all contours to each end, mm."""
    points, bounds, ends = pieces
    along_border: Floats = floats(2 * len(ends), 0.0)
    for k in range(len(ends)):
        for side in range(2):
            p, e = bounds[k + 1] - 1 if side else bounds[k], ends[k, side]
            along = np.hypot(points[p, 0] - edges[e, 0], points[p, 1] - edges[e, 1])
            along_border[2 * k + side] = min(way[e] + along, way[e + 1])
    return along_border


@helper
def _next_ends(along_border: Floats, ends: Indices, border: EdgeIndex, way: Floats) -> tuple[Indices, Floats]:
    """The next end along the contour from each end (itself if it is alone), and the distance to it. ends: (k, 2) edges on which
    they lie.
    """
    order, contour = argsort(along_border), longs(len(along_border), 0)
    for end in range(len(contour)):
        contour[end] = border.loop[ends[end // 2, end % 2]]
    after, gap = longs(len(along_border), 0), floats(len(along_border), 0.0)
    i = 0
    while i < len(order):
        c, j = contour[order[i]], i
        while j < len(order) and contour[order[j]] == c:
            j += 1
        for k in range(i, j):
            here, there = order[k], order[k + 1 if k + 1 < j else i]
            after[here] = there
            gap[here] = along_border[there] - along_border[here]
            if k + 1 == j:
                gap[here] += way[border.begins[c + 1]] - way[border.begins[c]]
        i = j
    return after, gap


@helper
def _join_ends(after: Indices, gap: Floats, group: Indices, most_mm: float) -> tuple[Indices, Indices]:
    """For each end its partner (-1 if none), and 1 if the joint runs forward, -1 backward, 0 without one."""
    partner, sense, ties = longs(len(after), -1), longs(len(after), 0), floats(len(after), 0.0)
    for here in range(len(after)):
        ties[here] = np.rint(gap[here] / TIE_MM)
    joined = singletons(len(after) // 2)
    for here in argsort(ties):
        there = after[here]
        if gap[here] > most_mm:
            break
        if partner[here] >= 0 or partner[there] >= 0:
            continue
        a, b = here // 2, there // 2
        if group[a] == group[b] and root(joined, a) != root(joined, b):
            join(joined, a, b)
            partner[here], partner[there], sense[here], sense[there] = there, here, 1, -1
    return partner, sense


@helper
def _runs(sense: Indices, after: Indices, gap: Floats, hook_mm: float, apart_mm: float) -> Floats:
    """The length of each end's run along the border, to its partner or as a hook; negative if backward."""
    runs: Floats = floats(len(after), 0.0)
    free, before = floats(len(after), 0.0), longs(len(after), 0)
    for here in range(len(after)):
        before[after[here]] = here
        free[here] = 0.0 if sense[here] == 1 else gap[here] - apart_mm
    for here in range(len(after)):
        back = before[here]
        if sense[here] != 0:
            runs[here] = gap[here] if sense[here] > 0 else -gap[back]
            continue
        side = here if free[here] >= free[back] else back
        length = min(hook_mm, free[side])
        if length > apart_mm:
            runs[here] = length if side == here else -length
            free[side] -= length + apart_mm
    return runs


@helper
def _wedges(
    pieces: Pieces, edges: Floats, sense: Indices, after: Indices, gap: Floats, runs: Floats, solid_mm: tuple[float, float]
) -> Floats:
    """Extension of each end's path along the border into the open wedge beside it, mm, negative if backward.

    Between two ends, the beads of their lines cover the border by half a spacing to both sides and round the end; the rest stays
    open. The open part is large at the sharp side of a line, and around a corner with room for a line but without one: there the
    line gets a run along the border.
    """
    spacing, deep = solid_mm
    wedges, before = floats(len(sense), 0.0), longs(len(sense), 0)
    slants, lengths = floats(len(sense), 0.0), floats(len(sense), 0.0)
    if spacing <= 0.0:
        return wedges
    for here in range(len(after)):
        before[after[here]] = here
        slants[here], lengths[here] = _slant(pieces, edges, here)
    round_mm = np.sqrt(max(0.25 * spacing * spacing - deep * deep, 0.0))
    for here in range(len(sense)):
        sine = np.sqrt(max(1.0 - slants[here] * slants[here], 0.0))
        if sine < FLAT:
            continue
        blunt_mm = (0.5 * spacing - deep * abs(slants[here])) / sine
        sharp = -1 if slants[here] > 0.0 else 1
        beside, free = (after[here], gap[here]) if sharp > 0 else (before[here], gap[before[here]])
        faced = slants[beside] * sharp > 0.0 and sense[beside] != -sharp
        left = 0.0
        if sense[here] != sharp and lengths[here] > 3.0 * BEND * spacing:
            left = 0.5 * free - round_mm if faced else WEDGE * (free - round_mm - blunt_mm)
        beyond, free = (before[here], gap[before[here]]) if sharp > 0 else (after[here], gap[here])
        beyond_mm, alone = free - blunt_mm - round_mm, here % 2 == 1 or sense[here ^ 1] != 0
        # one corner lies beyond both ends of the line, on their blunt sides
        corner = beyond == here ^ 1 and slants[here] * slants[beyond] < 0.0
        if sense[here] == 0 and corner and alone and beyond_mm > max(left, LEAST_RUN * spacing):
            runs[here] = -sharp * min(beyond_mm, MOST_WEDGE * spacing)
        elif left > LEAST_WEDGE * spacing:
            wedge = sharp * min(left, MOST_WEDGE * spacing)
            if sense[here] == 0 and abs(wedge) > spacing:  # a single end follows the border
                runs[here] = wedge
            else:
                wedges[here] = wedge
    return wedges


@helper
def _slant(pieces: Pieces, edges: Floats, end: int) -> tuple[float, float]:
    """Cosine of the angle between the border's direction and a straight piece that begins at an end, and the piece's length,
    mm.
    """
    k, side = end // 2, end % 2
    first, last, e = pieces.starts[k], pieces.starts[k + 1] - 1, pieces.ends[k, side]
    near, far = (last, first) if side else (first, last)
    x, y = pieces.points[far, 0] - pieces.points[near, 0], pieces.points[far, 1] - pieces.points[near, 1]
    u, v = edges[e, 2] - edges[e, 0], edges[e, 3] - edges[e, 1]
    length_mm = np.hypot(x, y)
    size = length_mm * np.hypot(u, v)
    return (x * u + y * v) / size if size > 0.0 else 1.0, length_mm


@no_nrt
def _bend(out: Floats, end: int, before: int, wedge_mm: float, spacing_mm: float) -> None:
    """Move the end of a line back from the border where it bends into a wedge."""
    if wedge_mm != 0.0:
        step = out[before, 0] - out[end, 0], out[before, 1] - out[end, 1]
        share = min(BEND * spacing_mm / max(np.hypot(step[0], step[1]), TIE_MM), 0.5)
        out[end, 0] += share * step[0]
        out[end, 1] += share * step[1]


@no_nrt
def _append_tip(out: Floats, n: int, end: int, length: float, border_ends: BorderEnds) -> int:
    """Append only the last point of a run; returns the new n."""
    last = _append_run(out, n, end, length, border_ends) - 1
    out[n, 0], out[n, 1] = out[last, 0], out[last, 1]
    return n + 1


@no_nrt
def _append_run(out: Floats, n: int, end: int, length: float, border_ends: BorderEnds) -> int:
    """Append the contour's vertices along a run from one of the ends, backward if the length is negative, and the run's last
    point; returns the new n.
    """
    border, way, sides, along_border = border_ends
    e, way_mm = sides[end // 2, end % 2], along_border[end]
    edges, first, last = border.edges, border.begins[border.loop[e]], border.begins[border.loop[e] + 1]
    left, forward = abs(length), length > 0.0
    at = way_mm - way[e] if forward else way[e + 1] - way_mm
    step = way[e + 1] - way[e]
    corner = 2 if forward else 0
    while left > step - at:
        left -= step - at
        out[n, 0], out[n, 1] = edges[e, corner], edges[e, corner + 1]
        n += 1
        e += 1 if forward else -1
        e = first if e == last else last - 1 if e < first else e
        step, at = way[e + 1] - way[e], 0.0
    share = (at + left) / step if step > 0.0 else 0.0
    share = share if forward else 1.0 - share
    out[n, 0] = edges[e, 0] + share * (edges[e, 2] - edges[e, 0])
    out[n, 1] = edges[e, 1] + share * (edges[e, 3] - edges[e, 1])
    return n + 1


@no_nrt
def _append_piece(out: Floats, n: int, pieces: Pieces, end: int) -> int:
    """Append the points of a piece, beginning at one of its ends; returns the new n."""
    first, last = pieces.starts[end // 2], pieces.starts[end // 2 + 1] - 1
    for i in range(last - first + 1):
        p = first + i if end % 2 == 0 else last - i
        out[n, 0], out[n, 1] = pieces.points[p, 0], pieces.points[p, 1]
        n += 1
    return n


@helper
def _reverse(out: Floats, first: int, end: int) -> None:
    """Reverse the order of points first .. end - 1."""
    for k in range((end - first) // 2):
        for axis in range(2):
            out[first + k, axis], out[end - 1 - k, axis] = out[end - 1 - k, axis], out[first + k, axis]
