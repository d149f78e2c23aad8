"""Pool: the candidates of several nodes in the order of the 2020 paper or by a trade-off, each checked when its turn comes.

Order of the paper: candidates that leave (almost) nothing risky above their plane come first, then delta is relaxed from 1e-4
by factors of 5; within a round the larger accumulated reduction comes first, and from the second round on only candidates that
reduce at least as much as the best so far are taken. Near-equal planes of one parent take one place.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from heapq import merge
from itertools import accumulate, repeat
from operator import mul

import numpy as np

from mdp.candidates import Bounds, Checked, Reason, Worth
from mdp.features import Plan
from mdp.mesh import Floats, Ints
from mdp.plane import Plane

FIRST_DELTA, DELTA_FACTOR, ROUNDS = 1e-4, 5.0, 11  # the last delta is above 1e3
DELTAS = np.array(list(accumulate(repeat(DELTA_FACTOR, ROUNDS - 1), mul, initial=FIRST_DELTA)))
SAME_COSINE = 0.95
LOOK_AHEAD = 128
EQUAL = 1e-9  # shares of the risky area that differ less are equal but for rounding
SORTED_FIRST = 256
UNKNOWN = -1
FEASIBLE = int(Reason.FEASIBLE)  # a number, for it is compared a hundred thousand times a search


class Table:
    """The candidates of one node that are worth a cut; whether they can be cut is looked up direction by direction."""

    def __init__(
        self,
        worth: Worth,
        limits: Bounds,
        saved_mm2: float,
        residual_mm2: float,
        check: Callable[[Ints, Floats], Checked],
        least_gain_mm2: float = 0.0,
    ) -> None:
        """least_gain_mm2: what gains less is for parts of the preferred volume only."""
        self.worth, self.limits, self.least_gain_mm2 = worth, limits, least_gain_mm2
        self.saved_mm2, self.residual_mm2 = saved_mm2, residual_mm2
        self._check = check
        self.reason = np.full(len(worth.gain_mm2), UNKNOWN, np.int32)
        self.volume_mm3, self._fragile_mm = np.zeros(len(worth.gain_mm2)), np.zeros(len(worth.gain_mm2))
        self._rankings: dict[float, _Ranking] = {}
        self._rounds: list[Ints] = []

    def let_in(self, number: int, risky_mm2: float) -> Ints:
        """The rows that a round of the relaxation lets in; risky_mm2: what delta is a share of."""
        if not self._rounds:
            rounds = np.searchsorted(DELTAS, self.worth.residual_mm2 / risky_mm2, side="right")
            order = np.argsort(rounds, kind="stable")
            self._rounds = np.split(order, np.searchsorted(rounds[order], np.arange(1, ROUNDS + 1)))
        return self._rounds[number]

    def ranked(self, trade_off: float) -> Iterator[int]:
        """Feasible rows by gain less trade_off times residual, best first; near-equal planes take one place."""
        if trade_off not in self._rankings:
            self._rankings[trade_off] = _Ranking(self, trade_off)
        ranking, place = self._rankings[trade_off], 0
        while (row := ranking.at(place)) is not None:
            yield row
            place += 1

    def look(self, rows: Ints) -> None:
        """Check these rows and all others of the same directions, where that is not known."""
        fresh = rows[self.reason[rows] == UNKNOWN]
        if len(fresh) == 0:
            return
        mine = np.nonzero(np.isin(self.worth.direction, self.worth.direction[fresh]))[0]
        found = self._check(self.worth.direction[mine], self.worth.offset_mm[mine])
        self.reason[mine], self.volume_mm3[mine], self._fragile_mm[mine] = found.reason, found.volume_mm3, found.fragile_mm

    def plane(self, row: int) -> Plane:
        """The plane of a row."""
        return Plane(self.limits.directions[self.worth.direction[row]], float(self.worth.offset_mm[row]))

    def plan(self, row: int) -> Plan:
        """The numbers of a checked row."""
        worth = self.worth
        return Plan(
            gain_mm2=float(worth.gain_mm2[row]),
            residual_mm2=float(worth.residual_mm2[row]),
            volume_mm3=float(self.volume_mm3[row]),
            above_platform_mm=float(worth.offset_mm[row] - self.limits.least_offset_mm[worth.direction[row]]),
            fragile_mm=min(float(self._fragile_mm[row]), worth.remainder.thin_mm(self.plane(row))),
            saved_before_mm2=self.saved_mm2,
            residual_before_mm2=self.residual_mm2,
        )


class _Ranking:
    """The feasible rows of a table by one trade-off, found as far as they are asked for."""

    def __init__(self, table: Table, trade_off: float) -> None:
        self._table = table
        enough = table.worth.gain_mm2 >= table.least_gain_mm2
        self._cost = np.where(enough, trade_off * table.worth.residual_mm2 - table.worth.gain_mm2, np.inf)
        self._count = int(enough.sum())
        self._order: Ints = np.zeros(0, np.int64)
        self._next = 0
        self._found: list[int] = []
        self._planes: list[Plane] = []

    def at(self, place: int) -> int | None:
        """The row at a place; None when there are not so many."""
        while len(self._found) <= place:
            if self._next == len(self._order) and not self._more():
                return None
            self._take(int(self._order[self._next]))
            self._next += 1
        return self._found[place]

    def _more(self) -> bool:
        """Sort four times as many rows as before; False when all are sorted."""
        known, count = len(self._order), self._count
        if known == count:
            return False
        wanted = min(count, max(SORTED_FIRST, 4 * known))
        first = np.flatnonzero(self._cost <= np.partition(self._cost, wanted - 1)[wanted - 1])
        ordered = first[np.lexsort((first, self._cost[first]))]
        self._order = np.concatenate([self._order, ordered[~np.isin(ordered, self._order)]])
        return True

    def _take(self, row: int) -> None:
        plane = self._table.plane(row)
        if any(same(plane, other) for other in self._planes):
            return
        if self._table.reason[row] == UNKNOWN:
            self._table.look(self._order[self._next : self._next + LOOK_AHEAD])
        if self._table.reason[row] == FEASIBLE:
            self._found.append(row)
            self._planes.append(plane)


@dataclass(frozen=True, eq=False)
class Entry:
    """A feasible candidate: the table and row it comes from, and the round of relaxation that let it in."""

    table: int
    row: int
    round: int


def traded(tables: Sequence[Table], trade_off: float, bound_mm2: float) -> Iterator[Entry]:
    """Feasible candidates by reduction less trade_off times residual, both accumulated, best first; those that would leave
    bound_mm2 or more for ever are left out."""

    def of(index: int, table: Table) -> Iterator[tuple[float, int, int]]:
        start = table.saved_mm2 - trade_off * table.residual_mm2
        for row in table.ranked(trade_off):
            gain, residual = float(table.worth.gain_mm2[row]), float(table.worth.residual_mm2[row])
            if table.residual_mm2 + residual < bound_mm2:
                yield trade_off * residual - gain - start, index, row

    for _, index, row in merge(*(of(index, table) for index, table in enumerate(tables))):
        yield Entry(index, row, 0)


def entries(
    tables: Sequence[Table], risky_mm2: float, bound_mm2: float, least_reduction: float = 0.0, preferred_mm3: float = 0.0
) -> Iterator[Entry]:
    """Feasible candidates, best first; those that would leave bound_mm2 or more for ever are left out.

    risky_mm2: the model's risky area, which delta and the reductions are shares of. least_reduction: accumulated reduction
    that a candidate must exceed. preferred_mm3: parts of at least this volume come before all smaller ones.
    """
    pool = _Pool(tables, risky_mm2, bound_mm2, least_reduction)
    yield from pool.relaxed(preferred_mm3, np.inf)
    if preferred_mm3 > 0.0:
        yield from pool.relaxed(0.0, preferred_mm3)


@dataclass(frozen=True, eq=False)
class _Turn:
    """Candidates of all tables side by side, by reduction, larger parts first among equals."""

    table: Ints
    row: Ints
    reduction: Floats


@dataclass(frozen=True, eq=False)
class _Pool:
    """The candidates of some tables that would leave less than bound_mm2 for ever and reduce more than least_reduction."""

    tables: Sequence[Table]
    risky_mm2: float
    bound_mm2: float
    least_reduction: float

    def relaxed(self, least_mm3: float, most_mm3: float) -> Iterator[Entry]:
        """The feasible ones whose parts have a volume from least_mm3 to below most_mm3."""
        near: list[list[Plane]] = [[] for _ in self.tables]
        best = -np.inf
        for number in range(ROUNDS):
            turn = self._turn(number, best, any_gain=least_mm3 > 0.0)
            for place, (index, row) in enumerate(zip(turn.table.tolist(), turn.row.tolist(), strict=True)):
                table = self.tables[index]
                if table.reason[row] == UNKNOWN:
                    self._look_ahead(turn.table[place : place + LOOK_AHEAD], turn.row[place : place + LOOK_AHEAD])
                if table.reason[row] != FEASIBLE or not least_mm3 <= table.volume_mm3[row] < most_mm3:
                    continue
                plane = table.plane(row)
                if not any(same(plane, other) for other in near[index]):
                    near[index].append(plane)
                    best = max(best, float(turn.reduction[place]))
                    yield Entry(index, row, number)

    def _turn(self, number: int, best: float, any_gain: bool) -> _Turn:
        """What a round lets in that reduces at least as much as the best so far; few of all, so they are chosen before anything
        is sorted. any_gain: also what gains enough for large parts only."""
        found: list[tuple[Ints, Ints, Ints]] = []
        sums: list[Floats] = []
        for index, table in enumerate(self.tables):
            worth, rows = table.worth, table.let_in(number, self.risky_mm2)
            reduction = np.round((worth.gain_mm2[rows] + table.saved_mm2) / self.risky_mm2 / EQUAL) * EQUAL
            kept = (reduction >= best) & (reduction > self.least_reduction)
            kept &= worth.residual_mm2[rows] + table.residual_mm2 < self.bound_mm2
            kept &= any_gain | (worth.gain_mm2[rows] >= table.least_gain_mm2)
            rows = rows[kept]
            found.append((np.full(len(rows), index, np.int32), rows.astype(np.int32), worth.direction[rows]))
            sums.append(np.stack([worth.offset_mm[rows], reduction[kept]]))
        number_of, row, direction = (np.concatenate(column, dtype=np.int32) for column in zip(*found, strict=True))
        offset, reduction = np.concatenate(sums, axis=1)
        order = np.lexsort((direction, number_of, offset, -reduction))
        return _Turn(number_of[order], row[order], reduction[order])

    def _look_ahead(self, table: Ints, row: Ints) -> None:
        """Check these candidates of every table in one go, all their directions in parallel."""
        for index in np.unique(table):
            self.tables[index].look(row[table == index])


def round_of(residual: float) -> int:
    """The round of relaxation that lets in a candidate with this share of the risky area left on its part."""
    return int(np.searchsorted(DELTAS, residual, side="right"))


def same(plane: Plane, other: Plane) -> bool:
    """Whether two planes of one parent are too alike to take two places (the authors' rule)."""
    cosine = abs(float(plane.normal @ other.normal))
    return cosine > SAME_COSINE and abs(plane.offset_mm - other.offset_mm) < 2.0 * cosine
