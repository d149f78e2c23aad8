"""Skeleton: the medial axis of polygons with ribs to the boundary, and the bead count along it, with hysteresis.

The triangles of closely sampled contours are the nodes of the axis, their circumcentres its points, their inner sides its edges
(Kuipers et al. 2020, section 3.1, use the Voronoi diagram of the segments: samples need no parabolas and no exact arithmetic). A
corner of a triangle is named by the half-edge that begins there.

Inward distributed beading (section 4.1 there): the outer beads have their nominal width, the innermost one or two take the rest.
Bead i, counted from the boundary, is described by its spacing s, its share of the thickness; its width is s + height (1 - pi/4),
since the round sides of beads overlap. The count changes with the thickness, but does not flicker.
"""

from typing import NamedTuple

import numpy as np

from mdp.kernels.arrays import flags, floats, ints, longs, table
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.kernels.sorting import argsort
from mdp.mesh import Floats, Indices, Ints
from mdp.overhang import Mask
from slicer.geometry.polyline import Segment, nearest_share, orientation
from slicer.geometry.triangulation import Triangulation, after

SLOPE = 0.2164  # sine of 12.5 deg: sides that meet at less than 25 deg enclose a narrowing region, others a corner
OPPOSITE = -0.8  # greatest cosine of the angle between the directions to opposite sides
ON_SIDE_MM2 = 1e-9  # tolerance: a node on a side is in both triangles
# tolerance: of two equally near feet, on the sides of a corner on a circle around the node, the first is always taken
TIE_MM = 1e-9
MOST_STEPS = 1000  # triangles on the way from a triangle to its centre; usually none
ADD = 0.7  # share of a spacing: a remainder between two beads from this size gets a bead of its own
ROOM = 1.5  # spacings: a narrower region between all walls gets one bead
SPLIT = 1.5  # spacings: from this width one bead becomes two
FEATURE = 0.5  # share of the least width: narrower regions get a bead wider than they are, still narrower ones none
STUB = 0.8  # nominal spacings: a shorter branch of the axis is a corner of a thicker region
POINT = 0.3  # share of an axis piece's half thickness: a shorter piece is a point
FLICKER = 2.0  # nominal spacings: a shorter stretch takes the count of its neighbours if the widths of beads allow it
ROUNDS = 4  # rounds in which such stretches are removed
ALIKE = 1.1  # the thickest point of a region belongs to an adjacent axis unless it is thicker by this factor
SAME_MM = 1e-6  # radii that differ by less are equal
MOST_HOPS = 8  # between nodes; two that refer to each other would loop forever


class Rule(NamedTuple):
    """Rule for bead counts. walls: greatest number of loops from a boundary inward. outer, inner: nominal spacings; round: width
    less spacing; least, most: widths of beads. All mm.
    """

    walls: int
    outer: float
    inner: float
    round: float
    least: float
    most: float


class Skeleton(NamedTuple):
    """A skeleton with m nodes. across: (3 m,) of the triangulation; centres: (m, 2); radii: (m,) distance to the boundary.

    feet: (3 m, 2) points of the boundary nearest to each; central: (3 m,) inner sides across which the axis runs between two
    opposite sides of the polygon, not into a corner of it; beads: (m,) across each node; thick: (m,) half thickness used for the
    beads, the node's own or that of its axis; dots: (m,) centres of round regions with room for a single bead.
    """

    across: Ints
    centres: Floats
    radii: Floats
    feet: Floats
    central: Mask
    beads: Ints
    thick: Floats
    dots: Mask


@kernel
def skeleton_of(triangulation: Triangulation, rule: Rule) -> Skeleton:
    """The skeleton of a triangulated polygon, with the bead count of each node."""
    points, tails, across, _ = triangulation
    following, preceding = ints(len(points), 0), ints(len(points), 0)
    for h in range(len(tails)):
        if across[h] < 0:
            following[tails[h]], preceding[tails[after(h)]] = tails[after(h)], tails[h]
    count = len(tails) // 3
    centres, radii, feet, central = table(count, 2), floats(count, 0.0), table(len(tails), 2), flags(len(tails))
    out = Skeleton(across, centres, radii, feet, central, ints(count, 0), floats(count, 0.0), flags(count))
    for t in range(count):
        _put_at_circumcentre(triangulation, t, out)
        near, far, least, most = _put_feet(points, tails, preceding, following, t, out)
        if _centre(out, (near, far), least, most):
            near, far, least, most = _put_feet(points, tails, preceding, following, t, out)
        radii[t] = least
        if _leaves(triangulation, t, centres[t, 0], centres[t, 1]):
            _put_in_middle(triangulation, t, out)
            _put_feet(points, tails, preceding, following, t, out)
            radii[t] = 0.0
    for h in range(len(tails)):
        twin = across[h]
        if twin > h:
            central[h] = central[twin] = 0.5 * (_slope2(out, h) + _slope2(out, twin)) < SLOPE * SLOPE
    _count_beads(out, rule)
    return out


@no_nrt
def _leaves(triangulation: Triangulation, t: int, x: float, y: float) -> bool:
    """Whether a node lies beyond the boundary, seen from its triangle: needles in a neck have their centres anywhere."""
    points, tails, across, _ = triangulation
    for _ in range(MOST_STEPS):
        onward = -1
        for h in range(3 * t, 3 * t + 3):
            a, b = tails[h], tails[after(h)]
            beside = orientation(Segment(points[a, 0], points[a, 1], points[b, 0], points[b, 1]), x, y)
            if beside <= 0.0 and across[h] < 0:
                return True
            if beside < -ON_SIDE_MM2:
                onward = across[h]
        if onward < 0:
            return False
        t = onward // 3
    return True


@no_nrt
def _put_at_circumcentre(triangulation: Triangulation, t: int, out: Skeleton) -> None:
    """Set a node to the circumcentre of its triangle."""
    points, tails, _, _ = triangulation
    a, b, c = tails[3 * t], tails[3 * t + 1], tails[3 * t + 2]
    bx, by = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    cx, cy = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
    doubled = 2.0 * (bx * cy - by * cx)
    if abs(doubled) < 1e-12:
        _put_in_middle(triangulation, t, out)
        return
    b2, c2 = bx * bx + by * by, cx * cx + cy * cy
    out.centres[t, 0] = points[a, 0] + (cy * b2 - by * c2) / doubled
    out.centres[t, 1] = points[a, 1] + (bx * c2 - cx * b2) / doubled


@no_nrt
def _put_in_middle(triangulation: Triangulation, t: int, out: Skeleton) -> None:
    """Set a node to the centroid of its triangle, if that has no usable circumcentre."""
    points, tails, _, _ = triangulation
    a, b, c = tails[3 * t], tails[3 * t + 1], tails[3 * t + 2]
    for axis in range(2):
        out.centres[t, axis] = (points[a, axis] + points[b, axis] + points[c, axis]) / 3.0


@no_nrt
def _put_feet(
    points: Floats, tails: Ints, preceding: Ints, following: Ints, t: int, out: Skeleton
) -> tuple[int, int, float, float]:
    """Fill in the feet of a node, each on the two sides that meet in a corner of its triangle. Returns the corners with the
    nearest and the farthest foot, and their distances.
    """
    x, y = out.centres[t, 0], out.centres[t, 1]
    near, far, least, most = 3 * t, 3 * t, np.inf, -1.0
    for h in range(3 * t, 3 * t + 3):
        corner, away = tails[h], np.inf
        for a, b in ((preceding[corner], corner), (corner, following[corner])):
            side = Segment(points[a, 0], points[a, 1], points[b, 0], points[b, 1])
            share = nearest_share(side, x, y)
            fx, fy = side.x0 + share * (side.x1 - side.x0), side.y0 + share * (side.y1 - side.y0)
            distance = np.hypot(fx - x, fy - y)
            if distance < away - TIE_MM:
                away, out.feet[h, 0], out.feet[h, 1] = distance, fx, fy
        if away < least:
            near, least = h, away
        if away > most:
            far, most = h, away
    return near, far, least, most


@no_nrt
def _centre(out: Skeleton, ends: tuple[int, int], short: float, long: float) -> bool:
    """Move a node between two opposite sides to their middle, since samples do not lie exactly opposite each other.

    ends: the corners with the nearest and the farthest foot; short, long: their distances. Returns whether the node moved.
    """
    near, far = ends
    t = near // 3
    ax, ay = out.feet[near, 0] - out.centres[t, 0], out.feet[near, 1] - out.centres[t, 1]
    bx, by = out.feet[far, 0] - out.centres[t, 0], out.feet[far, 1] - out.centres[t, 1]
    if short <= 0.0 or ax * bx + ay * by >= OPPOSITE * short * long:
        return False
    share = 0.5 * (long - short) / short
    out.centres[t, 0], out.centres[t, 1] = out.centres[t, 0] - share * ax, out.centres[t, 1] - share * ay
    return True


@no_nrt
def _slope2(out: Skeleton, h: int) -> float:
    """Squared slope of the radius along the axis across side h: the cosine of half the angle between its two ribs, squared."""
    t, next_side = h // 3, after(h)
    ax, ay = out.feet[h, 0] - out.centres[t, 0], out.feet[h, 1] - out.centres[t, 1]
    bx, by = out.feet[next_side, 0] - out.centres[t, 0], out.feet[next_side, 1] - out.centres[t, 1]
    long = np.hypot(ax, ay) * np.hypot(bx, by)
    return 0.5 * (1.0 + (ax * bx + ay * by) / long) if long > 1e-12 else 1.0


@no_nrt
def nominal(rule: Rule, level: int) -> float:
    """Nominal spacing of bead `level`."""
    return rule.outer if level == 0 else rule.inner


@no_nrt
def bead_count(rule: Rule, radius: float) -> int:
    """Number of beads across a region with a given half thickness; 2 walls + 2 means all walls, and more than a bead between
    them.
    """
    if 2.0 * radius < FEATURE * rule.least:
        return 0
    rest, narrowest, widest = 2.0 * radius - rule.round, rule.least - rule.round, rule.most - rule.round
    for level in range(rule.walls):
        own, following = nominal(rule, level), rule.inner
        if rest < max(min(SPLIT * own, widest), 2.0 * narrowest):
            return 2 * level + 1
        if rest < min(2.0 * own + max(ADD * following, narrowest), 2.0 * widest):
            return 2 * level + 2
        rest -= 2.0 * own
    return 2 * rule.walls + 1 if rest < max(min(ROOM * rule.inner, widest), narrowest) else 2 * rule.walls + 2


@no_nrt
def loops_of(rule: Rule, count: int) -> int:
    """The number of beads that run along both sides of a region."""
    return min(count // 2, rule.walls)


@no_nrt
def spacing_of(rule: Rule, count: int, radius: float, level: int) -> float:
    """Spacing of loop `level` with `count` beads across a region with a given half thickness."""
    own = nominal(rule, level)
    if level < loops_of(rule, count) - 1 or count == 2 * rule.walls + 2:
        return own
    rest, narrowest, widest = 2.0 * radius - rule.round, rule.least - rule.round, rule.most - rule.round
    for k in range(level):
        rest -= 2.0 * nominal(rule, k)
    if count % 2 == 0:
        return min(max(0.5 * rest, narrowest), widest)
    return max(min(own, 0.5 * (rest - narrowest)), narrowest)


@no_nrt
def depth_of(rule: Rule, count: int, radius: float, level: int) -> float:
    """Depth of the centreline of loop `level` below the boundary."""
    depth = 0.5 * rule.round
    for k in range(level):
        depth += spacing_of(rule, count, radius, k)
    return depth + 0.5 * spacing_of(rule, count, radius, level)


@kernel
def middle_widths(skeleton: Skeleton, rule: Rule) -> Floats:
    """(m,) width of the middle bead at nodes with an odd count."""
    widths = floats(len(skeleton.radii), 0.0)
    for t in range(len(widths)):
        rest = 2.0 * skeleton.radii[t]
        for k in range(loops_of(rule, skeleton.beads[t])):
            rest -= 2.0 * spacing_of(rule, skeleton.beads[t], skeleton.radii[t], k)
        widths[t] = min(max(rest, rule.least), rule.most)
    return widths


class _Pieces(NamedTuple):
    """Connected pieces of nodes. of: (m,) piece of each node, -1 for none; length: (p,) mm; low, high: (p,) least and greatest
    radius.
    """

    of: Indices
    length: Floats
    low: Floats
    high: Floats


@helper
def _count_beads(skeleton: Skeleton, rule: Rule) -> None:
    """Fill in the bead count of each node; clears `central` where a branch of the axis is too short for its own count."""
    _drop_stubs(skeleton, _pieces(skeleton, ints(len(skeleton.radii), 1)), STUB * rule.inner)
    for t in range(len(skeleton.radii)):
        skeleton.beads[t] = bead_count(rule, skeleton.radii[t])
    for _ in range(ROUNDS):
        if not _smooth(skeleton, rule):
            break
    _spread(skeleton, rule)


@helper
def _pieces(skeleton: Skeleton, value: Ints) -> _Pieces:
    """The pieces of the central axis with one value."""
    across, centres, radii = skeleton.across, skeleton.centres, skeleton.radii
    size = len(radii)
    of, stack = longs(size, -1), longs(size, 0)
    length, low, high = floats(size, 0.0), floats(size, np.inf), floats(size, 0.0)
    count = 0
    for seed in range(size):
        if of[seed] >= 0 or not _on_axis(skeleton, seed):
            continue
        of[seed], stack[0], waiting = count, seed, 1
        while waiting > 0:
            waiting -= 1
            t = stack[waiting]
            low[count], high[count] = min(low[count], radii[t]), max(high[count], radii[t])
            for h in range(3 * t, 3 * t + 3):
                beyond = across[h] // 3
                if skeleton.central[h]:
                    length[count] += 0.5 * np.hypot(centres[t, 0] - centres[beyond, 0], centres[t, 1] - centres[beyond, 1])
                    if value[beyond] == value[t] and of[beyond] < 0:
                        of[beyond], stack[waiting] = count, beyond
                        waiting += 1
        count += 1
    return _Pieces(of, length[:count], low[:count], high[:count])


@helper
def _drop_stubs(skeleton: Skeleton, pieces: _Pieces, shortest: float) -> None:
    """Remove short pieces that lead to a thicker region, and mere points, the centres of round regions."""
    rises = flags(len(pieces.length))
    for h in range(len(skeleton.across)):
        piece, beyond = pieces.of[h // 3], skeleton.across[h] // 3
        if beyond >= 0 and piece >= 0 and pieces.of[beyond] < 0 and skeleton.radii[beyond] > pieces.high[piece]:
            rises[piece] = True
    for h in range(len(skeleton.across)):
        piece = pieces.of[h // 3]
        if piece >= 0 and pieces.length[piece] < (shortest if rises[piece] else POINT * pieces.high[piece]):
            skeleton.central[h] = False


@helper
def _smooth(skeleton: Skeleton, rule: Rule) -> bool:
    """Give short stretches the count of the longest neighbour that suits their thickness; returns whether any changed."""
    beads, pieces = skeleton.beads, _pieces(skeleton, skeleton.beads)
    best, longest = longs(len(pieces.length), -1), floats(len(pieces.length), 0.0)
    for h in range(len(skeleton.across)):
        piece, beyond = pieces.of[h // 3], skeleton.across[h] // 3
        if not skeleton.central[h] or pieces.length[piece] > FLICKER * rule.inner or beads[beyond] == beads[h // 3]:
            continue
        length = pieces.length[pieces.of[beyond]]
        if length > max(longest[piece], pieces.length[piece]) and _suits(
            rule, beads[beyond], pieces.low[piece], pieces.high[piece]
        ):
            best[piece], longest[piece] = beads[beyond], length
    changed = False
    for t in range(len(beads)):
        piece = pieces.of[t]
        if piece >= 0 and best[piece] >= 0:
            beads[t], changed = best[piece], True
    return changed


@no_nrt
def _suits(rule: Rule, count: int, low: float, high: float) -> bool:
    """Whether a bead count fits a range of half thicknesses with printable widths."""
    if count == 0:
        return False
    rest_low, rest_high = 2.0 * low - rule.round, 2.0 * high - rule.round
    for level in range((count - 1) // 2):
        rest_low, rest_high = rest_low - 2.0 * nominal(rule, level), rest_high - 2.0 * nominal(rule, level)
    share = 1.0 if count % 2 else 0.5
    if count == 2 * rule.walls + 2:
        return rest_low > rule.inner
    return share * rest_low > rule.least - rule.round and share * rest_high < rule.most - rule.round


@helper
def _spread(skeleton: Skeleton, rule: Rule) -> None:
    """Assign corners, and nodes between parts of the axis, to the thickest region to which they lead.

    A round region has no axis, only a thickest point, and so no bead in the middle.
    """
    root, beads = _roots(skeleton), skeleton.beads
    for t in range(len(root)):
        if root[t] == t and beads[t] % 2 and not _on_axis(skeleton, t):
            skeleton.dots[t] = beads[t] == 1 and skeleton.radii[t] < rule.least
            beads[t] = beads[t] - 1 if beads[t] > 1 else 2 - int(skeleton.dots[t])
    for t in range(len(root)):
        skeleton.thick[t], beads[t] = skeleton.radii[root[t]], beads[root[t]]


@no_nrt
def _on_axis(skeleton: Skeleton, t: int) -> bool:
    return bool(skeleton.central[3 * t] or skeleton.central[3 * t + 1] or skeleton.central[3 * t + 2])


@helper
def _roots(skeleton: Skeleton) -> Indices:
    """(m,) the node on the axis, or the thickest node, to which the ascent from each node leads."""
    across, radii = skeleton.across, skeleton.radii
    falling, root, hop = floats(len(radii), 0.0), longs(len(radii), -1), longs(len(radii), -1)
    for t in range(len(radii)):
        falling[t] = -radii[t]
    for t in argsort(falling):
        root[t] = t
        if _on_axis(skeleton, t):
            continue
        for h in range(3 * t, 3 * t + 3):
            beyond = across[h] // 3
            if across[h] >= 0 and root[beyond] >= 0 and (root[t] == t or radii[beyond] > falling[t]):
                root[t], falling[t] = root[beyond], radii[beyond]
    for t in range(len(radii)):
        first = root[t]
        if _on_axis(skeleton, first) or radii[t] < radii[first] - SAME_MM:
            continue
        for h in range(3 * t, 3 * t + 3):  # among nearly equal nodes one comes first, which need not be the one that leads up
            beyond = across[h] // 3
            if across[h] < 0 or root[beyond] == first or (hop[first] >= 0 and not _on_axis(skeleton, root[beyond])):
                continue
            if radii[beyond] > radii[t] - SAME_MM or (_on_axis(skeleton, beyond) and radii[t] < ALIKE * radii[beyond]):
                hop[first] = root[beyond]
    for t in range(len(radii)):
        for _ in range(MOST_HOPS):
            if hop[root[t]] >= 0:
                root[t] = hop[root[t]]
    return root
