"""Centrelines: one line of varying width down the middle of places too narrow for two, along their chordal axis."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import table
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from slicer.bead import length_mm
from slicer.geometry.chordal_axis import Axis, chordal_axis
from slicer.geometry.polygons import resample
from slicer.geometry.triangulation import triangulate

SMOOTHINGS = 3  # moving averages over three points
REACH = 0.1  # of the width: a line is not led on between two corners by less
REACH_POINTS = 4  # on what is led on, at which the line may change its width
SPUR = 1.0  # a branch shorter than this many widths is a corner of the boundary, not a limb


@dataclass(frozen=True, eq=False)
class Line:
    """points: (n, 2) mm; width_mm: mean width of the place along it; place, area_mm2: which place, and its whole area.

    ends: whether its first and its last point are ends, or the next piece of a line goes on there.
    """

    points: Floats
    width_mm: float
    place: int
    area_mm2: float
    ends: tuple[bool, bool] = (True, True)


@dataclass(frozen=True, eq=False)
class _Chain:
    points: Floats
    widths: Floats
    ends: tuple[int, int]
    place: int

    @property
    def reversed(self) -> "_Chain":
        return _Chain(self.points[::-1], self.widths[::-1], self.ends[::-1], self.place)

    @cached_property
    def length_mm(self) -> float:
        return length_mm(self.points)


def centrelines(outlines: Sequence[Floats], step_mm: float, even: float, shortest_mm: float) -> list[Line]:
    """Lines down the middle of narrow polygons given by their contours, which are sampled at least every step_mm.

    Lines are cut where their width changes by the factor `even`, but not into pieces shorter than shortest_mm.
    """
    triangulation = triangulate([resample(loop, step_mm) for loop in outlines])
    if triangulation is None:
        return []
    axis = chordal_axis(triangulation)
    return _lines(_merge(_prune(_chains(axis))), axis.areas, even, shortest_mm)


def _chains(axis: Axis) -> list[_Chain]:
    """The chains of an axis, each by itself."""
    cuts = pairwise(np.append(axis.starts, len(axis.points)))
    return [
        _Chain(axis.points[a:b], axis.widths[a:b], (int(axis.ends[k, 0]), int(axis.ends[k, 1])), int(axis.places[k]))
        for k, (a, b) in enumerate(cuts)
    ]


@kernel
def _smooth(points: Floats) -> Floats:
    """The chain without the zigzag that comes from sampling its two sides at different places; its ends stay."""
    out: Floats = table(len(points), 2)
    for axis in range(2):
        for i in range(len(points)):
            out[i, axis] = points[i, axis]
        for _ in range(SMOOTHINGS):
            before = out[0, axis]
            for i in range(1, len(points) - 1):
                here = out[i, axis]
                out[i, axis] = 0.25 * before + 0.5 * here + 0.25 * out[i + 1, axis]
                before = here
    return out


def _prune(chains: list[_Chain]) -> list[_Chain]:
    """Without the branches that only run into a corner: from a fork to a tip (end -1) and short for the fork's width.

    A place that has no other branches keeps its longest. What is left of a fork with two corners reaches between them.
    """
    fork_width: dict[int, float] = defaultdict(float)
    for chain in chains:
        for end, width in zip(chain.ends, (chain.widths[0], chain.widths[-1]), strict=True):
            fork_width[end] = max(fork_width[end], float(width))
    longest: dict[int, _Chain] = {}
    for chain in chains:
        if chain.place not in longest or chain.length_mm > longest[chain.place].length_mm:
            longest[chain.place] = chain
    remaining = []
    corners: dict[int, list[Floats]] = defaultdict(list)
    for chain in chains:
        corner = (chain.ends[0] < 0) != (chain.ends[1] < 0) and chain.length_mm <= SPUR * fork_width[max(chain.ends)]
        if not corner or chain is longest[chain.place]:
            remaining.append(chain)
        else:
            corners[max(chain.ends)].append(chain.points[-1 if chain.ends[1] < 0 else 0])
    pairs = {fork: (tips[0], tips[1]) for fork, tips in corners.items() if len(tips) == 2}
    return [_lead_on(_lead_on(chain, pairs).reversed, pairs).reversed for chain in remaining]


def _lead_on(chain: _Chain, pairs: dict[int, tuple[Floats, Floats]]) -> _Chain:
    """The chain led on from its end between the two corners behind that, so far that the round end of its bead meets the
    middle between them; at a blunt end, where the fork lies half a width before the edge, it stays as it is."""
    if chain.ends[1] not in pairs:
        return chain
    one, other = pairs[chain.ends[1]]
    step = 0.5 * (one + other) - chain.points[-1]
    length, width, last = float(np.hypot(*step)), float(chain.widths[-1]), float(np.hypot(*(one - other)))
    wider = max(last - width, 0.0) / max(length, 1e-9)
    share = (length - 0.5 * width) / (1.0 + 0.5 * wider) / max(length, 1e-9)
    if share * length < REACH * width:
        return chain
    shares = share * np.arange(1, REACH_POINTS + 1)[:, None] / REACH_POINTS
    points, widths = chain.points[-1] + shares * step, width + shares[:, 0] * (last - width)
    return _Chain(np.vstack([chain.points, points]), np.append(chain.widths, widths), (chain.ends[0], -1), chain.place)


def _merge(chains: list[_Chain]) -> list[_Chain]:
    """Chains joined at forks of which only two branches are left."""
    at: dict[int, list[int]] = defaultdict(list)
    for k, chain in enumerate(chains):
        for end in chain.ends:
            if end >= 0:
                at[end].append(k)
    alive: dict[int, _Chain] = dict(enumerate(chains))
    for fork, members in at.items():
        if len(members) != 2 or members[0] == members[1]:
            continue
        first, second = alive[members[0]], alive[members[1]]
        first = first if first.ends[1] == fork else first.reversed
        second = second if second.ends[0] == fork else second.reversed
        points, widths = (np.concatenate([getattr(first, x), getattr(second, x)[1:]]) for x in ("points", "widths"))
        alive[members[0]] = _Chain(points, widths, (first.ends[0], second.ends[1]), first.place)
        del alive[members[1]]
        if second.ends[1] >= 0:
            at[second.ends[1]] = [members[0] if k == members[1] else k for k in at[second.ends[1]]]
    return list(alive.values())


def _lines(chains: list[_Chain], areas: Floats, even: float, shortest_mm: float) -> list[Line]:
    """Chains cut where the width changes."""
    lines = []
    for chain in sorted(chains, key=lambda chain: chain.place):
        points = _smooth(chain.points)
        cuts, widths = _split_by_width(points, chain.widths, np.log(even), shortest_mm)
        for a, b, width in zip(cuts[:-1], cuts[1:], widths, strict=True):
            ends = (bool(a == 0), bool(b == len(points) - 1))
            lines.append(Line(points[a : b + 1], float(width), chain.place, float(areas[chain.place]), ends))
    return lines


@kernel
def _split_by_width(points: Floats, widths: Floats, grade: float, shortest_mm: float) -> tuple[NDArray[np.int64], Floats]:
    """Where pieces of nearly one width begin and end, none shorter than shortest_mm but where the whole chain is.

    Widths are alike within one step of `grade` of their logarithm. Also the mean width of each piece.
    """
    n = len(points) - 1
    along, level = np.zeros(n + 1), np.empty(n, np.int64)
    middle = 0.5 * (widths[1:] + widths[:-1])
    for i in range(n):
        along[i + 1] = along[i] + np.hypot(points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1])
        around = 0.0
        for k in range(i - 2, i + 3):
            around += 0.2 * middle[min(max(k, 0), n - 1)]
        level[i] = int(np.round(np.log(max(around, 1e-3)) / grade))
    cuts = [0]
    for i in range(1, n):
        if level[i] != level[i - 1] and along[i] - along[cuts[-1]] >= shortest_mm and along[n] - along[i] >= shortest_mm:
            cuts.append(i)
    cuts.append(n)
    means = np.empty(len(cuts) - 1)
    for k in range(len(means)):
        total = 0.0
        for i in range(cuts[k], cuts[k + 1]):
            total += (along[i + 1] - along[i]) * middle[i]
        means[k] = total / max(along[cuts[k + 1]] - along[cuts[k]], 1e-12)
    return np.array(cuts), means
