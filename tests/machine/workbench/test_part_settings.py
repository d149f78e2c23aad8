"""Settings of single parts on the workbench, and the command line that does what lies on the bench."""

import json
import shlex
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from machine.pipeline.requests import Given
from machine.planning.stops import parse_stops
from machine.workbench.bench.bench import Bench, History, Step, with_cuts, with_model_turned_as_read
from machine.workbench.bench.changes import ResetPart, SetPart, Stand, Turn
from machine.workbench.bench.settings import export_command, settings_list, turns_deg, with_setting
from mdp.pose import UP, about, turned_by
from mdp.search.plan_file import PlannedPart
from profiles.errors import PlanError, ProfileError
from profiles.part_settings import OF_PARTS_ON_PLASTIC
from profiles.profile import load
from tests.machine.workbench.models import changed, model

LOW, MIDDLE, HIGH = (PlannedPart((0.0, 0.0, 1.0), offset) for offset in (10.0, 20.0, 30.0))
BENCH = Bench(load(), model(), cuts=(LOW, MIDDLE))


def with_own(bench: Bench, part: int, key: str, value: str | None) -> Bench:
    return SetPart(part=part, key=key, value=value).change(bench)


def own(bench: Bench) -> dict[int, dict[str, object]]:
    return {settings.part: settings.process for settings in bench.profile.parts}


def test_a_part_has_values_of_its_own_that_are_marked_and_go_back() -> None:
    bench = with_own(with_own(BENCH, 2, "process.walls", "5"), 2, "seam", "rear")
    assert own(bench) == {2: {"walls": 5, "seam": "rear"}}
    row = next(row for row in settings_list(bench.profile, Given(), 2) if row["key"] == "process.walls")
    assert (row["value"], row["changed"]) == (5, True)
    assert own(with_own(bench, 2, "process.walls", None)) == {2: {"seam": "rear"}}
    assert own(ResetPart(part=2).change(bench)) == {}


def test_only_what_a_part_may_have_of_its_own_is_listed() -> None:
    first, second = ({row["key"] for row in settings_list(load(), Given(), part)} for part in (1, 2))
    assert "process.scale" not in first | second
    assert second - first == {f"process.{key}" for key in OF_PARTS_ON_PLASTIC}
    assert "process.interface_fan" in second - first


@pytest.mark.parametrize(
    ("cuts", "stops", "lost"),
    [
        ((LOW, HIGH, MIDDLE), "--pause 1:3 --pause 4:15 --filament-change 9:1", ""),
        ((HIGH, MIDDLE), "--pause 1:3 --pause 3:15 --filament-change 9:1", ""),
        ((LOW,), "--pause 1:3 --filament-change 9:1", "cut: taken away with part 3: --pause 3:15 (Undo brings it back)"),
    ],
)
def test_a_pause_goes_with_its_part_and_says_so_and_undo_brings_it_back(
    cuts: tuple[PlannedPart, ...], stops: str, lost: str
) -> None:
    steps = History(Step("", replace(BENCH, stops=parse_stops(["1:3", "3:15"], ["9:1"]))))
    after = steps.do("cut", with_cuts(steps.now.bench, cuts))
    assert " ".join(stop.option for stop in after.now.bench.stops) == stops
    assert after.now.lost == lost
    assert after.undo().now.bench.stops == steps.now.bench.stops


def test_settings_follow_the_plane_of_their_part_and_go_with_it() -> None:
    bench = with_own(BENCH, 3, "process.walls", "5")
    assert own(with_cuts(bench, (LOW, HIGH, MIDDLE))) == {4: {"walls": 5}}
    assert own(with_cuts(bench, (MIDDLE,))) == {2: {"walls": 5}}
    assert own(with_cuts(bench, (LOW, HIGH))) == {3: {"walls": 5}}
    assert own(with_cuts(bench, (LOW,))) == {}


def test_what_a_part_had_of_its_own_is_told_when_it_goes_with_its_part_and_undo_brings_it_back() -> None:
    bench = with_own(with_own(BENCH, 3, "ironing", "true"), 1, "walls", "5")
    steps = History(Step("", replace(bench, stops=parse_stops(["3:15"], []))))
    after = steps.do("cut", with_cuts(steps.now.bench, (LOW,)))
    assert after.now.lost == "cut: taken away with part 3: --pause 3:15, --part 3:ironing=true (Undo brings them back)"
    assert own(after.undo().now.bench) == {1: {"walls": 5}, 3: {"ironing": True}}
    turned = changed(steps, Turn, axis="x", deg=90).now
    assert own(turned.bench) == {1: {"walls": 5}}
    assert "--part 3:ironing=true" in turned.lost
    assert bench.model is not None
    assert own(with_model_turned_as_read(bench, bench.model, about(UP, 1.0))) == {1: {"walls": 5}}
    assert changed(steps, ResetPart, part=3).now.lost == ""


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        ({"part": 4, "key": "process.walls", "value": "5"}, "part is 4: 1 to 3 is allowed"),
        ({"part": 2, "key": "process.scale", "value": "2"}, "part 2: process.scale holds for the whole print"),
        ({"part": 2, "key": "process.walls", "value": "-1"}, r"part 2: process\.walls"),
    ],
)
def test_what_a_part_cannot_have_is_told(asked: dict[str, object], sentence: str) -> None:
    with pytest.raises((PlanError, ProfileError), match=sentence):
        SetPart.of(asked).change(BENCH)


def test_the_command_line_names_what_differs_from_the_usual() -> None:
    given = Given(machine="fractal5pro", settings=("process.walls=4",))
    start = "tiltprint export tee.stl --machine fractal5pro --set process.walls=4"
    assert export_command(replace(BENCH, given=given)) == f"{start} --plan tee-plan.toml -o tee.gcode"
    uncut = with_own(replace(BENCH, given=given, cuts=None), 1, "process.ironing", "true")
    assert export_command(uncut) == f"{start} --parts 1 --as-is --part 1:ironing=true -o tee.gcode"


def test_the_command_line_sets_blocks_lists_and_names_as_they_are() -> None:
    given = BENCH.given
    for key, value in {
        "machine.gcode.before_part": json.dumps("M400\nM117 'part' \"{part}\" \\ $HOME `ls` -x\n"),
        "machine.head.boxes": '[\n  {name = "it\'s a duct", min_mm = [1, 1, 1], max_mm = [2, 2, 2]},\n]',
        "machine.name": json.dumps("mine, number 2"),
        "machine.sources": '{\n  "machine.x" = "measured",\n  "machine.y" = "guessed"\n}',
    }.items():
        given = with_setting(given, key, value)
    words = shlex.split(export_command(replace(BENCH, given=given)))
    typed = [word for option, word in pairwise(words) if option == "--set"]
    machine = load(settings=typed).machine
    assert machine.gcode.before_part == "M400\nM117 'part' \"{part}\" \\ $HOME `ls` -x\n"
    assert [box.name for box in machine.head.boxes] == ["it's a duct"]
    assert (machine.name, machine.sources) == ("mine, number 2", {"machine.x": "measured", "machine.y": "guessed"})


@pytest.mark.parametrize("angles_deg", [(20.0, -50.0, 130.0), (0.0, 90.0, 30.0), (0.0, 0.0, 0.0)])
def test_the_turns_of_the_command_line_stand_the_model_as_it_is(angles_deg: tuple[float, float, float]) -> None:
    profile = load(settings=["process.rotate_deg=[10, 0, 0]"])
    turned = Stand.of({"rotation": turned_by(angles_deg).tolist()}).change(Bench(profile, BENCH.model))
    assert turned_by(turns_deg(turned)) == pytest.approx(turned_by(angles_deg) @ turned_by((10.0, 0.0, 0.0)), abs=1e-9)
    assert np.linalg.det(turned_by(turns_deg(turned))) == pytest.approx(1.0)
