"""The orders of candidates against plain sorting: every candidate checked, none ahead of time, no round stopped early."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.directions.unit_vectors import spread
from mdp.mesh import Floats, Ints
from mdp.plane import Plane
from mdp.ranking.candidates import Bounds, Feasibility, Reason, ScoredCandidates
from mdp.ranking.ranking import (
    PER_TRADE_OFF,
    RESIDUAL_THRESHOLDS,
    SHORTLIST_TRADE_OFFS,
    CandidateTable,
    Model,
    RankedCandidate,
    nearly_equal,
    rank_by_trade_off,
    rank_classic,
    relaxation_rounds,
    shortlist,
)

DIRECTIONS = spread(40, 0.2)
RISKY_MM2, BOUND_MM2 = 100.0, 60.0
seeds = st.integers(0, 10_000)

Place = tuple[int, int]  # a table and one of its rows


class Drawn(NamedTuple):
    """Candidates of one node as arrays. same: index of the first candidate with the same plane, whose feasibility, weak base
    and part volume hold for it."""

    direction: Ints
    offset: Floats
    gain: Floats
    residual: Floats
    lost: Floats
    same: Ints
    can_be_cut: np.ndarray
    weak: np.ndarray
    volume: Floats
    saved: float
    left: float
    lost_before: float

    def plane(self, row: int) -> Plane:
        return Plane(DIRECTIONS[self.direction[row]], float(self.offset[row]))


def drawn(seed: int, most: int = 400) -> Drawn:
    """Random candidates, some with equal gain, many with equal direction."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(0, most))
    residual = np.where(rng.random(n) < 0.3, 0.0, 10.0 ** rng.uniform(-3, 2, n))
    gain = np.round(rng.uniform(-5, 60, n), int(rng.integers(0, 3)))
    direction, offset = rng.integers(0, 40, n).astype(np.int32), np.round(rng.uniform(0, 30, n))
    known: dict[tuple[int, float], int] = {}
    same = [known.setdefault(plane, k) for k, plane in enumerate(zip(direction.tolist(), offset.tolist(), strict=True))]
    return Drawn(
        direction,
        offset,
        gain,
        residual,
        residual * rng.uniform(0.3, 1.0, n),
        np.array(same, np.int64),
        rng.random(n) < 0.5,
        rng.random(n) < 0.1,
        rng.uniform(0, 10, n),
        *rng.uniform(0, 30, 3),
    )


def table_of(own: Drawn, least_gain_mm2: float = 0.0) -> CandidateTable:
    """The table of drawn candidates; its check identifies a candidate by direction and offset."""
    rows = dict(zip(zip(own.direction.tolist(), own.offset.tolist(), strict=True), own.same.tolist(), strict=True))

    def answer(remainder: None, limits: Bounds, step_mm: float, direction: Ints, offset: Floats) -> Feasibility:
        at = np.array([rows[int(d), float(o)] for d, o in zip(direction, offset, strict=True)], np.int64)
        reason = np.where(own.can_be_cut[at], Reason.FEASIBLE, Reason.FLOATING).astype(np.int32)
        return Feasibility(reason, own.volume[at], *np.zeros((3, len(at))))

    def is_weak(plane: Plane) -> bool:
        (direction,) = np.flatnonzero((plane.normal == DIRECTIONS).all(axis=1))
        return bool(own.weak[rows[int(direction), plane.offset_mm]])

    n = len(own.gain)
    costs = {"gain_mm2": own.gain, "residual_mm2": own.residual, "lost_mm2": own.lost}
    unused = dict.fromkeys(("above_mm2", "stairs_mm2", "seam_mm2", "unavoidable_mm2"), np.zeros(n))
    limits = Bounds(DIRECTIONS, np.zeros(40), np.zeros(40), 0.0, 0.0, np.zeros((40, 0, 2)), 0.0, 0.0, 1.0)
    scored = ScoredCandidates(
        None, limits, own.direction, own.offset, **costs, **unused, first=own.direction, columns=own.direction
    )  # type: ignore[arg-type]
    node: Any = SimpleNamespace(saved_mm2=own.saved, residual_mm2=own.left, lost_mm2=own.lost_before)
    table = CandidateTable(scored, node, Model(RISKY_MM2, 1.0, 1.0), least_gain_mm2, is_weak)
    table.check = answer
    return table


def without_alike(
    tables: Sequence[Drawn], ordered: Sequence[Place], least_mm3: float = 0.0, most_mm3: float = np.inf
) -> list[Place]:
    """The feasible candidates among ordered (table, row), and only the first of near-equal planes of a table."""
    taken: list[Place] = []
    for index, row in ordered:
        own = tables[index]
        k = own.same[row]
        if not own.can_be_cut[k] or own.weak[k] or not least_mm3 <= own.volume[k] < most_mm3:
            continue
        if not any(nearly_equal(own.plane(row), own.plane(earlier)) for at, earlier in taken if at == index):
            taken.append((index, row))
    return taken


def places(tables: Sequence[CandidateTable], candidates: Sequence[RankedCandidate]) -> list[Place]:
    return [(tables.index(candidate.table), candidate.row) for candidate in candidates]


def by_trade_off(tables: Sequence[Drawn], weight: float, least_gain: float = 0.0) -> list[Place]:
    """Rows of all tables by gain less residual: near-equal ones dropped within each table, then merged."""
    kept = []
    for index, own in enumerate(tables):
        rows = [row for row in range(len(own.gain)) if own.gain[row] >= least_gain]
        rows.sort(key=lambda row: (weight * own.lost[row] - own.gain[row], row))
        kept += without_alike(tables, [(index, row) for row in rows])
    kept = [(index, row) for index, row in kept if tables[index].left + tables[index].residual[row] < BOUND_MM2]

    def cost(place: tuple[int, int]) -> float:
        own, row = tables[place[0]], place[1]
        return float(weight * own.lost[row] - own.gain[row] - (own.saved - weight * own.lost_before))

    return sorted(kept, key=lambda place: (cost(place), *place))


@settings(max_examples=25)
@given(seeds, st.integers(1, 3), st.sampled_from((0.0, 1.0, 2.5)), st.sampled_from((0.0, 20.0)))
def test_candidates_by_trade_off_are_those_that_plain_sorting_finds(seed: int, count: int, weight: float, least: float) -> None:
    own = [drawn(seed + k) for k in range(count)]
    tables = [table_of(one, least) for one in own]
    ranked = list(rank_by_trade_off(tables, weight, BOUND_MM2))
    assert places(tables, ranked) == by_trade_off(own, weight, least)


@settings(max_examples=10)
@given(seeds)
def test_a_shortlist_has_the_first_few_by_each_trade_off_once(seed: int) -> None:
    own = [drawn(seed), drawn(seed + 1)]
    expected = []
    for number, one in enumerate(own):
        rows = [row for weight in SHORTLIST_TRADE_OFFS for _, row in by_trade_off([one], weight)[:PER_TRADE_OFF]]
        expected += [(number, row) for row in dict.fromkeys(rows)]
    tables = [table_of(one) for one in own]
    assert places(tables, list(shortlist(tables, BOUND_MM2))) == expected


def classic(tables: Sequence[Drawn], preferred: float, least_reduction: float) -> list[Place]:
    """The classic order by rounds: the candidates first admitted by a threshold that reduce at least as much as the best of
    the previous rounds."""
    spans = [(preferred, np.inf), (0.0, preferred)] if preferred > 0.0 else [(0.0, np.inf)]
    ranked = []
    for low, high in spans:
        taken: list[Place] = []
        for number in range(len(RESIDUAL_THRESHOLDS)):
            rows = [(i, r) for i, own in enumerate(tables) for r in range(len(own.gain)) if _round(own.lost[r]) == number]
            best = max((_reduction(tables, *place) for place in taken), default=-np.inf)
            rows = [place for place in rows if _reduction(tables, *place) >= best - 1e-10]
            rows = [(i, r) for i, r in rows if _reduction(tables, i, r) > least_reduction + 1e-10]
            rows = [(i, r) for i, r in rows if tables[i].left + tables[i].residual[r] < BOUND_MM2]
            rows = [(i, r) for i, r in rows if low > 0.0 or tables[i].gain[r] >= 0.0]
            rows.sort(key=lambda place: _by_reduction(tables, *place))
            taken = without_alike(tables, [*taken, *rows], low, high)
        ranked += taken
    return ranked


def _by_reduction(tables: Sequence[Drawn], index: int, row: int) -> tuple[float, float, int, int, int]:
    """Sort key of a candidate within its round: the greatest reduction first; of equal ones the larger part, which begins
    lower."""
    own = tables[index]
    return -_reduction(tables, index, row), float(own.offset[row]), index, int(own.direction[row]), row


def _round(residual: float) -> int:
    return sum(residual / RISKY_MM2 >= threshold for threshold in RESIDUAL_THRESHOLDS)


def _reduction(tables: Sequence[Drawn], index: int, row: int) -> float:
    return round((tables[index].gain[row] + tables[index].saved) / RISKY_MM2, 9)


@settings(max_examples=40)
@given(seeds, st.integers(1, 3), st.sampled_from((0.0, 5.0)), st.sampled_from((0.0, 0.3)))
def test_the_order_of_the_paper_is_the_one_worked_out_round_by_round(
    seed: int, count: int, preferred: float, least: float
) -> None:
    own = [drawn(seed + k, 120) for k in range(count)]
    tables = [table_of(one) for one in own]
    ranked = list(rank_classic(tables, BOUND_MM2, least, preferred))
    assert places(tables, ranked) == classic(own, preferred, least)
    assert [c.round for c in ranked] == [_round(own[index].lost[row]) for index, row in places(tables, ranked)]


@pytest.mark.parametrize(("share", "number"), [(0.0, 0), (0.99e-4, 0), (1e-4, 1), (4.9e-4, 1), (5e-4, 2), (1.0, 6), (1e6, 11)])
def test_the_threshold_of_the_paper_rises_from_a_ten_thousandth_by_factors_of_five(share: float, number: int) -> None:
    assert relaxation_rounds(np.array([share])).tolist() == [number]


def test_no_candidates_give_an_empty_ranking() -> None:
    none = table_of(drawn(0, 1))
    assert list(rank_by_trade_off([none], 1.0, BOUND_MM2)) == list(shortlist([none], BOUND_MM2)) == []
    assert list(rank_classic([none], BOUND_MM2)) == list(rank_by_trade_off([], 1.0, BOUND_MM2)) == []
