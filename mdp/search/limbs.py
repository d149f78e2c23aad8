"""Limbs: a search beside the beam's whose cuts may take single limbs off and leave the others standing.

The beam's cuts take all that lies above their planes. Letting single limbs compete with them for its slots can end worse, so
limbs have a search of their own. It chooses among few planes: the limbs that would save something of the uncut model, the head
being clear of what stands there, and the planes that the beam's ranking puts first. What they save of a node is summed up anew.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import merge
from itertools import islice

import numpy as np

from mdp.mesh import Floats
from mdp.overhang import threshold
from mdp.plane import Plane
from mdp.ranking.candidate_table import CandidateTable, nearly_equal
from mdp.ranking.candidates import gain_mm2, lost_mm2, residual_mm2
from mdp.ranking.ranking import rank_by_trade_off
from mdp.search.node import Node
from mdp.search.problem import Problem
from mdp.sweep.limbs import find_limbs

EVERY = 4  # sampled directions to one in which limbs are looked for
WORTH = 0.005  # share of the uncut model's cost that a limb must save
MOST_LIMBS, MOST_CHECKED = 24, 64  # planes of limbs that are kept, and that are checked for it
MOST_PLANES = 16  # planes of the beam's ranking that are looked at, by each trade-off
TRADE_OFFS = (4.0, 1.0)  # a slot each, see mdp.search.beam
MOST_TRIED = 16  # limbs, and planes, that a slot tries at a node before it gives up


def search_limbs(problem: Problem, table: CandidateTable) -> list[Node]:
    """The best node after every stage of a search that may cut single limbs off; none where no limb is worth a cut.

    table: the candidates of the node that the search begins with.
    """
    limbs = _find_limbs(problem)
    if not limbs:
        return []
    rows = [row for trade_off in TRADE_OFFS for row in islice(table.rows_by_trade_off(trade_off), MOST_PLANES)]
    directions = problem.limits.directions[np.unique(table.scored.direction[rows])]
    limits, seen, found = problem.bounds_along(directions), set[tuple[float, ...]](), list[Node]()
    nodes, best = [problem.start], problem.start
    while nodes and not problem.full(nodes[0]) and not problem.late():
        offers = [_Offers.of(problem, node, limbs, problem.table(node, limits=limits)) for node in nodes]
        children = []
        for trade_off in TRADE_OFFS:
            ranked = merge(*(offer.rank(trade_off, best.cost_mm2) for offer in offers), key=lambda ranked: ranked.key)
            child = next((child for each in ranked if (child := _cut(problem, each, seen)) is not None), None)
            children += [] if child is None else [child]
        nodes = children
        best = min((best, *nodes), key=lambda node: node.cost_mm2)
        found.append(best)
    return found


@dataclass(frozen=True, eq=False)
class _Ranked:
    """A cut that may be made: key, the less the better; row of the node's table, None: of limbs."""

    key: float
    node: Node
    plane: Plane
    table: CandidateTable
    row: int | None


@dataclass(frozen=True, eq=False)
class _Offers:
    """What may be cut off a node: limbs with what each gains, loses and costs for ever, (r,), and a table of planes."""

    problem: Problem
    node: Node
    limbs: Sequence[Plane]
    gain_mm2: Floats
    lost_mm2: Floats
    residual_mm2: Floats
    table: CandidateTable

    @classmethod
    def of(cls, problem: Problem, node: Node, limbs: Sequence[Plane], table: CandidateTable) -> "_Offers":
        sums = problem.limb_sums(node, limbs)
        residual = residual_mm2(sums, problem.terms)
        gain = np.where(sums.exists & ~sums.alone, gain_mm2(sums, residual), -np.inf)
        return cls(problem, node, limbs, gain, lost_mm2(sums, residual), residual, table)

    def rank(self, trade_off: float, bound_mm2: float) -> Iterator[_Ranked]:
        """The cuts by what they and those before gain, less trade_off times what they lose; those that would leave bound_mm2 or
        more for ever are left out."""
        node, scored = self.node, self.table.scored
        before = trade_off * node.lost_mm2 - (self.problem.root.cost_mm2 - node.cost_mm2)
        keys = before + trade_off * self.lost_mm2 - self.gain_mm2
        good = (self.gain_mm2 >= self.problem.least_gain_mm2) & (node.residual_mm2 + self.residual_mm2 < bound_mm2)
        order = [row for row in np.argsort(keys, kind="stable") if good[row]][:MOST_TRIED]
        of_limbs = (_Ranked(float(keys[row]), node, self.limbs[row], self.table, None) for row in order)
        rows = (ranked.row for ranked in islice(rank_by_trade_off([self.table], trade_off, bound_mm2), MOST_TRIED))
        of_planes = (
            _Ranked(
                before + trade_off * float(scored.lost_mm2[row]) - float(scored.gain_mm2[row]),
                node,
                self.table.plane(row),
                self.table,
                row,
            )
            for row in rows
        )
        return merge(of_limbs, of_planes, key=lambda ranked: ranked.key)


def _cut(problem: Problem, ranked: _Ranked, seen: set[tuple[float, ...]]) -> Node | None:
    """The node after a cut, where it can be made and leads to none that was seen."""
    if ranked.row is not None:
        child = problem.cut(ranked.node, ranked.plane, ranked.table.scored.cost(ranked.row))
    elif problem.allowed(ranked.node, ranked.plane):
        child = problem.cut(ranked.node, ranked.plane)
    else:
        return None
    if child is None or child.signature in seen:
        return None
    seen.add(child.signature)
    return child


def _find_limbs(problem: Problem) -> list[Plane]:
    """The limbs that save most of the uncut model and can be cut off it, of near-equal planes of one limb the best."""
    node, limits = problem.start, problem.limits
    grid = problem.limb_grid(problem.bounds_along(limits.directions[::EVERY]), WORTH * problem.root.cost_mm2)
    candidates, vertices = (
        find_limbs(node.remainder, grid, threshold(problem.terms.angle_deg)),
        node.remainder.facets.mesh.vertices,
    )
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
        if len(planes) == MOST_LIMBS or checked == MOST_CHECKED:
            break
    return planes
