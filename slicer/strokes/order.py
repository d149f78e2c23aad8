"""Order: the sequence of a layer's beads, and which of the travels between them retract.

Skirt and support come first. The pieces of support, then the islands of the section, follow in a short order; within an island
the walls come first, each outer wall right after the inner walls behind its seam, then, by ascending rank, gap fill, skin and
infill. Every piece ends near the next one, and the next layer begins where a layer ends.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mdp.mesh import Floats, Ints
from profiles.process import Process
from slicer.bead import BEFORE_WALLS, FILL, LAST, OUTSIDE, WALLS, Bead
from slicer.geometry.polygons import Polygons, area_mm2, contours
from slicer.paths import Kind
from slicer.strokes.path_order import AS_IT_IS, CLOSED, OPEN, order_lines, order_paths
from slicer.strokes.speed import bead_speed_mm_s
from slicer.strokes.strokes import Strokes, strokes_of
from slicer.strokes.travels import travels

SEAMED = (*WALLS, Kind.SKIRT)  # kinds whose rings have a fixed start
NO_GOAL = np.zeros((0, 3))  # x, y and speed; an unknown speed is NaN, which differs from every other
ROUNDS = 2  # the end of a phase can be optimised only when the start of the next one is known
SUPPORTS = (Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
FIRST = -1  # number for what comes before all islands: skirt and brim

Speed = Callable[[Bead], float]


def order_beads(
    beads: Sequence[Bead],
    section: Polygons,
    process: Process,
    tip: Floats | None,
    support: Polygons | None = None,
    skin: Polygons | None = None,
    kind_mm_s: Floats | None = None,
) -> Strokes:
    """The beads of one layer in printing order.

    tip: (2,) initial position of the nozzle, None at the part's start; support: its area; skin: visible wall beside joints, which
    no travel crosses; kind_mm_s: speeds by number of the kind, which replace the process's.
    """
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
    """(n,) number of each bead's island: the smallest outer contour around its start, in the section or in its support.

    Those of support come after those of the section; FIRST: skirt and brim.
    """
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
    """(n,) number of the area's piece that contains each start; starts outside all pieces share a separate number."""
    outer = sorted((loop for loop in contours(area) if area_mm2(loop) > 0), key=lambda loop: abs(area_mm2(loop)))
    if len(outer) < 2:
        return np.zeros(len(starts), np.int32)
    import shapely  # import takes 30 ms, which commands without slicing save

    rings = shapely.linearrings(np.concatenate(outer), indices=np.repeat(np.arange(len(outer)), [len(loop) for loop in outer]))
    piece, start = shapely.STRtree(shapely.points(starts)).query(shapely.polygons(rings), "contains")
    pieces = np.full(len(starts), len(outer), np.int32)
    np.minimum.at(pieces, start, piece.astype(np.int32))  # for an island in a hole of another one the inner, which is smaller
    return pieces


def _end(bead: Bead, end: int, speed_mm_s: Speed) -> Floats:
    """(3,) start (end = 0) or end (end = -1) of a bead, and its speed."""
    return np.append(bead.points[end], speed_mm_s(bead))


def _island_order(groups: dict[int, list[Bead]], first: Floats, support_first: bool) -> list[int]:
    """The islands in a short order after skirt and brim; support_first: support before the part."""
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
    """(2,) representative point of an island: the start of its first outer wall, otherwise the centre of its beads."""
    leader = next((bead for bead in beads if bead.kind is Kind.OUTER_WALL), None)
    points = np.concatenate([bead.points for bead in beads]) if leader is None else leader.points[:1]
    middle: Floats = 0.5 * (points.min(axis=0) + points.max(axis=0))
    return middle


def _phases(beads: Sequence[Bead]) -> list[list[list[Bead]]]:
    """The beads of an island in printing phases: by rank, except that all walls form one phase, in families that stay together.

    Inner walls that are open lines and not behind a seam are printed with the infill: most have its speed and lie beside it.
    """
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
    """The chains of a family: in every rank, the wall that begins nearest to the leader's start joins the leader's chain.

    The others, around separate areas where the walls behind an outer wall divide, form their own chains: printing them first
    would need travels there and back. Open lines among them begin beside no other wall and stay single.
    """
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
    """Order the phases of an island one after the other, and once more when the start of each next phase is known."""
    goals = [NO_GOAL] * (len(phases) - 1) + [goal]
    for _ in range(min(len(phases), ROUNDS)):
        runs, at = list[list[Bead]](), tip
        for phase, end in zip(phases, goals, strict=True):
            runs.append(_short_order(phase, speed_mm_s, at, end))
            at = _end(runs[-1][-1], -1, speed_mm_s)
        goals = [*(_end(run[0], 0, speed_mm_s)[None] for run in runs[1:]), goal]
    return [bead for run in runs for bead in run]


def _short_order(items: Sequence[Sequence[Bead]], speed_mm_s: Speed, tip: Floats, goal: Floats) -> list[Bead]:
    """Chains of beads in a short order starting from the tip, with their points in printing direction."""
    lines = [item[0].points if len(item) == 1 else np.array([item[0].points[0], item[-1].points[-1]]) for item in items]
    fixed = np.array([len(item) > 1 or item[0].one_way for item in items])
    speeds = np.array([[speed_mm_s(item[end]) for end in (0, -1)] for item in items])
    placed: list[Bead] = []
    for k, pieces in order_lines(lines, speeds, fixed, [_freedom(item) for item in items], tip, goal):
        placed += items[k] if len(items[k]) > 1 else [replace(items[k][0], points=piece) for piece in pieces]
    return placed


def _freedom(chain: Sequence[Bead]) -> int:
    """The freedom of a chain to begin elsewhere, so that the travels to and from it are short."""
    bead = chain[0]
    if len(chain) > 1 or bead.kind in SEAMED:
        return AS_IT_IS
    return CLOSED if bead.closed else OPEN if bead.kind is Kind.INFILL else AS_IT_IS
