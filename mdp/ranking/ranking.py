"""Ranking: the scored candidates of several nodes in the order of the 2020 paper or by a trade-off, checked as they come; and the
shortlist of several trade-offs that a learned ranker chooses from.

Order of the paper: candidates that leave (almost) nothing risky above their plane come first, then the residual threshold (the
paper's delta) is raised from 1e-4 by factors of 5; within a round the larger accumulated reduction comes first, and from the
second round on only candidates that reduce at least as much as the best so far are taken. Only the first of several near-equal
planes of one parent counts.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import merge
from itertools import islice

import numpy as np

from mdp.mesh import Floats, Ints
from mdp.plane import Plane
from mdp.ranking.candidate_table import FEASIBLE, FIRST_LOOK, LOOK_AHEAD, ROUNDS, UNKNOWN, CandidateTable, nearly_equal

LISTED = (2.0, 1.0, 4.0)  # trade-offs of the shortlist; more of them did not end better
EACH = 3  # candidates of a table on the shortlist by each of them
EQUAL = 1e-9  # shares of the risky area that differ less are equal but for rounding


@dataclass(frozen=True, eq=False)
class RankedCandidate:
    """A feasible candidate: the table and row it comes from, and the round whose residual threshold let it in."""

    table: int
    row: int
    round: int


def rank_by_trade_off(tables: Sequence[CandidateTable], trade_off: float, bound_mm2: float) -> Iterator[RankedCandidate]:
    """Feasible candidates by reduction less trade_off times what is lost, both accumulated, best first; those that would leave
    bound_mm2 or more for ever are left out."""

    def rank(index: int, table: CandidateTable) -> Iterator[tuple[float, int, int]]:
        start = table.saved_mm2 - trade_off * table.lost_mm2
        for row in table.rows_by_trade_off(trade_off):
            if table.residual_mm2 + float(table.scored.residual_mm2[row]) < bound_mm2:
                yield trade_off * float(table.scored.lost_mm2[row]) - float(table.scored.gain_mm2[row]) - start, index, row

    for _, index, row in merge(*(rank(index, table) for index, table in enumerate(tables))):
        yield RankedCandidate(index, row, 0)


def shortlist(tables: Sequence[CandidateTable], bound_mm2: float) -> Iterator[RankedCandidate]:
    """Feasible candidates of some tables, each once: the first few by several trade-offs, table by table; those that would leave
    bound_mm2 or more for ever are left out.

    No single trade-off between what is made safe and what is left risky for ever is best on most models, so the first few of each
    stand side by side, and few directions have to be swept for them.
    """
    for number, table in enumerate(tables):
        rows: dict[int, RankedCandidate] = {}
        for trade_off in LISTED:
            for candidate in islice(rank_by_trade_off([table], trade_off, bound_mm2), EACH):
                rows.setdefault(candidate.row, RankedCandidate(number, candidate.row, candidate.round))
        yield from rows.values()


def rank_classic(
    tables: Sequence[CandidateTable], bound_mm2: float, least_reduction: float = 0.0, preferred_mm3: float = 0.0
) -> Iterator[RankedCandidate]:
    """Feasible candidates, best first; those that would leave bound_mm2 or more for ever are left out.

    least_reduction: accumulated reduction, a share of the model's risky area, that a candidate must exceed. preferred_mm3: parts
    of at least this volume come before all smaller ones.
    """
    ranking = _ClassicRanking(tables, bound_mm2, least_reduction)
    yield from ranking.within_volume(preferred_mm3, np.inf)
    if preferred_mm3 > 0.0:
        yield from ranking.within_volume(0.0, preferred_mm3)


@dataclass(frozen=True, eq=False)
class _ClassicRanking:
    """The candidates of some tables that would leave less than bound_mm2 for ever and reduce more than least_reduction."""

    tables: Sequence[CandidateTable]
    bound_mm2: float
    least_reduction: float

    def within_volume(self, least_mm3: float, most_mm3: float) -> Iterator[RankedCandidate]:
        """The feasible ones whose parts have a volume from least_mm3 to below most_mm3."""
        near: list[list[Plane]] = [[] for _ in self.tables]
        best, ahead = -np.inf, FIRST_LOOK
        for number in range(ROUNDS):
            indices, rows, reduction = self._sort_round(number, best, any_gain=least_mm3 > 0.0)
            for position, (index, row) in enumerate(zip(indices.tolist(), rows.tolist(), strict=True)):
                table = self.tables[index]
                if table.reason[row] == UNKNOWN:
                    soon, ahead = slice(position, position + ahead), min(2 * ahead, LOOK_AHEAD)
                    for own in np.unique(indices[soon]):  # of every table in one go, all their directions in parallel
                        self.tables[own].check_rows(rows[soon][indices[soon] == own])
                if table.reason[row] != FEASIBLE or not least_mm3 <= table.volume_mm3[row] < most_mm3:
                    continue
                plane = table.plane(row)
                if not any(nearly_equal(plane, earlier) for earlier in near[index]) and table.feasible(row):
                    near[index].append(plane)
                    best = max(best, float(reduction[position]))
                    yield RankedCandidate(index, row, number)

    def _sort_round(self, number: int, best: float, any_gain: bool) -> tuple[Ints, Ints, Floats]:
        """What a round lets in that reduces at least as much as the best so far, by reduction, larger parts first among equals:
        (n,) tables, rows and reductions. Few of all, so they are chosen before anything is sorted. any_gain: also what gains
        enough for large parts only."""
        indices: list[tuple[Ints, Ints, Ints]] = []
        values: list[Floats] = []
        for index, table in enumerate(self.tables):
            scored, rows = table.scored, table.rows_of_round(number)
            reduction = np.round((scored.gain_mm2[rows] + table.saved_mm2) / table.model.risky_mm2 / EQUAL) * EQUAL
            admitted = (reduction >= best) & (reduction > self.least_reduction)
            admitted &= scored.residual_mm2[rows] + table.residual_mm2 < self.bound_mm2
            admitted &= any_gain | (scored.gain_mm2[rows] >= table.least_gain_mm2)
            rows = rows[admitted]
            indices.append((np.full(len(rows), index, np.int32), rows.astype(np.int32), scored.direction[rows]))
            values.append(np.stack([scored.offset_mm[rows], reduction[admitted]]))
        number_of, row, direction = (np.concatenate(column, dtype=np.int32) for column in zip(*indices, strict=True))
        offset, reduction = np.concatenate(values, axis=1)
        order = np.lexsort((direction, number_of, offset, -reduction))
        return number_of[order], row[order], reduction[order]
