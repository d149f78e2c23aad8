"""Order: in which sequence the beads of a layer are printed, and which travels between them retract.

Skirt and support come first. The pieces of support, then the islands of the section, follow each other in a short order; inside
an island the walls come first, each outer wall right after the inner walls behind its seam, then by rising rank gaps, skin and
infill. Every piece ends near the next one, and where a layer ends the next one begins.

A short order is greedy nearest neighbour, then the classic exchanges of the travelling salesman's problem: 2-opt (a stretch of
the order reversed) and Or-opt (up to three neighbours moved elsewhere), with true lengths also where a path must not be reversed.
A change of speed on the way from one path to the next counts as much as CHANGE_MM of travel, so that paths of one speed follow
each other unless that means a long detour.

Some lines may begin at any of their corners: closed ones without a seam, and long open ones, which are taken in two. A long line
of infill often runs through the whole island and ends beside its beginning, far from where the tip is. It is begun at the corner
beside the tip then, and after its end goes on at its beginning, wherever that saves travel.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mdp.kernels.arrays import flags, longs, table
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Indices, Ints
from mdp.overhang import Mask
from profiles.process import Process
from slicer.bead import BEFORE_WALLS, FILL, LAST, OUTSIDE, WALLS, Bead
from slicer.geometry.polygons import Polygons, area_mm2, contours
from slicer.paths import Kind
from slicer.strokes.speed import bead_speed_mm_s
from slicer.strokes.strokes import Strokes, strokes_of
from slicer.strokes.travels import travels

SEAMED = (*WALLS, Kind.SKIRT)  # kinds whose rings begin where they do
NO_GOAL = np.zeros((0, 3))  # x, y and speed; a speed that is not known is NaN, which differs from every other
ROUNDS = 2  # a phase ends well only once it is known where the next one begins
SUPPORTS = (Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
FIRST = -1  # the number of what comes before all islands: skirt and brim
CHANGE_MM = 3.0  # at 15 mm, prints with many small islands take 1 % longer, since most of their travels also retract
TRIES = 2  # the order depends on where lines begin, and that on the order
WORTH_MM = 5.0  # travel that taking a line in two has to save: a bead that ends and begins once more shows
CLOSED, OPEN, AS_IT_IS = 2, 1, 0  # what may be done with a line: begun anywhere, begun anywhere in two pieces, nothing
REACH = 200  # exchanges reach so far along the order, less far in an order of more than a thousand paths
# Random lines of 1 to 8 mm on a plate of 100 mm, commit 5c72b83f: with up to 900 of them nothing is gained after 12 passes,
# 4 leave the way 0.6 to 1 % longer for half the time, 1 leaves it 6 to 13 % longer; with 2,500 of them 4 leave it 0.3 % longer.
PASSES, FEW_PASSES = 12, 4
MANY = 1000  # paths, from which on there are few passes
GAIN_MM = 1e-6  # less is rounding, and an exchange back and forth would never end
MOST_MOVED = 3  # as Or (1976); one leaves the same ways 0.3 to 0.8 % longer, four change them by -0.4 to +0.5 %

Speed = Callable[[Bead], float]
# Paths in their present order: (n,) number of each, (n,) reversed, (n,) must not be, and (2 n + 1 + goals, 3) places with their
# speeds: where all begins, then where each path is entered and left as it runs now, then the goal.
Paths = tuple[Indices, Mask, Mask, Floats]


def order_beads(
    beads: Sequence[Bead],
    section: Polygons,
    process: Process,
    tip: Floats | None,
    support: Polygons | None = None,
    skin: Polygons | None = None,
    kind_mm_s: Floats | None = None,
) -> Strokes:
    """The beads of one layer in printing order. tip: (2,) where the nozzle stands before, None at the part's start; support:
    where that is printed; skin: outer walls beside an edge of an interface, which no travel passes over; kind_mm_s: by number of
    the kind, replaces the process's."""
    if not beads:
        return strokes_of([], np.zeros(0, np.bool_), {}, process.small_wall_mm)
    speed_mm_s: Speed = partial(bead_speed_mm_s, process=process, kind_mm_s=kind_mm_s)
    support, first = Polygons() if support is None else support, beads[0].points[0] if tip is None else tip
    groups: defaultdict[int, list[Bead]] = defaultdict(list)
    for bead, island in zip(beads, islands_of(beads, section, support).tolist(), strict=True):
        groups[island].append(bead)
    order = _island_order(groups, first, support_first=tip is None)
    at, placed = np.append(first, np.nan), list[Bead]()
    for island, after in zip(order, [*order[1:], order[-1]], strict=True):
        phases = _phases(groups[island])
        goal = NO_GOAL if after == island and len(phases) == 1 else np.append(_middle(groups[after]), np.nan)[None]
        placed += _in_phases(phases, speed_mm_s, at, goal)
        at = _end(placed[-1], -1, speed_mm_s)
    to = np.array([bead.points[0] for bead in placed])
    since = np.array([first, *(bead.points[-1] for bead in placed[:-1])])
    retracts, detours = travels(since, to, section, support, process, skin)
    retracts[0] = retracts[0] or tip is None
    return strokes_of(placed, retracts, detours, process.small_wall_mm)


def islands_of(beads: Sequence[Bead], section: Polygons, support: Polygons) -> Ints:
    """(n,) the number of each bead's island: the smallest outer contour round its start, of the section or of its support. Those
    of support come after those of the section; FIRST: skirt and brim."""
    ranks = np.array([bead.rank for bead in beads], dtype=np.int32)
    starts = np.array([bead.points[0] for bead in beads]).reshape(-1, 2)
    torn_off = np.array([bead.kind in SUPPORTS for bead in beads], dtype=np.bool_)
    islands = np.where(ranks <= OUTSIDE, FIRST, 0).astype(np.int32)
    own, after = ranks > OUTSIDE, 0
    for wanted, area in ((own, section), (~own & torn_off, support)):
        if wanted.any():
            islands[wanted] = after + _pieces_around(starts[wanted], area)
            after = int(islands.max()) + 1
    return islands


def _pieces_around(starts: Floats, area: Polygons) -> Ints:
    """(n,) the number of the area's piece that each start lies in; those in none have a number of their own."""
    outer = sorted((loop for loop in contours(area) if area_mm2(loop) > 0), key=lambda loop: abs(area_mm2(loop)))
    if len(outer) < 2:
        return np.zeros(len(starts), np.int32)
    import shapely  # 30 ms, which commands that slice nothing need not spend

    rings = shapely.linearrings(np.concatenate(outer), indices=np.repeat(np.arange(len(outer)), [len(loop) for loop in outer]))
    piece, start = shapely.STRtree(shapely.points(starts)).query(shapely.polygons(rings), "contains")
    pieces = np.full(len(starts), len(outer), np.int32)
    np.minimum.at(pieces, start, piece.astype(np.int32))  # of an island in a hole of another one the inner, which is smaller
    return pieces


def _end(bead: Bead, end: int, speed_mm_s: Speed) -> Floats:
    """(3,) where a bead begins, end = 0, or ends, end = -1, and its speed."""
    return np.append(bead.points[end], speed_mm_s(bead))


def _island_order(groups: dict[int, list[Bead]], first: Floats, support_first: bool) -> list[int]:
    """The islands in a short order after skirt and brim, support before the part where that is asked for."""
    stages: defaultdict[int, list[int]] = defaultdict(list)
    for island in sorted(groups):
        stages[0 if island == FIRST else 1 if support_first and groups[island][0].kind in SUPPORTS else 2].append(island)
    islands: list[int] = []
    for stage in sorted(stages):
        places = np.array([_middle(groups[island]) for island in stages[stage]])
        goal = NO_GOAL
        if stage == 1 and 2 in stages:
            parts = np.array([_middle(groups[island]) for island in stages[2]])
            goal = np.append(parts[np.argmin(((parts - places.mean(axis=0)) ** 2).sum(axis=1))], 0.0)[None]
        stops = np.c_[places, np.zeros(len(places))]
        order, _ = order_paths(stops, stops, np.ones(len(places), np.bool_), np.append(first, 0.0), goal)
        islands += [stages[stage][k] for k in order]
        first = _middle(groups[islands[-1]])
    return islands


def _middle(beads: Sequence[Bead]) -> Floats:
    """(2,) the place that stands for an island: where its first outer wall begins, of others the middle of all that they are."""
    leader = next((bead for bead in beads if bead.kind is Kind.OUTER_WALL), None)
    points = np.concatenate([bead.points for bead in beads]) if leader is None else leader.points[:1]
    middle: Floats = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return middle


def _phases(beads: Sequence[Bead]) -> list[list[list[Bead]]]:
    """The beads of an island in the phases of its printing: by rank, but all walls at once, in families that stay together. Inner
    walls that are open lines and behind no seam are printed with the infill: most have its speed and lie beside it."""
    leaders = [bead for bead in beads if bead.kind is Kind.OUTER_WALL and BEFORE_WALLS < bead.rank <= 0]
    walls = [bead for bead in beads if leaders and BEFORE_WALLS < bead.rank <= 0]
    phases: defaultdict[int, list[list[Bead]]] = defaultdict(list)
    for bead in beads:
        if leaders and BEFORE_WALLS < bead.rank <= 0:
            continue
        phase = FILL if FILL <= bead.rank <= LAST else bead.rank
        if bead.follows and phases[phase]:
            phases[phase][-1].append(bead)
        else:
            phases[phase].append([bead])
    for chain in _families(walls, leaders) if walls else ():
        phases[FILL if chain[0].line and chain[0].kind is Kind.INNER_WALL and len(chain) == 1 else 0].append(chain)
    return [phases[rank] for rank in sorted(phases)]


def _families(walls: Sequence[Bead], leaders: Sequence[Bead]) -> list[list[Bead]]:
    """Each outer wall with the inner walls nearest to it, in chains from the inside out that begin side by side."""
    points = np.concatenate([leader.points for leader in leaders])
    which = np.repeat(np.arange(len(leaders)), [len(leader.points) for leader in leaders])
    inner = [bead for bead in walls if bead.kind is not Kind.OUTER_WALL]
    members: list[list[Bead]] = [[] for _ in leaders]
    starts = np.array([bead.points[0] for bead in inner]).reshape(-1, 2)
    near = np.zeros(len(inner), np.int64)
    if len(leaders) > 1 and inner:
        import shapely  # as in _pieces_around

        near = which[shapely.STRtree(shapely.points(points)).nearest(shapely.points(starts))]
    for bead, k in zip(inner, near.tolist(), strict=True):
        members[k].append(bead)
    return [chain for leader, family in zip(leaders, members, strict=True) for chain in _chains(leader, family)]


def _chains(leader: Bead, family: Sequence[Bead]) -> Iterator[list[Bead]]:
    """The walls of a family: of every rank the one that begins nearest to the leader's start goes with the leader. The others,
    around places of their own where the walls behind an outer wall part, follow in chains of their own: to print them first would
    mean going there and back. Open lines among them begin beside no other wall and stay single."""
    chain, others = [leader], list[Bead]()
    for rank in sorted({bead.rank for bead in family}, key=lambda rank: abs(rank - leader.rank)):
        equal = [bead for bead in family if bead.rank == rank]
        equal.sort(key=lambda bead: float(((bead.points[0] - leader.points[0]) ** 2).sum()))
        chain.append(equal[0])
        others += equal[1:]
    yield sorted(chain, key=lambda bead: bead.rank)
    yield from ([bead] for bead in others if bead.line)
    loops = [bead for bead in others if not bead.line]
    if loops:
        yield from _chains(loops[0], loops[1:])


def _in_phases(phases: Sequence[Sequence[Sequence[Bead]]], speed_mm_s: Speed, tip: Floats, goal: Floats) -> list[Bead]:
    """The phases of an island one after the other, each once more when it is known where the next one begins."""
    goals = [NO_GOAL] * (len(phases) - 1) + [goal]
    for _ in range(min(len(phases), ROUNDS)):
        runs, at = list[list[Bead]](), tip
        for phase, end in zip(phases, goals, strict=True):
            runs.append(_short_order(phase, speed_mm_s, at, end))
            at = _end(runs[-1][-1], -1, speed_mm_s)
        goals = [*(_end(run[0], 0, speed_mm_s)[None] for run in runs[1:]), goal]
    return [bead for run in runs for bead in run]


def _short_order(items: Sequence[Sequence[Bead]], speed_mm_s: Speed, tip: Floats, goal: Floats) -> list[Bead]:
    """Chains of beads in a short order from the tip on, with their points as they are printed."""
    lines = [item[0].points if len(item) == 1 else np.array([item[0].points[0], item[-1].points[-1]]) for item in items]
    fixed = np.array([len(item) > 1 or item[0].one_way for item in items])
    speeds = np.array([[speed_mm_s(item[end]) for end in (0, -1)] for item in items])
    placed: list[Bead] = []
    for k, pieces in order_lines(lines, speeds, fixed, [_freedom(item) for item in items], tip, goal):
        placed += items[k] if len(items[k]) > 1 else [replace(items[k][0], points=piece) for piece in pieces]
    return placed


def _freedom(chain: Sequence[Bead]) -> int:
    """What may be done with a chain so that the ways to and from it are short."""
    bead = chain[0]
    if len(chain) > 1 or bead.kind in SEAMED:
        return AS_IT_IS
    return CLOSED if bead.closed else OPEN if bead.kind is Kind.INFILL else AS_IT_IS


def order_lines(
    lines: Sequence[Floats], speeds: Floats, fixed: Mask, freedom: Sequence[int], tip: Floats, goal: Floats
) -> list[tuple[int, list[Floats]]]:
    """Lines (n, 2) in a short order from the tip on, as order_paths, begun where their freedom allows it: the number of each and
    the pieces (n, 2) of it as they are printed. speeds: (n, 2) with which each begins and ends; fixed: (n,) must not be reversed;
    tip: (3,) where and with which speed all begins; goal: (1, 3) where and with which it ends up, or (0, 3)."""
    held, cut, pairs = fixed.copy(), [0] * len(lines), zip(lines, freedom, strict=True)
    begun = [_begin_at(line, _corner(line, tip[:2], tip[:2], True)) if free == CLOSED else line for line, free in pairs]
    for _ in range(TRIES if any(freedom) else 1):
        entries, exits = np.array([line[0] for line in begun]), np.array([line[-1] for line in begun])
        order, flips = order_paths(np.c_[entries, speeds[:, 0]], np.c_[exits, speeds[:, 1]], held, tip, goal)
        since = tip[:2]
        for step, k in enumerate(order.tolist()):
            if freedom[k]:
                after = order[step + 1] if step + 1 < len(order) else -1
                to = begun[after][-1 if flips[step + 1] else 0] if after >= 0 else goal[0, :2] if len(goal) else since
                at = _corner(lines[k], since, to, freedom[k] == CLOSED)
                begun[k] = _begin_at(lines[k], at)
                if freedom[k] == OPEN:
                    held[k], cut[k] = fixed[k] or at > 0, len(lines[k]) - at if at else 0
                    flips[step] = False if at else _nearer_from_its_end(lines[k], since, to)
            since = begun[k][0 if flips[step] else -1]
    return [
        (k, [begun[k][: cut[k]], begun[k][cut[k] :]] if cut[k] else [begun[k][::-1] if flip else begun[k]])
        for k, flip in zip(order.tolist(), flips.tolist(), strict=True)
    ]


def _corner(line: Floats, since: Floats, to: Floats, closed: bool) -> int:
    """The corner to begin a line at, so that the way from one place over it to another is shortest; 0: its beginning."""
    return int(_best_corner(np.ascontiguousarray(line), since[0], since[1], to[0], to[1], closed))


@kernel
def _best_corner(line: Floats, x0: float, y0: float, x1: float, y1: float, closed: bool) -> int:
    last = len(line) - 1
    best, least, between = 0, np.inf, 0.0
    if not closed:
        between = np.hypot(line[last, 0] - line[0, 0], line[last, 1] - line[0, 1])
        forth = np.hypot(line[0, 0] - x0, line[0, 1] - y0) + np.hypot(line[last, 0] - x1, line[last, 1] - y1)
        back = np.hypot(line[last, 0] - x0, line[last, 1] - y0) + np.hypot(line[0, 0] - x1, line[0, 1] - y1)
        least = min(forth, back) - WORTH_MM
    for k in range(0 if closed else 1, last):
        way = np.hypot(line[k, 0] - x0, line[k, 1] - y0) + np.hypot(line[k, 0] - x1, line[k, 1] - y1) + between
        if way < least - 1e-9:
            best, least = k, way
    return best


def _begin_at(line: Floats, at: int) -> Floats:
    """A line (n, 2) from one of its corners on to its end, and on from its beginning to that corner."""
    closed = bool((line[0] == line[-1]).all())
    return np.concatenate([line[at:], line[int(closed) : at + 1]]) if at else line


def _nearer_from_its_end(line: Floats, since: Floats, to: Floats) -> bool:
    forth = float(np.hypot(*(line[0] - since)) + np.hypot(*(to - line[-1])))
    return float(np.hypot(*(line[-1] - since)) + np.hypot(*(to - line[0]))) < forth - 1e-9


@kernel
def order_paths(starts: Floats, ends: Floats, fixed: Mask, tip: Floats, goal: Floats) -> tuple[Indices, Mask]:
    """Order and reversals of n paths; starts, ends: (n, 3) mm, mm and speed; fixed: (n,) must not be reversed. tip: (3,) place
    and speed from which the order starts; goal: (1, 3) those at which it should end, or (0, 3)."""
    n = len(starts)
    given, at = table(2 * n + 1, 3), table(2 * n + 1 + len(goal), 3)
    order, flips, held = longs(n, 0), flags(n), flags(n)
    for axis in range(3):
        given[0, axis] = tip[axis]
        for k in range(n):
            given[2 * k + 1, axis], given[2 * k + 2, axis] = starts[k, axis], ends[k, axis]
    _greedy(given, fixed, order, flips)
    for axis in range(3):
        at[0, axis] = tip[axis]
        for k in range(n):
            into = 2 * order[k] + 1 + int(flips[k])
            at[2 * k + 1, axis], at[2 * k + 2, axis] = given[into, axis], given[4 * order[k] + 3 - into, axis]
        for k in range(len(goal)):
            at[2 * n + 1, axis] = goal[k, axis]
    for k in range(n):
        held[k] = fixed[order[k]]
    paths, reach = (order, flips, held, at), max(REACH * MANY // n, 20) if n > MANY else REACH
    for _ in range(FEW_PASSES if n > MANY else PASSES):
        gained = _reverse_stretches(paths, reach)
        gained += _move_neighbours(paths, reach)
        if gained < GAIN_MM:
            break
    return order, flips


@no_nrt
def _greedy(given: Floats, fixed: Mask, order: Indices, flips: Mask) -> None:
    """Fills in the order that goes to the nearest path each time; given: places as in Paths, in the order of the numbers."""
    for k in range(len(order)):
        order[k] = k
    since = 0
    for step in range(len(order)):
        best, flip, least = step, False, np.inf
        for k in range(step, len(order)):
            i = order[k]
            way = _way(given, since, 2 * i + 1)
            if way < least or (way == least and i < order[best]):
                best, flip, least = k, False, way
            if not fixed[i]:
                way = _way(given, since, 2 * i + 2)
                if way < least:
                    best, flip, least = k, True, way
        i = order[best]
        order[step], order[best] = i, order[step]
        flips[step] = flip
        since = 2 * i + (1 if flip else 2)


@no_nrt
def _way(at: Floats, a: int, b: int) -> float:
    """Travel from one place to another, and CHANGE_MM where their speeds differ; no travel where b is no place."""
    if b >= len(at):
        return 0.0
    travel = np.hypot(at[b, 0] - at[a, 0], at[b, 1] - at[a, 1])
    return float(travel + CHANGE_MM) if at[b, 2] != at[a, 2] else float(travel)


@no_nrt
def _reverse_stretches(paths: Paths, reach: int) -> float:
    """2-opt: reverses stretches where that saves travel; returns how much."""
    order, _, fixed, at = paths
    n, gained = len(order), 0.0
    for i in range(n):
        before = _way(at, 2 * i, 2 * i + 1)
        last = 2 * i + (2 if fixed[i] else 1)  # where the reversed stretch is left
        forth = back = 0.0
        inner = last
        for j in range(i, min(i + reach, n)):
            into, out = (2 * j + 1, 2 * j + 2) if fixed[j] else (2 * j + 2, 2 * j + 1)  # of path j in the reversed stretch
            if j > i:
                forth += _way(at, 2 * j, 2 * j + 1)
                back += _way(at, out, inner)
            inner = into
            after = _way(at, 2 * j + 2, 2 * j + 3)
            change = before + forth + after - _way(at, 2 * i, into) - back - _way(at, last, 2 * j + 3)
            if change > GAIN_MM:
                _reverse(paths, i, j)
                gained += change
                break
    return gained


@no_nrt
def _move_neighbours(paths: Paths, reach: int) -> float:
    """Or-opt: moves up to MOST_MOVED neighbours elsewhere where that saves travel; returns how much."""
    order, _, _, at = paths
    n, gained = len(order), 0.0
    for i in range(n):
        for many in range(1, min(MOST_MOVED, n - i) + 1):
            last = i + many - 1
            into, out, after = 2 * i + 1, 2 * last + 2, 2 * last + 3
            saved = _way(at, 2 * i, into) + _way(at, out, after) - _way(at, 2 * i, after)
            if saved <= GAIN_MM:
                continue
            best, to = GAIN_MM, -2
            for k in range(max(i - reach, -1), min(last + reach, n)):  # put between k and k + 1
                if i - 1 <= k <= last:
                    continue
                left = 2 * k + 2
                added = _way(at, left, into) + _way(at, out, left + 1) - _way(at, left, left + 1)
                if saved - added > best:
                    best, to = saved - added, k
            if to == -2:
                continue
            _rotate(paths, i, last, to)
            gained += best
            break
    return gained


@no_nrt
def _reverse(paths: Paths, i: int, j: int) -> None:
    """The stretch i..j the other way round."""
    _mirror(paths, i, j)
    _, flips, fixed, at = paths
    for k in range(i, j + 1):
        if not fixed[k]:
            flips[k] = not flips[k]
            for axis in range(3):
                at[2 * k + 1, axis], at[2 * k + 2, axis] = at[2 * k + 2, axis], at[2 * k + 1, axis]


@no_nrt
def _rotate(paths: Paths, i: int, last: int, to: int) -> None:
    """Paths i..last put behind path `to`, all as they run: what lies on both sides of a place changes sides."""
    low, high = (i, to) if to > last else (to + 1, last)
    middle = last + 1 if to > last else i  # what begins here comes first
    _mirror(paths, low, middle - 1)
    _mirror(paths, middle, high)
    _mirror(paths, low, high)


@no_nrt
def _mirror(paths: Paths, i: int, j: int) -> None:
    """The paths i..j in reverse order, each as it runs."""
    order, flips, fixed, at = paths
    while i < j:
        order[i], order[j] = order[j], order[i]
        flips[i], flips[j] = flips[j], flips[i]
        fixed[i], fixed[j] = fixed[j], fixed[i]
        for axis in range(3):
            for end in range(1, 3):
                at[2 * i + end, axis], at[2 * j + end, axis] = at[2 * j + end, axis], at[2 * i + end, axis]
        i, j = i + 1, j - 1
