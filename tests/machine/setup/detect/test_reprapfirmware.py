"""Detection of a machine from RepRapFirmware's config.g, or from the object model of M409."""

import json

import pytest

from machine.setup.detect.found import ConfigText, Found
from machine.setup.detect.marlin import recognise as is_marlin
from machine.setup.detect.proposal import propose, read
from machine.setup.detect.reprapfirmware import recognise
from profiles.errors import ProfileError
from profiles.messages import terminal_words

CRADLE = """
; a cradle under a CoreXY head
M550 P"Cradle"                      ; name
M669 K1
M584 X0.0 Y0.1 Z0.2 B0.3 C0.4 E0.5
M98 P"0:/sys/speeds.g"
M208 X-60 Y-55 Z-3 S1
M208 X118 Y112 Z90 S0
M208 B-100:100 C-99999:99999
M140 H0
M143 H0 S110
M563 P0 D0 H1 F0
M143 H1 S290
M558 P9 C"^zprobe.in" H5 F120
if exists(global.fast)
  M203 X99999 Y99999
M575 P1 S1 B57600
"""
SPEEDS = """
M566 X600.00 Y540 Z12 B60 C60 E120
M203 X18000.00 Y17400 Z900 B1800 C3600 E3600
M201 X3000 Y2900 Z100 B400 C500 E2500
"""


def found(text: str = CRADLE, speeds: str = SPEEDS) -> Found:
    return read(ConfigText("config.g", text, lambda name: [ConfigText(name, speeds)]))


def values(found: Found, letter: str) -> dict[str, object]:
    return {key: reading.value for key, reading in found.axes[letter].items()}


def test_speeds_a_minute_become_speeds_a_second() -> None:
    assert values(found(), "X") == {"speed": 300.0, "acceleration": 3000.0, "limits": [-60.0, 118.0]}
    assert values(found(), "B") == {"speed": 30.0, "acceleration": 400.0, "limits": [-100.0, 100.0]}


def test_s1_means_speeds_a_second() -> None:
    assert values(found(CRADLE + "M203 S1 X300 Z15\n"), "Z")["speed"] == 15.0


def test_jerk_is_the_lesser_of_x_and_y_a_second() -> None:
    assert found().settings["junction_speed_mm_s"].value == 9.0
    assert found(CRADLE + "M205 X7 Y8\n").settings["junction_speed_mm_s"].value == 7.0


def test_heaters_are_those_of_tool_and_bed() -> None:
    told = found().settings
    assert (told["nozzle_limit_c"].value, told["bed_limit_c"].value) == (290.0, 110.0)
    assert found(CRADLE.replace("M140 H0", "M140 H-1")).settings["bed_limit_c"].value == 0.0


def test_name_letters_and_probe_are_read() -> None:
    told = found()
    assert (told.name, told.rotary, told.probe) == ("Cradle", "BC", "a BLTouch as its probe")


def test_u_and_v_are_rotary_only_by_r1_or_a_base_profile() -> None:
    config = CRADLE.replace(" B0", " U0").replace(" C0", " V0").replace(" B-", " U-").replace(" C-", " V-")
    speeds = SPEEDS.replace("B", "U").replace("C", "V")
    with pytest.raises(ProfileError, match=r"^config.g: nothing says whether U turns, as R1 of M584 does, .*: --base NAME"):
        propose(found(config, speeds))
    assert propose(found(config, speeds), "gen5x").values["machine.turn.letter"].value == "V"
    assert found(config.replace("E0.5", "R1 E0.5"), speeds).rotary == "UV"


def test_the_lock_of_a_tool_changer_is_left_alone_where_b_and_c_turn() -> None:
    proposal = propose(found(CRADLE.replace("E0.5", "U0.6 E0.5")))
    assert [proposal.values[f"machine.{axis}.letter"].value for axis in ("tilt", "turn")] == ["B", "C"]
    assert any(remark.startswith("U is left alone") for remark in proposal.remarks)


@pytest.mark.parametrize(("command", "named"), [("M669 K13", "K13"), ("M669 K1\nM669 K9 S100", "K9")])
def test_kinematics_that_are_not_known_are_refused(command: str, named: str) -> None:
    with pytest.raises(ProfileError, match=f"^config.g: M669 is '{named}': how that moves X, Y, Z"):
        found(CRADLE.replace("M669 K1", command))


def test_a_delta_reports_no_reach() -> None:
    told = found(CRADLE + "M665 L200 R100 B80\n")
    assert "limits" not in told.axes["X"]
    assert "delta" in told.remarks[0]


def test_axes_that_m584_does_not_make_are_no_axes_although_it_makes_no_other() -> None:
    assert found(CRADLE.replace("B0.3 C0.4 ", "")).rotary == ""


def test_an_axis_of_a_small_letter_is_not_that_of_the_large_one() -> None:
    assert values(found(CRADLE + "M208 'b-5:5\n"), "B")["limits"] == [-100.0, 100.0]


def test_a_macro_missing_next_to_the_file_is_reported() -> None:
    assert found(CRADLE + 'M98 P"drives.g"\n').remarks == []
    told = read(ConfigText("config.g", SPEEDS + CRADLE.replace("speeds.g", "drives.g")))
    assert told.remarks == ["drives.g is not beside it: its settings are unknown"]


def test_an_axis_without_a_reported_speed_is_kept_with_a_remark() -> None:
    told = found(CRADLE, SPEEDS.replace(" B1800", ""))
    assert (told.rotary, "speed" in told.axes["B"]) == ("BC", False)
    assert told.remarks == ["M584 makes B, whose speed no M203 gives"]


def test_letters_that_m584_does_not_make_are_passed_over() -> None:
    assert found(CRADLE + "M208 A-5:5\nM203 A60\n").rotary == "BC"


def test_values_computed_by_the_board_are_reported_as_unknown() -> None:
    told = found(CRADLE.replace("S290", "S{global.hot}"))
    assert "nozzle_limit_c" not in told.settings
    assert [*map(terminal_words, told.remarks)] == [
        "only the board evaluates what it has in braces (1): --port duet:HOST queries it"
    ]


def model(**axis: object) -> str:
    drives = [
        {"letter": letter, "min": -90.0, "max": 90.0, "speed": 6000.0, "acceleration": 900.0, "jerk": 480.0, **axis}
        for letter in "XYZAC"
    ]
    answers = {
        "move.axes": drives[:3],
        "move.extruders": [{"speed": 3000.0, "acceleration": 1200.0}],
        "tools": [{"heaters": [2]}],
        "heat": {"bedHeaters": [-1], "heaters": [{"max": 110.0}, None, {"max": 280.5}]},
        "boards[0]": {"firmwareName": "RepRapFirmware for Duet 3 MB6HC", "firmwareVersion": "3.5.4"},
    }
    pages = [{"key": "move.axes", "flags": "d99vna3", "result": drives[3:], "next": 0}]
    return "\n".join(json.dumps(line) for line in (*({"key": key, "result": value} for key, value in answers.items()), *pages))


def test_the_object_model_counts_in_minutes_too() -> None:
    told = found(model())
    assert recognise(model())
    assert values(told, "A") == {"speed": 100.0, "acceleration": 900.0, "limits": [-90.0, 90.0]}
    assert told.settings["extruder_speed_mm_s"].value == 50.0
    assert told.settings["junction_speed_mm_s"].value == 8.0


def test_the_object_model_names_its_kinematics() -> None:
    told = found(model() + '\n{"key": "move.kinematics", "result": {"name": "coreXY"}}')
    assert told.axes["X"]["limits"].value == [-90.0, 90.0]
    with pytest.raises(ProfileError, match=r"^config.g: move.kinematics is 'fivebarscara'"):
        found(model() + '\n{"key": "move.kinematics", "result": {"name": "FiveBarScara"}}')


def test_heaters_of_the_object_model_are_found_by_their_numbers() -> None:
    told = found(model())
    assert (told.firmware, told.rotary) == ("RepRapFirmware for Duet 3 MB6HC 3.5.4", "AC")
    assert told.settings["bed_limit_c"].value == 0.0
    assert told.settings["nozzle_limit_c"].value == 280.5


def test_a_config_g_is_not_taken_for_a_log_of_marlin() -> None:
    assert recognise(CRADLE)
    assert not is_marlin(CRADLE + SPEEDS)


@pytest.mark.parametrize(
    ("text", "speeds", "sentence"),
    [
        (CRADLE, SPEEDS.replace("M201 X3000 Y2900 Z100", "M201"), "no acceleration of X"),
        (CRADLE.replace("B-100:100", "B100:-100"), SPEEDS, "axis B: M208 gives limits from 100 to -100"),
        (CRADLE.replace("B0.3 C0.4 ", ""), 'M98 P"speeds.g"', "config.g: it is RepRapFirmware's, but reports no speed of X"),
        (model()[:-30], "", "cut off or damaged"),
        (model(min=95.0), "", "limits from 95 to 90"),
    ],
)
def test_a_truncated_or_absurd_answer_is_refused_in_one_sentence(text: str, speeds: str, sentence: str) -> None:
    with pytest.raises(ProfileError, match=sentence):
        found(text, speeds)
