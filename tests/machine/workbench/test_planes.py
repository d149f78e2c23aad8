"""Planes moved, added, taken away, put into another order and locked, as values."""

from dataclasses import replace
from typing import Any

import pytest

from machine.workbench.bench.bench import Bench, History, Step, locked_plan, with_cuts
from machine.workbench.bench.changes import lock
from machine.workbench.bench.planes import add_plane, move_plane, remove_plane, reorder
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
        (move_plane, {"part": 3, **NEW}, (A, PUT, C)),
        (add_plane, {"after": 1, **NEW}, (PUT, A, B, C)),
        (add_plane, {**NEW}, (A, B, C, PUT)),
        (remove_plane, {"part": 2}, (B, C)),
        (reorder, {"part": 2, "to": 4}, (B, C, A)),
        (reorder, {"part": 4, "to": 3}, (A, C, B)),
    ],
)
def test_an_edit_gives_the_planes_in_print_order(edit: Any, asked: dict[str, Any], cuts: tuple[PlannedPart, ...]) -> None:
    assert edit(BENCH, asked) == cuts


@pytest.mark.parametrize(
    ("edit", "asked", "said"),
    [
        (move_plane, {"part": 1, **NEW}, "part is 1: 2 to 4 is allowed"),
        (remove_plane, {"part": 5}, "part is 5: 2 to 4 is allowed"),
        (add_plane, {"after": 0, **NEW}, "after is 0: 1 to 4 is allowed"),
        (reorder, {"part": 2, "to": None}, "to is None: 2 to 4 is allowed"),
        (move_plane, {"part": 2, "normal": [0, 0, 0], "offset_mm": 1}, "a direction of a length of about 1"),
        (move_plane, {"part": 2, "normal": [0, 0, True], "offset_mm": 1}, "three numbers are expected"),
        (move_plane, {"part": 2, "normal": [0, 0, 1], "offset_mm": 1e9}, "offset_mm is 1000000000.0"),
    ],
)
def test_an_edit_that_makes_no_sense_is_one_sentence(edit: Any, asked: dict[str, Any], said: str) -> None:
    with pytest.raises(PlanError, match=said):
        edit(BENCH, asked)


def test_a_locked_plane_stays_where_it_is_until_it_is_unlocked() -> None:
    locked = changed(History(Step("", BENCH)), lock, part=3, locked=True)
    assert locked_plan(locked.now.bench).parts == (B,)
    with pytest.raises(PlanError, match="the plane of part 3 is locked"):
        move_plane(locked.now.bench, {"part": 3, **NEW})
    assert reorder(locked.now.bench, {"part": 3, "to": 2}) == (B, A, C)
    assert changed(locked, lock, part=3, locked=False).now.bench.locked == frozenset()


def test_a_lock_goes_with_its_plane() -> None:
    locked = changed(History(Step("", BENCH)), lock, part=3, locked=True).now.bench
    assert with_cuts(locked, (C, B)).locked == {B}
    assert with_cuts(locked, (A, C)).locked == frozenset()
