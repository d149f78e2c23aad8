"""Klipper: printer.cfg with the files it includes, or the object configfile of Moonraker (docs/Status_Reference.md).

docs/Config_Reference.md, klippy/configfile.py, toolhead.py, stepper.py, kinematics/extruder.py and extras/manual_stepper.py
(f68e511e2): lengths in mm, speeds in mm/s. SAVE_CONFIG writes after #*#, and applies to keys missing elsewhere. A
[manual_stepper] counts in the unit of its rotation_distance, degrees for a rotary axis; it has position_min and position_max only
if written; velocity and accel are its defaults.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from math import pi
from typing import Any

from machine.setup.detect.found import (
    ABC,
    PRINTING,
    AxisReadings,
    ConfigText,
    Found,
    Reading,
    Sections,
    axis_readings,
    has_box,
    read_sections,
)
from profiles.errors import ProfileError

SIGNS = re.compile(r"^\[(?:printer|include [^\]]+|stepper_x|mcu)\]", re.MULTILINE)
SAVED = "#*# "
INCLUDE = re.compile(r"\[include ([^\]]+)\]")
MANUAL = "manual_stepper "
LETTER = re.compile(r"(?:^|_)([abcuvwijk])(?:_axis)?$", re.IGNORECASE)
OF_Z = re.compile(r"(?:^|_)z(?:$|_|\d)", re.IGNORECASE)
REGISTERED = re.compile(r"MANUAL_STEPPER\b([^\n]*\bGCODE_AXIS=[ \t]*([A-Z])\b[^\n]*)", re.IGNORECASE)
STEPPER = re.compile(r"\bSTEPPER=\s*\"?([A-Za-z0-9_]+)", re.IGNORECASE)
SCREW_MM = 10.0  # greatest usual lead of a screw; in degrees it would be a gear of 36 to 1
TURN_DEG = 360.0
RATES = ("velocity", "accel")
CORNER_MM_S = 5.0  # toolhead.py: default of square_corner_velocity
PROBES = ("bltouch", "probe", "smart_effector", "probe_eddy_current", "load_cell_probe", "cartographer", "beacon")
SETTINGS = {  # key below machine -> section and key
    "junction_speed_mm_s": ("printer", "square_corner_velocity"),
    "head.nozzle_mm": ("extruder", "nozzle_diameter"),
    "nozzle_limit_c": ("extruder", "max_temp"),
    "bed_limit_c": ("heater_bed", "max_temp"),
    "extruder_speed_mm_s": ("extruder", "max_extrude_only_velocity"),
    "extruder_acceleration_mm_s2": ("extruder", "max_extrude_only_accel"),
}
WORKED_OUT = {"extruder_speed_mm_s": "max_velocity", "extruder_acceleration_mm_s2": "max_accel"}  # kinematics/extruder.py


def recognise(text: str) -> bool:
    """Whether a text is a printer.cfg, or the answer to a query for configfile."""
    return (text.lstrip().startswith("{") and '"configfile"' in text) or SIGNS.search(text) is not None


def read(config: ConfigText) -> Found:
    """The values in a configuration. Raises ProfileError."""
    is_answer = config.text.lstrip().startswith("{")
    sections, version = _answer_sections(config) if is_answer else (_sections(config), "")
    if "printer" not in sections.of:
        raise ProfileError(f"{config.name}: it has no [printer]: is it whole, and are the files it includes beside it?")
    remarks: list[str] = []
    axes = _linear(sections, remarks)
    if sections.missing:
        remarks.append(f"{', '.join(sections.missing)} is not beside it: its settings are unknown")
    registered = _registered(sections)
    steppers, doubtful = _steppers(sections, registered, remarks)
    as_axes = any(stepper in registered for stepper in steppers.values())
    if steppers and not as_axes:
        remarks.append(
            "no macro registers its steppers as axes of G1, so MANUAL_STEPPER moves them; with Klipper of May 2025 or later, "
            "machine.dialect klipper registers them"
        )
    axes |= {letter: _turning(sections, MANUAL + name, registered.get(name, ("", ""))[1]) for letter, name in steppers.items()}
    return Found(
        f"Klipper {version}".strip(),
        "klipper_steppers" if steppers and not as_axes else "klipper",
        axes,
        "".join(letter for letter in steppers if letter not in doubtful),
        doubtful,
        _settings(sections),
        steppers,
        probe=next((f"the probe [{title}]" for title in sections.of if title.split(" ")[0] in PROBES), ""),
        remarks=remarks,
    )


def _answer_sections(config: ConfigText) -> tuple[Sections, str]:
    """The sections in a query's answer (`config`: texts of the file, `settings`: values in use; titles in lower case), and the
    version."""
    try:
        document = json.loads(config.text)
    except (ValueError, RecursionError):
        raise ProfileError(f"{config.name}: its JSON is cut off or damaged") from None
    while isinstance(document, dict) and "configfile" not in document:
        document = next((document[key] for key in ("result", "status") if key in document), None)
    answer = document if isinstance(document, dict) else {}
    configfile = answer.get("configfile")
    own, in_use = (_texts(configfile.get(key) if isinstance(configfile, dict) else None) for key in ("config", "settings"))
    written = {title.lower(): title for title in own}
    for title, values in in_use.items():
        whole = written.get(title, title)
        own[whole] = own.get(whole, {}) | values
    return Sections(config.name, own), str(answer.get("software_version") or "")


def _texts(sections: Any) -> dict[str, dict[str, str]]:
    whole = {str(name): values for name, values in sections.items()} if isinstance(sections, Mapping) else {}
    return {  # null means unset without a default
        name: {str(key): str(value) for key, value in values.items() if value is not None}
        for name, values in whole.items()
        if isinstance(values, Mapping)
    }


def _sections(config: ConfigText) -> Sections:
    """The sections of a file; those of SAVE_CONFIG apply to keys missing in the file."""
    own, _, saved = config.text.partition(f"\n{SAVED}[")
    sections = read_sections(replace(config, text=own), INCLUDE)
    lines = f"[{saved}".split("\n") if saved else []
    for title, values in read_sections(replace(config, text="\n".join(line.removeprefix(SAVED) for line in lines))).of.items():
        sections.of[title] = {**values, **sections[title]}
    return sections


def _linear(sections: Sections, remarks: list[str]) -> dict[str, AxisReadings]:
    """X, Y and Z, which share speed and acceleration, though an axis may have lower ones. Raises ProfileError."""
    named = [sections["printer"][key] for key in ("kinematics", "kinematics_abc") if key in sections["printer"]]
    box = has_box(", ".join(named), f"{sections.name}: [printer] kinematics")
    if not box:
        remarks.append(f"its kinematics are {named[0]}: how far X, Y and Z reach stands in no axis of them")
    axes: dict[str, AxisReadings] = {}
    for letter in PRINTING:
        by_word = ([sections.reading("printer", f"max_{part}{word}") for part in ("", f"{letter.lower()}_")] for word in RATES)
        speed, acceleration = (min(filter(None, readings), default=None) for readings in by_word)
        title = next((title for title in (f"stepper_{letter.lower()}", f"carriage {letter.lower()}") if title in sections.of), "")
        low, high = (sections.number(title, f"position_{end}") for end in ("min", "max"))
        source, most = f"[{title}] position_min, position_max", high if box else None
        axes[letter] = axis_readings(f"{sections.name}: axis {letter}", speed, acceleration, low or 0.0, most, source)
    return axes


def _registered(sections: Sections) -> dict[str, tuple[str, str]]:
    """Stepper -> its letter for G1, assigned by a macro, and the rest of that command."""
    commands = (command for values in sections.of.values() for command in REGISTERED.findall(values.get("gcode", "")))
    return {named[1]: (letter.upper(), rest) for rest, letter in commands if (named := STEPPER.search(rest))}


def _steppers(
    sections: Sections, registered: Mapping[str, tuple[str, str]], remarks: list[str]
) -> tuple[dict[str, str], dict[str, str]]:
    """Letter -> [manual_stepper], and letter -> why it may not be rotary."""
    steppers, doubtful, others = dict[str, str](), dict[str, str](), list[str]()
    for title in sections.of:
        if not title.startswith(MANUAL):
            continue
        stepper = title.removeprefix(MANUAL)
        named = LETTER.search(stepper)
        letter = registered[stepper][0] if stepper in registered else named[1].upper() if named else ""
        if not letter:
            others.append(f"[{title}]")
        elif why := f"is the axis {letter} like {steppers[letter]}" if letter in steppers else _doubt(sections, title, letter):
            doubtful[letter] = f"{sections.name}: [{title}] {why}"
        if letter:
            steppers[letter] = stepper
    if others:
        remarks.append(
            f"not taken for axes of the table, which machine.tilt.stepper and machine.turn.stepper name: {', '.join(others)}"
        )
    return dict(sorted(steppers.items())), doubtful


def _doubt(sections: Sections, title: str, letter: str) -> str:
    """Why a stepper may not be rotary; "" if it is."""
    distance = sections.number(title, "rotation_distance")
    if OF_Z.search(title.removeprefix(MANUAL)):
        return "is named like a Z axis"
    if distance == TURN_DEG:
        return ""
    if "endstop_pin" in sections[title] and distance is not None and distance <= SCREW_MM:
        return f"has an endstop_pin and a rotation_distance of {distance:g}, as a screw has"
    return "" if letter in ABC else f"is the axis {letter}, which need not turn"


def _turning(sections: Sections, title: str, registration: str) -> AxisReadings:
    """The numbers of a stepper; those of its registration as an axis take precedence."""
    rates: list[Reading | None] = []
    for own in RATES:
        limit = f"LIMIT_{own.upper()}"
        as_axis = re.search(rf"\b{limit}=\s*([0-9]+(?:\.[0-9]+)?)", registration, re.IGNORECASE)
        reading = Reading(float(as_axis[1]), limit) if as_axis else sections.reading(title, own)
        rates.append(reading if reading is not None and reading.value else None)  # without an accel it starts and stops at once
    low, high = (sections.number(title, f"position_{end}") for end in ("min", "max"))
    return axis_readings(f"{sections.name}: [{title}]", rates[0], rates[1], low, high, "position_min, position_max")


def _settings(sections: Sections) -> dict[str, Reading]:
    """Settings by key below machine."""
    readings = {key: sections.reading(*place) for key, place in SETTINGS.items()}
    settings = {key: reading for key, reading in readings.items() if reading is not None}
    corner = Reading(CORNER_MM_S, "square_corner_velocity, which is 5 where it is not set")
    settings.setdefault("junction_speed_mm_s", corner)
    nozzle, filament = (sections.number("extruder", f"{which}_diameter") for which in ("nozzle", "filament"))
    for key, most in WORKED_OUT.items():
        of_printer = sections.number("printer", most)
        if key not in settings and nozzle and filament and of_printer:
            ratio = 4.0 * nozzle**2 / (pi * (filament / 2.0) ** 2)
            source = f"{SETTINGS[key][1]}, which Klipper makes of {most} where it is not set"
            settings[key] = Reading(of_printer * ratio, source)
    arcs = "gcode_arcs" in sections.of
    if arcs or not sections.missing:
        settings["arcs"] = Reading(arcs, "[gcode_arcs]" if arcs else "it has no [gcode_arcs]")
    if "heater_bed" not in sections.of and not sections.missing:
        settings["bed_limit_c"] = Reading(0.0, "it has no [heater_bed]")
    return settings
