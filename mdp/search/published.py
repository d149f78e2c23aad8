"""Published: the authors' own loop of 2020, for comparisons and for records on the paper's terms."""

from collections.abc import Callable, Sequence
from itertools import chain, islice

import numpy as np

from mdp.ranking.candidate_table import CandidateTable
from mdp.ranking.ranker import Ranker
from mdp.ranking.ranking import RankedCandidate, rank_classic
from mdp.ranking.record import Child, Trace, offer
from mdp.search.node import Node
from mdp.search.problem import Problem


def search_as_published(
    problem: Problem,
    ranker: Ranker,
    continues: Callable[[int], bool],
    trace: Trace | None,
    on_stage: Callable[[int, int, Node], None],
) -> tuple[Node, int]:
    """The best node of the authors' loop, and after how many stages.

    It ends as soon as the beam's best does not rise, keeps twins, and stops looking at candidates once one of a good parent
    is useless. A learned ranker chooses among the first 50 candidates; the plain best is followed beside its choice, so the beam
    holds one node more where it was not chosen. continues: whether there is a stage after a number of them; on_stage is told of a
    stage, its beam and the best node.
    """
    best, beam, stage = problem.start, [problem.start], 0
    while continues(stage):
        stage += 1
        tables = [problem.table(node, described=trace is not None or ranker.learned) for node in beam]
        chosen, children = _fill(problem, ranker, beam, tables)
        if trace is not None:
            _record(trace, beam, tables, chosen, children)
        highest = min(children, key=lambda node: node.cost_mm2, default=best)
        if highest.cost_mm2 >= best.cost_mm2:
            break
        best, beam = highest, children
        on_stage(stage, len(beam), best)
    return best, stage


def _fill(
    problem: Problem, ranker: Ranker, beam: Sequence[Node], tables: Sequence[CandidateTable]
) -> tuple[list[RankedCandidate], list[Node]]:
    """The candidates that fill the next beam, best first, and what they lead to; what cannot be cut is passed over."""
    useless = max(table.saved_mm2 for table in tables) / problem.model.risky_mm2
    classic = iter(rank_classic(tables, problem.model.risky_mm2, np.inf, useless))
    plain = list(islice(classic, 1))
    chosen: list[RankedCandidate] = []
    children: list[Node] = []

    def follow(candidate: RankedCandidate) -> None:
        table, row = tables[candidate.table], candidate.row
        child = problem.cut(beam[candidate.table], table.plane(row), table.scored.cost(row))
        if child is not None:
            chosen.append(candidate)
            children.append(child)

    for candidate in ranker.rank(chain(plain, classic), tables):
        follow(candidate)
        if len(children) == problem.settings.beam_width:
            break
    if ranker.learned and plain and plain[0] not in chosen:
        follow(plain[0])
    return chosen, children


def _record(
    trace: Trace,
    beam: Sequence[Node],
    tables: Sequence[CandidateTable],
    chosen: Sequence[RankedCandidate],
    children: Sequence[Node],
) -> None:
    """Put a stage on record: the candidates that filled the beam. Nodes of the last stage are not expanded, the loop ended."""
    trace.begin_stage([node.signature for node in beam])
    offers = [offer(beam[candidate.table].signature, tables[candidate.table], candidate) for candidate in chosen]
    trace.add(offers, [Child(row, child.signature, child.cost_mm2) for row, child in enumerate(children)])
