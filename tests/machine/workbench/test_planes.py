"""Planes moved, added, taken away, put into another order and locked, as values."""

from dataclasses import replace
from typing import Any

import pytest

from machine.workbench.bench.bench import Bench, History, Step, locked_plan, with_cuts
from machine.workbench.bench.changes import Lock
from machine.workbench.bench.planes import Add, Move, Remove, Reorder
from mdp.search.plan_file import PlannedPart
from profiles.errors import PlanError
from profiles.profile import load
from tests.machine.workbench.models import changed, model

A, B, C = (PlannedPart((0.0, 0.0, 1.0), offset_mm) for offset_mm in (10.0, 20.0, 30.0))
BENCH = replace(Bench(load(), model()), cuts=(A, B, C))
NEW = {"normal": [0, 3, 4], "offset_mm": 7}
PUT = PlannedPart((0.0, 0.6, 0.8), 7.0)


@pytest.mark.parametrize(
    ("edit", "asked", "cuts"),
    [
        (Move, {"part": 3, **NEW}, (A, PUT, C)),
        (Add, {"after": 1, **NEW}, (PUT, A, B, C)),
        (Add, {**NEW}, (A, B, C, PUT)),
        (Remove, {"part": 2}, (B, C)),
        (Reorder, {"part": 2, "to": 4}, (B, C, A)),
        (Reorder, {"part": 4, "to": 3}, (A, C, B)),
    ],
)
def test_an_edit_gives_the_planes_in_print_order(edit: Any, asked: dict[str, Any], cuts: tuple[PlannedPart, ...]) -> None:
    assert edit.of(asked).cuts(BENCH) == cuts


@pytest.mark.parametrize(
    ("edit", "asked", "said"),
    [
        (Move, {"part": 1, **NEW}, "part is 1: 2 to 4 is allowed"),
        (Remove, {"part": 5}, "part is 5: 2 to 4 is allowed"),
        (Add, {"after": 0, **NEW}, "after is 0: 1 to 4 is allowed"),
        (Reorder, {"part": 2, "to": None}, "to is null: it must be a whole number"),
        (Move, {"part": 2, "normal": [0, 0, 0], "offset_mm": 1}, "no direction: a length of about 1 is expected"),
        (Move, {"part": 2, "normal": [0, 0, True], "offset_mm": 1}, "normal.2 is true: it must be a list of three numbers"),
        (
            Move,
            {"part": 2, "normal": [0, 0, 1], "offset_mm": 1e9},
            "offset_mm is 1000000000.0: it must be a number from -100000 to 100000",
        ),
    ],
)
def test_an_edit_that_makes_no_sense_is_one_sentence(edit: Any, asked: dict[str, Any], said: str) -> None:
    with pytest.raises(PlanError, match=said):
        edit.of(asked).cuts(BENCH)


def test_a_locked_plane_stays_where_it_is_until_it_is_unlocked() -> None:
    locked = changed(History(Step("", BENCH)), Lock, part=3, locked=True)
    assert locked_plan(locked.now.bench).parts == (B,)
    with pytest.raises(PlanError, match="the plane of part 3 is locked"):
        Move.of({"part": 3, **NEW}).cuts(locked.now.bench)
    assert Reorder.of({"part": 3, "to": 2}).cuts(locked.now.bench) == (B, A, C)
    assert changed(locked, Lock, part=3, locked=False).now.bench.locked == frozenset()


def test_a_lock_goes_with_its_plane() -> None:
    locked = changed(History(Step("", BENCH)), Lock, part=3, locked=True).now.bench
    assert with_cuts(locked, (C, B)).locked == {B}
    assert with_cuts(locked, (A, C)).locked == frozenset()
