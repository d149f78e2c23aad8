"""grblHAL: a dump of $$, with the answer to $I before or after it.

settings.h, settings.c, report.c, machine_limits.c and planner.c (f80fc34): from $110 mm or deg per minute, from $120 per second
squared, from $130 the travel, in the order of the axes, which [AXS:5:XYZAC] of $I names; $376 says which of A B C are rotary. An
axis moves from -travel to 0 of the machine; with bit 3 of $22 from its home, whose side $23 gives; with hard limits ($21) the
pull-off $27 is kept free at both ends. A travel of 0 means no limit. $11 is the junction deviation. Neither $13 nor G20 turns a
setting into inches.
"""

import re

from machine.gcode.words import NUMBER
from machine.setup.detect.found import ABC, AxisReadings, ConfigText, Found, Reading, axis_readings, corner_speed, reading
from profiles.errors import ProfileError

SETTING = re.compile(rf"^.*?\$(\d{{1,4}})=({NUMBER})", re.MULTILINE)
AXES = re.compile(r"\[AXS:\d+:([A-Z]+)\]")
BUFFER = re.compile(r"\[OPT:[^,\]]*,\d+,(\d+)")
VERSION = re.compile(r"\[VER:([^:\]\s]+)")
JUNCTION_MM, MINUTE_S = 11, 60.0
HARD_LIMITS, HOMING, HOME_SIDES, PULL_OFF, ROTARY = 21, 22, 23, 27, 376
AT_ORIGIN = 1 << 3  # bit of $22: "Set machine origin to 0"
SPEEDS, ACCELERATIONS, TRAVELS = 110, 120, 130


def recognise(text: str) -> bool:
    """Whether a text is a dump of grblHAL."""
    return {"110", "120", "130"} <= {number for number, _ in SETTING.findall(text)}


def read(config: ConfigText) -> Found:
    """The values in a dump. Raises ProfileError."""
    values = {int(number): float(value) for number, value in SETTING.findall(config.text)}
    named = AXES.search(config.text)
    if named is None and SPEEDS + 3 in values:
        raise ProfileError(f"{config.name}: it has more than three axes, whose letters only $I names: add its answer to the dump")
    letters = named[1] if named else "XYZ"
    axes = {letter: _axis(config, values, index, letter) for index, letter in enumerate(letters)}
    turning = int(values.get(ROTARY, 0))
    rotary = "".join(letter for letter in letters if letter in ABC and turning >> ABC.index(letter) & 1)
    unsaid = f"{config.name}: it has no ${ROTARY}, which says"
    doubtful = {} if ROTARY in values else {letter: f"{unsaid} whether {letter} turns" for letter in letters if letter in ABC}
    settings: dict[str, Reading] = {}
    accelerations = [values[number] for number in (ACCELERATIONS, ACCELERATIONS + 1) if number in values]
    if values.get(JUNCTION_MM, 0.0) > 0.0 and min(accelerations, default=0.0) > 0.0:
        speed = corner_speed(values[JUNCTION_MM], min(accelerations))
        settings["junction_speed_mm_s"] = Reading(speed, f"$11 and the {min(accelerations):g} mm/s2 of $120, $121")
    if buffer := BUFFER.search(config.text):
        settings["receive_bytes"] = Reading(int(buffer[1]), "$I, OPT")
    version = VERSION.search(config.text)
    firmware = f"grblHAL {version[1]}" if version else "grblHAL"
    remarks = ["its limits are of the machine: a work offset (G54) moves them"]
    return Found(firmware, "grblhal", axes, rotary, doubtful, settings, remarks=remarks)


def _axis(config: ConfigText, values: dict[int, float], index: int, letter: str) -> AxisReadings:
    speed, acceleration, travel = (values.get(first + index) or None for first in (SPEEDS, ACCELERATIONS, TRAVELS))
    low, high = (None, None) if travel is None else _envelope(values, index, travel)
    rates = reading(speed, f"${SPEEDS + index}", 1.0 / MINUTE_S), reading(acceleration, f"${ACCELERATIONS + index}")
    return axis_readings(f"{config.name}: axis {letter}", *rates, low, high, f"${TRAVELS + index}")


def _envelope(values: dict[int, float], index: int, travel: float) -> tuple[float, float]:
    """Limits of an axis as in limits_set_work_envelope of machine_limits.c."""
    left = values.get(PULL_OFF, 0.0) if int(values.get(HARD_LIMITS, 0.0)) & 1 else 0.0
    if not int(values.get(HOMING, 0.0)) & AT_ORIGIN:
        return left - travel, 0.0 - left
    to_the_least = int(values.get(HOME_SIDES, 0.0)) >> index & 1
    return (0.0, travel - left) if to_the_least else (left - travel, 0.0)
