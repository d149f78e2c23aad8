"""Settings of the workbench: what a page is told of the profile's keys, and what changes by names and values."""

import json
from typing import Any

import pytest

from machine.pipeline.requests import Given
from machine.workbench.bench.bench import USUAL
from machine.workbench.bench.settings import (
    check_block,
    profile_as_given,
    settings_list,
    with_name,
    with_setting,
    with_typed,
)
from profiles.errors import ProfileError
from profiles.profile import SECTIONS, load
from profiles.wording import keys


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
    assert height["meaning"] == "height of a layer, mm"


def test_choices_and_yes_or_no_are_told_as_such() -> None:
    assert described("process.seam")["choices"] == ["aligned", "corner", "rear", "nearest", "random"]
    assert described("process.ironing")["kind"] == "boolean"
    assert described("search.time_limit_s")["value"] is None


def test_every_key_can_be_typed_and_what_is_told_of_it_is_taken_back_as_the_same() -> None:
    rows = settings_list(load(), USUAL)
    assert {row["key"] for row in rows} == {key for name, kind in SECTIONS.items() for key, _ in keys(kind, f"{name}.")}
    assert {row["kind"] for row in rows} == {"number", "integer", "boolean", "choice", "numbers", "text", "block", "rows"}
    given = USUAL
    for row in rows:
        if row["kind"] in ("text", "block", "rows"):
            given = with_setting(given, row["key"], row["value"] if row["kind"] == "rows" else json.dumps(row["value"]))
    assert profile_as_given(given, load()) == load()
    assert not any("\n" in setting for setting in given.settings)


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
def test_a_list_is_refused_in_the_profile_s_own_sentence(typed: str, sentence: str) -> None:
    with pytest.raises(ProfileError, match=sentence):
        profile_as_given(with_setting(USUAL, "machine.head.silhouette_mm", typed), load())


def test_nothing_leaves_out_what_may_be_left_out_and_is_no_change_where_the_profile_has_nothing() -> None:
    wound = with_setting(USUAL, "machine.turn.budget_deg", "720")
    assert (described("machine.turn.budget_deg")["optional"], described("machine.clearance_mm")["optional"]) == (True, False)
    assert profile_as_given(with_setting(wound, "machine.turn.budget_deg", ""), load()).machine.turn.budget_deg is None
    assert with_typed(wound, "machine.turn.budget_deg", "", load()) == USUAL
    with pytest.raises(ProfileError, match=r'machine\.clearance_mm is "": it must be a number from 0 to 100'):
        profile_as_given(with_setting(USUAL, "machine.clearance_mm", ""), load())


def test_what_is_set_is_marked_and_goes_back() -> None:
    changed = with_setting(with_setting(USUAL, "process.walls", "3"), "process.walls", "4")
    assert changed.settings == ("process.walls=4",)
    assert (described("process.walls", changed)["value"], described("process.walls", changed)["changed"]) == (4, True)
    assert with_setting(changed, "process.walls", None) == USUAL


def test_another_machine_is_taken_by_its_name_and_an_unknown_one_refused() -> None:
    assert profile_as_given(with_name(USUAL, "machine", "fractal5pro"), load()).machine.name != load().machine.name
    with pytest.raises(ProfileError, match=r"'/etc/passwd' is no machine: .*generic_ac.* are known"):
        with_name(USUAL, "machine", "/etc/passwd")


def test_a_value_out_of_range_is_the_command_line_s_sentence() -> None:
    with pytest.raises(ProfileError, match=r"process\.walls"):
        profile_as_given(with_setting(USUAL, "process.walls", "-3"), load())
