"""Detection of a machine from Klipper's printer.cfg with its includes, or from configfile over Moonraker."""

import json

import pytest

from machine.setup.detect.found import ConfigText, Found
from machine.setup.detect.klipper import recognise
from machine.setup.detect.proposal import propose, read
from profiles.errors import ProfileError

GIMBAL = """
[include steppers/*.cfg]
[printer]
kinematics: corexy
max_velocity: 280   # mm/s
max_accel: 2800
max_z_velocity: 6
max_z_accel: 90

[extruder]
nozzle_diameter = 0.6
filament_diameter: 1.750
max_temp: 265
max_extrude_only_velocity: 45

[heater_bed]
max_temp: 125

[gcode_macro PARK]
gcode:
  G1 X0 ; and wait

  G4 P1

#*# <---------------------- SAVE_CONFIG ---------------------->
#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.
#*#
#*# [stepper_z]
#*# position_min = -99
#*#
#*# [bltouch]
#*# z_offset = 1.5
"""
STEPPERS = """
[stepper_x]
position_min: -140
position_max: 145.5
[stepper_y]
position_max: 150
[stepper_z]
position_min: -2
position_max: 245
[manual_stepper stepper_a]
rotation_distance: 90
velocity: 12
accel: 110
[manual_stepper stepper_b]
rotation_distance: 24
velocity: 22
accel: 120
position_min: -5
position_max: 95
"""
REGISTRATION = """
[gcode_macro TURN_TABLE]
gcode:
  MANUAL_STEPPER STEPPER=stepper_a GCODE_AXIS=C LIMIT_VELOCITY=33 LIMIT_ACCEL=150
  MANUAL_STEPPER STEPPER=stepper_b GCODE_AXIS=B
"""


def found(text: str = GIMBAL, steppers: str = STEPPERS) -> Found:
    def beside(pattern: str) -> list[ConfigText]:
        return [ConfigText(pattern, steppers, beside)]

    return read(ConfigText("printer.cfg", text, beside))


def values(found: Found, letter: str) -> dict[str, object]:
    return {key: reading.value for key, reading in found.axes[letter].items()}


def test_x_and_y_share_a_speed_and_z_has_its_own() -> None:
    assert values(found(), "X") == {"speed": 280.0, "acceleration": 2800.0, "limits": [-140.0, 145.5]}
    assert values(found(), "Z") == {"speed": 6.0, "acceleration": 90.0, "limits": [-2.0, 245.0]}


def test_an_axis_without_position_min_begins_at_0() -> None:
    assert values(found(), "Y")["limits"] == [0.0, 150.0]


def test_manual_steppers_named_by_a_letter_turn_the_table_in_degrees() -> None:
    told = found()
    assert (told.dialect, told.rotary, dict(told.steppers)) == ("klipper_steppers", "AB", {"A": "stepper_a", "B": "stepper_b"})
    assert values(told, "A") == {"speed": 12.0, "acceleration": 110.0}
    assert values(told, "B")["limits"] == [-5.0, 95.0]


def test_a_macro_that_registers_steppers_gives_letters_and_limits() -> None:
    told = found(GIMBAL + REGISTRATION.replace("\n[gcode", "[gcode"), STEPPERS)
    assert (told.dialect, told.rotary) == ("klipper", "BC")
    assert values(told, "C") == {"speed": 33.0, "acceleration": 150.0}


def test_the_filaments_limits_are_worked_out_where_they_are_not_set() -> None:
    settings = found().settings
    # 4 x 0.6^2 / (pi x 0.875^2) = 0.5987 of max_accel
    assert settings["extruder_acceleration_mm_s2"].value == 1676.3108
    assert settings["extruder_speed_mm_s"].value == 45.0


def test_nozzle_heaters_corner_and_probe_are_read() -> None:
    told = found()
    wanted = {"head.nozzle_mm": 0.6, "nozzle_limit_c": 265.0, "bed_limit_c": 125.0, "junction_speed_mm_s": 5.0, "arcs": False}
    assert {key: told.settings[key].value for key in wanted} == wanted
    assert told.probe == "the probe [bltouch]"


def test_moonraker_reports_the_same() -> None:
    told = {
        "printer": {"kinematics": "cartesian", "max_velocity": 200.0, "max_accel": 1000.0, "max_z_velocity": 200.0},
        **{f"stepper_{letter}": {"position_min": 0.0, "position_max": 210.0} for letter in "xyz"},
        "extruder": {"nozzle_diameter": 0.4, "filament_diameter": 1.75, "max_extrude_only_velocity": 53.2},
    }
    text = json.dumps({"software_version": "v0.13.0-210", "configfile": {"settings": told, "config": {}}})
    assert recognise(text)
    assert found(text).firmware == "Klipper v0.13.0-210"
    assert values(found(text), "Z") == {"speed": 200.0, "acceleration": 1000.0, "limits": [0.0, 210.0]}


def test_settings_that_may_be_in_a_missing_file_are_not_assumed_absent() -> None:
    text = (STEPPERS + GIMBAL).replace("steppers/*.cfg", "mainsail.cfg").replace("[heater_bed]\nmax_temp: 125\n", "")
    told = read(ConfigText("printer.cfg", text))
    assert {"bed_limit_c", "arcs"}.isdisjoint(told.settings)
    assert told.remarks[0] == "mainsail.cfg is not beside it: its settings are unknown"


def test_moonrakers_names_in_small_letters_are_those_of_the_file_and_null_is_nothing() -> None:
    axis = {"position_min": 0.0, "position_max": 9.0}
    settings = {
        "printer": {"kinematics": "cartesian", "max_velocity": 90.0, "max_accel": 900.0},
        **{f"stepper_{letter}": axis for letter in "xyz"},
        **{f"manual_stepper table_{letter}": {"velocity": 5.0, "accel": 0.0, "position_min": None} for letter in "ac"},
    }
    config = {f"manual_stepper TABLE_{letter}": {"velocity": "5"} for letter in "AC"}
    told = found(json.dumps({"result": {"status": {"configfile": {"settings": settings, "config": config}}}}))
    assert told.steppers == {"A": "TABLE_A", "C": "TABLE_C"}
    assert values(told, "A") == {"speed": 5.0}


@pytest.mark.parametrize(
    ("name", "numbers", "sentence"),
    [
        ("z_axis", "rotation_distance: 8\nendstop_pin: PG10", "is named like a Z axis"),
        ("lift_u", "rotation_distance: 40", "is the axis U, which need not turn"),
        ("table_b", "rotation_distance: 8\nendstop_pin: PG10", "has an endstop_pin and a rotation_distance of 8, as a screw has"),
        ("right_c", "rotation_distance: 40\n[manual_stepper table_a]", "is the axis C like table_c"),
    ],
)
def test_a_stepper_that_may_move_a_screw_or_a_belt_is_not_taken_for_the_tilt(name: str, numbers: str, sentence: str) -> None:
    steppers = STEPPERS.partition("[manual")[0] + "[manual_stepper table_c]\n"
    registered = "[gcode_macro AXES]\ngcode:\n  MANUAL_STEPPER STEPPER=z_axis GCODE_AXIS=U\n"
    told = found(GIMBAL, f"{steppers}[manual_stepper {name}]\n{numbers}\n{registered}")
    with pytest.raises(ProfileError, match=rf"^printer.cfg: \[manual_stepper {name}\] {sentence}, .*: --base NAME"):
        propose(told)


def test_a_rotation_distance_of_360_makes_a_rotary_axis_of_any_letter() -> None:
    told = found(GIMBAL, STEPPERS + "[manual_stepper table_u]\nrotation_distance: 360\ngear_ratio: 40:1\nendstop_pin: PG10\n")
    assert (told.rotary, told.doubtful) == ("ABU", {})


@pytest.mark.parametrize("kinematics", ["xby", "none", "cartesian\nkinematics_abc: cartesian_abc", "robot"])
def test_kinematics_that_are_not_known_are_refused(kinematics: str) -> None:
    name = ", ".join(line.rpartition(": ")[2] for line in kinematics.splitlines())
    with pytest.raises(ProfileError, match=rf"^printer.cfg: \[printer\] kinematics is '{name}': how that moves X, Y, Z"):
        found(GIMBAL.replace("corexy", kinematics))


def test_the_tilt_axis_among_a_and_b_is_unknown_until_a_base_profile_is_named() -> None:
    with pytest.raises(ProfileError, match="has the rotary axes A B, and nothing says which tilts and which turns: --base NAME"):
        propose(found())
    values = propose(found(), "fractal5pro").values
    assert (values["machine.tilt.letter"].value, values["machine.tilt.stepper"].value) == ("B", "stepper_b")


def test_other_steppers_are_named_and_left_out() -> None:
    told = found(GIMBAL, STEPPERS + "[manual_stepper gear_stepper]\nrotation_distance: 22.7\n")
    assert told.rotary == "AB"
    assert any("[manual_stepper gear_stepper]" in remark for remark in told.remarks)


def test_an_axis_may_have_its_own_limit() -> None:
    assert values(found(GIMBAL.replace("corexy", "limited_corexy\nmax_x_accel: 1500")), "X")["acceleration"] == 1500.0


def test_a_delta_reports_no_reach() -> None:
    told = found(GIMBAL.replace("corexy", "delta"))
    assert "limits" not in told.axes["X"]
    assert "delta" in told.remarks[0]


@pytest.mark.parametrize(
    ("text", "steppers", "sentence"),
    [
        (GIMBAL.replace("max_accel: 2800\n", ""), STEPPERS, "no acceleration of X, no acceleration of Y: is it whole"),
        (GIMBAL, STEPPERS + "[manual_st", "neither a section nor a setting: is the file cut off"),
        (
            GIMBAL,
            STEPPERS.replace("145.5", "-145"),
            "axis X: .stepper_x. position_min, position_max gives limits from -140 to -145",
        ),
        (GIMBAL.replace("280 ", "fast "), STEPPERS, "max_velocity is 'fast', which is no number"),
        ("[include a.cfg]", "[include a.cfg]", "more than 100 files"),
        ("[mcu]\nserial: x\n", "", "no .printer.: is it whole"),
        ('{"configfile": {"settings": {', "", "cut off or damaged"),
        ("max: 5\n[printer]\n", "", "'max: 5' stands in no section"),
    ],
)
def test_a_truncated_or_absurd_answer_is_refused_in_one_sentence(text: str, steppers: str, sentence: str) -> None:
    with pytest.raises(ProfileError, match=sentence):
        found(text, steppers)
