"""Pool: the candidates of all nodes of the beam in the order of the 2020 paper, each checked when its turn comes.

Candidates that leave (almost) nothing risky above their plane come first, then delta is relaxed from 1e-4 by factors of 5;
within a round the larger accumulated reduction comes first, and from the second round on only candidates that reduce at
least as much as the best so far are taken. Near-equal planes of one parent take one place.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mdp.candidates import Bounds, Checked, Reason, Worth
from mdp.features import Plan
from mdp.mesh import Floats, Ints
from mdp.plane import Plane

FIRST_DELTA, DELTA_FACTOR, LAST_DELTA = 1e-4, 5.0, 1e3
SAME_COSINE = 0.95
LOOK_AHEAD = 256
EQUAL = 1e-9  # shares of the risky area that differ less are equal but for rounding

Check = Callable[[int, Ints, Floats], Checked]


@dataclass(frozen=True, eq=False)
class Entry:
    """A feasible candidate: the beam's node it belongs to, its plane, its numbers, and the round that let it in."""

    node: int
    plane: Plane
    plan: Plan
    round: int


@dataclass(frozen=True)
class Standing:
    """What the cuts of a node have saved and left risky so far."""

    saved_mm2: float
    residual_mm2: float


def fill(
    tables: Sequence[Worth],
    standings: Sequence[Standing],
    limits: Bounds,
    risky_mm2: float,
    bound_mm2: float,
    most: int,
    check: Check,
) -> list[Entry]:
    """Up to `most` entries, best first. bound_mm2: nodes that leave more residual than this can no longer win."""
    rows = _Rows(tables, standings, risky_mm2)
    chosen: list[Entry] = []
    checked: dict[int, tuple[int, float, float]] = {}
    near: dict[int, list[tuple[Floats, float]]] = {}
    best, delta, number = -np.inf, FIRST_DELTA, 0
    waiting = rows.order[rows.residual_sum[rows.order] * risky_mm2 < bound_mm2]
    while len(waiting) and len(chosen) < most and delta <= LAST_DELTA:
        admitted = rows.residual[waiting] < delta
        turn = waiting[admitted & (rows.reduction[waiting] >= best)]
        for place, index in enumerate(turn):
            if len(chosen) == most:
                break
            direction, offset = limits.directions[rows.direction[index]], float(rows.offset[index])
            others = near.setdefault(int(rows.node[index]), [])
            if any(_same(direction, offset, *other) for other in others):
                continue
            if index not in checked:
                _check_ahead(rows, turn[place : place + LOOK_AHEAD], checked, check)
            reason, volume, fragile = checked[index]
            if reason != Reason.FEASIBLE:
                continue
            others.append((direction, offset))
            above = offset - float(limits.least_offset_mm[rows.direction[index]])
            standing = standings[rows.node[index]]
            numbers = (float(rows.gain[index]), float(rows.residual[index]) * risky_mm2, volume, above, fragile)
            plan = Plan(*numbers, standing.saved_mm2, standing.residual_mm2)
            chosen.append(Entry(int(rows.node[index]), Plane(direction, offset), plan, number))
        best = max((rows.share(entry) for entry in chosen), default=-np.inf)
        waiting = waiting[~admitted]
        delta, number = delta * DELTA_FACTOR, number + 1
    return chosen


class _Rows:
    """The candidates of all nodes side by side, and their order by reduction, larger parts first among equals."""

    def __init__(self, tables: Sequence[Worth], standings: Sequence[Standing], risky_mm2: float) -> None:
        self.risky_mm2 = risky_mm2
        self.node = np.concatenate([np.full(len(table.gain_mm2), k) for k, table in enumerate(tables)])
        self.direction = np.concatenate([table.direction for table in tables])
        self.offset = np.concatenate([table.offset_mm for table in tables])
        self.gain = np.concatenate([table.gain_mm2 for table in tables])
        self.residual = np.concatenate([table.residual_mm2 for table in tables]) / risky_mm2
        saved, left = (np.array([getattr(s, key) for s in standings]) for key in ("saved_mm2", "residual_mm2"))
        self.reduction = np.round((self.gain + saved[self.node]) / risky_mm2 / EQUAL) * EQUAL
        self.residual_sum = self.residual + left[self.node] / risky_mm2
        self.order = np.lexsort((self.direction, self.node, self.offset, -self.reduction))

    def share(self, entry: Entry) -> float:
        """Accumulated reduction of an entry, as the rows hold it."""
        return round((entry.plan.gain_mm2 + entry.plan.saved_before_mm2) / self.risky_mm2 / EQUAL) * EQUAL


def _check_ahead(rows: _Rows, ahead: Ints, checked: dict[int, tuple[int, float, float]], check: Check) -> None:
    """Check all candidates that share node and direction with the next ones, a node's directions in parallel."""
    for node in np.unique(rows.node[ahead]):
        fresh = [index for index in ahead[rows.node[ahead] == node] if int(index) not in checked]
        mine = np.nonzero((rows.node == node) & np.isin(rows.direction, rows.direction[fresh]))[0]
        if len(mine) == 0:
            continue
        found = check(int(node), rows.direction[mine], rows.offset[mine])
        for k, index in enumerate(mine):
            checked[int(index)] = (int(found.reason[k]), float(found.volume_mm3[k]), float(found.fragile_mm[k]))


def _same(direction: Floats, offset_mm: float, other_direction: Floats, other_offset_mm: float) -> bool:
    """Whether two planes of one parent are too alike to take two places (the authors' rule)."""
    cosine = abs(float(direction @ other_direction))
    return cosine > SAME_COSINE and abs(offset_mm - other_offset_mm) < 2.0 * cosine
