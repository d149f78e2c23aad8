"""Rule: how many beads lie across a place of some thickness, and how wide and how deep each of them is.

Inward distributed beading (Kuipers et al. 2020, section 4.1): the outer beads have their nominal width, the innermost one or two
take what is left. Bead i, counted from the boundary, is named by its spacing s, what it takes of the thickness; it is s + height
(1 - pi/4) wide, for the round sides of beads lie over each other.
"""

from typing import NamedTuple

from mdp.kernels.kernel import no_nrt

ADD = 0.7  # of a spacing: from this on what two beads leave between them gets a bead of its own
ROOM = 1.5  # spacings: narrower places between all walls get one bead
SPLIT = 1.5  # spacings: from this on one bead becomes two
FEATURE = 0.5  # of the least width: places so narrow get a bead that is wider than they are, narrower ones none


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
