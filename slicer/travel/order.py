"""Order: in which sequence the beads of a layer are printed, and which travels between them retract.

Skirt and support come first. Islands of the section follow each other in a short order; inside an island the walls come
first, each outer wall right after the inner walls behind its seam, then by rising rank gaps, skin and infill.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import longs
from mdp.kernels.kernel import kernel
from mdp.kernels.sorting import counting_sort
from mdp.mesh import Floats, Ints
from profiles.process import Process
from slicer.bead import Bead
from slicer.geometry.polygons import Polygons, area_mm2, contours, start_at
from slicer.geometry.segments import inside
from slicer.paths import Kind
from slicer.travel.combing import NOWHERE
from slicer.travel.path_order import order_paths
from slicer.travel.retracting import travels

OUTSIDE = -1000  # ranks up to this belong to no island: skirt, brim, support
NO_SUPPORT = Polygons()


@dataclass(frozen=True, eq=False)
class Placed:
    """A bead in its place: points as printed, whether the travel to them retracts, and the (k, 2) points it passes."""

    bead: Bead
    points: Floats
    retract: bool
    approach: Floats


def order_beads(
    beads: Sequence[Bead], section: Polygons, process: Process, tip: Floats | None, support: Polygons = NO_SUPPORT
) -> list[Placed]:
    """The beads of one layer in printing order.

    tip: (2,) where the nozzle stands before, None at the part's start; support: where that is printed.
    """
    if not beads:
        return []
    first = beads[0].points[0] if tip is None else tip
    placed = _sequence(beads, section, first)
    to = np.array([points[0] for _, points in placed])
    since = np.array([first, *(points[-1] for _, points in placed[:-1])])
    retracts, detours = travels(since, to, section, support, process)
    retracts[0] = retracts[0] or tip is None
    return [
        Placed(bead, points, bool(pull), detours.get(k, NOWHERE))
        for k, ((bead, points), pull) in enumerate(zip(placed, retracts, strict=True))
    ]


def _sequence(beads: Sequence[Bead], section: Polygons, first: Floats) -> list[tuple[Bead, Floats]]:
    """The beads in order, each with its points as printed."""
    ranks = np.array([bead.rank for bead in beads], dtype=np.int32)
    starts = _starts(beads)
    islands = _islands(starts, ranks, section)
    groups: defaultdict[int, list[int]] = defaultdict(list)
    for k, island in enumerate(islands):
        groups[int(island)].append(k)
    waiting = np.argsort(islands, kind="stable")  # by island: of two alike the lower number
    tip, placed = first, list[tuple[Bead, Floats]]()
    while groups:
        nearest = -1 if -1 in groups else int(islands[waiting[np.argmin(((starts[waiting] - tip) ** 2).sum(axis=1))]])
        waiting = waiting[islands[waiting] != nearest]
        phases = _phases([beads[k] for k in groups.pop(nearest)])
        begun = len(placed)
        for number, items in enumerate(phases, start=1):
            entries = np.array([item[0].points[0] for item in items])
            exits = np.array([item[-1].points[-1] for item in items])
            fixed = np.array([len(item) > 1 or item[0].one_way for item in items])
            last = number == len(phases) > 1 and not groups  # the next layer most likely begins where this island began
            goal = np.ascontiguousarray(placed[begun][1][:1]) if last else NOWHERE
            for k, flip in zip(*order_paths(entries, exits, fixed, tip[0], tip[1], goal), strict=True):
                placed += [(bead, bead.points[::-1] if flip else bead.points) for bead in items[k]]
            tip = placed[-1][1][-1]
    return placed


def _phases(beads: Sequence[Bead]) -> list[list[list[Bead]]]:
    """What of an island is printed before what: by rank, but all walls at once, in families that stay together."""
    leaders = [bead for bead in beads if bead.kind is Kind.OUTER_WALL and OUTSIDE < bead.rank <= 0]
    walls = [bead for bead in beads if leaders and OUTSIDE < bead.rank <= 0]
    phases: defaultdict[int, list[list[Bead]]] = defaultdict(list)
    for bead in beads:
        if leaders and OUTSIDE < bead.rank <= 0:
            continue
        if bead.follows and phases[bead.rank]:
            phases[bead.rank][-1].append(bead)
        else:
            phases[bead.rank].append([bead])
    if walls:
        phases[0] = _families(walls, leaders)
    return [phases[rank] for rank in sorted(phases)]


def _families(walls: Sequence[Bead], leaders: Sequence[Bead]) -> list[list[Bead]]:
    """Each outer wall with the inner walls nearest to it, in chains from the inside out that begin side by side."""
    points = np.concatenate([leader.points for leader in leaders])
    which = np.repeat(np.arange(len(leaders)), [len(leader.points) for leader in leaders])
    inner = [bead for bead in walls if bead.kind is not Kind.OUTER_WALL]
    members: list[list[Bead]] = [[] for _ in leaders]
    near = np.zeros(len(inner), np.int64) if len(leaders) == 1 else which[_nearest(points, _starts(inner))]
    for bead, k in zip(inner, near, strict=True):
        members[k].append(bead)
    return [chain for leader, family in zip(leaders, members, strict=True) for chain in _chains(leader, family)]


def _chains(leader: Bead, family: Sequence[Bead]) -> Iterator[list[Bead]]:
    """The walls of a family: of every rank the one that begins nearest to the leader's start goes with the leader.

    The others, around places of their own where the walls behind an outer wall part, follow in chains of their own: to
    print them first would mean to go there and back.
    """
    chain, others = [leader], list[Bead]()
    for rank in sorted({bead.rank for bead in family}, key=lambda rank: abs(rank - leader.rank)):
        equal = [bead for bead in family if bead.rank == rank]
        equal.sort(key=lambda bead: float(((bead.points[0] - leader.points[0]) ** 2).sum()))
        chain.append(equal[0])
        others += equal[1:]
    yield sorted(chain, key=lambda bead: bead.rank)
    if others:
        yield from _chains(others[0], others[1:])


def _starts(beads: Sequence[Bead]) -> Floats:
    return np.array([bead.points[0] for bead in beads]).reshape(-1, 2)


@kernel
def _nearest(points: Floats, places: Floats) -> NDArray[np.int64]:
    """The point nearest to each place; points sorted into square cells, searched ring by ring."""
    low_x, high_x, low_y, high_y = points[0, 0], points[0, 0], points[0, 1], points[0, 1]
    for k in range(len(points)):
        low_x, high_x = min(low_x, points[k, 0]), max(high_x, points[k, 0])
        low_y, high_y = min(low_y, points[k, 1]), max(high_y, points[k, 1])
    cells = max(int(np.sqrt(len(points) / 2.0)), 1)
    size = (max(high_x - low_x, high_y - low_y) + 1e-6) / cells
    cell = longs(len(points), 0)
    for k in range(len(points)):
        cell[k] = int((points[k, 0] - low_x) / size) * cells + int((points[k, 1] - low_y) / size)
    first, order = counting_sort(cell, cells * cells)
    out: NDArray[np.int64] = longs(len(places), 0)
    for p in range(len(places)):
        px, py = places[p, 0], places[p, 1]
        column, row = min(max(int((px - low_x) / size), 0), cells - 1), min(max(int((py - low_y) / size), 0), cells - 1)
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
    sides = [np.hstack([loop, start_at(loop, 1)]) for loop in outer]
    offsets = np.cumsum([0, *(len(side) for side in sides)])
    boxes = np.array([[*loop.min(axis=0), *loop.max(axis=0)] for loop in outer])
    islands = _containing(np.concatenate(sides), offsets, boxes, starts)
    return np.where(ranks <= OUTSIDE, -1, islands).astype(np.int32)


@kernel
def _containing(sides: Floats, offsets: NDArray[np.int64], boxes: Floats, points: Floats) -> Ints:
    islands = np.full(len(points), len(boxes), np.int32)
    for p in range(len(points)):
        x, y = points[p, 0], points[p, 1]
        for k in range(len(boxes)):
            near = boxes[k, 0] <= x <= boxes[k, 2] and boxes[k, 1] <= y <= boxes[k, 3]
            if near and inside(sides[offsets[k] : offsets[k + 1]], x, y):
                islands[p] = k
                break
    return islands
