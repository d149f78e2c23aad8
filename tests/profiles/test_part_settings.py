"""Part settings: a part's own values of the process, refused with the messages of profiles."""

import pytest

from profiles.errors import ProfileError
from profiles.part_settings import PartSettings, parse_part_settings, part_keys
from profiles.profile import Profile, load, with_part_settings


def given(*texts: str) -> Profile:
    return with_part_settings(load(), map(parse_part_settings, texts))


def test_a_part_has_its_own_values_and_all_others_those_of_the_process() -> None:
    profile = given("2:walls=4,infill_density=0.4", "2:process.infill_pattern=gyroid", "2:walls=5")
    own = profile.of_part(2).process
    assert (own.walls, own.infill_density, own.infill_pattern) == (5, 0.4, "gyroid")
    assert profile.of_part(1).process == profile.of_part(3).process == load().process


def test_later_settings_override_those_of_a_plan() -> None:
    profile = with_part_settings(given("3:walls=5"), [PartSettings(part=3, process={"walls": 2, "top_layers": 9})])
    assert profile.parts == [PartSettings(part=3, process={"walls": 5, "top_layers": 9})]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("walls=4", "--part walls=4: PART:KEY=VALUE,... is expected, such as 2:walls=4,infill_density=40%"),
        ("0:walls=4", "PART is 1 to 1000"),
        ("2:walls", "--part 2:walls: PART:KEY=VALUE,... is expected"),
        ("2:", "--part 2:: PART:KEY=VALUE,... is expected"),
        ("2:walls=many", 'part 2: process.walls is "many": it must be a whole number from 0 to 50'),
        ("2:wals=4", "part 2: process.wals is not a key of a profile: did you mean process.walls?"),
        ("2:scale=2", "part 2: process.scale holds for the whole print: --set process.scale=... sets it"),
        ("2:brim_mm=2", "part 2: process.brim_mm holds for the whole print"),
        ("1:interface_flow=1.1", "part 1: process.interface_flow holds for parts that rest on plastic"),
        ("2:layer_height_mm=0.5", "part 2: process.layer_height_mm is 0.5: a 0.4 mm nozzle prints layers of at most 0.4 mm"),
        ("2:line_width_mm=0.23", "part 2: process.line_width_mm is 0.23: a 0.4 mm nozzle prints lines of 0.24 to 1 mm"),
    ],
)
def test_a_key_that_a_part_cannot_set_is_refused_in_one_sentence(text: str, sentence: str) -> None:
    with pytest.raises(ProfileError) as refused:
        given("2:line_width_mm=0.8" if "0.5" in text else "2:walls=3", text)
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


def test_all_problems_of_part_settings_are_reported_at_once() -> None:
    with pytest.raises(ProfileError) as refused:
        given("2:walls=-1,line_width_mm=2,scale=2")
    assert str(refused.value).split("; ") == [
        "part 2: process.scale holds for the whole print: --set process.scale=... sets it",
        "part 2: process.walls is -1: it must be a whole number from 0 to 50",
        "part 2: process.line_width_mm is 2: a 0.4 mm nozzle prints lines of 0.24 to 1 mm",
    ]


def test_keys_of_the_cut_or_shared_by_parts_cannot_be_set_for_one_part() -> None:
    keys = part_keys()
    assert {"walls", "infill_density", "layer_height_mm", "outer_wall_speed_mm_s", "interface_flow"} <= set(keys)
    assert not {"rotate_deg", "self_supporting_angle_deg", "bridge_longest_mm", "skirt_loops", "travel_speed_mm_s"} & set(keys)


def test_a_decimal_comma_in_the_setting_of_a_part_is_refused_with_what_to_write() -> None:
    with pytest.raises(ProfileError, match=r"numbers have a decimal point: 2:layer_height_mm=0\.2,walls=3$"):
        parse_part_settings("2:layer_height_mm=0,2,walls=3")
