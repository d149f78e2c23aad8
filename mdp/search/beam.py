"""Beam: the nodes that a search pursues, one in each slot.

The first slot follows the ranker: the classic ranking, large parts first, or a learned one. Every further slot has its own
trade-off between saved area and final loss, and takes its node from the children of its own node and those of all lower slots. So
a wider beam contains the narrower ones and never ends worse, and the slots do not fill with near-equal cuts of one ranking; a
learned ranker for all slots gained less.

The cuts of these slots take everything above their planes. If cuts of single limbs competed with them for the slots, the result
could be worse, so limbs have their own slots (search_limbs). Those choose among few planes: limbs of the uncut model that save
enough and that the head can print beside standing parts, and the planes that rank first in the beam.

search_as_published is the authors' own loop of 2020, for comparisons and for records on the paper's terms.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from heapq import merge
from itertools import chain, islice
from math import isqrt
from operator import itemgetter

import numpy as np

from mdp.cost.cost import CutCost
from mdp.kernels.threads import ahead
from mdp.overhang import threshold
from mdp.plane import Plane
from mdp.ranking.candidates import Bounds, gain_mm2, lost_mm2, residual_mm2
from mdp.ranking.node import Node
from mdp.ranking.ranker import LearnedRanker
from mdp.ranking.ranking import (
    SHORTLIST_TRADE_OFFS,
    CandidateTable,
    RankedCandidate,
    nearly_equal,
    rank_by_trade_off,
    rank_classic,
    shortlist,
)
from mdp.ranking.record import Trace, offer
from mdp.search.front import ParetoFront
from mdp.search.problem import Problem
from mdp.sweep.limbs import LimbGrid, LimbSums, find_limbs

# Weight of finally lost area against saved area; None: the ranker's own order. In greedy searches of many models, 4 is best on
# average, and no value is best on most models.
TRADE_OFFS = (None, 4.0, 1.0, 8.0, 2.0, 0.5, 16.0, 0.0)
RECORDED = 50  # candidates of a stage that are recorded, the B of the 2020 paper
EVERY = 6  # limbs are searched along every sixth of the sampled directions
WORTH = 0.005  # share of the uncut model's cost that a limb must save
MOST_LIMBS, MOST_CHECKED = 16, 32  # planes of limbs that are used, and planes that are checked to find them
MOST_PLANES = 16  # planes of the beam's ranking, per trade-off, whose directions are used
LIMB_TRADE_OFFS = (4.0, 1.0)  # a slot each
MAX_STALLED_STAGES = 2  # stages without a better node after which the search for limbs ends
MOST_TRIED = 16  # limbs, and planes, tried by a slot at a node

Pick = tuple[RankedCandidate, Node]  # a candidate taken by a slot of the beam, and the resulting node
# a possible cut: its key (lower is better), node, plane, and its cost if known
Offered = tuple[float, Node, Plane, CutCost | None]


# The candidates for the next cut of a node, computed in the background while other slots are still picking.
FutureTable = Future[CandidateTable]


class Beam:
    """A beam of search.beam_width slots; bests holds the best node of each slot so far."""

    def __init__(self, problem: Problem, ranker: LearnedRanker | None, trace: Trace | None) -> None:
        self.problem, self.ranker, self.trace = problem, ranker, trace
        width = problem.settings.beam_width
        self.nodes: list[Node | None] = [problem.start] + [None] * (width - 1)
        self.bests = [problem.start] * width
        self.front = ParetoFront(problem.start)
        self.first = self._branch(problem.start, 0)
        self._branches: list[FutureTable | None] = [self.first]
        self._seen = {problem.start.signature: 0}  # solids by signature, and the lowest slot that had them
        self._children: dict[tuple[CandidateTable, int], Node | None] = {}
        self._taken: dict[CandidateTable, list[Plane]] = {}

    @property
    def best(self) -> Node:
        """The best node so far."""
        return min(self.bests, key=lambda node: node.cost_mm2)

    def advance(self) -> None:
        """Make one more cut in every slot; slots without a feasible cut stay empty."""
        if self.trace is not None:
            self.trace.begin_stage([node.signature for node in self.nodes if node is not None])
        branches, self._branches = self._branches, []
        self._children.clear()
        self._taken.clear()
        picks: list[Pick | None] = []
        for slot in range(len(self.nodes)):
            pick = self._pick([branch for branch in branches[: slot + 1] if branch is not None], slot)
            picks.append(pick)
            self._branches.append(None if pick is None or self.problem.full(pick[1]) else self._branch(pick[1], slot))
        if self.trace is not None:
            self._record(self.trace, [branch for branch in branches if branch is not None], picks)
        self.nodes = [None if pick is None else pick[1] for pick in picks]
        for slot, node in enumerate(self.nodes):
            if node is not None:
                self.front.offer(node)
                self.bests[slot] = min(self.bests[slot], node, key=lambda node: node.cost_mm2)
        for branch in branches:
            if branch is not None and branch.result().node is not self.problem.root:
                branch.result().node.release()

    def close(self) -> None:
        """Cancel pending evaluations for a next cut."""
        for branch in self._branches:
            if branch is not None:
                branch.cancel()

    def _branch(self, node: Node, slot: int) -> FutureTable:
        large = TRADE_OFFS[slot % len(TRADE_OFFS)] is None and self.ranker is None
        return ahead(self.problem.table, node, large, self.ranker is not None or self.trace is not None)

    def finalists(self) -> list[Node]:
        """The nodes to polish: for the second slot and every slot with a square number, the best node so far of that or any lower
        slot that is not a finalist yet; for a single slot its best, if a learned ranker saved the time.
        """
        if len(self.bests) == 1:
            return [node for node in self.bests if node.cuts and self.ranker is not None]
        finalists: list[Node] = []
        for count in range(2, len(self.bests) + 1):
            if count == 2 or isqrt(count) ** 2 == count:
                others = [node for node in self.bests[:count] if node.cuts and node not in finalists]
                finalists += [min(others, key=lambda node: node.cost_mm2)] if others else []
        return finalists

    def _pick(self, branches: Sequence[FutureTable], slot: int) -> Pick | None:
        """The candidate and node that a slot takes from some branches: no solid twice, no two near-equal cuts of one node."""
        for candidate in self._rank(branches, slot):
            plane, taken = candidate.table.plane(candidate.row), self._taken.setdefault(candidate.table, [])
            if any(nearly_equal(plane, earlier) for earlier in taken):
                continue
            child = self._child(candidate)
            if child is not None and self._seen.get(child.signature, slot + 1) > slot:
                self._seen[child.signature] = slot
                taken.append(plane)
                return candidate, child
        return None

    def _rank(self, branches: Sequence[FutureTable], slot: int) -> Iterator[RankedCandidate]:
        if not branches:
            return iter(())
        tables = [branch.result() for branch in branches]
        bound_mm2 = min(node.cost_mm2 for node in self.bests[: slot + 1])
        trade_off = TRADE_OFFS[slot % len(TRADE_OFFS)]
        if trade_off is not None:
            return rank_by_trade_off(tables, trade_off, bound_mm2)
        if self.ranker is not None:  # the shortlist is followed by candidates for the case that nothing on it can be cut
            return chain(
                self.ranker.rank(shortlist(tables, bound_mm2)), rank_by_trade_off(tables, SHORTLIST_TRADE_OFFS[0], bound_mm2)
            )
        return rank_classic(tables, bound_mm2, preferred_mm3=self.problem.preferred_mm3)

    def _child(self, candidate: RankedCandidate) -> Node | None:
        key = candidate.table, candidate.row
        if key not in self._children:
            self._children[key] = self.problem.cut_row(*key)
        return self._children[key]

    def _record(self, trace: Trace, branches: Sequence[FutureTable], picks: Sequence[Pick | None]) -> None:
        """Record the stage: the first candidates of the classic ranking, and those taken by the slots."""
        tables = [branch.result() for branch in branches]
        bound_mm2, preferred_mm3 = self.best.cost_mm2, self.problem.preferred_mm3
        classic = rank_classic(tables, bound_mm2, preferred_mm3=preferred_mm3) if tables else iter(())
        offered = {(ranked.table, ranked.row): ranked for ranked in islice(classic, max(RECORDED, 2 * len(self.nodes)))}
        picked = [pick for pick in picks if pick is not None]
        for candidate, _ in picked:
            offered.setdefault((candidate.table, candidate.row), candidate)
        number_of = {key: number for number, key in enumerate(offered)}
        children = [(number_of[each.table, each.row], node.signature, node.cost_mm2) for each, node in picked]
        trace.add(list(map(offer, offered.values())), children)


def search_limbs(problem: Problem, first: FutureTable) -> list[Node]:
    """The best node after each stage of a search that may cut off single limbs; empty if no limb is worth a cut. first: the
    candidate table of the start node.
    """
    limbs = [] if problem.full(problem.start) or problem.late() else _find_limbs(problem)
    if not limbs:
        return []
    table = first.result()
    rows = [row for trade_off in LIMB_TRADE_OFFS for row in islice(table.rows_by_trade_off(trade_off), MOST_PLANES)]
    directions = problem.limits.directions[np.unique(table.scored.direction[rows])]
    limits, seen, found = problem.bounds_along(directions), set[tuple[float, ...]](), list[Node]()
    nodes, best = [problem.start], problem.start
    while nodes and not problem.full(nodes[0]) and not problem.late():
        offers = [(problem.limb_sums(node, limbs), problem.table(node, limits=limits)) for node in nodes]
        nodes = []
        for trade_off in LIMB_TRADE_OFFS:
            cuts = (_rank_cuts(problem, limbs, offer, trade_off, best.cost_mm2) for offer in offers)
            ranked = merge(*cuts, key=itemgetter(0))
            child = next((child for offered in ranked if (child := _cut(problem, offered, seen)) is not None), None)
            nodes += [] if child is None else [child]
        best = min((best, *nodes), key=lambda node: node.cost_mm2)
        found.append(best)
        if len(found) > MAX_STALLED_STAGES and found[-1 - MAX_STALLED_STAGES] is best:
            break
    return found


def _rank_cuts(
    problem: Problem, limbs: Sequence[Plane], offer: tuple[LimbSums, CandidateTable], trade_off: float, bound_mm2: float
) -> Iterator[Offered]:
    """Feasible cuts of a node, limbs or everything above planes of its table, best first by trade_off times the loss less the
    gain over all cuts so far. Cuts with a final cost of bound_mm2 or more are left out.
    """
    sums, table = offer
    node, residual = table.node, residual_mm2(sums, problem.terms)
    gain = np.where(sums.exists & ~sums.alone, gain_mm2(sums, residual), -np.inf)
    before = trade_off * node.lost_mm2 - node.saved_mm2
    keys = before + trade_off * lost_mm2(sums, residual) - gain
    good = (gain >= problem.least_gain_mm2) & (node.residual_mm2 + residual < bound_mm2)
    order = [row for row in np.argsort(keys, kind="stable") if good[row]][:MOST_TRIED]
    scored, ranked = table.scored, islice(rank_by_trade_off([table], trade_off, bound_mm2), MOST_TRIED)
    of_limbs = ((float(keys[row]), node, limbs[row], None) for row in order)
    of_planes = (
        (before + trade_off * float(scored.lost_mm2[row]) - float(scored.gain_mm2[row]), node, table.plane(row), scored.cost(row))
        for row in (candidate.row for candidate in ranked)
    )
    return merge(of_limbs, of_planes, key=itemgetter(0))


def _cut(problem: Problem, offered: Offered, seen: set[tuple[float, ...]]) -> Node | None:
    """The node after a cut; None if it is impossible or its solid is already known."""
    _, node, plane, cost = offered
    child = problem.cut(node, plane, cost) if plane.limbs_mm is None or problem.allowed(node, plane) else None
    if child is None or child.signature in seen:
        return None
    seen.add(child.signature)
    return child


def _find_limbs(problem: Problem) -> list[Plane]:
    """The limbs of the uncut model that save most and can be cut off; among near-equal planes of one limb only the best."""
    node = problem.start
    grid = _limb_grid(problem, problem.bounds_along(problem.limits.directions[::EVERY]))
    candidates = find_limbs(node.remainder, grid, threshold(problem.terms.angle_deg))
    vertices = node.remainder.facets.mesh.vertices
    planes, by_limb, checked = list[Plane](), dict[tuple[int, ...], list[Plane]](), 0
    for row in range(len(candidates.offset_mm)):
        tops = candidates.tops[row][candidates.tops[row] >= 0]
        plane = Plane(grid.directions[candidates.direction[row]], float(candidates.offset_mm[row]), vertices[tops])
        others = by_limb.setdefault(tuple(tops.tolist()), [])
        if any(nearly_equal(plane, other) for other in others):
            continue
        checked += 1
        if problem.allowed(node, plane) and problem.is_clear(node, plane):
            others.append(plane)
            planes.append(plane)
        if len(planes) == MOST_LIMBS or checked == MOST_CHECKED or problem.late():
            break
    return planes


def _limb_grid(problem: Problem, limits: Bounds) -> LimbGrid:
    """Search grid for limbs: the directions and constraints of some bounds, and the least gain of a limb."""
    return LimbGrid(
        directions=limits.directions,
        step_mm=limits.step_mm,
        least_height_mm=limits.least_height_mm,
        keep_mm=limits.keep_mm,
        seam_mm=problem.terms.seam_mm,
        cut_mm2=problem.terms.cut_mm2,
        least_gain_mm2=max(problem.least_gain_mm2, WORTH * problem.root.cost_mm2),
        least_volume_mm3=limits.least_volume_mm3,
        least_interface_mm2=limits.contact_area_mm2,
        fragment=limits.fragment_mm / limits.step_mm,
    )


def search_as_published(
    problem: Problem, ranker: LearnedRanker | None, trace: Trace | None, on_stage: Callable[[int, int, Node], None]
) -> tuple[Node, int]:
    """The best node of the authors' loop, and its number of stages.

    It ends as soon as the beam's best stops improving, keeps twins, and skips the rest once a candidate of a good parent is
    useless. A learned ranker chooses among the first 50 candidates; the best of the classic ranking is pursued as well, so the
    beam holds one more node if the ranker did not choose it. on_stage is called with a stage, the size of its beam and the best
    node.
    """
    best, beam, stage = problem.start, [problem.start], 0
    while problem.continues(stage):
        stage += 1
        tables = [problem.table(node, described=trace is not None or ranker is not None) for node in beam]
        chosen, children = _fill_as_published(problem, ranker, tables)
        if trace is not None:  # nodes of the last stage are not expanded, since the loop ended
            trace.begin_stage([node.signature for node in beam])
            trace.add(list(map(offer, chosen)), [(row, child.signature, child.cost_mm2) for row, child in enumerate(children)])
        highest = min(children, key=lambda node: node.cost_mm2, default=best)
        if highest.cost_mm2 >= best.cost_mm2:
            break
        best, beam = highest, children
        on_stage(stage, len(beam), best)
    return best, stage


def _fill_as_published(
    problem: Problem, ranker: LearnedRanker | None, tables: Sequence[CandidateTable]
) -> tuple[list[RankedCandidate], list[Node]]:
    """The candidates that fill the next beam, best first, and the resulting nodes; infeasible ones are skipped."""
    useless = max(table.saved_mm2 for table in tables) / problem.model.risky_mm2
    classic = iter(rank_classic(tables, np.inf, useless))
    plain = list(islice(classic, 1))
    chosen: list[RankedCandidate] = []
    children: list[Node] = []

    def follow(candidate: RankedCandidate) -> None:
        child = problem.cut_row(candidate.table, candidate.row)
        if child is not None:
            chosen.append(candidate)
            children.append(child)

    offered = chain(plain, classic)
    for candidate in offered if ranker is None else ranker.rank(offered):
        follow(candidate)
        if len(children) == problem.settings.beam_width:
            break
    if ranker is not None and plain and plain[0] not in chosen:
        follow(plain[0])
    return chosen, children
