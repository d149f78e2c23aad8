"""The bench as a value: rotating, placing on a face, choosing a row, undo and redo."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from machine.workbench.bench.bench import STANDING, Bench, History, Step, plan_of_bench, with_front
from mdp.decomposition import FrontRow
from mdp.plane import Plane
from mdp.search.plan_file import PlannedPart
from profiles.errors import PlanError
from profiles.profile import load
from tests.machine.workbench.models import changed, model
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


def test_a_quarter_turn_is_exact_and_four_of_them_are_the_identity() -> None:
    turned = history()
    for _ in range(3):
        turned = changed(turned, "turn", axis="x", deg=90)
    assert turned.now.bench.rotation == ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
    assert changed(turned, "turn", axis="x", deg=90).now.bench.rotation == STANDING


def test_a_face_that_is_laid_down_looks_down() -> None:
    mesh = branch()
    start = history(Bench(PROFILE, model("branch.stl", mesh)))
    for face in (0, 40, 200):
        rotation = np.array(changed(start, "lay", normal=mesh.normals[face].tolist()).now.bench.rotation)
        assert rotation @ mesh.normals[face] == pytest.approx([0, 0, -1], abs=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_one_copy_is_allowed_and_zero_copies_are_not() -> None:
    three = changed(history(), "copies", count=3)
    assert [steps.now.bench.copies for steps in (three, changed(three, "copies", count=1))] == [3, 1]
    with pytest.raises(PlanError, match="is 0: 1 to 1000 is allowed"):
        changed(three, "copies", count=0)


def test_everything_is_undone_and_done_again() -> None:
    searched = with_front(history().now.bench, FRONT)
    steps = history().do("find parts", searched)
    fewer = changed(steps, "take", parts=2)
    turned = changed(fewer, "turn", axis="z", deg=30)
    assert [turned.now.bench.parts, fewer.now.bench.parts, steps.now.bench.parts] == [0, 2, 3]
    back = turned.undo().undo()
    assert back.now.bench is searched
    assert back.redo().redo().now.bench is turned.now.bench
    assert changed(back, "take", parts=1).undone == ()


def test_steps_back_end_where_their_models_would_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.workbench.bench.bench.MOST_KEPT_FACES", 3 * 28)  # a tee has 28 faces
    now = history(Bench(PROFILE))
    for name in "abcdef":
        now = now.do(f"open {name}", Bench(PROFILE, model(name)))
        now = now.do(f"find parts of {name}", replace(now.now.bench, cuts=()))
    assert [step.word for step in now.before][:2] == ["open d", "find parts of d"]


def test_a_command_that_changes_nothing_adds_no_step() -> None:
    searched = history().do("find parts", with_front(history().now.bench, FRONT))
    assert changed(searched, "take", parts=3) is searched
    assert changed(history(), "turn", axis="y", deg=0).before == ()


def test_a_plan_has_the_planes_in_print_order() -> None:
    plan = plan_of_bench(with_front(history().now.bench, FRONT), "plan.toml")
    assert [part.offset_mm for part in plan.parts] == [10.0, 30.0]
    assert [row.parts for row in plan.front] == [1, 2, 3]
    assert (plan.model, plan.orientation, plan.sha256) == ("tee.stl", None, "")


@pytest.mark.parametrize(
    ("change", "asked", "said"),
    [
        ("turn", {"axis": "w", "deg": 1}, 'axis is "w": it must be one of "x", "y", "z"'),
        ("turn", {"axis": ["x"], "deg": 1}, "axis is"),
        ("turn", {"axis": "x", "deg": 10**400}, "deg is 1000"),
        ("turn", {"axis": "x", "deg": True}, "deg is true"),
        ("turn", {"axis": "x", "deg": float("nan")}, "deg is nan: it must be a number from -360 to 360"),
        ("lay", {"normal": [0, 0, 0]}, r"normal: \[0.0, 0.0, 0.0\] is not a direction: a length of about 1 is expected"),
        ("stand", {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "rotation: its rows are not a rotation"),
        ("stand", {"rotation": [[1, 0], [0, 1]]}, "rotation is .1, 0.: it must be a list of three numbers"),
        ("stand", {"rotation": [[1, 0, 0], [0, 1, 0], None]}, "rotation.2 is null: it must be a list of three numbers"),
        ("take", {"parts": 3}, "parts is 3"),
    ],
)
def test_an_impossible_command_is_refused_in_one_sentence(change: str, asked: dict[str, Any], said: str) -> None:
    with pytest.raises(PlanError, match=said):
        changed(history(), change, **asked)


def test_a_locked_limb_stays_locked_where_a_search_names_it_by_another_point() -> None:
    clicked = PlannedPart((0.0, 0.0, 1.0), 12.0, limbs_mm=((30.0, 8.0, 14.0),))
    bench = replace(Bench(PROFILE, model()), cuts=(clicked,), locked=frozenset({clicked}))
    limb = Plane(np.array([0.0, 0.0, 1.0]), 12.0, np.array([[33.0, 17.0, 36.0]]))
    searched = with_front(bench, (FrontRow((), 500.0, 0.0, 500.0), FrontRow((limb,), 100.0, 40.0, 140.0, chosen=True)))
    assert searched.locked == frozenset(searched.cuts or ()) == {PlannedPart.of(limb)}


def test_each_of_two_limbs_of_one_plane_keeps_its_own_lock() -> None:
    clicked = tuple(PlannedPart((0.0, 0.0, 1.0), 12.0, limbs_mm=((x, 8.0, 14.0),)) for x in (30.0, -30.0))
    limbs = tuple(Plane(np.array([0.0, 0.0, 1.0]), 12.0, np.array([[x, 17.0, 36.0]])) for x in (33.0, -33.0))
    for locked in (clicked, clicked[:1], clicked[1:]):
        bench = replace(Bench(PROFILE, model()), cuts=clicked, locked=frozenset(locked))
        for planes in (limbs, limbs[::-1]):
            searched = with_front(bench, (FrontRow((), 500.0, 0.0, 500.0), FrontRow(planes, 100.0, 40.0, 140.0, chosen=True)))
            assert searched.locked == {PlannedPart.of(limbs[clicked.index(part)]) for part in locked}
