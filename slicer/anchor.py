"""Anchors: ends of infill lines joined along the border of their area, and hooked onto it where no neighbour is near.

Ends that follow each other on the border are joined by rising distance, unless that would close a ring or the distance
is beyond a limit; an end left alone gets a short run along the border, towards the side with more room.
"""

import numpy as np

from mdp.kernel import flags, floats, kernel, longs, part, rising
from mdp.mesh import Floats
from slicer.clip import Border, Indices, Pieces

TIE_MM = 1e-6  # distances nearer to each other count as equal: rounding must not choose between the sides of a zigzag


def anchored(
    pieces: Pieces, border: Border, hook_mm: float, most_mm: float, apart_mm: float, group: Indices | None = None
) -> list[Floats]:
    """Pieces as long lines (n, 2): joined where ends are at most most_mm apart along the border, else with hooks.

    A hook is hook_mm long, less where it would come nearer than apart_mm to another end or hook. group: (k,) only pieces
    of one group are joined.
    """
    if not len(pieces.starts):
        return []
    bounds = np.append(pieces.starts, len(pieces.points))
    contour = np.searchsorted(border.offsets, pieces.ends.ravel(), side="right") - 1
    out = np.empty((len(pieces.points) + 2 * len(border.edges) + 4 * len(pieces.ends) + 8, 2))
    starts = np.empty(len(pieces.ends), np.int64)
    limits_mm = (hook_mm, most_mm, apart_mm)
    own = np.zeros(len(pieces.ends), np.int64) if group is None else group
    n, count = _anchored(pieces.points, bounds, pieces.ends, border.edges, border.offsets, contour, own, limits_mm, out, starts)
    return np.split(out[:n].copy(), starts[1:count])


@part
def _places(points: Floats, bounds: Indices, ends: Indices, edges: Floats) -> tuple[Floats, Floats]:
    """Way along all contours to the beginning of each edge (m + 1,) and to each end (2 k,)."""
    way, place = floats(len(edges) + 1, 0.0), floats(2 * len(ends), 0.0)
    for e in range(len(edges)):
        way[e + 1] = way[e] + np.hypot(edges[e, 2] - edges[e, 0], edges[e, 3] - edges[e, 1])
    for k in range(len(ends)):
        for side in range(2):
            p, e = bounds[k + 1] - 1 if side else bounds[k], ends[k, side]
            along = np.hypot(points[p, 0] - edges[e, 0], points[p, 1] - edges[e, 1])
            place[2 * k + side] = min(way[e] + along, way[e + 1])
    return way, place


@part
def _following(place: Floats, contour: Indices, way: Floats, offsets: Indices) -> tuple[Indices, Floats]:
    """Of each end the next one on its contour, which may be itself, and how far it is."""
    order = rising(place)
    after, gap = longs(len(place), 0), floats(len(place), 0.0)
    i = 0
    while i < len(order):
        c, j = contour[order[i]], i
        while j < len(order) and contour[order[j]] == c:
            j += 1
        for k in range(i, j):
            here, there = order[k], order[k + 1 if k + 1 < j else i]
            after[here] = there
            gap[here] = place[there] - place[here]
            if k + 1 == j:
                gap[here] += way[offsets[c + 1]] - way[offsets[c]]
        i = j
    return after, gap


@part
def _joined(after: Indices, gap: Floats, group: Indices, most_mm: float) -> tuple[Indices, Indices]:
    """Of each end the one it is joined with (-1: none), and 1 where the way there goes forward, -1 backward."""
    partner, sense, ties = longs(len(after), -1), longs(len(after), 0), floats(len(after), 0.0)
    for here in range(len(after)):
        ties[here] = np.rint(gap[here] / TIE_MM)
    order, root = rising(ties), longs(len(after) // 2, 0)
    for k in range(len(root)):
        root[k] = k
    for here in order:
        there = after[here]
        if gap[here] > most_mm:
            break
        if partner[here] >= 0 or partner[there] >= 0:
            continue
        a, b = here // 2, there // 2
        if group[a] != group[b]:
            continue
        while root[a] != a:
            root[a] = root[root[a]]
            a = root[a]
        while root[b] != b:
            root[b] = root[root[b]]
            b = root[b]
        if a != b:
            root[a] = b
            partner[here], partner[there], sense[here], sense[there] = there, here, 1, -1
    return partner, sense


@part
def _hooks(partner: Indices, sense: Indices, after: Indices, gap: Floats, hook_mm: float, apart_mm: float) -> Floats:
    """Of each end the length of its hook, negative for a way back along the border."""
    hooks: Floats = floats(len(after), 0.0)
    room, before = floats(len(after), 0.0), longs(len(after), 0)
    for here in range(len(after)):
        before[after[here]] = here
        room[here] = 0.0 if sense[here] == 1 else gap[here] - apart_mm
    for here in range(len(after)):
        if partner[here] < 0:
            back = before[here]
            way = here if room[here] >= room[back] else back
            length = min(hook_mm, room[way])
            if length > apart_mm:
                hooks[here] = length if way == here else -length
                room[way] -= length + apart_mm
    return hooks


@part
def _run(out: Floats, n: int, e: int, place: float, length: float, edges: Floats, way: Floats, a: int, b: int) -> int:
    """Appends the vertices of contour a..b-1 passed on a run from `place` on edge e, backward where the length is negative.

    Also its last point; returns the new n.
    """
    left, forward = abs(length), length > 0.0
    at = place - way[e] if forward else way[e + 1] - place
    step = way[e + 1] - way[e]
    corner = 2 if forward else 0
    while left > step - at:
        left -= step - at
        out[n, 0], out[n, 1] = edges[e, corner], edges[e, corner + 1]
        n += 1
        e += 1 if forward else -1
        e = a if e == b else b - 1 if e < a else e
        step, at = way[e + 1] - way[e], 0.0
    share = (at + left) / step if step > 0.0 else 0.0
    share = share if forward else 1.0 - share
    out[n, 0] = edges[e, 0] + share * (edges[e, 2] - edges[e, 0])
    out[n, 1] = edges[e, 1] + share * (edges[e, 3] - edges[e, 1])
    return n + 1


@kernel
def _anchored(  # type: ignore[no-untyped-def]
    points, bounds, ends, edges, offsets, contour, group, limits_mm, out, starts
):
    """Fills in the lines and where each begins; returns the number of points and of lines. limits_mm: hook, most, apart."""
    hook_mm, most_mm, apart_mm = limits_mm
    way, place = _places(points, bounds, ends, edges)
    after, gap = _following(place, contour, way, offsets)
    partner, sense = _joined(after, gap, group, most_mm)
    hooks = _hooks(partner, sense, after, gap, hook_mm, apart_mm)
    done = flags(len(ends))
    n = count = 0
    for seed in range(len(ends)):
        if done[seed]:
            continue
        end = 2 * seed
        while partner[end] >= 0:
            end = partner[end] ^ 1
        starts[count] = n
        count += 1
        if hooks[end] != 0.0:
            begun, a, b = n, offsets[contour[end]], offsets[contour[end] + 1]
            n = _run(out, n, ends[end // 2, end % 2], place[end], hooks[end], edges, way, a, b)
            for k in range((n - begun) // 2):
                for axis in range(2):
                    out[begun + k, axis], out[n - 1 - k, axis] = out[n - 1 - k, axis], out[begun + k, axis]
        while True:
            k = end // 2
            done[k] = True
            for i in range(bounds[k], bounds[k + 1]):
                p = i if end % 2 == 0 else bounds[k] + bounds[k + 1] - 1 - i
                out[n, 0], out[n, 1] = points[p, 0], points[p, 1]
                n += 1
            end ^= 1
            length = hooks[end]
            if partner[end] >= 0:
                length = gap[end] if sense[end] > 0 else -gap[partner[end]]
            if length != 0.0:
                a, b = offsets[contour[end]], offsets[contour[end] + 1]
                n = _run(out, n, ends[end // 2, end % 2], place[end], length, edges, way, a, b)
            if partner[end] < 0:
                break
            n -= 1  # the run's last point is the partner itself
            end = partner[end]
    return n, count
