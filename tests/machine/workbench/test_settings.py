"""Settings on the workbench, for all parts and for single ones, and the command line with the same result."""

import json
import shlex
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from machine.pipeline.requests import Given
from machine.planning.stops import parse_stops
from machine.workbench.bench.bench import USUAL, Bench, History, Step, with_cuts, with_model_turned_as_read
from machine.workbench.bench.settings import (
    check_block,
    check_known,
    export_command,
    profile_as_given,
    profile_labels,
    settings_list,
    turns_deg,
    with_allowed,
    with_setting,
    with_typed,
    without_settings,
)
from mdp.pose import UP, about, turned_by
from mdp.search.plan_file import PlannedPart
from profiles.errors import PlanError, ProfileError
from profiles.messages import terminal_words
from profiles.part_settings import OF_PARTS_ON_PLASTIC
from profiles.profile import DEFAULTS, SECTIONS, load
from profiles.wording import keys
from tests.machine.workbench.models import changed, changed_bench, model

LOW, MIDDLE, HIGH = (PlannedPart((0.0, 0.0, 1.0), offset) for offset in (10.0, 20.0, 30.0))
BENCH = Bench(load(), model(), cuts=(LOW, MIDDLE))


def described(key: str, given: Given = USUAL) -> dict[str, Any]:
    return next(row for row in settings_list(profile_as_given(given, load()), given) if row["key"] == key)


def test_a_number_has_its_meaning_and_its_range() -> None:
    height = described("process.layer_height_mm")
    assert (height["kind"], height["least"], height["most"], height["value"], height["changed"]) == (
        "number",
        0.02,
        2,
        0.2,
        False,
    )
    assert height["meaning"] == "Height of a layer, mm (0.02 to 2)."


def test_a_share_is_shown_as_a_percentage_and_its_key_stays_a_share() -> None:
    density = described("process.infill_density", with_setting(USUAL, "process.infill_density", "7%"))
    assert [density[word] for word in ("unit", "value", "was", "least", "most")] == ["%", 7.0, "Profile value: 20 %", 0.0, 100.0]
    assert profile_as_given(with_setting(USUAL, "process.infill_density", "7%"), load()).process.infill_density == 0.07
    assert described("material.fan_bridge")["value"] is None


def test_profiles_are_listed_by_what_people_call_them() -> None:
    assert profile_labels("material", "pla") == {"abs": "ABS", "petg": "PETG", "pla": "PLA", "tpu": "TPU"}
    labels = profile_labels("machine", "generic_ac")
    assert (labels["generic_ac"], labels["three_axis"]) == ("Generic A/C table", "Three axes")
    assert profile_labels("process", "gone.toml")["gone.toml"] == "gone"


def test_choices_and_booleans_are_listed_as_such() -> None:
    assert described("process.seam")["choices"] == ["aligned", "corner", "rear", "nearest", "random"]
    assert described("process.ironing")["kind"] == "boolean"
    assert described("search.time_limit_s")["value"] is None


def test_every_key_can_be_typed_and_its_shown_value_is_accepted_as_the_same() -> None:
    rows = settings_list(load(), USUAL)
    assert {row["key"] for row in rows} == {key for name, kind in SECTIONS.items() for key, _ in keys(kind, f"{name}.")}
    assert {row["kind"] for row in rows} == {"number", "integer", "boolean", "choice", "numbers", "text", "block", "rows"}
    given = USUAL
    for row in rows:
        if row["kind"] in ("text", "block", "rows"):
            given = with_setting(given, row["key"], row["value"] if row["kind"] == "rows" else json.dumps(row["value"]))
    assert profile_as_given(given, load()) == load()
    assert not any("\n" in setting for setting in given.settings)


def test_the_settings_of_one_kind_are_taken_back_and_those_of_the_others_stay() -> None:
    given = replace(USUAL, settings=("machine.tilt.sign=-1", "material.nozzle_c=215", "process.walls=3", "search.directions=9"))
    left = {kind: [key.partition(".")[0] for key in without_settings(given, kind).settings] for kind in (*DEFAULTS, None)}
    assert left == {
        "machine": ["material", "process", "search"],
        "material": ["machine", "process", "search"],
        "process": ["machine", "material"],
        None: [],
    }


def test_a_block_names_its_placeholders_and_one_that_cannot_be_filled_in_is_refused() -> None:
    assert "clear_z_mm" in described("machine.gcode.resume")["placeholders"]
    assert "nozzle_c" in described("machine.gcode.start")["placeholders"]
    given = with_setting(USUAL, "machine.gcode.resume", json.dumps("G28\nG0 Z{nozzle_c}"))
    with pytest.raises(
        ProfileError, match=r"machine\.gcode\.resume: placeholder \{nozzle_c\} is not known: allowed are clear_z_mm"
    ):
        check_block(profile_as_given(given, load()), "machine.gcode.resume")


@pytest.mark.parametrize(
    ("typed", "sentence"),
    [
        ("[[1.0, 2.0], [1.0, 3.0]]", r"machine\.head\.silhouette_mm: .* radii must rise"),
        ("[[1.0], 2.0", r"machine\.head\.silhouette_mm is \"\[\[1.0\], 2.0\": it must be a list of one or more pairs of numbers"),
    ],
)
def test_an_invalid_list_is_refused_in_the_sentence_of_the_profile(typed: str, sentence: str) -> None:
    with pytest.raises(ProfileError, match=sentence):
        profile_as_given(with_setting(USUAL, "machine.head.silhouette_mm", typed), load())


def test_an_empty_value_leaves_out_an_optional_key() -> None:
    wound = with_setting(USUAL, "machine.turn.budget_deg", "720")
    assert (described("machine.turn.budget_deg")["optional"], described("machine.clearance_mm")["optional"]) == (True, False)
    assert profile_as_given(with_setting(wound, "machine.turn.budget_deg", ""), load()).machine.turn.budget_deg is None
    assert with_typed(wound, "machine.turn.budget_deg", "", load()) == USUAL
    with pytest.raises(ProfileError, match=r'machine\.clearance_mm is "": it must be a number from 0 to 100'):
        profile_as_given(with_setting(USUAL, "machine.clearance_mm", ""), load())


def test_a_changed_key_is_marked_and_can_be_reset() -> None:
    changed = with_setting(with_setting(USUAL, "process.walls", "3"), "process.walls", "4")
    assert changed.settings == ("process.walls=4",)
    assert (described("process.walls", changed)["value"], described("process.walls", changed)["changed"]) == (4, True)
    assert with_setting(changed, "process.walls", None) == USUAL


def test_another_machine_is_taken_by_its_name_and_an_unknown_one_refused() -> None:
    check_known("machine", "fractal5pro")
    with pytest.raises(ProfileError, match=r"'/etc/passwd' is no machine: .*generic_ac.* are known"):
        check_known("machine", "/etc/passwd")


def test_another_machine_keeps_the_settings_that_it_allows_and_names_the_others() -> None:
    typed = ("process.walls=4", "machine.tilt.limits_deg=[-100, 100]", "machine.clearance_mm=3")
    allowed = Given(machine="open5x_jubilee", settings=("process.walls=4", "machine.clearance_mm=3"))
    assert with_allowed(allowed, load()) == (allowed, "")
    kept, lost = with_allowed(replace(allowed, settings=(*typed, "process.layer_height_mm=5")), load())
    assert kept.settings[-1:] == ("machine.clearance_mm=3",)
    assert terminal_words(lost) == "process.layer_height_mm is as in the profile, which does not allow your value"


def test_a_value_out_of_range_is_the_command_line_s_sentence() -> None:
    with pytest.raises(ProfileError, match=r"process\.walls"):
        profile_as_given(with_setting(USUAL, "process.walls", "-3"), load())


def with_own(bench: Bench, part: int, key: str, value: str | None) -> Bench:
    return changed_bench(bench, "set_part", part=part, key=key, value=value)


def own(bench: Bench) -> dict[int, dict[str, object]]:
    return {settings.part: settings.process for settings in bench.profile.parts}


def test_settings_of_a_part_are_marked_and_can_be_reset() -> None:
    bench = with_own(with_own(BENCH, 2, "process.walls", "5"), 2, "seam", "rear")
    assert own(bench) == {2: {"walls": 5, "seam": "rear"}}
    row = next(row for row in settings_list(bench.profile, Given(), 2) if row["key"] == "process.walls")
    assert (row["value"], row["changed"]) == (5, True)
    assert own(with_own(bench, 2, "process.walls", None)) == {2: {"seam": "rear"}}
    assert own(changed_bench(bench, "reset_part", part=2)) == {}


def test_only_keys_that_a_part_may_set_are_listed() -> None:
    first, second = ({row["key"] for row in settings_list(load(), Given(), part)} for part in (1, 2))
    assert "process.scale" not in first | second
    assert second - first == {f"process.{key}" for key in OF_PARTS_ON_PLASTIC}
    assert "process.interface_fan" in second - first


@pytest.mark.parametrize(
    ("cuts", "stops", "lost"),
    [
        ((LOW, HIGH, MIDDLE), "--pause 1:3 --pause 4:15 --filament-change 9:1", ""),
        ((HIGH, MIDDLE), "--pause 1:3 --pause 3:15 --filament-change 9:1", ""),
        ((LOW,), "--pause 1:3 --filament-change 9:1", "cut: removed with part 3: --pause 3:15 (Undo brings it back)"),
    ],
)
def test_a_pause_is_removed_with_its_part_with_a_note_and_undo_restores_it(
    cuts: tuple[PlannedPart, ...], stops: str, lost: str
) -> None:
    steps = History(Step("", replace(BENCH, stops=parse_stops(["1:3", "3:15"], ["9:1"]))))
    after = steps.do("cut", with_cuts(steps.now.bench, cuts))
    assert " ".join(f"--{stop.option} {stop.at}" for stop in after.now.bench.stops) == stops
    assert terminal_words(after.now.lost) == lost
    assert after.undo().now.bench.stops == steps.now.bench.stops


def test_settings_follow_the_plane_of_their_part_and_go_with_it() -> None:
    bench = with_own(BENCH, 3, "process.walls", "5")
    assert own(with_cuts(bench, (LOW, HIGH, MIDDLE))) == {4: {"walls": 5}}
    assert own(with_cuts(bench, (MIDDLE,))) == {2: {"walls": 5}}
    assert own(with_cuts(bench, (LOW, HIGH))) == {3: {"walls": 5}}
    assert own(with_cuts(bench, (LOW,))) == {}


def test_settings_removed_with_their_part_are_reported_and_undo_restores_them() -> None:
    bench = with_own(with_own(BENCH, 3, "ironing", "true"), 1, "walls", "5")
    steps = History(Step("", replace(bench, stops=parse_stops(["3:15"], []))))
    after = steps.do("cut", with_cuts(steps.now.bench, (LOW,)))
    lost = "cut: removed with part 3: --pause 3:15, its own ironing=true (Undo brings them back)"
    assert terminal_words(after.now.lost) == lost
    assert own(after.undo().now.bench) == {1: {"walls": 5}, 3: {"ironing": True}}
    turned = changed(steps, "turn", axis="x", deg=90).now
    assert own(turned.bench) == {1: {"walls": 5}}
    assert "its own ironing=true" in terminal_words(turned.lost)
    assert bench.model is not None
    assert own(with_model_turned_as_read(bench, bench.model, about(UP, 1.0))) == {1: {"walls": 5}}
    assert changed(steps, "reset_part", part=3).now.lost == ""


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        ({"part": 4, "key": "process.walls", "value": "5"}, "part is 4: 1 to 3 is allowed"),
        ({"part": 2, "key": "process.scale", "value": "2"}, "part 2: process.scale holds for the whole print"),
        ({"part": 2, "key": "process.walls", "value": "-1"}, r"part 2: process\.walls"),
    ],
)
def test_a_key_that_a_part_cannot_set_is_refused(asked: dict[str, object], sentence: str) -> None:
    with pytest.raises((PlanError, ProfileError), match=sentence):
        changed_bench(BENCH, "set_part", **asked)


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
def test_the_rotation_of_the_command_line_reproduces_the_orientation(angles_deg: tuple[float, float, float]) -> None:
    profile = load(settings=["process.rotate_deg=[10, 0, 0]"])
    turned = changed_bench(Bench(profile, BENCH.model), "stand", rotation=turned_by(angles_deg).tolist())
    assert turned_by(turns_deg(turned)) == pytest.approx(turned_by(angles_deg) @ turned_by((10.0, 0.0, 0.0)), abs=1e-9)
    assert np.linalg.det(turned_by(turns_deg(turned))) == pytest.approx(1.0)
