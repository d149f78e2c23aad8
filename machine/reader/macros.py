"""Macros: Klipper's commands of a name and KEY=VALUE words."""

import re
from collections.abc import Callable
from math import inf

from machine.firmware.klipper import COMMANDS
from machine.gcode.words import quote, read_number, read_values
from machine.reader.motion import flush
from machine.reader.state import Reader
from profiles.errors import GcodeError

Values = dict[str, str]
KEYS = re.compile(r"(?: +[A-Z_][A-Z0-9_]*=(?:\"[^\"]*\"|[^\s\"'#()\\]*))* *").fullmatch  # a # begins a comment for Klipper


def macro(reader: Reader, code: str) -> bool:
    """Do one line in capitals; False when its name is not known."""
    name, _, rest = code.partition(" ")
    action = MACROS.get(name) if reader.dialect.macros else None
    if action is None:
        homed = re.fullmatch(r"HOME_([A-DU-Z]+)", name) if reader.dialect.macros else None
        if homed is None:
            return False
        _home(reader, homed[1])
        return True
    if name in VALUED and not KEYS(f" {rest}"):
        raise GcodeError(f"line {reader.number}: {quote(code)}: behind {name} only KEY=VALUE is allowed")
    if reader.turning and name != "MANUAL_STEPPER":
        flush(reader)
    action(reader, read_values(rest))
    return True


def _number(reader: Reader, values: Values, key: str, default: float | None = None) -> float:
    text = values.get(key)
    if text is None and default is not None:
        return default
    number = None if text is None else read_number(text)
    if number is None:
        raise GcodeError(f"line {reader.number}: {key} is {text!r}: a number is expected"[:200])
    return number


def _home(reader: Reader, letters: str) -> None:
    """HOME_AB and the like, which machines define for themselves: the named rotary axes stand at their zero."""
    for axis, letter in enumerate((reader.machine.tilt.letter, reader.machine.turn.letter), start=3):
        if letter in letters:
            reader.note("G28", 0.0, letter)
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
        reader.at[index] = _number(reader, values, "SET_POSITION")
        reader.note("G92", 0.0, axis.letter)
    if "MOVE" not in values:
        if reader.turning and values.get("SYNC") == "1":
            flush(reader)
        return
    value, speed = _number(reader, values, "MOVE"), _number(reader, values, "SPEED", axis.speed_deg_s)
    if speed <= 0:
        raise GcodeError(f"line {reader.number}: SPEED is {speed:g}: it must be above 0")
    if values.get("STOP_ON_ENDSTOP", "0") != "0":
        reader.note("G28", 0.0, axis.letter)
        reader.at[index] = reader.home[index]
        return
    if any(index == turned for turned, _, _ in reader.turning):
        flush(reader)
    reader.turning.append((index, value, speed))
    if values.get("SYNC", "1") != "0":
        flush(reader)


def _heat(reader: Reader, values: Values) -> None:
    target = _number(reader, values, "TARGET", 0.0)
    if values.get("HEATER") == "EXTRUDER":
        reader.nozzle_c = target
        reader.note("M104", target, "S")
    elif values.get("HEATER") == "HEATER_BED":
        reader.bed_c = target
        reader.note("M140", target, "S")


def _wait(reader: Reader, values: Values) -> None:
    """TEMPERATURE_WAIT: the heater's target counts, for MINIMUM stands a little below it."""
    if values.get("SENSOR") == "EXTRUDER" and reader.nozzle_c > 0:
        reader.note("M109", reader.nozzle_c, "S")
    elif values.get("SENSOR") == "HEATER_BED" and reader.bed_c > 0:
        reader.note("M190", reader.bed_c, "S")


def _off(reader: Reader, values: Values) -> None:
    reader.nozzle_c = reader.bed_c = 0.0
    reader.note("M104", 0.0, "S")
    reader.note("M140", 0.0, "S")


def _limit(reader: Reader, values: Values) -> None:
    accel = _number(reader, values, "ACCEL", inf)
    if 0 < accel < inf:
        reader.printing = reader.travelling = accel


def _pause(reader: Reader, values: Values) -> None:
    reader.note("M0", 0.0, "")


VALUED = frozenset({"MANUAL_STEPPER", "SET_HEATER_TEMPERATURE", "TEMPERATURE_WAIT", "SET_VELOCITY_LIMIT"})
MACROS: dict[str, Callable[[Reader, Values], None]] = {
    "MANUAL_STEPPER": _turn,
    "SET_HEATER_TEMPERATURE": _heat,
    "TEMPERATURE_WAIT": _wait,
    "TURN_OFF_HEATERS": _off,
    "PAUSE": _pause,
    **{name: lambda reader, values: None for name, command in COMMANDS.items() if command.shows or command.tunes},
    "SET_VELOCITY_LIMIT": _limit,
}
