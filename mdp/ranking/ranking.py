"""Ranking: the scored candidates of several nodes in the order of the 2020 paper or by a trade-off, checked as they come.

Order of the paper: candidates that leave (almost) nothing risky above their plane come first, then the residual threshold (the
paper's delta) is raised from 1e-4 by factors of 5; within a round the larger accumulated reduction comes first, and from the
second round on only candidates that reduce at least as much as the best so far are taken. Of near-equal planes of one parent
only the first counts.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from heapq import merge
from itertools import accumulate, repeat
from operator import mul

import numpy as np

from mdp.mesh import Floats, Ints
from mdp.plane import Plane
from mdp.ranking.candidates import Bounds, Feasibility, Reason, ScoredCandidates
from mdp.ranking.features import Model, Situation

FIRST_THRESHOLD, THRESHOLD_FACTOR, ROUNDS = 1e-4, 5.0, 11  # shares of the risky area; the last one is above 1e3
RESIDUAL_THRESHOLDS = np.array(list(accumulate(repeat(THRESHOLD_FACTOR, ROUNDS - 1), mul, initial=FIRST_THRESHOLD)))
SAME_COSINE = 0.95
FIRST_LOOK, LOOK_AHEAD = 8, 128  # rows that are checked together: few as long as the first ones will do, then twice as many
EQUAL = 1e-9  # shares of the risky area that differ less are equal but for rounding
SORTED_FIRST = 256
UNKNOWN = -1
FEASIBLE = int(Reason.FEASIBLE)  # a number, for it is compared a hundred thousand times a search


class CandidateTable:
    """The scored candidates of one node; whether they can be cut is checked direction by direction, when it is asked for."""

    def __init__(
        self,
        scored: ScoredCandidates,
        limits: Bounds,
        situation: Situation,
        check: Callable[[Ints, Floats], Feasibility],
        least_gain_mm2: float = 0.0,
        is_weak: Callable[[Plane], bool] = lambda plane: False,
    ) -> None:
        """least_gain_mm2: what gains less is for parts of the preferred volume only; is_weak: whether a plane that can be cut
        leaves too weak a base, asked for only where a row's turn comes."""
        self.scored: ScoredCandidates = scored
        self.limits: Bounds = limits
        self.least_gain_mm2 = least_gain_mm2
        self.situation: Situation = situation
        self.saved_mm2: float = situation.saved_mm2
        self.residual_mm2: float = situation.residual_mm2
        self._check, self._is_weak, self._strong = check, is_weak, set[int]()
        count = len(scored.gain_mm2)
        self.reason = np.full(count, UNKNOWN, np.int32)
        self.volume_mm3: Floats = np.zeros(count)
        self.section_mm2: Floats = np.zeros(count)
        self.contact_area_mm2: Floats = np.zeros(count)
        self._sliver_mm = np.zeros(count)
        self._rankings: dict[float, _TradeOffRanking] = {}
        self._rounds: list[Ints] = []

    @property
    def model(self) -> Model:
        """What the features are measured against."""
        return self.situation.model

    def rows_of_round(self, number: int, risky_mm2: float) -> Ints:
        """The rows that come below the residual threshold in this round first; risky_mm2: what the threshold is a share of."""
        if not self._rounds:
            rounds = relaxation_rounds(self.scored.residual_mm2 / risky_mm2)
            order = np.argsort(rounds, kind="stable")
            self._rounds = np.split(order, np.searchsorted(rounds[order], np.arange(1, ROUNDS + 1)))
        return self._rounds[number]

    def rows_by_trade_off(self, trade_off: float) -> Iterator[int]:
        """Feasible rows by gain less trade_off times residual, best first; of near-equal planes only the first."""
        if trade_off not in self._rankings:
            self._rankings[trade_off] = _TradeOffRanking(self, trade_off)
        ranking, position = self._rankings[trade_off], 0
        while (row := ranking.row_at(position)) is not None:
            yield row
            position += 1

    def check_rows(self, rows: Ints) -> None:
        """Check these rows and all others of the same directions, where that is not known."""
        fresh = rows[self.reason[rows] == UNKNOWN]
        if len(fresh) == 0:
            return
        alike = np.nonzero(np.isin(self.scored.direction, self.scored.direction[fresh]))[0]
        checked = self._check(self.scored.direction[alike], self.scored.offset_mm[alike])
        self.reason[alike], self.volume_mm3[alike] = checked.reason, checked.volume_mm3
        self.section_mm2[alike], self.contact_area_mm2[alike] = checked.section_mm2, checked.contact_area_mm2
        self._sliver_mm[alike] = checked.fragile_mm

    def feasible(self, row: int) -> bool:
        """Whether a checked row can be cut, its base strong enough."""
        if self.reason[row] == FEASIBLE and row not in self._strong:
            if self._is_weak(self.plane(row)):
                self.reason[row] = Reason.WEAK
            else:
                self._strong.add(row)
        return bool(self.reason[row] == FEASIBLE)

    def plane(self, row: int) -> Plane:
        """The plane of a row."""
        return Plane(self.limits.directions[self.scored.direction[row]], float(self.scored.offset_mm[row]))

    def normals(self, rows: Ints) -> Floats:
        """(n, 3) the normals of the rows' planes."""
        normals: Floats = self.limits.directions[self.scored.direction[rows]]
        return normals

    def fragile_mm(self, row: int) -> float:
        """Distance of a checked row's plane to fragile regions."""
        return min(float(self._sliver_mm[row]), self.scored.remainder.thin_mm(self.plane(row)))

    def rounds(self, rows: Ints) -> Ints:
        """(n,) the rounds whose residual thresholds let the rows in."""
        return relaxation_rounds(self.scored.residual_mm2[rows] / self.model.risky_mm2)


class _TradeOffRanking:
    """The feasible rows of a table by one trade-off, sorted and checked as far as they are asked for."""

    def __init__(self, table: CandidateTable, trade_off: float) -> None:
        self._table = table
        enough = table.scored.gain_mm2 >= table.least_gain_mm2
        self._cost = np.where(enough, trade_off * table.scored.residual_mm2 - table.scored.gain_mm2, np.inf)
        self._count = int(enough.sum())
        self._order: Ints = np.zeros(0, np.int64)
        self._next, self._ahead = 0, FIRST_LOOK
        self._feasible: list[int] = []
        self._planes: list[Plane] = []

    def row_at(self, position: int) -> int | None:
        """The row at a position of the ranking; None when there are not so many."""
        while len(self._feasible) <= position:
            self._skip_infeasible()
            if self._next < len(self._order):
                self._append_if_feasible(int(self._order[self._next]))
                self._next += 1
            elif not self._sort_more():
                return None
        return self._feasible[position]

    def _skip_infeasible(self) -> None:
        """Go on to the next row that is not known to be infeasible; most are, so they are passed over many at a time."""
        while self._next < len(self._order):
            reason = self._table.reason[self._order[self._next : self._next + SORTED_FIRST]]
            possible = np.flatnonzero((reason == FEASIBLE) | (reason == UNKNOWN))
            if len(possible) > 0:
                self._next += int(possible[0])
                return
            self._next += len(reason)

    def _sort_more(self) -> bool:
        """Sort four times as many rows as before; False when all are sorted."""
        known, count = len(self._order), self._count
        if known == count:
            return False
        wanted = min(count, max(SORTED_FIRST, 4 * known))
        first = np.flatnonzero(self._cost <= np.partition(self._cost, wanted - 1)[wanted - 1])
        ordered = first[np.lexsort((first, self._cost[first]))]
        self._order = np.concatenate([self._order, ordered[~np.isin(ordered, self._order)]])
        return True

    def _append_if_feasible(self, row: int) -> None:
        plane = self._table.plane(row)
        if any(nearly_equal(plane, other) for other in self._planes):
            return
        if self._table.reason[row] == UNKNOWN:
            self._table.check_rows(self._order[self._next : self._next + self._ahead])
            self._ahead = min(2 * self._ahead, LOOK_AHEAD)
        if self._table.feasible(row):
            self._feasible.append(row)
            self._planes.append(plane)


@dataclass(frozen=True, eq=False)
class RankedCandidate:
    """A feasible candidate: the table and row it comes from, and the round whose residual threshold let it in."""

    table: int
    row: int
    round: int


def rank_by_trade_off(tables: Sequence[CandidateTable], trade_off: float, bound_mm2: float) -> Iterator[RankedCandidate]:
    """Feasible candidates by reduction less trade_off times residual, both accumulated, best first; those that would leave
    bound_mm2 or more for ever are left out."""

    def rank(index: int, table: CandidateTable) -> Iterator[tuple[float, int, int]]:
        start = table.saved_mm2 - trade_off * table.residual_mm2
        for row in table.rows_by_trade_off(trade_off):
            gain, residual = float(table.scored.gain_mm2[row]), float(table.scored.residual_mm2[row])
            if table.residual_mm2 + residual < bound_mm2:
                yield trade_off * residual - gain - start, index, row

    for _, index, row in merge(*(rank(index, table) for index, table in enumerate(tables))):
        yield RankedCandidate(index, row, 0)


def rank_classic(
    tables: Sequence[CandidateTable], risky_mm2: float, bound_mm2: float, least_reduction: float = 0.0, preferred_mm3: float = 0.0
) -> Iterator[RankedCandidate]:
    """Feasible candidates, best first; those that would leave bound_mm2 or more for ever are left out.

    risky_mm2: the model's risky area, which the residual thresholds and the reductions are shares of. least_reduction:
    accumulated reduction that a candidate must exceed. preferred_mm3: parts of at least this volume come before all smaller
    ones.
    """
    ranking = _ClassicRanking(tables, risky_mm2, bound_mm2, least_reduction)
    yield from ranking.within_volume(preferred_mm3, np.inf)
    if preferred_mm3 > 0.0:
        yield from ranking.within_volume(0.0, preferred_mm3)


@dataclass(frozen=True, eq=False)
class _Round:
    """Candidates of all tables side by side, by reduction, larger parts first among equals."""

    table: Ints
    row: Ints
    reduction: Floats


@dataclass(frozen=True, eq=False)
class _ClassicRanking:
    """The candidates of some tables that would leave less than bound_mm2 for ever and reduce more than least_reduction."""

    tables: Sequence[CandidateTable]
    risky_mm2: float
    bound_mm2: float
    least_reduction: float

    def within_volume(self, least_mm3: float, most_mm3: float) -> Iterator[RankedCandidate]:
        """The feasible ones whose parts have a volume from least_mm3 to below most_mm3."""
        near: list[list[Plane]] = [[] for _ in self.tables]
        best, ahead = -np.inf, FIRST_LOOK
        for number in range(ROUNDS):
            sorted_round = self._sort_round(number, best, any_gain=least_mm3 > 0.0)
            for position, (index, row) in enumerate(zip(sorted_round.table.tolist(), sorted_round.row.tolist(), strict=True)):
                table = self.tables[index]
                if table.reason[row] == UNKNOWN:
                    soon, ahead = slice(position, position + ahead), min(2 * ahead, LOOK_AHEAD)
                    self._check_ahead(sorted_round.table[soon], sorted_round.row[soon])
                if table.reason[row] != FEASIBLE or not least_mm3 <= table.volume_mm3[row] < most_mm3:
                    continue
                plane = table.plane(row)
                if not any(nearly_equal(plane, other) for other in near[index]) and table.feasible(row):
                    near[index].append(plane)
                    best = max(best, float(sorted_round.reduction[position]))
                    yield RankedCandidate(index, row, number)

    def _sort_round(self, number: int, best: float, any_gain: bool) -> _Round:
        """What a round lets in that reduces at least as much as the best so far; few of all, so they are chosen before anything
        is sorted. any_gain: also what gains enough for large parts only."""
        indices: list[tuple[Ints, Ints, Ints]] = []
        values: list[Floats] = []
        for index, table in enumerate(self.tables):
            scored, rows = table.scored, table.rows_of_round(number, self.risky_mm2)
            reduction = np.round((scored.gain_mm2[rows] + table.saved_mm2) / self.risky_mm2 / EQUAL) * EQUAL
            admitted = (reduction >= best) & (reduction > self.least_reduction)
            admitted &= scored.residual_mm2[rows] + table.residual_mm2 < self.bound_mm2
            admitted &= any_gain | (scored.gain_mm2[rows] >= table.least_gain_mm2)
            rows = rows[admitted]
            indices.append((np.full(len(rows), index, np.int32), rows.astype(np.int32), scored.direction[rows]))
            values.append(np.stack([scored.offset_mm[rows], reduction[admitted]]))
        number_of, row, direction = (np.concatenate(column, dtype=np.int32) for column in zip(*indices, strict=True))
        offset, reduction = np.concatenate(values, axis=1)
        order = np.lexsort((direction, number_of, offset, -reduction))
        return _Round(number_of[order], row[order], reduction[order])

    def _check_ahead(self, table: Ints, row: Ints) -> None:
        """Check these candidates of every table in one go, all their directions in parallel."""
        for index in np.unique(table):
            self.tables[index].check_rows(row[table == index])


def relaxation_round(residual: float) -> int:
    """The round whose residual threshold lets in a candidate with this share of the risky area left on its part."""
    return int(relaxation_rounds(np.array([residual]))[0])


def relaxation_rounds(residual: Floats) -> Ints:
    """(n,) the same for many."""
    return np.searchsorted(RESIDUAL_THRESHOLDS, residual, side="right").astype(np.int32)


def nearly_equal(plane: Plane, other: Plane) -> bool:
    """Whether two planes of one parent are too alike for both to count.

    The authors' rule but for its abs() of the cosine: planes that look opposite ways cut off opposite ends. Directions at least
    e over the platform are at most 180 - 2 e apart, so from 9.1 degrees on (half the angle of SAME_COSINE) both rules are one.
    """
    cosine = float(plane.normal @ other.normal)
    return cosine > SAME_COSINE and abs(plane.offset_mm - other.offset_mm) < 2.0 * cosine
