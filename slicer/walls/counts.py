"""Counts: how many beads lie across every place of a skeleton, and by which rule, and how wide and how deep each of them is.

Inward distributed beading (Kuipers et al. 2020, section 4.1): the outer beads have their nominal width, the innermost one or two
take what is left. Bead i, counted from the boundary, is named by its spacing s, what it takes of the thickness; it is s + height
(1 - pi/4) wide, for the round sides of beads lie over each other. One count changes where the place does and not to and fro.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, floats, ints, longs
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.kernels.sorting import argsort
from mdp.mesh import Floats, Ints
from slicer.walls.skeleton import Skeleton

ADD = 0.7  # of a spacing: from this on what two beads leave between them gets a bead of its own
ROOM = 1.5  # spacings: narrower places between all walls get one bead
SPLIT = 1.5  # spacings: from this on one bead becomes two
FEATURE = 0.5  # of the least width: places so narrow get a bead that is wider than they are, narrower ones none
STUB = 0.8  # nominal spacings: a shorter limb of the axis is a corner of a thicker place
POINT = 0.3  # of its half thickness: a piece of the axis shorter than that is a point
FLICKER = 2.0  # nominal spacings: a shorter stretch keeps the count of its neighbours where beads can be as wide
ROUNDS = 4  # of taking out such stretches
ALIKE = 1.1  # the thickest point of a place belongs to an axis beside it where it is not thicker by this factor
SAME_MM = 1e-6  # radii that differ by less are equal
MOST_HOPS = 8  # from node to node; two that lead to each other would go on for ever


class Rule(NamedTuple):
    """walls: loops from a boundary inward at most. outer, inner: nominal spacings; round: width less spacing.

    least, most: widths of beads. All mm.
    """

    walls: int
    outer: float
    inner: float
    round: float
    least: float
    most: float


@no_nrt
def nominal(rule: Rule, level: int) -> float:
    """Spacing of bead `level` where there is room."""
    return rule.outer if level == 0 else rule.inner


@no_nrt
def bead_count(rule: Rule, radius: float) -> int:
    """How many beads lie across a place with that half thickness; 2 walls + 2: all walls, and more than a bead between them."""
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
    """How many of the beads run along both sides of a place."""
    return min(count // 2, rule.walls)


@no_nrt
def spacing_of(rule: Rule, count: int, radius: float, level: int) -> float:
    """Spacing of loop `level` where `count` beads lie across a place with that half thickness."""
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
    """How deep below the boundary the centreline of loop `level` runs."""
    depth = 0.5 * rule.round
    for k in range(level):
        depth += spacing_of(rule, count, radius, k)
    return depth + 0.5 * spacing_of(rule, count, radius, level)


@no_nrt
def middle_width(rule: Rule, count: int, radius: float) -> float:
    """Width of the bead in the middle of a place with an odd count."""
    rest = 2.0 * radius
    for k in range(loops_of(rule, count)):
        rest -= 2.0 * spacing_of(rule, count, radius, k)
    return min(max(rest, rule.least), rule.most)


class Counts(NamedTuple):
    """Of every node: beads across it, and the half thickness by which they are laid: its own, or of the axis it belongs to.

    dots: the middles of round places with room for a single bead.
    """

    beads: Ints
    radii: Floats
    dots: NDArray[np.bool_]


class _Pieces(NamedTuple):
    """Connected nodes. of: (m,) piece of each node, -1: none; many: pieces; length: (p,) mm; low, high: (p,) radii."""

    of: NDArray[np.int64]
    many: int
    length: Floats
    low: Floats
    high: Floats


@kernel
def count_beads(across: Ints, skeleton: Skeleton, rule: Rule) -> Counts:
    """The counts of a skeleton; clears `central` where a limb of the axis is too short to have a count of its own."""
    size = len(skeleton.radii)
    beads, uniform = ints(size, 0), ints(size, 1)
    _drop_stubs(across, skeleton, _pieces(across, skeleton, uniform), STUB * rule.inner)
    for t in range(size):
        beads[t] = bead_count(rule, skeleton.radii[t])
    for _ in range(ROUNDS):
        if not _smooth(across, skeleton, rule, beads):
            break
    return _spread(across, skeleton, rule, beads)


@helper
def _pieces(across: Ints, skeleton: Skeleton, value: Ints) -> _Pieces:
    """The pieces of the central axis with one value."""
    size = len(skeleton.radii)
    of, stack = longs(size, -1), longs(size, 0)
    length, low, high = floats(size, 0.0), floats(size, np.inf), floats(size, 0.0)
    many = 0
    for seed in range(size):
        if of[seed] >= 0 or not _on_axis(skeleton, seed):
            continue
        of[seed], stack[0], waiting = many, seed, 1
        while waiting > 0:
            waiting -= 1
            t = stack[waiting]
            low[many], high[many] = min(low[many], skeleton.radii[t]), max(high[many], skeleton.radii[t])
            for h in range(3 * t, 3 * t + 3):
                beyond = across[h] // 3
                if skeleton.central[h]:
                    step = 0.5 * np.hypot(
                        skeleton.centres[t, 0] - skeleton.centres[beyond, 0],
                        skeleton.centres[t, 1] - skeleton.centres[beyond, 1],
                    )
                    length[many] += step
                    if value[beyond] == value[t] and of[beyond] < 0:
                        of[beyond], stack[waiting] = many, beyond
                        waiting += 1
        many += 1
    return _Pieces(of, many, length, low, high)


@helper
def _drop_stubs(across: Ints, skeleton: Skeleton, pieces: _Pieces, shortest: float) -> None:
    """Short pieces from which a thicker place goes on are none, nor is a mere point, the middle of something round."""
    rises = flags(pieces.many)
    for h in range(len(across)):
        piece = pieces.of[h // 3]
        if across[h] >= 0 and piece >= 0 and pieces.of[across[h] // 3] < 0:
            rises[piece] = rises[piece] or skeleton.radii[across[h] // 3] > pieces.high[piece]
    for h in range(len(across)):
        piece = pieces.of[h // 3]
        if piece >= 0 and pieces.length[piece] < (shortest if rises[piece] else POINT * pieces.high[piece]):
            skeleton.central[h] = False


@helper
def _smooth(across: Ints, skeleton: Skeleton, rule: Rule, beads: Ints) -> bool:
    """Short stretches take the count of the longest neighbour that suits their thickness; whether any did."""
    pieces = _pieces(across, skeleton, beads)
    best, longest = longs(pieces.many, -1), floats(pieces.many, 0.0)
    for h in range(len(across)):
        piece = pieces.of[h // 3]
        if not skeleton.central[h] or pieces.length[piece] > FLICKER * rule.inner:
            continue
        next_piece = pieces.of[across[h] // 3]
        count = beads[across[h] // 3]
        if count == beads[h // 3] or pieces.length[next_piece] <= max(longest[piece], pieces.length[piece]):
            continue
        if _suits(rule, count, pieces.low[piece], pieces.high[piece]):
            best[piece], longest[piece] = count, pieces.length[next_piece]
    changed = False
    for t in range(len(beads)):
        piece = pieces.of[t]
        if piece >= 0 and best[piece] >= 0:
            beads[t], changed = best[piece], True
    return changed


@no_nrt
def _suits(rule: Rule, count: int, low: float, high: float) -> bool:
    """Whether so many beads fit into places from one half thickness to another with widths that can be printed."""
    if count == 0:
        return False
    rest_low, rest_high = 2.0 * low - rule.round, 2.0 * high - rule.round
    for level in range((count - 1) // 2):
        taken = 2.0 * (rule.outer if level == 0 else rule.inner)
        rest_low, rest_high = rest_low - taken, rest_high - taken
    share = 1.0 if count % 2 else 0.5
    if count == 2 * rule.walls + 2:
        return rest_low > rule.inner
    return share * rest_low > rule.least - rule.round and share * rest_high < rule.most - rule.round


@helper
def _spread(across: Ints, skeleton: Skeleton, rule: Rule, beads: Ints) -> Counts:
    """Corners and what lies between parts of the axis belong to the thickest place that they lead up to.

    A round place has no axis, only a thickest point, and so no bead in the middle.
    """
    root, dots = _roots(across, skeleton), flags(len(beads))
    for t in range(len(root)):
        if root[t] == t and beads[t] % 2 and not _on_axis(skeleton, t):
            dots[t] = beads[t] == 1 and skeleton.radii[t] < rule.least
            beads[t] = beads[t] - 1 if beads[t] > 1 else 2 - int(dots[t])
    radii = floats(len(root), 0.0)
    for t in range(len(root)):
        radii[t] = skeleton.radii[root[t]]
        beads[t] = beads[root[t]]
    return Counts(beads, radii, dots)


@no_nrt
def _on_axis(skeleton: Skeleton, t: int) -> bool:
    return bool(skeleton.central[3 * t] or skeleton.central[3 * t + 1] or skeleton.central[3 * t + 2])


@helper
def _roots(across: Ints, skeleton: Skeleton) -> NDArray[np.int64]:
    """(m,) the node on the axis, or the thickest one, to which the way up from each node leads."""
    radii = skeleton.radii
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
        if root[t] != t or _on_axis(skeleton, t):
            continue
        for h in range(3 * t, 3 * t + 3):  # of nodes as good as equal one comes first, and need not be the one that leads up
            beyond = across[h] // 3
            alike = radii[beyond] > radii[t] - SAME_MM or (_on_axis(skeleton, beyond) and radii[t] < ALIKE * radii[beyond])
            if across[h] >= 0 and root[beyond] != t and alike:
                hop[t] = root[beyond]
    for t in range(len(radii)):
        for _ in range(MOST_HOPS):
            if hop[root[t]] >= 0:
                root[t] = hop[root[t]]
    return root
