"""Order: in which sequence the beads of a layer are printed, and which travels between them retract.

Skirt and support come first. Islands of the section follow each other on a short tour; inside an island the walls come
first, each outer wall right after the inner walls behind it, then by rising rank gaps, skin and infill, each on a short tour.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mdp.mesh import Floats, Ints
from profiles.process import Process
from slicer.bead import Bead
from slicer.combing import NOWHERE, Ground
from slicer.lattice import free
from slicer.paths import Kind
from slicer.polygons import Polygons, area_mm2, contours
from slicer.scanline import inside
from slicer.tour import tour

OUTSIDE = -1000  # ranks up to this belong to no island: skirt, brim, support
PROPS = "Support"  # with this word begin the kinds that are torn off: a travel among them may ooze


@dataclass(frozen=True, eq=False)
class Placed:
    """A bead in its place: points as printed, whether the travel to them retracts, and the (k, 2) points it passes."""

    bead: Bead
    points: Floats
    retract: bool
    approach: Floats


def ordered(beads: Sequence[Bead], section: Polygons, process: Process, tip: Floats | None) -> list[Placed]:
    """The beads of one layer in printing order; tip: (2,) where the nozzle stands before, None at the part's start."""
    if not beads:
        return []
    first = beads[0].points[0] if tip is None else tip
    placed = _sequence(beads, section, first)
    to = np.array([points[0] for _, points in placed])
    since = np.array([first, *(points[-1] for _, points in placed[:-1])])
    props = np.array([bead.kind.value.startswith(PROPS) for bead, _ in placed])
    retracts, ways = _travels(Ground(section, process.line_width_mm), since, to, props, process)
    retracts[0] = retracts[0] or tip is None
    return [
        Placed(bead, points, bool(pull), ways.get(k, NOWHERE))
        for k, ((bead, points), pull) in enumerate(zip(placed, retracts, strict=True))
    ]


def _travels(
    ground: Ground, since: Floats, to: Floats, props: NDArray[np.bool_], process: Process
) -> tuple[NDArray[np.bool_], dict[int, Floats]]:
    """Which travels retract: long ones that leave the inside of the section and find no short way round inside it.

    A travel from support to support may leave it, but not cross it. Returns the ways round too, by the travel's number.
    """
    long = np.hypot(*(to - since).T) >= process.retract_travel_mm
    retracts = long.copy()
    retracts[long] = ground.leaves(since[long], to[long])
    ways: dict[int, Floats] = {}
    for k in np.flatnonzero(retracts):
        if k and props[k] and props[k - 1]:
            retracts[k] = not free(ground.safe, since[k, 0], since[k, 1], to[k, 0], to[k, 1])
        elif process.combing:
            way = ground.way(since[k], to[k], process.combing_detour_mm)
            if way is not None:
                retracts[k], ways[int(k)] = False, way
    return retracts, ways


def _sequence(beads: Sequence[Bead], section: Polygons, first: Floats) -> list[tuple[Bead, Floats]]:
    """The beads in order, each with its points as printed."""
    ranks = np.array([bead.rank for bead in beads], dtype=np.int32)
    starts = np.array([bead.points[0] for bead in beads])
    islands = _islands(starts, ranks, section)
    groups: defaultdict[int, list[int]] = defaultdict(list)
    for k, island in enumerate(islands):
        groups[int(island)].append(k)
    tip, placed = first, list[tuple[Bead, Floats]]()
    while groups:
        nearest = -1 if -1 in groups else _next_island(groups, starts, tip)
        for items in _phases([beads[k] for k in groups.pop(nearest)]):
            entries = np.array([item[0].points[0] for item in items])
            exits = np.array([item[-1].points[-1] for item in items])
            fixed = np.array([len(item) > 1 or item[0].one_way for item in items])
            for k, flip in zip(*tour(entries, exits, fixed, tip[0], tip[1]), strict=True):
                placed += [(bead, bead.points[::-1] if flip else bead.points) for bead in items[k]]
            tip = placed[-1][1][-1]
    return placed


def _next_island(groups: dict[int, list[int]], starts: Floats, tip: Floats) -> int:
    """The island with the nearest beginning of a bead."""
    if len(groups) == 1:
        return next(iter(groups))
    return min(groups, key=lambda island: (float(((starts[groups[island]] - tip) ** 2).sum(axis=1).min()), island))


def _phases(beads: Sequence[Bead]) -> list[list[list[Bead]]]:
    """What of an island is printed before what: by rank, but all walls at once, in families that stay together."""
    leaders = [bead for bead in beads if bead.kind is Kind.OUTER_WALL and OUTSIDE < bead.rank <= 0]
    walls = [bead for bead in beads if leaders and OUTSIDE < bead.rank <= 0]
    phases: defaultdict[int, list[list[Bead]]] = defaultdict(list)
    for bead in beads:
        if not leaders or not OUTSIDE < bead.rank <= 0:
            phases[bead.rank].append([bead])
    if walls:
        phases[0] = _families(walls, leaders)
    return [phases[rank] for rank in sorted(phases)]


def _families(walls: Sequence[Bead], leaders: Sequence[Bead]) -> list[list[Bead]]:
    """Each outer wall with the inner walls nearest to it, by rising rank, equal ranks as they lie nearest."""
    if len(leaders) == 1:
        members = [list(walls)]
    else:
        points = np.concatenate([leader.points for leader in leaders])
        which = np.repeat(np.arange(len(leaders)), [len(leader.points) for leader in leaders])
        of = {id(leader): k for k, leader in enumerate(leaders)}
        near = which[_nearest(points, np.array([bead.points[0] for bead in walls]))]
        members = [[] for _ in leaders]
        for bead, k in zip(walls, near, strict=True):
            members[of.get(id(bead), int(k))].append(bead)
    return [_by_rank(family) for family in members]


def _by_rank(family: list[Bead]) -> list[Bead]:
    out: list[Bead] = []
    left = sorted(family, key=lambda bead: bead.rank)
    while left:
        equal = [bead for bead in left if bead.rank == left[0].rank]
        place = out[-1].points[-1] if out else equal[0].points[0]
        best = min(range(len(equal)), key=lambda k: float(((equal[k].points[0] - place) ** 2).sum())) if len(equal) > 1 else 0
        out.append(left.pop(best))
    return out


@njit(cache=True)
def _nearest(points: Floats, places: Floats) -> NDArray[np.int64]:
    """The point nearest to each place; points sorted into square cells, searched ring by ring."""
    x, y = points[:, 0].min(), points[:, 1].min()
    wide = max(points[:, 0].max() - x, points[:, 1].max() - y) + 1e-6
    cells = max(int(np.sqrt(len(points) / 2.0)), 1)
    size = wide / cells
    cell = (points[:, 0] - x) // size * cells + (points[:, 1] - y) // size
    order = np.argsort(cell, kind="mergesort")
    first = np.searchsorted(cell[order], np.arange(cells * cells + 1))
    out = np.empty(len(places), np.int64)
    for p in range(len(places)):
        px, py = places[p]
        column, row = min(max(int((px - x) / size), 0), cells - 1), min(max(int((py - y) / size), 0), cells - 1)
        best, least, ring = 0, np.inf, 0
        while ring <= cells and (ring - 1) * size < least:
            for c in range(max(column - ring, 0), min(column + ring, cells - 1) + 1):
                for r in range(max(row - ring, 0), min(row + ring, cells - 1) + 1):
                    if max(abs(c - column), abs(r - row)) != ring:
                        continue
                    for k in range(first[c * cells + r], first[c * cells + r + 1]):
                        distance = np.hypot(points[order[k], 0] - px, points[order[k], 1] - py)
                        if distance < least:
                            best, least = order[k], distance
            ring += 1
        out[p] = best
    return out


def _islands(starts: Floats, ranks: Ints, section: Polygons) -> Ints:
    """The island of each bead: the smallest outer contour around its start; -1 for beads outside (skirt, support)."""
    outer = sorted((loop for loop in contours(section) if area_mm2(loop) > 0), key=lambda loop: abs(area_mm2(loop)))
    if len(outer) < 2:
        return np.where(ranks <= OUTSIDE, -1, 0).astype(np.int32)
    sides = [np.hstack([loop, np.roll(loop, -1, axis=0)]) for loop in outer]
    offsets = np.cumsum([0, *(len(side) for side in sides)])
    boxes = np.array([[*loop.min(axis=0), *loop.max(axis=0)] for loop in outer])
    found = _containing(np.concatenate(sides), offsets, boxes, starts)
    return np.where(ranks <= OUTSIDE, -1, found).astype(np.int32)


@njit(cache=True)
def _containing(sides: Floats, offsets: NDArray[np.int64], boxes: Floats, points: Floats) -> Ints:
    found = np.full(len(points), len(boxes), np.int32)
    for p in range(len(points)):
        x, y = points[p]
        for k in range(len(boxes)):
            near = boxes[k, 0] <= x <= boxes[k, 2] and boxes[k, 1] <= y <= boxes[k, 3]
            if near and inside(sides[offsets[k] : offsets[k + 1]], x, y):
                found[p] = k
                break
    return found
