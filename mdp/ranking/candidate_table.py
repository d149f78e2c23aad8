"""Candidate table: the scored candidates of one node and what the cuts before have made of it; what can be cut of them is checked
as it is asked for.

Of near-equal planes of one parent only the first counts.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import accumulate, repeat
from math import pi
from operator import mul

import numpy as np

from mdp.mesh import Floats, Ints
from mdp.plane import Plane
from mdp.ranking.candidates import Reason, ScoredCandidates, check

FIRST_THRESHOLD, THRESHOLD_FACTOR, ROUNDS = 1e-4, 5.0, 11  # shares of the risky area; the last one is above 1e3
RESIDUAL_THRESHOLDS = np.array(list(accumulate(repeat(THRESHOLD_FACTOR, ROUNDS - 1), mul, initial=FIRST_THRESHOLD)))
SAME_COSINE = 0.95
FIRST_LOOK, LOOK_AHEAD = 8, 128  # rows that are checked together: few as long as the first ones will do, then twice as many
SORTED_FIRST = 256
UNKNOWN = -1
FEASIBLE = int(Reason.FEASIBLE)  # a number, for it is compared a hundred thousand times a search


@dataclass(frozen=True)
class Model:
    """What shares of a model are shares of."""

    risky_mm2: float
    volume_mm3: float
    radius_mm: float

    @property
    def circle_mm2(self) -> float:
        """Area of the bounding sphere's great circle."""
        return pi * self.radius_mm**2


@dataclass(frozen=True, eq=False)
class Situation:
    """What the cuts before have made of a model: what they saved, cost for ever and lost (CutCost), the area that is risky now
    and how much of it no cut can save (0: not asked for), the volume that remains, how many they were, and (3,) the last one's
    direction."""

    model: Model
    saved_mm2: float
    residual_mm2: float
    lost_mm2: float
    risky_mm2: float
    hopeless_mm2: float
    volume_mm3: float
    cuts: int
    last: Floats


class CandidateTable:
    """The scored candidates of one node; whether they can be cut is checked direction by direction, when it is asked for."""

    def __init__(
        self,
        scored: ScoredCandidates,
        situation: Situation,
        least_gain_mm2: float = 0.0,
        is_weak: Callable[[Plane], bool] = lambda plane: False,
    ) -> None:
        """least_gain_mm2: what gains less is for parts of the preferred volume only; is_weak: whether a plane that can be cut
        leaves too weak a base, asked for only where a row's turn comes."""
        self.scored, self.limits, self.least_gain_mm2 = scored, scored.limits, least_gain_mm2
        self.situation, self.model = situation, situation.model
        self.saved_mm2, self.residual_mm2, self.lost_mm2 = situation.saved_mm2, situation.residual_mm2, situation.lost_mm2
        self.check, self._is_weak, self._strong = check, is_weak, set[int]()
        count = len(scored.gain_mm2)
        self.reason = np.full(count, UNKNOWN, np.int32)
        self.volume_mm3: Floats = np.zeros(count)
        self.section_mm2: Floats = np.zeros(count)
        self.contact_area_mm2: Floats = np.zeros(count)
        self._sliver_mm = np.zeros(count)
        self._rankings: dict[float, _TradeOffRanking] = {}
        self._rounds: list[Ints] = []

    def rows_of_round(self, number: int) -> Ints:
        """The rows that come below the residual threshold in this round first."""
        if not self._rounds:
            rounds = relaxation_rounds(self.scored.lost_mm2 / self.model.risky_mm2)
            order = np.argsort(rounds, kind="stable")
            self._rounds = np.split(order, np.searchsorted(rounds[order], np.arange(1, ROUNDS + 1)))
        return self._rounds[number]

    def rows_by_trade_off(self, trade_off: float) -> Iterator[int]:
        """Feasible rows by gain less trade_off times what is lost, best first; of near-equal planes only the first."""
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
        scored, limits = self.scored, self.limits
        checked = self.check(scored.remainder, limits, limits.step_mm, scored.direction[alike], scored.offset_mm[alike])
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
        return relaxation_rounds(self.scored.lost_mm2[rows] / self.model.risky_mm2)


class _TradeOffRanking:
    """The feasible rows of a table by one trade-off, sorted and checked as far as they are asked for."""

    def __init__(self, table: CandidateTable, trade_off: float) -> None:
        self._table = table
        enough = table.scored.gain_mm2 >= table.least_gain_mm2
        self._cost = np.where(enough, trade_off * table.scored.lost_mm2 - table.scored.gain_mm2, np.inf)
        self._count = int(enough.sum())
        self._order: Ints = np.zeros(0, np.int64)
        self._next, self._ahead = 0, FIRST_LOOK
        self._feasible: list[int] = []
        self._planes: list[Plane] = []

    def row_at(self, position: int) -> int | None:
        """The row at a position of the ranking; None when the ranking is shorter."""
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
        if any(nearly_equal(plane, earlier) for earlier in self._planes):
            return
        if self._table.reason[row] == UNKNOWN:
            self._table.check_rows(self._order[self._next : self._next + self._ahead])
            self._ahead = min(2 * self._ahead, LOOK_AHEAD)
        if self._table.feasible(row):
            self._feasible.append(row)
            self._planes.append(plane)


def relaxation_rounds(residual: Floats) -> Ints:
    """(n,) rounds whose residual thresholds let in candidates with these shares of the risky area left on their parts."""
    return np.searchsorted(RESIDUAL_THRESHOLDS, residual, side="right").astype(np.int32)


def nearly_equal(plane: Plane, other: Plane) -> bool:
    """Whether two planes of one parent are too alike for both to count.

    The authors' rule but for its abs() of the cosine: planes that look opposite ways cut off opposite ends. Directions at least
    e over the platform are at most 180 - 2 e apart, so from 9.1 degrees on (half the angle of SAME_COSINE) both rules are one.
    """
    cosine = float(plane.normal @ other.normal)
    return cosine > SAME_COSINE and abs(plane.offset_mm - other.offset_mm) < 2.0 * cosine
