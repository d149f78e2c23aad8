"""Marlin: the answers to M115, M503 and M211, direct or from a saved log.

gcode/config/M200-M205.cpp, gcode/control/M211.cpp and module/settings.cpp of Marlin 2.1: M203 gives units/s, M201 and M204
units/s2, under the letters of AXIS4_NAME and so on; in inches after G20. M205 gives jerk by axis, or J, the junction deviation.
M211 gives the software end stops in mm. M115 has capabilities, and in a build with M115_GEOMETRY_REPORT the reach of the axes,
from the fourth as i, j, k (gcode/host/M115.cpp).
"""

import re

from machine.gcode.words import NUMBER
from machine.link.identification import KEY, VERSION
from machine.link.protocol.events import AREA, NAME, REACH
from machine.setup.detect.found import (
    ABC,
    EXTRUDER,
    PRINTING,
    AxisReadings,
    ConfigText,
    Found,
    Reading,
    axis_readings,
    corner_speed,
    reading,
)
from profiles.errors import ProfileError

REPORT = re.compile(  # after echo: and what a host's log adds; a command with only its words, not a sentence about it
    rf"(?:^|[:>])[ \t]*(M92|M20[0-5]|M211|M851|G20)((?:[ \t]+[A-Z]{NUMBER})*)[ \t]*(?:[;(#].*)?$", re.MULTILINE
)
WORD = re.compile(rf"([A-Z])({NUMBER})")
SOFT_LIMITS = re.compile(r"Min:(.*?)Max:(.*)")
PLACE = re.compile(rf"([A-Z])[: ]*({NUMBER})")
CAPABILITY = re.compile(r"Cap:(\w+):1")
RATES = ("M203", "M201")  # speeds and accelerations


def recognise(text: str) -> bool:
    """Whether a text is a log of Marlin."""
    reports = {command for command, words in REPORT.findall(text) if words}
    return {"M92", "M203"} <= reports and ("echo:" in text or "M205" in reports)


def read(config: ConfigText) -> Found:
    """The values in a log. Raises ProfileError."""
    words = _words(config)
    axes = _axes(config, words)
    capabilities = set(CAPABILITY.findall(config.text))
    settings, remarks = _corner(words), []
    if words.get("M200", {}).get("S", 0.0) > 0.0:
        remarks.append("the printer counts filament in mm³ (M200 S1): its speed is left as it is")
    else:
        filament = axes.get("E", {})
        settings |= {key: filament[word] for key, word in EXTRUDER.items() if word in filament}
    if "ARCS" in capabilities:
        settings["arcs"] = Reading(True, "Cap:ARCS of M115")
    others = [letter for letter in axes if letter not in (*PRINTING, "E")]
    doubtful = {letter: f"{config.name}: M203 does not say whether {letter} turns" for letter in others if letter not in ABC}
    rotary = "".join(letter for letter in others if letter in ABC)
    firmware, name = _identity(config.text)
    probe = "a Z probe" if "M851" in words or "Z_PROBE" in capabilities else ""
    return Found(firmware, "marlin", axes, rotary, doubtful, settings, name=name, probe=probe, remarks=remarks)


def _words(config: ConfigText) -> dict[str, dict[str, float]]:
    """Command -> its letters; the first of several extruders."""
    words: dict[str, dict[str, float]] = {}
    for command, rest in REPORT.findall(config.text):
        if command == "G20":
            raise ProfileError(f"{config.name}: the printer reports inches (G20): send it G21 first, then it reports mm")
        letters = {letter: float(number) for letter, number in WORD.findall(rest)}
        if letters.get("T", 0.0) == 0.0 or command not in RATES:
            words[command] = words.get(command, {}) | letters
    return words


def _axes(config: ConfigText, words: dict[str, dict[str, float]]) -> dict[str, AxisReadings]:
    speeds, accelerations = (words.get(command, {}) for command in RATES)
    letters = [letter for letter in speeds if letter != "T"]
    reach = _area(config.text, letters) | _soft_limits(config.text)
    return {
        letter: axis_readings(
            f"{config.name}: axis {letter}",
            reading(speeds.get(letter), RATES[0]),
            reading(accelerations.get(letter), RATES[1]),
            *reach.get(letter, (None, None, "")),
        )
        for letter in letters
    }


def _soft_limits(text: str) -> dict[str, tuple[float, float, str]]:
    """Limits in the answer to M211: `Min:  X0.00 Y0.00 Z0.00   Max:  X200.00 ...`."""
    line = SOFT_LIMITS.search(text)
    if line is None:
        return {}
    least, most = ({letter: float(number) for letter, number in PLACE.findall(side)} for side in line.groups())
    return {letter: (low, most[letter], "M211") for letter, low in least.items() if letter in most}


def _area(text: str, letters: list[str]) -> dict[str, tuple[float, float, str]]:
    """Limits in the answer to M115, whose axes are in the order of M203."""
    area = AREA.search(text)
    if area is None:
        return {}
    least, most = ([float(number) for _, number in REACH.findall(side)] for side in area.groups())
    named = [letter for letter in letters if letter != "E"]
    return {letter: (low, high, "M115, area") for letter, low, high in zip(named, least, most, strict=False)}


def _corner(words: dict[str, dict[str, float]]) -> dict[str, Reading]:
    """Corner speed: the smaller jerk of X and Y, or from the junction deviation at the acceleration of printing moves."""
    report = words.get("M205", {})
    jerks = [report[letter] for letter in "XY" if letter in report]
    if jerks:
        return {"junction_speed_mm_s": Reading(min(jerks), "M205")}
    printing = words.get("M204", {}).get("P", 0.0)
    if report.get("J", 0.0) <= 0.0 or printing <= 0.0:
        return {}
    source = f"M205 J{report['J']:g}, at the {printing:g} mm/s2 of M204 P"
    return {"junction_speed_mm_s": Reading(corner_speed(report["J"], printing), source)}


def _identity(text: str) -> tuple[str, str]:
    """The firmware with its version, and the name of the machine."""
    line = next((line for line in text.splitlines() if NAME in line), "")
    words = line[line.index(NAME) + len(NAME) :].strip() if line else ""
    version, machine = VERSION.search(line), re.search(r"MACHINE_TYPE:(.*?)\s+[A-Z_]+:", line)
    firmware = KEY.split(words)[0] or "Marlin"
    return (f"{firmware} {version[1]}" if version else firmware), (machine[1] if machine else "")
