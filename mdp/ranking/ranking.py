"""Ranking: the scored candidates of nodes in the order of the 2020 paper or by a trade-off, and the shortlist from several
trade-offs for a learned ranker.

Feasibility is checked on demand. Among near-equal planes of one parent only the first counts.

Order of the paper: candidates that leave (almost) nothing risky above their plane come first, then the residual threshold (the
paper's delta) is raised from 1e-4 by factors of 5; within a round the larger accumulated reduction comes first, and from the
second round on only candidates that reduce at least as much as the best so far are taken.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from heapq import merge
from itertools import accumulate, islice, repeat
from math import pi
from operator import mul

import numpy as np

from mdp.mesh import Floats, Ints
from mdp.plane import Plane
from mdp.ranking.candidates import Reason, ScoredCandidates, check
from mdp.ranking.node import Node

FIRST_THRESHOLD, THRESHOLD_FACTOR, ROUNDS = 1e-4, 5.0, 11  # shares of the risky area; the last one is above 1e3
RESIDUAL_THRESHOLDS = np.array(list(accumulate(repeat(THRESHOLD_FACTOR, ROUNDS - 1), mul, initial=FIRST_THRESHOLD)))
SAME_COSINE = 0.95
FIRST_LOOK, LOOK_AHEAD = 8, 128  # rows that are checked together: few while the first ones suffice, then twice as many each time
SORTED_FIRST = 256
UNKNOWN = -1
FEASIBLE = int(Reason.FEASIBLE)  # a plain int, since it is compared a hundred thousand times per search
SHORTLIST_TRADE_OFFS = (2.0, 1.0, 4.0)  # trade-offs of the shortlist; more of them gave no better results
PER_TRADE_OFF = 3  # candidates of a table on the shortlist for each trade-off
EQUAL = 1e-9  # shares of the risky area that differ less are equal up to rounding


@dataclass(frozen=True)
class Model:
    """Measures of a model, to which shares refer."""

    risky_mm2: float
    volume_mm3: float
    radius_mm: float

    @property
    def circle_mm2(self) -> float:
        """Area of the bounding sphere's great circle."""
        return pi * self.radius_mm**2


class CandidateTable:
    """The scored candidates of one node; their feasibility is checked direction by direction, on demand."""

    def __init__(
        self,
        scored: ScoredCandidates,
        node: Node,
        model: Model,
        least_gain_mm2: float = 0.0,
        is_weak: Callable[[Plane], bool] = lambda plane: False,
    ) -> None:
        """least_gain_mm2: candidates with a lower gain count only for parts of the preferred volume; is_weak: whether a feasible
        plane leaves too weak a base, called only when a row's turn comes.
        """
        self.scored, self.limits, self.least_gain_mm2 = scored, scored.limits, least_gain_mm2
        self.node, self.model = node, model
        self.saved_mm2, self.residual_mm2, self.lost_mm2 = node.saved_mm2, node.residual_mm2, node.lost_mm2
        self.check, self._is_weak, self._strong = check, is_weak, set[int]()
        count = len(scored.gain_mm2)
        self.reason = np.full(count, UNKNOWN, np.int32)
        self.volume_mm3: Floats = np.zeros(count)
        self.section_mm2: Floats = np.zeros(count)
        self.contact_area_mm2: Floats = np.zeros(count)
        self._sliver_mm = np.zeros(count)
        self._rankings: dict[float, tuple[list[int], Iterator[int]]] = {}  # the rows known so far, and the iterator over the rest
        self._rounds: list[Ints] = []

    def rows_of_round(self, number: int) -> Ints:
        """The rows whose first residual threshold is that of a round."""
        if not self._rounds:
            rounds = relaxation_rounds(self.scored.lost_mm2 / self.model.risky_mm2)
            order = np.argsort(rounds, kind="stable")
            self._rounds = np.split(order, np.searchsorted(rounds[order], np.arange(1, ROUNDS + 1)))
        return self._rounds[number]

    def rows_by_trade_off(self, trade_off: float) -> Iterator[int]:
        """Feasible rows by gain less trade_off times the loss, best first; among near-equal planes only the first."""
        known, more = self._rankings.setdefault(trade_off, ([], self._rank(trade_off)))
        position = 0
        while True:
            if position == len(known):
                row = next(more, None)
                if row is None:
                    return
                known.append(row)
            yield known[position]
            position += 1

    def _rank(self, trade_off: float) -> Iterator[int]:
        """Iterate over the feasible rows of rows_by_trade_off, sorted and checked only as far as needed."""
        enough = self.scored.gain_mm2 >= self.least_gain_mm2
        cost = np.where(enough, trade_off * self.scored.lost_mm2 - self.scored.gain_mm2, np.inf)
        order: Ints = np.zeros(0, np.int64)
        at, look, planes = 0, FIRST_LOOK, list[Plane]()
        while at < len(order) or len(order) < enough.sum():
            if at == len(order):
                order = _sort_more(cost, int(enough.sum()), order)
            reason = self.reason[order[at : at + SORTED_FIRST]]
            possible = np.flatnonzero((reason == FEASIBLE) | (reason == UNKNOWN))
            if len(possible) == 0:  # usual for most rows: a whole block is skipped at a time
                at += len(reason)
                continue
            at += int(possible[0])
            row = int(order[at])
            plane = self.plane(row)
            if not any(nearly_equal(plane, earlier) for earlier in planes):
                if self.reason[row] == UNKNOWN:
                    self.check_rows(order[at : at + look])
                    look = min(2 * look, LOOK_AHEAD)
                if self.feasible(row):
                    planes.append(plane)
                    yield row
            at += 1

    def check_rows(self, rows: Ints) -> None:
        """Check these rows and all others of the same directions, unless they are known."""
        fresh = rows[self.reason[rows] == UNKNOWN]
        if len(fresh) == 0:
            return
        alike = np.nonzero(np.isin(self.scored.direction, self.scored.direction[fresh]))[0]
        scored, limits = self.scored, self.limits
        checked = self.check(scored.remainder, limits, limits.step_mm, scored.direction[alike], scored.offset_mm[alike])
        self.reason[alike], self.volume_mm3[alike] = checked.reason, checked.volume_mm3
        self.section_mm2[alike], self.contact_area_mm2[alike] = checked.section_mm2, checked.contact_area_mm2
        self._sliver_mm[alike] = checked.fragile_mm

    def feasible(self, row: int) -> bool:
        """Whether a checked row can be cut and leaves a strong enough base."""
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
        """(n, 3) normals of the rows' planes."""
        normals: Floats = self.limits.directions[self.scored.direction[rows]]
        return normals

    def fragile_mm(self, row: int) -> float:
        """Distance of a checked row's plane to fragile regions, mm."""
        return min(float(self._sliver_mm[row]), self.scored.remainder.thin_mm(self.plane(row)))

    def rounds(self, rows: Ints) -> Ints:
        """(n,) first rounds whose residual thresholds admit the rows."""
        return relaxation_rounds(self.scored.lost_mm2[rows] / self.model.risky_mm2)


def _sort_more(cost: Floats, count: int, known: Ints) -> Ints:
    """The rows known to be first by cost, extended to four times their number, at most `count`."""
    wanted = min(count, max(SORTED_FIRST, 4 * len(known)))
    first = np.flatnonzero(cost <= np.partition(cost, wanted - 1)[wanted - 1])
    ordered = first[np.lexsort((first, cost[first]))]
    return np.concatenate([known, ordered[~np.isin(ordered, known)]])


def relaxation_rounds(residual: Floats) -> Ints:
    """(n,) first rounds whose residual thresholds admit candidates with these shares of the risky area left on their parts."""
    return np.searchsorted(RESIDUAL_THRESHOLDS, residual, side="right").astype(np.int32)


def nearly_equal(plane: Plane, other: Plane) -> bool:
    """Whether two planes of one parent are too similar for both to count.

    The authors' rule without their abs() of the cosine, since planes with opposite normals cut off opposite ends. Directions at
    least e above the horizon are at most 180 - 2 e apart, so both rules agree for e above 9.1 degrees (half the angle of
    SAME_COSINE).
    """
    cosine = float(plane.normal @ other.normal)
    return cosine > SAME_COSINE and abs(plane.offset_mm - other.offset_mm) < 2.0 * cosine


@dataclass(frozen=True, eq=False)
class RankedCandidate:
    """A feasible candidate: its table and row."""

    table: CandidateTable
    row: int

    @property
    def round(self) -> int:
        """The first round whose residual threshold admits it."""
        return int(self.table.rounds(np.array([self.row]))[0])


def rank_by_trade_off(tables: Sequence[CandidateTable], trade_off: float, bound_mm2: float) -> Iterator[RankedCandidate]:
    """Feasible candidates by reduction less trade_off times the loss, both accumulated, best first; those with a final cost of
    bound_mm2 or more are left out.
    """

    def rank(index: int, table: CandidateTable) -> Iterator[tuple[float, int, int]]:
        start = table.saved_mm2 - trade_off * table.lost_mm2
        for row in table.rows_by_trade_off(trade_off):
            if table.residual_mm2 + float(table.scored.residual_mm2[row]) < bound_mm2:
                yield trade_off * float(table.scored.lost_mm2[row]) - float(table.scored.gain_mm2[row]) - start, index, row

    for _, index, row in merge(*(rank(index, table) for index, table in enumerate(tables))):
        yield RankedCandidate(tables[index], row)


def shortlist(tables: Sequence[CandidateTable], bound_mm2: float) -> Iterator[RankedCandidate]:
    """Feasible candidates of some tables without duplicates: the first few by several trade-offs, table by table; those with a
    final cost of bound_mm2 or more are left out.

    No single trade-off between saved area and final loss is best on most models, so the shortlist combines the first few of each,
    and few directions have to be swept for them.
    """
    for table in tables:
        rows: dict[int, RankedCandidate] = {}
        for trade_off in SHORTLIST_TRADE_OFFS:
            for candidate in islice(rank_by_trade_off([table], trade_off, bound_mm2), PER_TRADE_OFF):
                rows.setdefault(candidate.row, candidate)
        yield from rows.values()


def rank_classic(
    tables: Sequence[CandidateTable], bound_mm2: float, least_reduction: float = 0.0, preferred_mm3: float = 0.0
) -> Iterator[RankedCandidate]:
    """Feasible candidates in the classic order, best first; those with a final cost of bound_mm2 or more are left out.

    least_reduction: accumulated reduction, a share of the model's risky area, that a candidate must exceed. preferred_mm3: parts
    of at least this volume come before all smaller ones.
    """
    yield from _within_volume(tables, bound_mm2, least_reduction, preferred_mm3, np.inf)
    if preferred_mm3 > 0.0:
        yield from _within_volume(tables, bound_mm2, least_reduction, 0.0, preferred_mm3)


def _within_volume(
    tables: Sequence[CandidateTable], bound_mm2: float, least_reduction: float, least_mm3: float, most_mm3: float
) -> Iterator[RankedCandidate]:
    """Feasible candidates in the classic order whose parts have a volume from least_mm3 to below most_mm3."""
    near: list[list[Plane]] = [[] for _ in tables]
    best, ahead = float(np.nextafter(least_reduction, np.inf)), FIRST_LOOK  # must be exceeded; later bests must only be reached
    for number in range(ROUNDS):
        indices, rows, reduction = _sort_round(tables, number, bound_mm2, best, any_gain=least_mm3 > 0.0)
        for position, (index, row) in enumerate(zip(indices.tolist(), rows.tolist(), strict=True)):
            table = tables[index]
            if table.reason[row] == UNKNOWN:
                soon, ahead = slice(position, position + ahead), min(2 * ahead, LOOK_AHEAD)
                for own in np.unique(indices[soon]):  # all of a table at once, so its directions are swept in parallel
                    tables[own].check_rows(rows[soon][indices[soon] == own])
            if table.reason[row] != FEASIBLE or not least_mm3 <= table.volume_mm3[row] < most_mm3:
                continue
            plane = table.plane(row)
            if not any(nearly_equal(plane, earlier) for earlier in near[index]) and table.feasible(row):
                near[index].append(plane)
                best = max(best, float(reduction[position]))
                yield RankedCandidate(table, row)


def _sort_round(
    tables: Sequence[CandidateTable], number: int, bound_mm2: float, best: float, *, any_gain: bool
) -> tuple[Ints, Ints, Floats]:
    """The candidates that a round admits, with a final cost below bound_mm2 and at least the best reduction so far: (n,) tables,
    rows and reductions, by descending reduction, larger parts first among equals.

    These are few, so they are selected before sorting. any_gain: also candidates that gain enough for large parts only.
    """
    indices: list[tuple[Ints, Ints, Ints]] = []
    values: list[Floats] = []
    for index, table in enumerate(tables):
        scored, rows = table.scored, table.rows_of_round(number)
        reduction = np.round((scored.gain_mm2[rows] + table.saved_mm2) / table.model.risky_mm2 / EQUAL) * EQUAL
        admitted = (reduction >= best) & (scored.residual_mm2[rows] + table.residual_mm2 < bound_mm2)
        admitted &= any_gain | (scored.gain_mm2[rows] >= table.least_gain_mm2)
        rows = rows[admitted]
        indices.append((np.full(len(rows), index, np.int32), rows.astype(np.int32), scored.direction[rows]))
        values.append(np.stack([scored.offset_mm[rows], reduction[admitted]]))
    number_of, row, direction = (np.concatenate(column, dtype=np.int32) for column in zip(*indices, strict=True))
    offset, reduction = np.concatenate(values, axis=1)
    order = np.lexsort((direction, number_of, offset, -reduction))
    return number_of[order], row[order], reduction[order]
