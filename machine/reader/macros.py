"""Macros: Klipper's commands of a name and KEY=VALUE words."""

import re
from collections.abc import Callable, Mapping
from math import inf

from machine.firmware.klipper import COMMANDS
from machine.gcode.words import quote, read_number, read_values
from machine.reader.codes import flush
from machine.reader.state import Reader
from profiles.errors import GcodeError

Values = Mapping[str, str]
KEYS = re.compile(r"(?: +[A-Z_][A-Z0-9_]*=(?:\"[^\"]*\"|[^\s\"'#()\\]*))* *").fullmatch  # a # begins a comment for Klipper
HEATERS = {"EXTRUDER": ("M104", "M109"), "HEATER_BED": ("M140", "M190")}  # the codes that set, and that wait for, a target


def macro(reader: Reader, code: str) -> bool:
    """Do one line in capitals; False when its name is not known."""
    name, _, rest = code.partition(" ")
    action = MACROS.get(name)
    if action is None:
        if homed := re.fullmatch(r"HOME_([A-DU-Z]+)", name):
            _home(reader, homed[1])
        return homed is not None
    if name in VALUED and not KEYS(f" {rest}"):
        raise GcodeError(f"{quote(code)}: behind {name} only KEY=VALUE is allowed")
    if reader.turning and name != "MANUAL_STEPPER":
        flush(reader)
    action(reader, read_values(rest))
    return True


def _number(values: Values, key: str, default: float | None = None) -> float:
    text = values.get(key)
    number = default if text is None else read_number(text)
    if number is None:
        raise GcodeError(f"{key} is {text!r}: a number is expected"[:190])
    return number


def _home(reader: Reader, letters: str) -> None:
    """HOME_AB and the like, which machines define for themselves: the named rotary axes stand at their zero."""
    for axis, letter in enumerate((reader.machine.tilt.letter, reader.machine.turn.letter), start=3):
        if letter in letters:
            reader.note("G28", letters=letter)
            reader.at[axis] = reader.home[axis]


def _turn(reader: Reader, values: Values) -> None:
    """MANUAL_STEPPER of a rotary axis: MOVE, SET_POSITION, homing by STOP_ON_ENDSTOP; SYNC=0 lets the next one begin too."""
    names = reader.modes.axes.steppers
    if values.get("STEPPER") not in names:
        reader.ignore("MANUAL_STEPPER")
        return
    index = 3 + names.index(values["STEPPER"])
    axis = (reader.machine.tilt, reader.machine.turn)[index - 3]
    if "SET_POSITION" in values:
        reader.at[index] = _number(values, "SET_POSITION")
        reader.note("G92", letters=axis.letter)
    if "MOVE" not in values:
        if reader.turning and values.get("SYNC") == "1":
            flush(reader)
        return
    value, speed = _number(values, "MOVE"), _number(values, "SPEED", axis.speed_deg_s)
    if speed <= 0:
        raise GcodeError(f"SPEED is {speed:g}: it must be above 0")
    if values.get("STOP_ON_ENDSTOP", "0") != "0":
        reader.note("G28", letters=axis.letter)
        reader.at[index] = reader.home[index]
        return
    if any(index == turned for turned, _, _ in reader.turning):
        flush(reader)
    reader.turning.append((index, value, speed))
    if values.get("SYNC", "1") != "0":
        flush(reader)


def _heat(reader: Reader, values: Values) -> None:
    target = _number(values, "TARGET", 0.0)
    if values.get("HEATER") in HEATERS:
        reader.note(HEATERS[values["HEATER"]][0], target, "S")


def _wait(reader: Reader, values: Values) -> None:
    """TEMPERATURE_WAIT: the heater's target counts, for MINIMUM stands a little below it."""
    target = {"EXTRUDER": reader.nozzle_c, "HEATER_BED": reader.bed_c}.get(values.get("SENSOR", ""), 0.0)
    if target > 0:
        reader.note(HEATERS[values["SENSOR"]][1], target, "S")


def _off(reader: Reader, values: Values) -> None:
    for code, _ in HEATERS.values():
        reader.note(code, letters="S")


def _limit(reader: Reader, values: Values) -> None:
    accel = _number(values, "ACCEL", inf)
    if 0 < accel < inf:
        reader.printing = reader.travelling = accel


VALUED = frozenset({"MANUAL_STEPPER", "SET_HEATER_TEMPERATURE", "TEMPERATURE_WAIT", "SET_VELOCITY_LIMIT"})
MACROS: dict[str, Callable[[Reader, Values], None]] = {
    "MANUAL_STEPPER": _turn,
    "SET_HEATER_TEMPERATURE": _heat,
    "TEMPERATURE_WAIT": _wait,
    "TURN_OFF_HEATERS": _off,
    "PAUSE": lambda reader, values: reader.note("M0"),
    **{name: lambda reader, values: None for name, command in COMMANDS.items() if command.shows or command.tunes},
    "SET_VELOCITY_LIMIT": _limit,
}
