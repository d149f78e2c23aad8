"""LearnedRanker: its file, and its effect on a search."""

import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest

from mdp.mesh import Floats
from mdp.ranking.features import CHECKED, COLUMNS, features
from mdp.ranking.ranker import LearnedRanker, ranker_named, shipped
from mdp.ranking.ranking import PER_TRADE_OFF, SHORTLIST_TRADE_OFFS, RankedCandidate, rank_classic, shortlist
from mdp.search.beam import Beam, search_as_published
from mdp.search.problem import Problem
from mdp.search.search import SearchRequest, decompose
from profiles.errors import UserError
from profiles.profile import load
from tests import shapes

SETTINGS = ("search.directions=150", "search.objective=risky", "search.clearance=false")


def _problem(width: int = 1, shape: str = "branch") -> Problem:
    return Problem(getattr(shapes, shape)(), load(settings=(*SETTINGS, f"search.beam_width={width}")))


class ByColumn(LearnedRanker):
    """A ranker with a plain sum in place of its network, so that the expected order is known."""

    def __init__(self, column: str) -> None:
        super().__init__(Path("none.onnx"))
        self.__dict__["columns"] = (column,)

    def scores(self, rows: Floats) -> Floats:
        return rows[:, 0]


@pytest.mark.parametrize("column", ["M1", "M4", "seam"])
def test_candidates_come_by_their_scores_and_equal_ones_as_they_were_offered(column: str) -> None:
    problem = _problem()
    table = problem.table(problem.root, described=True)
    offered = list(shortlist([table], np.inf))
    ranked = list(ByColumn(column).rank(offered))
    values = features(table, np.array([each.row for each in offered]), (column,))[:, 0]
    assert [each.row for each in ranked] == [offered[place].row for place in np.argsort(-values, kind="stable")]


def test_candidates_beyond_the_list_keep_their_order_behind_it() -> None:
    problem = _problem()
    table = problem.table(problem.root, described=True)
    table.check_rows(np.arange(len(table.reason)))
    offered = [RankedCandidate(table, int(row)) for row in np.flatnonzero(table.reason == 0)[:60]]
    ranked = list(ByColumn("M1").rank(offered))
    assert ranked[50:] == offered[50:]
    assert {each.row for each in ranked[:50]} == {each.row for each in offered[:50]}


def test_a_shortlist_has_distinct_feasible_candidates_that_leave_little() -> None:
    problem = _problem(shape="ball")
    table = problem.table(problem.root, described=True)
    listed = list(shortlist([table], np.inf))
    assert len({each.row for each in listed}) == len(listed) <= len(SHORTLIST_TRADE_OFFS) * PER_TRADE_OFF
    assert all(table.feasible(each.row) for each in listed)
    residual = sorted(float(table.scored.residual_mm2[each.row]) for each in listed)
    assert len(list(shortlist([table], residual[0]))) == 0


def test_the_features_of_a_record_are_those_that_a_search_ranks_by() -> None:
    problem = _problem()
    table = problem.table(problem.root, described=True)
    rows = np.array([each.row for each in shortlist([table], np.inf)])
    everything = features(table, rows)
    for number, column in enumerate(COLUMNS):
        assert (features(table, rows, (column,))[:, 0] == everything[:, number]).all()


def test_the_ranker_that_ships_wants_what_needs_no_check_and_is_small() -> None:
    assert not set(shipped().columns) & CHECKED
    assert shipped().file.stat().st_size < 200_000


def test_scores_do_not_change_with_the_order_of_the_candidates_nor_below_the_last_decimal() -> None:
    rng = np.random.default_rng(3)
    rows, order = rng.random((20, len(shipped().columns))), rng.permutation(20)
    scores = shipped().scores(rows)
    assert (scores[order] == shipped().scores(rows[order])).all()
    assert (scores == np.round(scores, 4)).all()


def test_one_and_two_threads_give_the_same_search() -> None:
    code = (
        "import sys, mdp.kernels.threads as t; t.use_threads(int(sys.argv[1]));"
        "from mdp.search.search import SearchRequest, decompose; from profiles.profile import load; from tests import shapes;"
        f"p = load(settings={(*SETTINGS, 'search.beam_width=2')!r});"
        "found = decompose(shapes.branch(), 'b', p, SearchRequest(ranker='learned'));"
        "print([(x.base.normal.tolist(), x.base.offset_mm) for x in found.parts])"
    )
    one, two = (subprocess.run([sys.executable, "-c", code, threads], capture_output=True, check=True).stdout for threads in "12")
    assert one == two
    assert one.count(b"], ") > 1


@pytest.mark.parametrize("shape", ["tee", "branch", "ball"])
def test_a_wide_beam_holds_the_narrow_one_with_a_learned_ranker_too(shape: str) -> None:
    beams = []
    for width in (2, 4):
        beam = Beam(_problem(width, shape), shipped(), None)
        for _ in range(3):
            beam.advance()
        beams.append(beam)
    for mine, other in zip(beams[0].bests, beams[1].bests, strict=False):
        assert mine.signature == other.signature


@pytest.mark.parametrize("width", [1, 2])
def test_the_published_search_follows_the_plain_best_and_the_learned_choices(width: int) -> None:
    profile = load(settings=(*SETTINGS, "search.method=published", f"search.beam_width={width}", "search.most_parts=2"))
    problem = Problem(shapes.branch(), profile)
    table = problem.table(problem.root, described=True)
    plain, *_ = rank_classic([table], np.inf)
    told: list[tuple[int, int]] = []
    best, _ = search_as_published(problem, LastFirst(shipped().file), None, lambda *given: told.append(given[:2]))
    assert told == [(1, width + 1)]
    assert (best.cuts[-1].base.normal @ table.plane(plain.row).normal) == pytest.approx(1.0)
    assert best.cuts[-1].base.offset_mm == pytest.approx(table.plane(plain.row).offset_mm)


class LastFirst(LearnedRanker):
    """A learned ranker that prefers the last choice of the classic ranking."""

    def rank(self, offered: Iterable[RankedCandidate]) -> Iterator[RankedCandidate]:
        return reversed(list(offered))


def test_a_single_slot_is_polished_where_a_learned_ranker_saved_the_time() -> None:
    for ranker, finalists in ((shipped(), 1), (None, 0)):
        beam = Beam(_problem(1), ranker, None)
        beam.advance()
        assert len(beam.finalists()) == finalists


def test_the_next_candidates_are_tried_if_no_shortlisted_one_can_be_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = _problem()
    table = problem.table(problem.root, described=True)
    listed = {table.plane(each.row).offset_mm for each in shortlist([table], np.inf)}
    cut = problem.cut
    monkeypatch.setattr(problem, "cut", lambda node, plane, *rest: None if plane.offset_mm in listed else cut(node, plane, *rest))
    beam = Beam(problem, shipped(), None)
    beam.advance()
    assert beam.best.cuts[0].base.offset_mm not in listed


def test_an_unknown_ranker_is_refused_with_the_known_names() -> None:
    with pytest.raises(UserError, match=r"--ranker oracle: classic, learned or the name of an \.onnx file is allowed"):
        ranker_named("oracle")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, ": there is no such file"),
        (b"", " is not an ONNX file"),
        (b"solid", " is not an ONNX file"),
        (5000, " is not an ONNX file"),
    ],
)
def test_a_missing_a_foreign_and_a_truncated_file_are_a_sentence(
    tmp_path: Path, content: bytes | int | None, sentence: str
) -> None:
    file = tmp_path / "mine.onnx"
    if content is not None:
        file.write_bytes(shipped().file.read_bytes()[:content] if isinstance(content, int) else content)
    with pytest.raises(UserError, match=rf"^ranker \S+mine\.onnx{sentence}[^\n]*$"):
        ranker_named(str(file))


def test_candidates_without_a_number_are_a_sentence() -> None:
    rows = np.full((2, len(shipped().columns)), np.nan)
    with pytest.raises(UserError, match="gives no number for each of 2 candidates"):
        shipped().scores(rows)


@pytest.mark.train
@pytest.mark.parametrize(
    ("names", "columns", "sentence"),
    [
        (("rows", "scores"), ("M1", "M2"), r"takes \['rows'\] and gives \['scores'\]; features and scores are needed"),
        (("features", "out"), ("M1", "M2"), r"gives \['out'\]; features and scores are needed"),
        (("features", "scores"), ("M1", "luck"), "wants the feature luck, which this version does not know"),
        (("features", "scores"), (), "names no features"),
        (("features", "scores"), ("M1", "M2", "M3"), "3 features a candidate are named"),
    ],
)
def test_a_network_with_other_names_or_another_shape_is_a_sentence(
    tmp_path: Path, names: tuple[str, str], columns: tuple[str, ...], sentence: str
) -> None:
    onnx = pytest.importorskip("onnx")
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    nodes = [helper.make_node("ReduceSum", [names[0]], [names[1]], keepdims=0)]
    given = helper.make_tensor_value_info(names[0], kind, ["n", 2])
    taken = helper.make_tensor_value_info(names[1], kind, None)
    model = helper.make_model(helper.make_graph(nodes, "g", [given], [taken]), opset_imports=[helper.make_opsetid("", 13)])
    model.ir_version = 8
    helper.set_model_props(model, {"features": ",".join(columns)})
    file = tmp_path / "other.onnx"
    file.write_bytes(model.SerializeToString())
    with pytest.raises(UserError, match=sentence):
        ranker_named(str(file))


def test_a_decomposition_names_its_ranker_and_a_learned_one_is_not_worse_than_the_uncut_model() -> None:
    found = decompose(
        shapes.branch(), "branch", load(settings=(*SETTINGS, "search.beam_width=1")), SearchRequest(ranker="learned")
    )
    assert found.ranker == "learned"
    assert found.reduction > 0.5
