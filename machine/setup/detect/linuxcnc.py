"""LinuxCNC: its .ini, with the files it includes.

docs/src/config/ini-config.adoc (0052c79): [TRAJ] COORDINATES names the axes, LINEAR_UNITS and ANGULAR_UNITS the units, all per
second; [AXIS_X] has MIN_LIMIT, MAX_LIMIT, MAX_VELOCITY and MAX_ACCELERATION, before 2.8 [AXIS_0] by the joint's number. Keys
missing there are taken from the joint; with kinematics that follow the table (xyzac-trt-kins and the like, [KINS] KINEMATICS) the
joints take precedence, for their positions are the machine's. No velocity exceeds those of [TRAJ]. An axis without limits is
unlimited.
"""

import re
from collections.abc import Mapping
from math import pi

from machine.setup.detect.found import ABC, AxisReadings, ConfigText, Found, Reading, Sections, axis_readings, read_sections
from profiles.errors import ProfileError

SIGNS = re.compile(r"^(?:\[(?:EMC|EMCMOT|TRAJ|KINS)\]|#INCLUDE\s+\S)", re.MULTILINE)
INCLUDE = re.compile(r"#INCLUDE\s+(\S+)")
LINEAR_MM = {"mm": 1.0, "metric": 1.0, "inch": 25.4, "in": 25.4, "imperial": 25.4}
ANGULAR_DEG = {**dict.fromkeys(("deg", "degree"), 1.0), **dict.fromkeys(("rad", "radian"), 180.0 / pi), "grad": 0.9, "gon": 0.9}
FOLLOWS = re.compile(r"xyz(?:ac|bc)-trt-kins")
PLAIN = ("trivkins", "corexykins")


def recognise(text: str) -> bool:
    """Whether a text is a LinuxCNC configuration."""
    return SIGNS.search(text) is not None


def read(config: ConfigText) -> Found:
    """The values in a file. Raises ProfileError."""
    sections = read_sections(config, INCLUDE, indents=False)
    module = sections["KINS"].get("kinematics", "")
    kinematics = (module.split() or [""])[0]
    follows = FOLLOWS.fullmatch(kinematics) is not None
    if follows and "identityfirst" not in module:
        raise ProfileError(
            f"{config.name}: [KINS] KINEMATICS is {module!r} without sparm=identityfirst: M428, with which a print lets the tip "
            "follow the table, would end that; add it"
        )
    joints = _letters(module.lower().partition("coordinates=")[2].split(" ")[0])
    coordinates = _letters(sections["TRAJ"].get("coordinates", "")) or joints or "XYZ"
    mm = _unit(sections, "linear_units", LINEAR_MM, "mm or inch")
    deg = _unit(sections, "angular_units", ANGULAR_DEG, "degree, radian or grad")
    axes, doubtful = dict[str, AxisReadings](), dict[str, str]()
    for letter in dict.fromkeys(coordinates):
        titles = _titles(sections, letter, (joints or coordinates).find(letter), follows)
        axes[letter] = _axis(sections, letter, titles, deg if letter in ABC else mm)
        if letter in ABC and not (follows or kinematics in PLAIN):
            doubtful[letter] = f"{config.name}: [KINS] KINEMATICS is {kinematics!r}, with which {letter} need not turn the table"
        elif letter in ABC and any(sections[title].get("type", "").upper() == "LINEAR" for title in titles):
            doubtful[letter] = f"{config.name}: the joint of axis {letter} has TYPE = LINEAR"
    settings: dict[str, Reading] = {}
    if follows or kinematics in PLAIN:
        settings["coordinates"] = Reading("workpiece" if follows else "table", f"[KINS] KINEMATICS {kinematics}")
    rotary = "".join(letter for letter in axes if letter in ABC and letter not in doubtful)
    remarks = ["where its kinematics have the axes stands in its .hal files: x-rot-point and its like"] if rotary else []
    name = sections["EMC"].get("machine", "").strip()
    return Found("LinuxCNC", "linuxcnc", axes, rotary, doubtful, settings, name=name, remarks=remarks)


def _letters(text: str) -> str:
    return re.sub(r"[^XYZABCUVW]", "", text.upper())


def _titles(sections: Sections, letter: str, joint: int, follows: bool) -> list[str]:
    """The sections of an axis in order of precedence."""
    titles = (f"JOINT_{joint}", f"AXIS_{letter}") if follows else (f"AXIS_{letter}", f"JOINT_{joint}")
    return [title for title in (*titles, f"AXIS_{joint}") if title in sections.of]


def _unit(sections: Sections, key: str, units: Mapping[str, float], allowed: str) -> float:
    """Size of a unit in mm or deg; mm and degree by default. Raises ProfileError."""
    text = sections["TRAJ"].get(key, "").strip().lower()
    if text and text not in units:
        raise ProfileError(f"{sections.name}: [TRAJ] {key.upper()} is {text[:40]!r}: {allowed} is expected")
    return units.get(text, 1.0)


def _axis(sections: Sections, letter: str, titles: list[str], unit: float) -> AxisReadings:
    rates: list[Reading | None] = []
    for word in ("VELOCITY", "ACCELERATION"):
        rate = _first(sections, titles, f"MAX_{word}", unit)
        most = _first(sections, ["TRAJ"], f"MAX_{'ANGULAR' if letter in ABC else 'LINEAR'}_{word}", unit)
        rates.append(None if rate is None else Reading(*min(rate, most or rate)))
    low, high = (_first(sections, titles, f"{end}_LIMIT", unit) for end in ("MIN", "MAX"))
    ends = (low[0], high[0]) if low and high else (None, None)
    source = low[1].replace("MIN_LIMIT", "MIN_LIMIT, MAX_LIMIT") if low else ""
    return axis_readings(f"{sections.name}: axis {letter}", rates[0], rates[1], ends[0], ends[1], source)


def _first(sections: Sections, titles: list[str], key: str, unit: float) -> tuple[float, str] | None:
    """The number of the first section that has it, in the profile's units, and its source."""
    for title in titles:
        if (value := sections.number(title, key.lower())) is not None:
            return unit * value, f"[{title}] {key}"
    return None
