"""The bench as a value: turning, laying down, taking a row, undo and redo."""

from dataclasses import replace

import numpy as np
import pytest

from machine.app.workbench.bench.bench import STANDING, Bench, History, Step, plan_of_bench, with_front
from machine.app.workbench.bench.commands import obey
from mdp.decomposition import FrontRow
from mdp.plane import Plane
from profiles.errors import PlanError
from profiles.profile import load
from tests.machine.app.workbench.models import model
from tests.shapes import branch

PROFILE = load()
LOW, HIGH = Plane(np.array([0.0, 0.0, 1.0]), 10.0), Plane(np.array([0.0, 0.0, 1.0]), 30.0)
FRONT = (
    FrontRow((), 500.0, 0.0, 500.0),
    FrontRow((LOW,), 100.0, 40.0, 140.0),
    FrontRow((HIGH, LOW), 0.0, 80.0, 90.0, chosen=True),
)


def history(bench: Bench | None = None) -> History:
    return History(Step("", bench or Bench(PROFILE, model())))


def test_a_quarter_turn_is_exact_and_four_of_them_are_none() -> None:
    turned = history()
    for _ in range(3):
        turned = obey(turned, {"do": "turn", "axis": "x", "deg": 90})
    assert turned.now.bench.rotation == ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    assert obey(turned, {"do": "turn", "axis": "x", "deg": 90}).now.bench.rotation == STANDING


def test_a_face_that_is_laid_down_looks_down() -> None:
    mesh = branch()
    start = history(Bench(PROFILE, model("branch.stl", mesh)))
    for face in (0, 40, 200):
        rotation = np.array(obey(start, {"do": "lay", "face": face}).now.bench.rotation)
        assert rotation @ mesh.normals[face] == pytest.approx([0, 0, -1], abs=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_everything_is_undone_and_done_again() -> None:
    found = with_front(history().now.bench, FRONT)
    steps = history().do("find parts", found)
    fewer = obey(steps, {"do": "take", "parts": 2})
    turned = obey(fewer, {"do": "turn", "axis": "z", "deg": 30})
    assert [turned.now.bench.parts, fewer.now.bench.parts, steps.now.bench.parts] == [0, 2, 3]
    back = obey(obey(turned, {"do": "undo"}), {"do": "undo"})
    assert back.now.bench is found
    assert obey(obey(back, {"do": "redo"}), {"do": "redo"}).now.bench is turned.now.bench
    assert obey(back, {"do": "take", "parts": 1}).undone == ()


def test_steps_back_end_where_their_models_would_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.app.workbench.bench.bench.MOST_KEPT_FACES", 3 * 28)  # a tee has 28 faces
    now = history(Bench(PROFILE))
    for name in "abcdef":
        now = now.do(f"open {name}", Bench(PROFILE, model(name)))
        now = now.do(f"find parts of {name}", replace(now.now.bench, cuts=()))
    assert [step.word for step in now.before][:2] == ["open d", "find parts of d"]


def test_what_changes_nothing_is_no_step() -> None:
    found = history().do("find parts", with_front(history().now.bench, FRONT))
    assert obey(found, {"do": "take", "parts": 3}) is found
    assert obey(history(), {"do": "turn", "axis": "y", "deg": 0}).before == ()


def test_a_plan_has_the_planes_in_print_order() -> None:
    plan = plan_of_bench(with_front(history().now.bench, FRONT), "plan.toml")
    assert [part.offset_mm for part in plan.parts] == [10.0, 30.0]
    assert [len(row.parts) for row in plan.front] == [0, 1, 2]
    assert (plan.model, plan.orientation, plan.sha256) == ("tee.stl", None, "")


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"do": "dance"}, "'dance' is no command of the workbench"),
        ({"do": ["turn"]}, "is no command"),
        ({"do": "turn", "axis": "w", "deg": 1}, "axis is 'w': x, y, z are allowed"),
        ({"do": "turn", "axis": ["x"], "deg": 1}, "axis is"),
        ({"do": "turn", "axis": "x", "deg": 10**400}, "deg is 1000"),
        ({"do": "turn", "axis": "x", "deg": True}, "deg is True"),
        ({"do": "turn", "axis": "x", "deg": float("nan")}, "deg is nan"),
        ({"do": "lay", "face": 28}, "face is 28: 0 to 27 is allowed"),
        ({"do": "stand", "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "its rows are no rotation"),
        ({"do": "stand", "rotation": [[1, 0], [0, 1]]}, "three rows of three numbers"),
        ({"do": "take", "parts": 3}, "parts is 3"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(asked: dict[str, object], said: str) -> None:
    with pytest.raises(PlanError, match=said.replace("(", r"\(")):
        obey(history(), asked)


def test_without_a_model_nothing_can_be_turned() -> None:
    with pytest.raises(PlanError, match="choose a file first"):
        obey(history(Bench(PROFILE)), {"do": "turn", "axis": "x", "deg": 90})
