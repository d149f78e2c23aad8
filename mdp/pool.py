"""Pool: the candidates of several nodes in the order of the 2020 paper or by a trade-off, each checked when its turn comes.

Order of the paper: candidates that leave (almost) nothing risky above their plane come first, then delta is relaxed from 1e-4
by factors of 5; within a round the larger accumulated reduction comes first, and from the second round on only candidates that
reduce at least as much as the best so far are taken. Near-equal planes of one parent take one place.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from heapq import merge

import numpy as np

from mdp.candidates import Bounds, Checked, Reason, Worth
from mdp.features import Plan
from mdp.mesh import Floats, Ints
from mdp.plane import Plane

FIRST_DELTA, DELTA_FACTOR, LAST_DELTA = 1e-4, 5.0, 1e3
SAME_COSINE = 0.95
LOOK_AHEAD = 128
EQUAL = 1e-9  # shares of the risky area that differ less are equal but for rounding
SORTED_FIRST = 256
UNKNOWN = -1
FEASIBLE = int(Reason.FEASIBLE)  # a number, for it is compared a hundred thousand times a search


class Table:
    """The candidates of one node that are worth a cut; whether they can be cut is looked up direction by direction."""

    def __init__(
        self, worth: Worth, limits: Bounds, saved_mm2: float, residual_mm2: float, check: Callable[[Ints, Floats], Checked]
    ) -> None:
        self.worth, self.limits = worth, limits
        self.saved_mm2, self.residual_mm2 = saved_mm2, residual_mm2
        self._check = check
        self.reason = np.full(len(worth.gain_mm2), UNKNOWN, np.int32)
        self.volume_mm3, self._fragile_mm = np.zeros(len(worth.gain_mm2)), np.zeros(len(worth.gain_mm2))
        self._rankings: dict[float, _Ranking] = {}

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
        self._cost = trade_off * table.worth.residual_mm2 - table.worth.gain_mm2
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
        known, count = len(self._order), len(self._cost)
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
    side = _side_by_side(tables, risky_mm2, bound_mm2, least_reduction)
    waiting = np.arange(len(side.row), dtype=np.int32)
    yield from _relaxed(tables, side, waiting, preferred_mm3, np.inf)
    if preferred_mm3 > 0.0:
        yield from _relaxed(tables, side, waiting, 0.0, preferred_mm3)


def _relaxed(tables: Sequence[Table], side: "_Side", waiting: Ints, least_mm3: float, most_mm3: float) -> Iterator[Entry]:
    """The feasible ones of the waiting candidates whose parts have a volume from least_mm3 to below most_mm3."""
    near: list[list[Plane]] = [[] for _ in tables]
    best, delta, number = -np.inf, FIRST_DELTA, 0
    while len(waiting) and delta <= LAST_DELTA:
        admitted = side.residual[waiting] < delta
        turn = waiting[admitted & (side.reduction[waiting] >= best)]
        for place, index in enumerate(turn):
            table, row = tables[int(side.table[index])], int(side.row[index])
            if table.reason[row] == UNKNOWN:
                _look_ahead(tables, side, turn[place : place + LOOK_AHEAD])
            if table.reason[row] != FEASIBLE or not least_mm3 <= table.volume_mm3[row] < most_mm3:
                continue
            plane, others = table.plane(row), near[int(side.table[index])]
            if not any(same(plane, other) for other in others):
                others.append(plane)
                best = max(best, float(side.reduction[index]))
                yield Entry(int(side.table[index]), row, number)
        waiting = waiting[~admitted]
        delta, number = delta * DELTA_FACTOR, number + 1


@dataclass(frozen=True, eq=False)
class _Side:
    """Candidates of all tables side by side, by reduction, larger parts first among equals."""

    table: Ints
    row: Ints
    reduction: Floats
    residual: Floats


def _side_by_side(tables: Sequence[Table], risky_mm2: float, bound_mm2: float, least_reduction: float) -> _Side:
    """Those that would leave less than bound_mm2 for ever and reduce more than least_reduction: few of all, so they are
    chosen before anything is sorted."""
    found: list[tuple[Ints, Ints, Ints]] = []
    sums: list[Floats] = []
    for index, table in enumerate(tables):
        worth = table.worth
        reduction = np.round((worth.gain_mm2 + table.saved_mm2) / risky_mm2 / EQUAL) * EQUAL
        kept = np.flatnonzero((worth.residual_mm2 + table.residual_mm2 < bound_mm2) & (reduction > least_reduction))
        found.append((np.full(len(kept), index, np.int32), kept.astype(np.int32), worth.direction[kept]))
        sums.append(np.stack([worth.offset_mm[kept], reduction[kept], worth.residual_mm2[kept] / risky_mm2]))
    number, row, direction = (np.concatenate(column, dtype=np.int32) for column in zip(*found, strict=True))
    offset, reduction, residual = np.concatenate(sums, axis=1)
    order = np.lexsort((direction, number, offset, -reduction))
    return _Side(number[order], row[order], reduction[order], residual[order])


def _look_ahead(tables: Sequence[Table], side: _Side, ahead: Ints) -> None:
    """Check the next candidates of every table in one go, all their directions in parallel."""
    for table in np.unique(side.table[ahead]):
        tables[table].look(side.row[ahead[side.table[ahead] == table]])


def round_of(residual: float) -> int:
    """The round of relaxation that lets in a candidate with this share of the risky area left on its part."""
    delta, number = FIRST_DELTA, 0
    while residual >= delta and delta <= LAST_DELTA:
        delta, number = delta * DELTA_FACTOR, number + 1
    return number


def same(plane: Plane, other: Plane) -> bool:
    """Whether two planes of one parent are too alike to take two places (the authors' rule)."""
    cosine = abs(float(plane.normal @ other.normal))
    return cosine > SAME_COSINE and abs(plane.offset_mm - other.offset_mm) < 2.0 * cosine
