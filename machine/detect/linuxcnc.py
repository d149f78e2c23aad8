"""LinuxCNC: its .ini, with what it includes.

docs/src/config/ini-config.adoc (0052c79): [TRAJ] COORDINATES names the axes, LINEAR_UNITS and ANGULAR_UNITS say what lengths and
angles of the file count in, a second; [AXIS_X] has MIN_LIMIT, MAX_LIMIT, MAX_VELOCITY and MAX_ACCELERATION, before 2.8 [AXIS_0]
by the joint's number; where an axis does not say it, its joint does, and where the kinematics follow the table (xyzac-trt-kins
and its like, [KINS] KINEMATICS) the joints go first, whose places are those of the machine; none of [TRAJ]'s velocities may be
passed. Without a limit an axis that turns is endless.
"""

import re
from collections.abc import Mapping
from math import pi

from machine.detect.found import (
    ACCELERATION,
    LIMITS,
    SPEED,
    AxisReadings,
    ConfigText,
    Found,
    Reading,
    check_whole,
    is_limit,
    limits,
    rounded,
)
from machine.detect.sections import Sections, number, read_sections
from profiles.errors import ProfileError

SIGNS = re.compile(r"^(?:\[(?:EMC|EMCMOT|TRAJ|KINS)\]|#INCLUDE\s+\S)", re.MULTILINE)
INCLUDE = re.compile(r"#INCLUDE\s+(\S+)")
LINEAR_MM = {"mm": 1.0, "metric": 1.0, "inch": 25.4, "in": 25.4, "imperial": 25.4}
ANGULAR_DEG = {**dict.fromkeys(("deg", "degree"), 1.0), **dict.fromkeys(("rad", "radian"), 180.0 / pi), "grad": 0.9, "gon": 0.9}
FOLLOWS = re.compile(r"\bxyz(?:ac|bc)-trt-kins\b")
TURNING = "ABC"


def recognise(text: str) -> bool:
    """Whether a text is such a file."""
    return SIGNS.search(text) is not None


def read(config: ConfigText) -> Found:
    """What a file tells. Raises ProfileError."""
    sections = read_sections(config, INCLUDE, indents=False)
    trajectory, kinematics = sections.get("TRAJ", {}), sections.get("KINS", {})
    module = kinematics.get("kinematics", "")
    coordinates = _letters(trajectory, module)
    joints = _of_module(module) or coordinates
    follows = FOLLOWS.search(module) is not None
    units = {
        "linear": _unit(config, trajectory, "linear_units", LINEAR_MM, "mm or inch"),
        "angular": _unit(config, trajectory, "angular_units", ANGULAR_DEG, "degree, radian or grad"),
    }
    axes = {
        letter: _axis(config, sections, letter, _places(sections, letter, joints.find(letter), follows), units[_kind(letter)])
        for letter in dict.fromkeys(coordinates)
    }
    settings: dict[str, Reading] = {}
    if module:
        settings["coordinates"] = Reading("workpiece" if follows else "table", f"[KINS] KINEMATICS {module.split()[0]}")
    rotary = "".join(letter for letter in axes if letter in TURNING)
    remarks = ("where its kinematics have the axes stands in its .hal files: x-rot-point and its like",) if rotary else ()
    name = sections.get("EMC", {}).get("machine", "").strip()
    return check_whole(Found("LinuxCNC", "linuxcnc", axes, rotary, settings, name=name, remarks=remarks), config.name)


def _letters(trajectory: Mapping[str, str], module: str) -> str:
    """The letters of COORDINATES, else of the kinematics, else X Y Z."""
    return _axis_letters(trajectory.get("coordinates", "")) or _of_module(module) or "XYZ"


def _of_module(module: str) -> str:
    """The letters of the joints in their order, as the kinematics are told them; "" where they are not."""
    return _axis_letters((module.lower().partition("coordinates=")[2].split() or [""])[0])


def _axis_letters(text: str) -> str:
    return re.sub(r"[^XYZABCUVW]", "", text.upper())


def _places(sections: Sections, letter: str, joint: int, follows: bool) -> list[str]:
    """The sections that tell of an axis, the one that counts first."""
    titles = (f"JOINT_{joint}", f"AXIS_{letter}") if follows else (f"AXIS_{letter}", f"JOINT_{joint}")
    return [title for title in (*titles, f"AXIS_{joint}") if title in sections]


def _kind(letter: str) -> str:
    return "angular" if letter in TURNING else "linear"


def _unit(config: ConfigText, trajectory: Mapping[str, str], key: str, units: Mapping[str, float], allowed: str) -> float:
    """How many mm or deg a unit has; mm and degree where it is not said. Raises ProfileError."""
    text = trajectory.get(key, "").strip().lower()
    if text and text not in units:
        raise ProfileError(f"{config.name}: [TRAJ] {key.upper()} is {text[:40]!r}: {allowed} is expected")
    return units.get(text, 1.0)


def _axis(config: ConfigText, sections: Sections, letter: str, places: list[str], unit: float) -> AxisReadings:
    trajectory, readings = sections.get("TRAJ", {}), AxisReadings()
    for key, theirs in ((SPEED, "MAX_VELOCITY"), (ACCELERATION, "MAX_ACCELERATION")):
        told = _first(config, sections, places, theirs)
        most_key = theirs.replace("MAX_", f"MAX_{_kind(letter).upper()}_")
        most = number(trajectory, most_key.lower(), f"{config.name}, [TRAJ]")
        if told is not None:
            value, title = told
            capped = most is not None and most < value
            source = f"[TRAJ] {most_key}" if capped else f"[{title}] {theirs}"
            readings[key] = Reading(rounded(unit * (most if capped and most is not None else value)), source)
    low, high = (_first(config, sections, places, f"{end}_LIMIT") for end in ("MIN", "MAX"))
    if low is not None and high is not None and is_limit(low[0]) and is_limit(high[0]):
        name = f"{config.name}: axis {letter}"
        readings[LIMITS] = limits(name, unit * low[0], unit * high[0], f"[{low[1]}] MIN_LIMIT, MAX_LIMIT")
    return readings


def _first(config: ConfigText, sections: Sections, places: list[str], key: str) -> tuple[float, str] | None:
    """The number of the first section that says it, and that section."""
    for title in places:
        value = number(sections[title], key.lower(), f"{config.name}, [{title}]")
        if value is not None:
            return value, title
    return None
