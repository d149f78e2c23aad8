"""Pool: the candidates of several nodes in the order of the 2020 paper, each checked when its turn comes.

Candidates that leave (almost) nothing risky above their plane come first, then delta is relaxed from 1e-4 by factors of 5;
within a round the larger accumulated reduction comes first, and from the second round on only candidates that reduce at
least as much as the best so far are taken. Near-equal planes of one parent take one place.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mdp.candidates import Bounds, Checked, Reason, Worth
from mdp.features import Plan
from mdp.mesh import Floats, Ints
from mdp.plane import Plane

FIRST_DELTA, DELTA_FACTOR, LAST_DELTA = 1e-4, 5.0, 1e3
SAME_COSINE = 0.95
LOOK_AHEAD = 128
EQUAL = 1e-9  # shares of the risky area that differ less are equal but for rounding
UNKNOWN = -1


class Table:
    """The candidates of one node that are worth a cut; whether they can be cut is looked up direction by direction."""

    def __init__(
        self, worth: Worth, limits: Bounds, saved_mm2: float, residual_mm2: float, check: Callable[[Ints, Floats], Checked]
    ) -> None:
        self.worth, self.limits = worth, limits
        self.saved_mm2, self.residual_mm2 = saved_mm2, residual_mm2
        self._check = check
        self.reason = np.full(len(worth.gain_mm2), UNKNOWN, np.int32)
        self._volume_mm3, self._fragile_mm = np.zeros(len(worth.gain_mm2)), np.zeros(len(worth.gain_mm2))

    def look(self, rows: Ints) -> None:
        """Check these rows and all others of the same directions, where that is not known."""
        fresh = rows[self.reason[rows] == UNKNOWN]
        if len(fresh) == 0:
            return
        mine = np.nonzero(np.isin(self.worth.direction, self.worth.direction[fresh]))[0]
        found = self._check(self.worth.direction[mine], self.worth.offset_mm[mine])
        self.reason[mine], self._volume_mm3[mine], self._fragile_mm[mine] = found.reason, found.volume_mm3, found.fragile_mm

    def plane(self, row: int) -> Plane:
        """The plane of a row."""
        return Plane(self.limits.directions[self.worth.direction[row]], float(self.worth.offset_mm[row]))

    def plan(self, row: int) -> Plan:
        """The numbers of a checked row."""
        worth = self.worth
        return Plan(
            gain_mm2=float(worth.gain_mm2[row]),
            residual_mm2=float(worth.residual_mm2[row]),
            volume_mm3=float(self._volume_mm3[row]),
            above_platform_mm=float(worth.offset_mm[row] - self.limits.least_offset_mm[worth.direction[row]]),
            fragile_mm=min(float(self._fragile_mm[row]), worth.remainder.thin_mm(self.plane(row))),
            saved_before_mm2=self.saved_mm2,
            residual_before_mm2=self.residual_mm2,
        )


@dataclass(frozen=True, eq=False)
class Entry:
    """A feasible candidate: the table and row it comes from, and the round of relaxation that let it in."""

    table: int
    row: int
    round: int


def entries(tables: Sequence[Table], risky_mm2: float, bound_mm2: float, least_reduction: float = 0.0) -> Iterator[Entry]:
    """Feasible candidates, best first; those that would leave bound_mm2 or more for ever are left out.

    risky_mm2: the model's risky area, which delta and the reductions are shares of. least_reduction: accumulated reduction
    that a candidate must exceed.
    """
    side = _side_by_side(tables, risky_mm2)
    waiting = side.order[(side.residual_sum_mm2 < bound_mm2)[side.order] & (side.reduction > least_reduction)[side.order]]
    near: list[list[tuple[Floats, float]]] = [[] for _ in tables]
    best, delta, number = -np.inf, FIRST_DELTA, 0
    while len(waiting) and delta <= LAST_DELTA:
        admitted = side.residual[waiting] < delta
        turn = waiting[admitted & (side.reduction[waiting] >= best)]
        for place, index in enumerate(turn):
            table, row = int(side.table[index]), int(side.row[index])
            plane = tables[table].plane(row)
            if any(_same(plane, *other) for other in near[table]):
                continue
            if tables[table].reason[row] == UNKNOWN:
                _look_ahead(tables, side, turn[place : place + LOOK_AHEAD])
            if tables[table].reason[row] == Reason.FEASIBLE:
                near[table].append((plane.normal, plane.offset_mm))
                best = max(best, float(side.reduction[index]))
                yield Entry(table, row, number)
        waiting = waiting[~admitted]
        delta, number = delta * DELTA_FACTOR, number + 1


@dataclass(frozen=True, eq=False)
class _Side:
    """The candidates of all tables side by side, and their order by reduction, larger parts first among equals."""

    table: Ints
    row: Ints
    reduction: Floats
    residual: Floats
    residual_sum_mm2: Floats
    order: Ints


def _side_by_side(tables: Sequence[Table], risky_mm2: float) -> _Side:
    table = np.concatenate([np.full(len(t.reason), k, np.int32) for k, t in enumerate(tables)])
    row = np.concatenate([np.arange(len(t.reason), dtype=np.int32) for t in tables])
    direction = np.concatenate([t.worth.direction for t in tables])
    offset = np.concatenate([t.worth.offset_mm for t in tables])
    saved = np.concatenate([t.worth.gain_mm2 + t.saved_mm2 for t in tables])
    residual = np.concatenate([t.worth.residual_mm2 for t in tables])
    residual_sum = np.concatenate([t.worth.residual_mm2 + t.residual_mm2 for t in tables])
    reduction = np.round(saved / risky_mm2 / EQUAL) * EQUAL
    order = np.lexsort((direction, table, offset, -reduction)).astype(np.int32)
    return _Side(table, row, reduction, residual / risky_mm2, residual_sum, order)


def _look_ahead(tables: Sequence[Table], side: _Side, ahead: Ints) -> None:
    """Check the next candidates of every table in one go, all their directions in parallel."""
    for table in np.unique(side.table[ahead]):
        tables[table].look(side.row[ahead[side.table[ahead] == table]])


def _same(plane: Plane, other_direction: Floats, other_offset_mm: float) -> bool:
    """Whether two planes of one parent are too alike to take two places (the authors' rule)."""
    cosine = abs(float(plane.normal @ other_direction))
    return cosine > SAME_COSINE and abs(plane.offset_mm - other_offset_mm) < 2.0 * cosine
