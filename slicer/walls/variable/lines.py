"""Lines: the beads in the middle of places where an odd number of beads lies side by side, along the skeleton."""

from collections import defaultdict
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import flags, longs, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Ints
from slicer.walls.variable.counts import Counts
from slicer.walls.variable.rule import Rule, depth_of, loops_of, middle_width, spacing_of
from slicer.walls.variable.skeleton import Skeleton

LOOK_MM = 0.4  # so far from a fork the directions of its branches are looked at
ABUT = 0.45  # of a bead's width: a line ends so far from the middle of a bead that runs across its end


class Chains(NamedTuple):
    """courses: (n, 3) x, y and width; starts: (k + 1,) where each chain begins; levels: (k,) loops on both sides of it.

    ends: (k, 2) nodes; forks: (k, 2) whether more chains meet there; taken: (k, 2) mm that a loop across that end takes of it.
    """

    courses: Floats
    starts: NDArray[np.int64]
    levels: NDArray[np.int64]
    ends: NDArray[np.int64]
    forks: NDArray[np.int64]
    taken: Floats


@dataclass(frozen=True, eq=False)
class Line:
    """course: (n, 3) x, y and width, a ring repeats its first; level: loops on both sides; ends, taken: as in Chains."""

    course: Floats
    level: int
    ends: tuple[int, int]
    taken: tuple[float, float]

    @property
    def reversed(self) -> "Line":
        """The same line from its other end."""
        return Line(self.course[::-1], self.level, self.ends[::-1], self.taken[::-1])


def lines_of(chains: Chains) -> list[Line]:
    """The chains, at every fork the two joined that go on most straightly, the ends cut back where a bead runs across them."""
    lines: dict[int, Line] = {}
    at: defaultdict[int, list[int]] = defaultdict(list)
    for k, (a, b) in enumerate(pairwise(chains.starts)):
        (first, last), taken = chains.ends[k].tolist(), chains.taken[k].tolist()
        lines[k] = Line(chains.courses[a:b], int(chains.levels[k]), (first, last), (taken[0], taken[1]))
        for node, fork in zip((first, last), chains.forks[k].tolist(), strict=True):
            if fork:
                at[node].append(k)
    for node, members in sorted(at.items()):
        _join(lines, at, node, members)
    cut = (_cut_back(_cut_back(line).reversed).reversed for _, line in sorted(lines.items()))
    return [line for line in cut if len(line.course) > 1]


def _join(lines: dict[int, Line], at: dict[int, list[int]], node: int, members: list[int]) -> None:
    """Join the two lines at a fork that go on most straightly; the others end beside them."""
    if len(set(members)) < len(members):
        return
    leaving = {k: lines[k] if lines[k].ends[0] == node else lines[k].reversed for k in members}
    a, b = min(combinations(members, 2), key=lambda pair: float(_heading(leaving[pair[0]]) @ _heading(leaving[pair[1]])))
    into, onward = leaving[a].reversed, leaving[b]
    course = np.concatenate([into.course, onward.course[1:]])
    for k in members:
        if k not in (a, b):
            lines[k] = replace(leaving[k], taken=(ABUT * float(onward.course[0, 2]), leaving[k].taken[1]))
    lines[a] = Line(course, into.level, (into.ends[0], onward.ends[1]), (into.taken[0], onward.taken[1]))
    del lines[b]
    at[onward.ends[1]] = [a if k == b else k for k in at[onward.ends[1]]]


def _heading(line: Line) -> Floats:
    """Unit vector from the first point of a line to where it is a little later."""
    steps = line.course[:, :2] - line.course[0, :2]
    away = np.hypot(*steps.T)
    far = int(np.argmax(away > LOOK_MM)) if (away > LOOK_MM).any() else len(away) - 1
    heading: Floats = steps[far] / max(float(away[far]), 1e-9)
    return heading


def _cut_back(line: Line) -> Line:
    """The line without what is taken of its beginning."""
    if line.taken[0] <= 0.0 or line.ends[0] == line.ends[1]:
        return line
    done = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line.course[:, :2], axis=0).T))])
    if done[-1] <= line.taken[0]:
        return replace(line, course=line.course[:0])
    first = int(np.searchsorted(done, line.taken[0], side="right")) - 1
    share = (line.taken[0] - done[first]) / (done[first + 1] - done[first])
    course = line.course[first:].copy()
    course[0, :2] += share * (course[1, :2] - course[0, :2])
    return replace(line, course=course)


@no_nrt
def _joined(across: Ints, skeleton: Skeleton, counts: Counts, h: int) -> bool:
    """Whether a line runs across an inner side."""
    if across[h] < 0 or not skeleton.central[h]:
        return False
    count = counts.beads[h // 3]
    return bool(count % 2 == 1 and counts.beads[across[h] // 3] == count)


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
