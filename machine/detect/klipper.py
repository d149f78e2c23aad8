"""Klipper: printer.cfg with what it includes, or the object configfile as Moonraker tells it (docs/Status_Reference.md).

docs/Config_Reference.md, klippy/configfile.py, toolhead.py, stepper.py, kinematics/extruder.py and extras/manual_stepper.py
(f68e511e2): lengths in mm, speeds mm/s; what the file does not say is what the program takes. Comments begin with # anywhere, or
with ; behind a blank; a line that begins with a blank goes on with the value before; later sections go over earlier ones; what
SAVE_CONFIG has written stands behind #*#. A [manual_stepper] counts in what its rotation_distance counts in, degrees for an axis
that turns; it has position_min and position_max only where they are written, and velocity and accel are what it moves with unless
told otherwise.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from math import pi
from typing import Any

from machine.detect.found import (
    ACCELERATION,
    LIMITS,
    PRINTING,
    SPEED,
    AxisReadings,
    ConfigText,
    Found,
    Reading,
    check_whole,
    limits,
    rounded,
)
from machine.detect.sections import Included, Sections, number, read_sections
from profiles.errors import ProfileError

SIGNS = re.compile(r"^\[(?:printer|include [^\]]+|stepper_x|mcu)\]", re.MULTILINE)
SAVED = "#*# "
INCLUDE = re.compile(r"\[include ([^\]]+)\]")
MANUAL = "manual_stepper "
RECTANGULAR = ("cartesian", "corexy", "corexz", "hybrid_corexy", "hybrid_corexz", "generic_cartesian", "limited_cartesian")
LETTER = re.compile(r"(?:^|_)([abcuvwijk])$", re.IGNORECASE)
REGISTERED = re.compile(r"MANUAL_STEPPER\b([^\n]*\bGCODE_AXIS=\s*([A-Z])\b[^\n]*)", re.IGNORECASE)
STEPPER = re.compile(r"\bSTEPPER=\s*\"?([A-Za-z0-9_]+)", re.IGNORECASE)
CORNER_MM_S = 5.0  # toolhead.py: square_corner_velocity
PROBES = ("bltouch", "probe", "smart_effector", "probe_eddy_current", "load_cell_probe", "cartographer", "beacon")


def recognise(text: str) -> bool:
    """Whether a text is a printer.cfg, or the answer to a query for configfile."""
    return (text.lstrip().startswith("{") and '"configfile"' in text) or SIGNS.search(text) is not None


def read(config: ConfigText) -> Found:
    """What a configuration tells. Raises ProfileError."""
    version, included = "", Included()
    if config.text.lstrip().startswith("{"):
        sections, version = _told_sections(config)
    else:
        sections = _sections(config, included)
    if "printer" not in sections:
        raise ProfileError(f"{config.name}: it has no [printer]: is it whole, and are the files it includes beside it?")
    axes, remarks = _linear(config, sections)
    if included.missing:
        remarks.append(f"{', '.join(included.missing)} is not beside it: what stands there is not known")
    letters, rotary = _rotary(config, sections)
    if rotary and not any(letter in letters for letter in rotary):
        remarks.append(
            "no macro makes its steppers letters of G1: MANUAL_STEPPER turns them; Klipper of May 2025 on can do both, and "
            "machine.dialect klipper has it register them"
        )
    firmware = f"Klipper {version}".strip()
    found = Found(
        firmware,
        "klipper" if letters or not rotary else "klipper_steppers",
        axes | {letter: readings for letter, (_, readings) in rotary.items()},
        "".join(rotary),
        _settings(config, sections, whole=not included.missing),
        {letter: name for letter, (name, _) in rotary.items()},
        probe=_probe(sections),
        remarks=tuple(remarks),
    )
    return check_whole(found, config.name)


def _told_sections(config: ConfigText) -> tuple[Sections, str]:
    """Of a query's answer: `config` has the file's words, `settings` what the program works with, sections in small letters."""
    try:
        document = json.loads(config.text)
    except (ValueError, RecursionError):
        raise ProfileError(f"{config.name}: its JSON is cut off or damaged") from None
    while isinstance(document, dict) and "configfile" not in document:
        document = next((document[key] for key in ("result", "status") if key in document), None)
    told = document.get("configfile") if isinstance(document, dict) else None
    sections = _texts(told.get("config") if isinstance(told, dict) else None)
    written = {name.lower(): name for name in sections}
    for name, values in _texts(told.get("settings") if isinstance(told, dict) else None).items():
        own = written.get(name, name)
        sections[own] = sections.get(own, {}) | values
    return sections, str(document.get("software_version") or "") if isinstance(document, dict) else ""


def _texts(sections: Any) -> Sections:
    if not isinstance(sections, Mapping):
        return {}
    whole = {str(name): values for name, values in sections.items() if isinstance(values, Mapping)}
    return {  # null stands for what is not set and has no default
        name: {str(key): str(value) for key, value in values.items() if value is not None} for name, values in whole.items()
    }


def _sections(config: ConfigText, included: Included) -> Sections:
    """Of a file; what SAVE_CONFIG has written counts where the file says nothing."""
    own, _, saved = config.text.partition(f"\n{SAVED}[")
    sections = read_sections(replace(config, text=own), INCLUDE, included)
    lines = f"[{saved}".splitlines() if saved else []
    for name, values in read_sections(replace(config, text="\n".join(line.removeprefix(SAVED) for line in lines))).items():
        sections[name] = values | sections.get(name, {})
    return sections


def _linear(config: ConfigText, sections: Sections) -> tuple[dict[str, AxisReadings], list[str]]:
    """X Y Z: one speed and acceleration for all, Z may have less; and sentences."""
    printer, name = sections["printer"], f"{config.name}, [printer]"
    kinematics = printer.get("kinematics", "")
    axes: dict[str, AxisReadings] = {letter: {} for letter in PRINTING}
    for key, most in ((SPEED, "max_velocity"), (ACCELERATION, "max_accel")):
        value, of_z = number(printer, most, name), number(printer, most.replace("max_", "max_z_"), name)
        if value is None:
            continue
        for letter in PRINTING:
            slower = letter == "Z" and of_z is not None
            source = f"[printer] {most.replace('max_', 'max_z_') if slower else most}"
            axes[letter][key] = Reading(rounded(min(value, of_z or value) if slower else value), source)
    if kinematics and kinematics not in RECTANGULAR:
        return axes, [f"its kinematics are {kinematics}: how far X, Y and Z reach stands in no axis of them"]
    for letter in PRINTING:
        stepper = f"stepper_{letter.lower()}"
        section = sections.get(stepper, sections.get(f"carriage {letter.lower()}", {}))
        low, high = (number(section, key, f"{config.name}, [{stepper}]") for key in ("position_min", "position_max"))
        if high is not None:
            axes[letter][LIMITS] = limits(
                f"{config.name}: axis {letter}", low or 0.0, high, f"[{stepper}] position_min, position_max"
            )
    return axes, []


def _rotary(config: ConfigText, sections: Sections) -> tuple[set[str], dict[str, tuple[str, AxisReadings]]]:
    """Letters that macros give to G1, and every letter with its stepper and its numbers."""
    registered: dict[str, tuple[str, str]] = {}  # stepper -> letter, rest of the command
    for values in sections.values():
        for rest, letter in REGISTERED.findall(values.get("gcode", "")):
            if of_stepper := STEPPER.search(rest):
                registered[of_stepper[1]] = letter.upper(), rest
    rotary: dict[str, tuple[str, AxisReadings]] = {}
    for title, section in sections.items():
        stepper = title.removeprefix(MANUAL)
        named = LETTER.search(stepper)
        letter, rest = registered.get(stepper, (named[1].upper() if named else "", ""))
        if title.startswith(MANUAL) and letter and letter not in rotary:
            rotary[letter] = stepper, _turning(config, title, section, rest)
    return {letter for letter, _ in registered.values()}, dict(sorted(rotary.items()))


def _turning(config: ConfigText, title: str, section: Mapping[str, str], registration: str) -> AxisReadings:
    """The numbers of a stepper; those with which it is registered as an axis go before its own."""
    readings: AxisReadings = {}
    for key, own, told in ((SPEED, "velocity", "LIMIT_VELOCITY"), (ACCELERATION, "accel", "LIMIT_ACCEL")):
        as_axis = re.search(rf"\b{told}=\s*([0-9]+(?:\.[0-9]+)?)", registration, re.IGNORECASE)
        value = float(as_axis[1]) if as_axis else number(section, own, f"{config.name}, [{title}]")
        if value:  # without an accel it starts and stops at once
            readings[key] = Reading(rounded(value), told if as_axis else f"[{title}] {own}")
    low, high = (number(section, key, f"{config.name}, [{title}]") for key in ("position_min", "position_max"))
    if low is not None and high is not None:
        readings[LIMITS] = limits(f"{config.name}: [{title}]", low, high, "position_min, position_max")
    return readings


def _settings(config: ConfigText, sections: Sections, whole: bool) -> dict[str, Reading]:
    """Settings by key; whole: what is not there is not there."""
    settings: dict[str, Reading] = {}
    extruder, bed, printer = sections.get("extruder", {}), sections.get("heater_bed"), sections["printer"]
    corner = number(printer, "square_corner_velocity", f"{config.name}, [printer]")
    source = (
        "[printer] square_corner_velocity" if corner is not None else "square_corner_velocity, which is 5 where it is not set"
    )
    settings["junction_speed_mm_s"] = Reading(rounded(CORNER_MM_S if corner is None else corner), source)
    name = f"{config.name}, [extruder]"
    for key, theirs in (("head.nozzle_mm", "nozzle_diameter"), ("nozzle_limit_c", "max_temp")):
        if (value := number(extruder, theirs, name)) is not None:
            settings[key] = Reading(rounded(value), f"[extruder] {theirs}")
    settings |= _filament(extruder, printer, config)
    if bed is None and whole:
        settings["bed_limit_c"] = Reading(0.0, "it has no [heater_bed]")
    elif bed is not None and (heat_c := number(bed, "max_temp", f"{config.name}, [heater_bed]")) is not None:
        settings["bed_limit_c"] = Reading(rounded(heat_c), "[heater_bed] max_temp")
    arcs = "gcode_arcs" in sections
    if arcs or whole:
        settings["arcs"] = Reading(arcs, "[gcode_arcs]" if arcs else "it has no [gcode_arcs]")
    return settings


def _filament(extruder: Mapping[str, str], printer: Mapping[str, str], config: ConfigText) -> dict[str, Reading]:
    """Of moves of the filament alone; where they are not set Klipper works them out of 4 nozzle^2 over the filament's area."""
    name = f"{config.name}, [extruder]"
    settings: dict[str, Reading] = {}
    nozzle, filament = (number(extruder, f"{which}_diameter", name) for which in ("nozzle", "filament"))
    for key, theirs, most in (
        ("extruder_speed_mm_s", "max_extrude_only_velocity", "max_velocity"),
        ("extruder_acceleration_mm_s2", "max_extrude_only_accel", "max_accel"),
    ):
        value, of_printer = number(extruder, theirs, name), number(printer, most, f"{config.name}, [printer]")
        if value is not None:
            settings[key] = Reading(rounded(value), f"[extruder] {theirs}")
        elif nozzle and filament and of_printer:
            ratio = 4.0 * nozzle**2 / (pi * (filament / 2.0) ** 2)
            settings[key] = Reading(rounded(of_printer * ratio), f"{theirs}, which Klipper makes of {most} where it is not set")
    return settings


def _probe(sections: Sections) -> str:
    kind = next((title for title in sections if title.split(" ")[0] in PROBES), "")
    return f"the probe [{kind}]" if kind else ""
