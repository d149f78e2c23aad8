"""Planes and marks as values: edits, locks, and marks that stay on the model when it is rotated or scaled."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from machine.workbench.bench.bench import (
    Bench,
    History,
    Step,
    locked_plan,
    plan_of_bench,
    with_cuts,
    with_model_turned_as_read,
    with_profile,
    with_rotation,
    with_scaled_model,
)
from machine.workbench.bench.changes import workpiece_mesh
from machine.workbench.work.models import named_faces
from mdp.directions.orientation import set_on_plate
from mdp.pose import about, turned_by, unit
from mdp.search.plan_file import PlannedPart
from mdp.search.plan_reading import read_plan
from mdp.search.plan_writing import plan_text
from mdp.zone import Grown, MeshVolume, Modifier, Zone, Zones
from profiles.errors import PlanError
from profiles.profile import load
from tests.machine.workbench.models import changed, edited_cuts, model
from tests.shapes import tee

A, B, C = (PlannedPart((0.0, 0.0, 1.0), offset_mm) for offset_mm in (10.0, 20.0, 30.0))
BENCH = replace(Bench(load(), model()), cuts=(A, B, C))
NEW: dict[str, Any] = {"normal": [0, 3, 4], "offset_mm": 7}
PUT = PlannedPart((0.0, 0.6, 0.8), 7.0)
ARM = Grown((-12.0, 1.0, 30.0), 1.0)
BOX = Zone((1.0, 2.0, 3.0), (9.0, 9.0, 9.0))
LIFTED = load(settings=["search.pedestal_mm=10"])
MARKED = replace(
    Bench(load(), model()),
    zones=Zones(keep=(BOX,), no_support=(ARM,)),
)


@pytest.mark.parametrize(
    ("edit", "asked", "cuts"),
    [
        ("move", {"part": 3, **NEW}, (A, PUT, C)),
        ("add", {"after": 1, **NEW}, (PUT, A, B, C)),
        ("add", {**NEW}, (A, B, C, PUT)),
        ("remove", {"part": 2}, (B, C)),
        ("reorder", {"part": 2, "to": 4}, (B, C, A)),
        ("reorder", {"part": 4, "to": 3}, (A, C, B)),
    ],
)
def test_an_edit_gives_the_planes_in_print_order(edit: str, asked: dict[str, Any], cuts: tuple[PlannedPart, ...]) -> None:
    assert edited_cuts(BENCH, edit, **asked) == cuts


@pytest.mark.parametrize(
    ("edit", "asked", "said"),
    [
        ("move", {"part": 1, **NEW}, "part is 1: 2 to 4 is allowed"),
        ("remove", {"part": 5}, "part is 5: 2 to 4 is allowed"),
        ("add", {"after": 0, **NEW}, "after is 0: 1 to 4 is allowed"),
        ("reorder", {"part": 2, "to": None}, "to is null: it must be a whole number"),
        ("move", {"part": 2, "normal": [0, 0, 0], "offset_mm": 1}, "is not a direction: a length of about 1 is expected"),
        ("move", {"part": 2, "normal": [0, 0, True], "offset_mm": 1}, "normal.2 is true: it must be a list of three numbers"),
        (
            "move",
            {"part": 2, "normal": [0, 0, 1], "offset_mm": 1e9},
            "offset_mm is 1000000000.0: it must be a number from -100000 to 100000",
        ),
    ],
)
def test_an_edit_that_makes_no_sense_is_one_sentence(edit: str, asked: dict[str, Any], said: str) -> None:
    with pytest.raises(PlanError, match=said):
        edited_cuts(BENCH, edit, **asked)


def test_a_locked_plane_stays_where_it_is_until_it_is_unlocked() -> None:
    locked = changed(History(Step("", BENCH)), "lock", part=3, locked=True)
    assert locked_plan(locked.now.bench).parts == (B,)
    with pytest.raises(PlanError, match="the plane of part 3 is locked"):
        edited_cuts(locked.now.bench, "move", part=3, **NEW)
    assert edited_cuts(locked.now.bench, "reorder", part=3, to=2) == (B, A, C)
    assert changed(locked, "lock", part=3, locked=False).now.bench.locked == frozenset()


def test_a_lock_is_removed_with_its_plane() -> None:
    locked = changed(History(Step("", BENCH)), "lock", part=3, locked=True).now.bench
    assert with_cuts(locked, (C, B)).locked == {B}
    assert with_cuts(locked, (A, C)).locked == frozenset()


@pytest.mark.parametrize("angle_deg", [90.0, 180.0, 37.0])
def test_marks_stay_where_they_are_on_the_model_however_often_it_is_turned(angle_deg: float) -> None:
    turned = with_rotation(MARKED, about(unit([1.0, 2.0, 0.5]), np.radians(angle_deg)).tolist())
    again = with_rotation(turned, about(unit([0.0, 1.0, -0.5]), np.radians(angle_deg)).tolist())
    for bench in (turned, again):
        (box,), (zone,) = bench.zones.keep, bench.zones.no_support
        assert isinstance(box, Zone)
        assert (box.faces(workpiece_mesh(bench)) == BOX.faces(tee())).all()
        assert (named_faces(bench) == named_faces(MARKED)).all()
        assert isinstance(zone, Grown)
        assert zone.away_mm(workpiece_mesh(bench)) < 0.002
    back = with_rotation(again, MARKED.rotation).zones
    assert back.keep == (BOX,)
    assert isinstance(back.no_support[0], Grown)
    assert back.no_support[0].point_mm == pytest.approx(ARM.point_mm, abs=0.003)


def test_a_box_on_a_model_that_is_laid_down_is_a_plain_one_again() -> None:
    (box,) = with_rotation(MARKED, ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0))).zones.keep
    assert box == Zone((-17.0, 2.0, 11.0), (-11.0, 9.0, 19.0))  # the tee is 40 mm wide and tall


def test_a_plan_of_boxes_without_end_on_a_model_turned_by_rounded_numbers_is_read_again(tmp_path: Path) -> None:
    half = Zone((-1e5, -1e5, -1e5), (1e5, 0.0, 1e5))
    bench, file = replace(MARKED, zones=Zones(keep=(half,)), cuts=()), tmp_path / "plan.toml"
    for deg in range(10, 60):
        bench = with_rotation(bench, about(unit([1.0, 0.01 * deg, 0.5]), np.radians(deg)).round(7).tolist())
    (box,) = bench.zones.keep
    file.write_text(plan_text(plan_of_bench(replace(bench, cuts=()), "tiltprint")))
    assert read_plan(file).zones.keep == (box,)
    assert isinstance(box, Zone)
    assert (box.faces(workpiece_mesh(bench)) == half.faces(tee())).all()


def test_modifiers_go_along_with_a_model_but_for_meshes(tmp_path: Path) -> None:
    heights = Zone((-1e5, -1e5, 10.0), (1e5, 1e5, 20.0))
    both = replace(
        MARKED, zones=Zones(modifiers=(Modifier(BOX, {"walls": 4}), Modifier(heights, {"infill_density": 0.5}))), cuts=()
    )
    larger = with_scaled_model(both, model(mesh=tee().transform(2.0 * np.eye(3))), 2.0)
    box, slab = (modifier.volume for modifier in larger.zones.modifiers)
    assert box == Zone((2.0, 4.0, 6.0), (18.0, 18.0, 18.0))
    assert slab == Zone((-1e5, -1e5, 20.0), (1e5, 1e5, 40.0))
    assert [modifier.process for modifier in larger.zones.modifiers] == [{"walls": 4}, {"infill_density": 0.5}]
    mesh = replace(both, zones=Zones(modifiers=(Modifier(MeshVolume(tmp_path / "a.stl", tee()), {"walls": 4}),)))
    with pytest.raises(PlanError, match=r"modifier 1: its mesh lies where a\.stl has it and cannot be moved with the model"):
        with_rotation(mesh, ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)))


def test_planes_and_marks_go_along_with_a_model_that_is_scaled_and_lifted() -> None:
    cut = replace(MARKED, cuts=(PlannedPart((0.6, 0.0, 0.8), 20.0),))
    larger = with_scaled_model(cut, model(mesh=tee().transform(2.0 * np.eye(3))), 2.0)
    lifted = with_profile(larger, larger.given, load(settings=["search.pedestal_mm=10"]))
    assert lifted.cuts == (PlannedPart((0.6, 0.0, 0.8), 48.0),)
    assert lifted.zones == Zones(keep=(Zone((2.0, 4.0, 16.0), (18.0, 18.0, 28.0)),), no_support=(Grown((-24.0, 2.0, 70.0), 1.0),))


def test_marks_move_with_a_model_that_is_read_again_turned_and_scaled() -> None:
    turn = turned_by((0.0, 90.0, 0.0))
    again = model(mesh=set_on_plate(tee(), turn).transform(2.0 * np.eye(3)))
    cut = with_profile(replace(MARKED, cuts=(PlannedPart((0.6, 0.0, 0.8), 20.0),)), MARKED.given, LIFTED)
    turned = with_model_turned_as_read(with_rotation(cut, about(unit([1.0, 2.0, 0.5]), 0.7).tolist()), again, turn, 2.0)
    stood = with_model_turned_as_read(cut, again, turn, 2.0)
    assert (stood.cuts, stood.zones.keep) == (None, (Zone((-34.0, 4.0, 32.0), (-22.0, 18.0, 48.0)),))
    for bench in (turned, stood):
        (box,), (zone,) = bench.zones.keep, bench.zones.no_support
        assert isinstance(box, Zone)
        assert (box.faces(workpiece_mesh(bench)) == BOX.faces(tee())).all()
        assert isinstance(zone, Grown)
        assert zone.away_mm(workpiece_mesh(bench)) < 0.005


def test_a_move_of_a_box_beyond_the_limits_of_a_plan_is_refused() -> None:
    far = replace(MARKED, zones=Zones(no_seam=(BOX, Zone((9e4, 0.0, 0.0), (9.5e4, 1.0, 1.0)))))
    assert far.model is not None
    said = r"no_seam 2: its box would have min_mm \[180000, 0, 0\] and max_mm \[190000, 2, 2\]: -100000 to 100000 is allowed"
    with pytest.raises(PlanError, match=said):
        with_scaled_model(far, far.model, 2.0)


def test_faces_marked_with_several_kinds_are_listed_for_each() -> None:
    both = replace(MARKED, zones=Zones(no_seam=(Grown((0.0, 5.0, 10.0), 1.0),), no_support=(ARM,)))
    assert named_faces(both).sum(axis=1).tolist() == [0, 6, 2, 0]
