"""Detection of a machine from Marlin's answers to M115, M503 and M211, as a log or at a port."""

import re

import pytest

from machine.firmware.marlin import settings_report
from machine.setup.detect.found import ConfigText, Found
from machine.setup.detect.marlin import recognise
from machine.setup.detect.proposal import propose, read
from machine.simulator.motion import Motion
from profiles.errors import ProfileError
from profiles.profile import load

LOG = """
FIRMWARE_NAME:Marlin 2.1.2.5 (Jul  1 2024) SOURCE_CODE_URL:x PROTOCOL_VERSION:1.0 MACHINE_TYPE:Gimbal AXIS_COUNT:5 UUID:1
Cap:ARCS:1
echo:; Linear Units:
echo:  G21 ; (mm)
echo:; Steps per unit:
echo:  M92 X80.00 Y80.00 Z400.00 A26.67 C35.56 E93.00
echo:  M203 X250.00 Y240.00 Z12.00 A45.00 C90.00 E40.00
echo:  M201 X2000.00 Y1800.00 Z120.00 A300.00 C500.00 E5000.00
echo:; Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>):
echo:  M204 P1000.00 R3000.00 T2000.00
echo:; Advanced (B<min_segment_time_us> S<min_feedrate> T<min_travel_feedrate> J<junc_dev>):
echo:  M205 B20000.00 S0.00 T0.00 J0.02
echo:  M851 X-28.00 Y10.00 Z-1.25 ; (mm)
  M211 S1 ; ON
  Min:  X-110.00 Y-105.00 Z0.00 A-90.00 C-7200.00   Max:  X110.00 Y105.00 Z180.00 A90.00 C7200.00
"""


def found(text: str) -> Found:
    return read(ConfigText("m503.log", text))


def test_speeds_are_mm_a_second_and_limits_those_of_m211() -> None:
    axes = found(LOG).axes
    assert {key: reading.value for key, reading in axes["X"].items()} == {
        "speed": 250.0,
        "acceleration": 2000.0,
        "limits": [-110.0, 110.0],
    }
    assert (axes["A"]["speed"].value, axes["C"]["limits"].value) == (45.0, [-7200.0, 7200.0])
    assert axes["Z"]["limits"].source == "M211"


def test_a_junction_deviation_becomes_the_speed_of_a_right_angled_corner() -> None:
    # sqrt(1000 mm/s2 x 0.02 mm x (1 + sqrt 2)), while 0.4 v^2 / a = 0.02 would give 7.07
    assert found(LOG).settings["junction_speed_mm_s"].value == 6.9487


def test_jerk_is_the_lesser_of_x_and_y() -> None:
    assert found(LOG.replace("J0.02", "X9.00 Y7.50 Z0.40")).settings["junction_speed_mm_s"].value == 7.5


def test_name_letters_probe_and_arcs_are_read() -> None:
    told = found(LOG)
    assert (told.firmware, told.name, told.rotary, told.probe) == ("Marlin 2.1.2.5 (Jul  1 2024)", "Gimbal", "AC", "a Z probe")
    assert told.settings["arcs"].value is True


def test_the_area_of_m115_replaces_a_missing_m211() -> None:
    area = "area:{full:{min:{x:-5.00,y:0.00,z:0.00,i:-91.00},max:{x:200.00,y:210.00,z:180.00,i:92.00}}}"
    told = found(LOG.split("  M211")[0] + area)
    assert (told.axes["X"]["limits"].value, told.axes["A"]["limits"].value) == ([-5.0, 200.0], [-91.0, 92.0])


def test_prefixes_of_a_host_log_are_ignored() -> None:
    hosted = "\n".join(f"12:00:01 Recv: {line}" for line in LOG.splitlines())
    assert found(hosted).axes == found(LOG).axes


def test_comments_after_a_line_are_ignored() -> None:
    noted = "\n".join(
        f"{line}   #{line.split()[0]} - M203 set" if line.startswith("echo:  M") else line for line in LOG.splitlines()
    )
    assert found(noted).axes == found(LOG).axes


def test_the_first_of_several_extruders_is_used() -> None:
    log = LOG.replace(" C90.00 E40.00", " C90.00\necho:  M203 T0 E31.00\necho:  M203 T1 E62.00")
    assert found(log).settings["extruder_speed_mm_s"].value == 31.0


@pytest.mark.parametrize(
    "line",
    [
        " * M203 X Y Z E: set with M92, M205, G20 ; echo: in inches",
        "#define INCH_MODE_SUPPORT // G20 and G21",
        "echo: send G20 for inches",
    ],
)
def test_a_sentence_about_a_command_is_not_an_answer(line: str) -> None:
    assert found(f"{line}\n{LOG}{line}\n").axes == found(LOG).axes


SOURCES = {
    "Configuration.h": "#define DEFAULT_MAX_FEEDRATE { 300, 25 } // M203, M92\n//#define INCH_MODE_SUPPORT // G20\n",
    "Configuration_adv.h": " * Config\n  //#define ARC_SUPPORT\n#if 0\n // M205 echo: G20\n",
    "platformio.ini": "[platformio]\nsrc_dir = Marlin\n[env:mega2560]\n",
    "config.ini": "[config:base]\nini_use_config = none\n",
}


@pytest.mark.parametrize("name", SOURCES)
def test_configuration_sources_of_marlin_are_distinguished_from_answers(name: str) -> None:
    expected = rf"^{name}: it is source that a firmware is built from .*: the answers to M115, M503 and M211 are expected"
    with pytest.raises(ProfileError, match=expected):
        read(ConfigText(name, SOURCES[name]))


def test_an_axis_u_is_not_assumed_to_be_rotary() -> None:
    told = found(LOG.replace(" A", " U"))
    assert (told.rotary, list(told.doubtful)) == ("C", ["U"])
    with pytest.raises(ProfileError, match=r"^m503.log: M203 does not say whether U turns, .*: --base NAME"):
        propose(told)


def test_a_base_that_follows_the_table_does_not_make_plain_axes_follow_it() -> None:
    assert propose(found(LOG)).values["machine.coordinates"].value == "table"


def test_the_winding_limit_of_the_cables_must_be_measured() -> None:
    assert "machine.turn.budget_deg" in propose(found(LOG)).measured


def test_a_base_with_two_rotary_axes_is_not_put_over_a_machine_without() -> None:
    with pytest.raises(ProfileError, match="reports no rotary axis, the base has two: leave out --base"):
        propose(found(re.sub(r" [AC]-?\d\S*", "", LOG)), "generic_ac")


def test_filament_in_mm3_is_left_and_said() -> None:
    told = found(LOG + "echo:  M200 S1 D1.75\n")
    assert "extruder_speed_mm_s" not in told.settings
    assert "mm³" in told.remarks[0]


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("echo:  M201", "echo:  M2", "reports no acceleration of X, no acceleration of Y: is it whole"),
        ("G21", "G20", "reports inches"),
        ("Max:  X110.00", "Max:  X-120.00", "axis X: M211 gives limits from -110 to -120"),
    ],
)
def test_half_a_log_inches_and_reversed_limits_are_refused(old: str, new: str, sentence: str) -> None:
    with pytest.raises(ProfileError, match=sentence):
        found(LOG.replace(old, new))


def test_the_simulated_printer_reports_all_values_that_are_read() -> None:
    settings = Motion(load("generic_ac").machine).settings()
    text = "\n".join(line for command in ("M503", "M211") for line in settings_report(command, settings))
    assert recognise(text)
    assert found(text).axes["C"]["speed"].value == 60.0
