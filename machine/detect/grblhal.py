"""grblHAL: a dump of $$, with $I before or behind it where it has that.

settings.h, settings.c, report.c, machine_limits.c and planner.c (f80fc34): $110 on are mm or deg a minute, $120 on a second
squared, $130 on the travel, by the axes' order, which [AXS:5:XYZAC] of $I names and which is XYZABC otherwise; $376 says which of
A B C turn. An axis moves from -travel to 0 of the machine, with bit 3 of $22 from its home on, whose side $23 says; with hard
limits ($21) the pull-off $27 is left at its ends. A travel of 0 bounds nothing. $11 is the junction deviation. Neither $13 nor
G20 makes inches of a setting.
"""

import re

from machine.detect.found import (
    ACCELERATION,
    LIMITS,
    SPEED,
    AxisReadings,
    ConfigText,
    Found,
    Reading,
    check_whole,
    corner_speed,
    limits,
    rounded,
)
from machine.gcode.words import NUMBER

SETTING = re.compile(rf"^.*?\$(\d{{1,4}})=({NUMBER})", re.MULTILINE)
AXES = re.compile(r"\[AXS:\d+:([A-Z]+)\]")
BUFFER = re.compile(r"\[OPT:[^,\]]*,\d+,(\d+)")
VERSION = re.compile(r"\[VER:([^:\]\s]+)")
USUAL = "XYZABCUVW"
JUNCTION_MM, MINUTE_S = 11, 60.0
HARD_LIMITS, HOMING, HOME_SIDES, PULL_OFF, ROTARY = 21, 22, 23, 27, 376
AT_ORIGIN = 1 << 3  # of $22: "Set machine origin to 0"
SPEEDS, ACCELERATIONS, TRAVELS = 110, 120, 130
TURNING = "ABC"


def recognise(text: str) -> bool:
    """Whether a text is such a dump."""
    return {"110", "120", "130"} <= {number for number, _ in SETTING.findall(text)}


def read(config: ConfigText) -> Found:
    """What a dump tells. Raises ProfileError."""
    values = {int(number): float(value) for number, value in SETTING.findall(config.text)}
    named = AXES.search(config.text)
    letters = named[1] if named else "".join(letter for index, letter in enumerate(USUAL) if SPEEDS + index in values)
    axes = {letter: _axis(config, values, index, letter) for index, letter in enumerate(letters)}
    turning = int(values.get(ROTARY, 0b111))
    rotary = "".join(letter for letter in letters if letter in TURNING and turning >> TURNING.index(letter) & 1)
    settings: dict[str, Reading] = {}
    accelerations = [values[number] for number in (ACCELERATIONS, ACCELERATIONS + 1) if number in values]
    if values.get(JUNCTION_MM, 0.0) > 0.0 and min(accelerations, default=0.0) > 0.0:
        speed = corner_speed(values[JUNCTION_MM], min(accelerations))
        settings["junction_speed_mm_s"] = Reading(rounded(speed), f"$11 and the {min(accelerations):g} mm/s2 of $120, $121")
    if buffer := BUFFER.search(config.text):
        settings["receive_bytes"] = Reading(int(buffer[1]), "$I, OPT")
    version = VERSION.search(config.text)
    remarks = ("its limits are of the machine: a work offset (G54) moves them", *_unnamed(named is not None, letters))
    firmware = f"grblHAL {version[1]}" if version else "grblHAL"
    return check_whole(Found(firmware, "grblhal", axes, rotary, settings, remarks=remarks), config.name)


def _axis(config: ConfigText, values: dict[int, float], index: int, letter: str) -> AxisReadings:
    readings: AxisReadings = {}
    if speed := values.get(SPEEDS + index):
        readings[SPEED] = Reading(rounded(speed / MINUTE_S), f"${SPEEDS + index}")
    if acceleration := values.get(ACCELERATIONS + index):
        readings[ACCELERATION] = Reading(rounded(acceleration), f"${ACCELERATIONS + index}")
    travel = values.get(TRAVELS + index, 0.0)
    if travel:
        low, high = _envelope(values, index, travel)
        readings[LIMITS] = limits(f"{config.name}: axis {letter}", low, high, f"${TRAVELS + index}")
    return readings


def _envelope(values: dict[int, float], index: int, travel: float) -> tuple[float, float]:
    """limits_set_work_envelope of machine_limits.c."""
    left = values.get(PULL_OFF, 0.0) if int(values.get(HARD_LIMITS, 0.0)) & 1 else 0.0
    if not int(values.get(HOMING, 0.0)) & AT_ORIGIN:
        return left - travel, 0.0 - left
    to_the_least = int(values.get(HOME_SIDES, 0.0)) >> index & 1
    return (0.0, travel - left) if to_the_least else (left - travel, 0.0)


def _unnamed(named: bool, letters: str) -> tuple[str, ...]:
    turning = [letter for letter in letters if letter in TURNING]
    if named or not turning:
        return ()
    return (f"its axes beyond Z are taken for {' '.join(turning)}: $I names them",)
