"""Codes: the effect of each G and M code and each Klipper macro on the reader; moves, arcs and turns become rows."""

import re
from collections.abc import Mapping
from math import hypot, inf, pi

import numpy as np

from machine.firmware import klipper
from machine.gcode.arcs import arc_centre, chord_count, chords, sweep_rad
from machine.gcode.commands import BED, HOME, HOMES, NOZZLE
from machine.gcode.modes import E_AXIS, MODES
from machine.gcode.reader.state import Reader, Words
from machine.gcode.words import quote, read_number, read_values
from machine.kinematics.table import axis_positions, followed_places
from mdp.pose import Pose
from profiles.errors import GcodeError

CHORD_MM = 0.005  # deviation of the chords of arcs
ROUND_MM = 0.1  # allowed difference of an arc's radius at its ends
Values = Mapping[str, str]
KEYS = re.compile(r"(?: +[A-Z_][A-Z0-9_]*=(?:\"[^\"]*\"|[^\s\"'#()\\]*))* *").fullmatch  # a # begins a comment for Klipper
HEATERS = {"EXTRUDER": NOZZLE, "HEATER_BED": BED}


# Codes recorded under their Marlin names, with their values; and codes without effect on motion, heat or time.
# fmt: off
NOTED = frozenset({
    "G4", "M0", "M1", "M18", "M84", "M104", "M106", "M107", "M109", "M140", "M190", "M226", "M400", "M600",
})
WITHOUT_EFFECT = frozenset({
    "G17", "G40", "G43", "G49", "G53", "G54", "G61", "G64", "G80", "G91.1", "G92.1", "G92.2", "M6", "M17", "M73", "M105", "M110",
    "M115", "M117", "M118", "M126", "M127", "M155", "M201", "M203", "M205", "M208", "M486", "M502", "M572", "M900",
})
# fmt: on
SILENT_MACROS = frozenset(name for name, command in klipper.COMMANDS.items() if command.shows or command.tunes)
# Allowed text after a command besides words with numbers: of the G codes only these take letters alone; M codes with values that
# the dry run uses take none, for firmwares differ in how they read it.
BARE_WORDS = frozenset({"G28", "G29", "G32", "G34"})
VALUED = frozenset({"M82", "M83", "M104", "M109", "M140", "M190", "M200", "M204", "M207", "M220", "M221", "M568"})
KEYED = frozenset({"MANUAL_STEPPER", "SET_HEATER_TEMPERATURE", "TEMPERATURE_WAIT", "SET_VELOCITY_LIMIT"})
MACROS = KEYED | SILENT_MACROS | {"TURN_OFF_HEATERS", "PAUSE"}


def do_command(reader: Reader, name: str, words: Words) -> None:
    """Execute a command. Raises GcodeError for unsupported motion codes; other unknown codes are counted."""
    dialect = reader.dialect
    if reader.turning:
        flush(reader)
    if name in (dialect.follow_on, dialect.follow_off):
        _follow(reader, name)
        return
    match name:
        case "G0" | "G1":
            _straight(reader, name, words)
        case "G2" | "G3":
            _arc(reader, name, words)
        case "G10" | "G11":
            _retract(reader, name, words)
        case "G28":
            _at_home(reader, _axes(reader, words) or _axes(reader, reader.letters))
        case "G29" | "G32" | "G34":  # levelling: moves that only the machine knows
            reader.ignore(name)
        case "G92":
            _set(reader, words)
        case "G93" if not dialect.inverse_time:
            raise GcodeError(f"G93 is not supported: {dialect.firmware} has no inverse time feed")
        case "M98":
            reader.own(name)
        case "M116":
            _wait(reader)
        case "M200":
            _volumetric(reader, words)
        case "M204":
            _accelerate(reader, words)
        case "M207":
            _retraction(reader, words)
        case "M220" | "M221":
            _override(reader, name, words)
        case "M568":
            _tool_heat(reader, words)
        case "M2" | "M30" if dialect.last:
            reader.ended = True
        case _ if name in MODES:
            reader.modes.set(name)
        case _ if name in NOTED:
            _note(reader, name, words)
        case _ if name in WITHOUT_EFFECT:
            pass
        case _ if name[0] == "T":
            if dialect.serial and name not in ("T0", "T-1"):
                raise GcodeError(f"{name} is not supported: this machine has one tool, T0")
        case _ if name[0] == "G":
            raise GcodeError(
                f"{name} is not supported: motion codes are G0 to G4, G10, G11, G28 and G92, modes G17, G20, "
                f"G21, G90, G91{', G93, G94' if dialect.inverse_time else ''}"
                f"{f', {dialect.follow_on}' if dialect.follow_on else ''}"
            )
        case _:
            reader.ignore(name)


def do_macro(reader: Reader, code: str) -> bool:
    """Execute a macro line in capitals; False for an unknown name."""
    name, _, rest = code.partition(" ")
    if HOMES.fullmatch(name):
        _home_turned(reader, name.removeprefix(HOME))
        return True
    if name not in MACROS:
        return False
    if name in KEYED and not KEYS(f" {rest}"):
        raise GcodeError(f"{quote(code)}: behind {name} only KEY=VALUE is allowed")
    if reader.turning and name != "MANUAL_STEPPER":
        flush(reader)
    values = read_values(rest)
    match name:
        case "MANUAL_STEPPER":
            _turn(reader, values)
        case "SET_HEATER_TEMPERATURE":
            _heat(reader, values)
        case "TEMPERATURE_WAIT":
            _wait_for(reader, values)
        case "TURN_OFF_HEATERS":
            for set_target, _ in HEATERS.values():
                reader.note(set_target, letters="S")
        case "SET_VELOCITY_LIMIT":
            _limit(reader, values)
        case "PAUSE":
            reader.note("M0")
    return True


def flush(reader: Reader) -> None:
    """Combine pending stepper turns in one row, as long as the slowest of them."""
    before, minutes = reader.at.copy(), 0.0
    for axis, value, speed_deg_s in reader.turning:
        minutes = max(minutes, abs(value - before[axis]) / speed_deg_s / 60.0)
        reader.at[axis] = value
    reader.turning.clear()
    reader.row(before, -1.0 / minutes if minutes > 0 else inf)


def _follow(reader: Reader, name: str) -> None:
    """Switch X Y Z to positions relative to the table (TCP), or back to axis positions; nothing moves."""
    reader.note(name)
    on = name == reader.dialect.follow_on
    if on != reader.followed:
        reader.followed = on
        reader.switches.append(reader.rows)
        coordinates, pose = np.array([reader.at[:5]]), Pose(reader.at[3], reader.at[4])
        moved = followed_places(reader.machine, pose, coordinates[:, :3]) if on else axis_positions(reader.machine, coordinates)
        reader.at[:3] = moved[0].tolist()


def _straight(reader: Reader, name: str, words: Words) -> None:
    """Execute G0 or G1: a row, unless only F is given; RepRapFirmware's H1, H3 and H4 run to an end stop."""
    reader.motion, dialect, modes = name, reader.dialect, reader.modes
    if dialect.endstop_word and name in ("G0", "G1"):
        if words.get(dialect.endstop_word) in (1.0, 3.0, 4.0):
            _at_home(reader, _axes(reader, words))
            return
        words = {letter: value for letter, value in words.items() if letter != dialect.endstop_word}
    before = reader.at.copy()
    if not modes.move(reader.at, words.items()):
        return
    if reader.flow != 1.0 or reader.filament_mm2:  # the extruder moves by more or less; the program's own sum stays
        step = reader.at[E_AXIS] - before[E_AXIS]
        pushed = step * reader.flow / (reader.filament_mm2 or 1.0)
        reader.at[E_AXIS] = before[E_AXIS] + pushed
        modes.offset[E_AXIS] -= pushed - step
    feed = modes.feed * reader.feed_share
    if name == "G0" and dialect.rapid:
        feed = inf
    elif modes.inverse_time:
        if "F" not in words:
            raise GcodeError("after G93 every move needs its own F")
        feed = -feed
    reader.row(before, feed)


def _arc(reader: Reader, name: str, words: Words) -> None:
    """Execute G2 or G3 in the X Y plane, by I J or R: rows of chords; the other axes move proportionally."""
    clockwise, before = name == "G2", reader.at.copy()
    unit_mm, letters = reader.modes.unit_mm, reader.letters
    shape = {letter: value * unit_mm for letter, value in words.items() if letter in "IJR" and letter not in letters}
    known = reader.rows
    _straight(reader, name, {letter: value for letter, value in words.items() if letter not in shape})
    after = reader.at.copy()
    reader.rows = known
    start, end = (before[0], before[1]), (after[0], after[1])
    centre = arc_centre(start, end, shape, clockwise)
    radii = [0.0, 0.0] if centre is None else [hypot(p[0] - centre[0], p[1] - centre[1]) for p in (start, end)]
    if centre is None or min(radii) == 0.0 or abs(radii[0] - radii[1]) > ROUND_MM:
        raise GcodeError(f"{name} is not an arc: I and J, or R, must give a centre equally far from both ends")
    sweep = sweep_rad(start, end, centre, clockwise)
    points = chords(start, end, centre, sweep, chord_count(max(radii), sweep, CHORD_MM))
    reader.at[:] = before
    feed = reader.modes.feed * reader.feed_share * (-len(points) if reader.modes.inverse_time else 1)
    for k, point in enumerate(points, start=1):
        row_before, share = reader.at.copy(), k / len(points)
        others = [a + share * (b - a) for a, b in zip(before[2:], after[2:], strict=True)]
        reader.at[:] = after if k == len(points) else [*point, *others]
        reader.row(row_before, feed)


def _axes(reader: Reader, words: Words) -> list[str]:
    """The letters of axes, without filament."""
    return [letter for letter in words if reader.letters.get(letter, E_AXIS) != E_AXIS]


def _at_home(reader: Reader, letters: list[str]) -> None:
    """Put axes to 0, or to the nearest position within their limits."""
    if reader.followed:
        raise GcodeError(f"homing while the firmware follows the table: {reader.dialect.follow_off} first")
    reader.note("G28", letters="".join(letters))
    for letter in letters:
        reader.at[reader.letters[letter]] = reader.home[reader.letters[letter]]


def _set(reader: Reader, words: Words) -> None:
    """Execute G92: set the named axes to values; E keeps its sum and changes its zero."""
    _note(reader, "G92", words)
    for axis, coordinate in reader.modes.named(words.items()):
        if axis == E_AXIS:
            reader.modes.offset[E_AXIS] = coordinate - reader.at[E_AXIS]
        else:
            reader.at[axis] = coordinate


def _note(reader: Reader, name: str, words: Words) -> None:
    """Record a command under its Marlin name, with its value."""
    order = ("P", "S", "R") if reader.dialect.value_word == "P" else ("S", "R")
    value = next((words[letter] for letter in order if letter in words), 0.0)
    if name == "G4":
        value = words.get("S", words.get("P", 0.0) * (0.001 if reader.dialect.serial else 1.0))
    reader.note(name, value, "".join(words))


def _retract(reader: Reader, name: str, words: Words) -> None:
    """Execute G10, which retracts by M207's length, or G11, which primes; with P G10 sets a tool's temperature (RepRapFirmware),
    with L20 a new zero (CNC)."""
    if name == "G10" and words.get("L") == 20.0:
        _set(reader, {letter: value for letter, value in words.items() if letter in reader.letters})
    elif name == "G10" and "L" in words:
        raise GcodeError(f"G10 L{words['L']:g} is not supported: of the offsets only L20 is")
    elif name == "G10" and "P" in words:
        if "S" in words:
            reader.note("M104", words["S"], "S")
    elif reader.retracted == (name == "G11"):
        reader.retracted, before = not reader.retracted, reader.at.copy()
        pushed_mm = -reader.retraction_mm if reader.retracted else reader.retraction_mm
        reader.at[E_AXIS] += pushed_mm
        reader.modes.offset[E_AXIS] -= pushed_mm
        reader.row(before, reader.retraction_feed)


def _retraction(reader: Reader, words: Words) -> None:
    """Execute M207: length (S, mm) and speed (F, mm/min) of G10."""
    if not reader.retracted:
        reader.retraction_mm = max(0.0, words.get("S", reader.retraction_mm))
    if words.get("F", 0.0) > 0:
        reader.retraction_feed = words["F"]


def _tool_heat(reader: Reader, words: Words) -> None:
    """Execute M568 (RepRapFirmware): S sets the tool's temperature, A0 switches its heater off."""
    if "S" in words or words.get("A") == 0.0:
        reader.note("M104", 0.0 if words.get("A") == 0.0 else words["S"], "S")


def _wait(reader: Reader) -> None:
    """Execute M116 (RepRapFirmware): wait for all heaters that are on."""
    for code, target in (("M190", reader.bed_c), ("M109", reader.nozzle_c)):
        if target > 0:
            reader.note(code, target, "S")


def _accelerate(reader: Reader, words: Words) -> None:
    """Execute M204: P for moves with filament, T for others, S for both; values not above 0 change nothing."""
    for letter, value in words.items():
        if value > 0 and letter in "PS":
            reader.printing = value * reader.modes.unit_mm
        if value > 0 and letter in "TS":
            reader.travelling = value * reader.modes.unit_mm


def _override(reader: Reader, name: str, words: Words) -> None:
    """Execute M220 or M221: S percent of every feed, of all filament; a value not above 0 changes nothing."""
    percent = words.get("S", 0.0)
    if percent > 0 and name == "M220":
        reader.feed_share = percent / 100.0
    elif percent > 0:
        reader.flow = percent / 100.0


def _volumetric(reader: Reader, words: Words) -> None:
    """Execute M200: with D, the filament's diameter, later E words are mm³; D0 or S0: millimetres again."""
    if "D" in words or words.get("S") == 0.0:
        diameter = words.get("D", 0.0) * reader.modes.unit_mm
        reader.filament_mm2 = pi * max(diameter, 0.0) ** 2 / 4.0 if words.get("S") != 0.0 else 0.0


def _number(values: Values, key: str, default: float | None = None) -> float:
    text = values.get(key)
    number = default if text is None else read_number(text)
    if number is None:
        raise GcodeError(f"{key} is {str(text)[:150]!r}: a number is expected")
    return number


def _home_turned(reader: Reader, letters: str) -> None:
    """Execute HOME_AB and similar macros, which machines define: the named rotary axes go to their zero."""
    for axis, letter in enumerate((reader.machine.tilt.letter, reader.machine.turn.letter), start=3):
        if letter in letters:
            reader.note("G28", letters=letter)
            reader.at[axis] = reader.home[axis]


def _turn(reader: Reader, values: Values) -> None:
    """Execute MANUAL_STEPPER of a rotary axis: MOVE, SET_POSITION, homing by STOP_ON_ENDSTOP; SYNC=0 starts the next one too."""
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


def _wait_for(reader: Reader, values: Values) -> None:
    """Execute TEMPERATURE_WAIT: the heater's target counts, for MINIMUM is slightly below it."""
    target = {"EXTRUDER": reader.nozzle_c, "HEATER_BED": reader.bed_c}.get(values.get("SENSOR", ""), 0.0)
    if target > 0:
        reader.note(HEATERS[values["SENSOR"]][1], target, "S")


def _limit(reader: Reader, values: Values) -> None:
    accel = _number(values, "ACCEL", inf)
    if 0 < accel < inf:
        reader.printing = reader.travelling = accel
