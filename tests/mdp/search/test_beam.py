"""Beam: the nodes that its slots expand."""

import numpy as np
import pytest

from mdp.ranking.ranking import CandidateTable, nearly_equal, rank_by_trade_off, rank_classic, relaxation_rounds
from mdp.search.beam import Beam
from mdp.search.problem import Problem
from profiles.profile import load
from tests import shapes


def _problem(width: int, shape: str = "tee") -> Problem:
    return Problem(
        getattr(shapes, shape)(),
        load(settings=("search.directions=150", f"search.beam_width={width}", "search.seam_mm=0.6", "search.cut_mm2=0")),
    )


def _beam(width: int, stages: int, shape: str = "tee") -> Beam:
    beam = Beam(_problem(width, shape), None, None)
    for _ in range(stages):
        beam.advance()
    return beam


@pytest.mark.parametrize("shape", ["tee", "branch", "ball"])
def test_a_wide_beam_holds_the_narrow_one(shape: str) -> None:
    narrow, wide = _beam(3, 3, shape), _beam(6, 3, shape)
    for mine, other in zip(narrow.bests, wide.bests, strict=False):
        assert mine.signature == other.signature


def test_no_solid_is_followed_twice() -> None:
    held = [node.signature for node in _beam(8, 1, "ball").nodes if node is not None]
    assert len(held) == len(set(held)) > 2


def test_finalists_are_few_and_different_and_the_best_is_one_of_them() -> None:
    beam = _beam(9, 2)
    finalists = beam.finalists()
    assert len(finalists) == len({id(node) for node in finalists}) == 3
    assert beam.best in finalists


def test_a_beam_of_one_has_no_finalist() -> None:
    assert _beam(1, 1).finalists() == []


@pytest.mark.parametrize("trade_off", [0.0, 1.0, 4.0])
def test_a_trade_off_is_the_order_of_a_plain_sort(trade_off: float) -> None:
    problem = _problem(1, "branch")
    table = problem.table(problem.root)
    rows = [candidate.row for candidate in rank_by_trade_off([table], trade_off, np.inf)]
    assert rows == _sorted_plainly(table, trade_off)


def _sorted_plainly(table: CandidateTable, trade_off: float) -> list[int]:
    """Feasible rows by falling score, without those too similar to an earlier one."""
    everything = np.arange(len(table.reason), dtype=np.int32)
    table.check_rows(everything)
    cost = trade_off * table.scored.lost_mm2 - table.scored.gain_mm2
    rows: list[int] = []
    for row in everything[np.lexsort((everything, cost))]:
        if table.reason[row] == 0 and not any(nearly_equal(table.plane(row), table.plane(other)) for other in rows):
            rows.append(int(row))
    return rows


def test_two_tables_are_merged_by_what_they_saved_before() -> None:
    problem = _problem(1, "branch")
    table, ahead = problem.table(problem.root), problem.table(problem.root)
    ahead.saved_mm2 += 1000.0
    assert next(rank_by_trade_off([table, ahead], 1.0, np.inf)).table is ahead


def test_candidates_that_leave_too_much_for_ever_are_left_out() -> None:
    problem = _problem(1, "ball")
    table = problem.table(problem.root)
    least = table.scored.residual_mm2.min()
    assert list(rank_by_trade_off([table], 0.0, float(least))) == []


def test_the_round_is_the_first_whose_residual_threshold_admits_a_candidate() -> None:
    problem = _problem(1, "ball")
    table = problem.table(problem.root)
    for candidate in rank_classic([table], np.inf):
        lost = float(table.scored.lost_mm2[candidate.row]) / problem.model.risky_mm2
        assert relaxation_rounds(np.array([lost])) == [candidate.round]


def test_parts_of_the_preferred_volume_come_first_and_all_others_after_them() -> None:
    problem = _problem(1, "branch")
    table, tenth = problem.table(problem.root), 0.1 * problem.model.volume_mm3
    classic = rank_classic([table], np.inf, preferred_mm3=tenth)
    volumes = [table.volume_mm3[candidate.row] for candidate in classic]
    large = [volume >= tenth for volume in volumes]
    assert large == sorted(large, reverse=True)
    assert 0 < sum(large) < len(large)


def test_candidates_with_little_gain_are_only_for_large_parts_of_the_classic_ranking() -> None:
    problem = Problem(shapes.branch(), load(settings=("search.directions=150", "search.least_gain=0.2")))
    table, least_mm2 = problem.table(problem.root, large=True), problem.least_gain_mm2
    small = {row for row in range(len(table.reason)) if table.scored.gain_mm2[row] < least_mm2}
    classic = rank_classic([table], np.inf, preferred_mm3=problem.preferred_mm3)
    gaining_little = [candidate.row for candidate in classic if candidate.row in small]
    assert gaining_little
    assert (table.volume_mm3[gaining_little] >= problem.preferred_mm3).all()
    assert not small & {candidate.row for candidate in rank_by_trade_off([table], 4.0, np.inf)}


def test_a_gain_is_measured_by_what_cuts_can_save() -> None:
    counted, usual = (Problem(shapes.tee(), load(settings=[f"search.count_platform_faces={on}"])) for on in ("true", "false"))
    assert counted.root.risky_mm2 > usual.root.risky_mm2 + 1.0
    assert counted.least_gain_mm2 == pytest.approx(usual.least_gain_mm2)
