"""Settings of the workbench: what a page is told of the profile's keys, and what changes by names and values."""

import pytest

from machine.app.requests import Given
from machine.app.workbench.bench.settings import USUAL, profile_as_given, settings_list, with_name, with_setting
from profiles.errors import ProfileError
from profiles.profile import load


def told(key: str, given: Given = USUAL) -> dict[str, object]:
    return next(row for row in settings_list(profile_as_given(given, load()), given) if row["key"] == key)


def test_a_number_has_its_meaning_and_its_range() -> None:
    height = told("process.layer_height_mm")
    assert (height["kind"], height["least"], height["most"], height["value"], height["changed"]) == (
        "number",
        0.02,
        2,
        0.2,
        False,
    )
    assert height["meaning"] == "height of a layer, mm"


def test_choices_and_yes_or_no_are_told_as_such() -> None:
    assert told("process.seam")["choices"] == ["aligned", "corner", "rear", "nearest", "random"]
    assert told("process.ironing")["kind"] == "boolean"
    assert told("search.time_limit_s")["value"] is None


def test_what_is_set_is_marked_and_goes_back() -> None:
    changed = with_setting(with_setting(USUAL, "process.walls", "3"), "process.walls", "4")
    assert changed.settings == ("process.walls=4",)
    assert (told("process.walls", changed)["value"], told("process.walls", changed)["changed"]) == (4, True)
    assert with_setting(changed, "process.walls", None) == USUAL


def test_another_machine_is_taken_by_its_name_and_an_unknown_one_refused() -> None:
    assert profile_as_given(with_name(USUAL, "machine", "fractal5pro"), load()).machine.name != load().machine.name
    with pytest.raises(ProfileError, match=r"'/etc/passwd' is no machine: .*generic_ac.* are known"):
        with_name(USUAL, "machine", "/etc/passwd")


def test_a_value_out_of_range_is_the_command_line_s_sentence() -> None:
    with pytest.raises(ProfileError, match=r"process\.walls"):
        profile_as_given(with_setting(USUAL, "process.walls", "-3"), load())
