"""Codes: what each G and M code does to the reader."""

from collections.abc import Callable
from math import pi

from machine.gcode.modes import COMMANDS, E_AXIS
from machine.reader.motion import arc, flush, follow, push, straight
from machine.reader.state import Reader, Words
from profiles.errors import GcodeError


def dispatch(reader: Reader, name: str, words: Words) -> None:
    """Do one command. Raises GcodeError for motion codes that are not supported; other unknown codes are counted."""
    dialect = reader.dialect
    if reader.turning:
        flush(reader)
    if name in (dialect.follow_on, dialect.follow_off):
        reader.note(name, 0.0, "")
        follow(reader, name == dialect.follow_on)
        return
    action = CODES.get(name)
    if action is not None:
        action(reader, name, words)
    elif name in ("M2", "M30") and dialect.last:
        reader.ended = reader.number
    elif name == "T0" or name == "T-1" or (name[0] == "T" and not dialect.serial):
        return
    elif name[0] == "T":
        raise GcodeError(f"line {reader.number}: {name} is not supported: this machine has one tool, T0")
    elif name == "M98":
        reader.own(name)
    elif name[0] == "G":
        raise GcodeError(
            f"line {reader.number}: {name} is not supported: motion codes are G0 to G4, G10, G11, G28 and G92, modes G17, G20, "
            f"G21, G90, G91{', G93, G94' if dialect.inverse_time else ''}{f', {dialect.follow_on}' if dialect.follow_on else ''}"
        )
    else:
        reader.ignore(name)


def _move(reader: Reader, name: str, words: Words) -> None:
    reader.motion = name
    if endstop := reader.dialect.endstop_word:
        kind = next((value for letter, value in words if letter == endstop), 0.0)
        words = [word for word in words if word[0] != endstop]
        if kind in (1.0, 3.0, 4.0):  # until an end stop
            named = [letter for letter, _ in words if letter in reader.letters and letter != "E"]
            _at_home(reader, named)
            return
    straight(reader, words, name == "G0")


def _arc(reader: Reader, name: str, words: Words) -> None:
    reader.motion = name
    arc(reader, name, words)


def _mode(reader: Reader, name: str, words: Words) -> None:
    if name == "G93" and not reader.dialect.inverse_time:
        raise GcodeError(f"line {reader.number}: G93 is not supported: {reader.dialect.firmware} has no inverse time feed")
    reader.modes.set(name)


def _home(reader: Reader, name: str, words: Words) -> None:
    """G28: the named axes, or all, stand at 0 (or the nearest place inside their limits)."""
    named = [letter for letter, _ in words if letter in reader.letters and reader.letters[letter] != E_AXIS]
    _at_home(reader, named or [letter for letter, axis in reader.letters.items() if axis != E_AXIS])


def _at_home(reader: Reader, named: list[str]) -> None:
    if reader.followed:
        raise GcodeError(f"line {reader.number}: homing while the firmware follows the table: {reader.dialect.follow_off} first")
    reader.note("G28", 0.0, "".join(named))
    for letter in named:
        reader.at[reader.letters[letter]] = reader.home[reader.letters[letter]]


def _set(reader: Reader, name: str, words: Words) -> None:
    """G92: the named axes stand at the given values from now on; E keeps its sum and changes its zero."""
    _note(reader, name, words)
    for axis, coordinate in reader.modes.named(words):
        if axis == E_AXIS:
            reader.modes.offset[E_AXIS] = coordinate - reader.at[E_AXIS]
        else:
            reader.at[axis] = coordinate


def _note(reader: Reader, name: str, words: Words) -> None:
    """Put a command on record under its Marlin name, with its value."""
    values = dict(words)
    order = ("P", "S", "R") if reader.dialect.value_word == "P" else ("S", "R")
    value = next((values[letter] for letter in order if letter in values), 0.0)
    if name == "G4":
        seconds = 1.0 if not reader.dialect.serial else 0.001
        value = values.get("S", values.get("P", 0.0) * seconds)
    elif name in ("M104", "M109"):
        reader.nozzle_c = value
    elif name in ("M140", "M190"):
        reader.bed_c = value
    reader.note(name, value, "".join(letter for letter, _ in words))


def _offset(reader: Reader, name: str, words: Words) -> None:
    """G10: pull filament back as M207 has it; with P (RepRapFirmware) a tool's temperature; with L20 (CNC) a new zero."""
    values = dict(words)
    if values.get("L") == 20.0:
        _set(reader, "G92", [word for word in words if word[0] in reader.letters])
    elif "L" in values:
        raise GcodeError(f"line {reader.number}: G10 L{values['L']:g} is not supported: of the offsets only L20 is")
    elif "P" in values:
        if "S" in values:
            _note(reader, "M104", [("S", values["S"])])
    elif not reader.retracted:
        reader.retracted = True
        push(reader, -reader.retraction_mm, reader.retraction_feed)


def _recover(reader: Reader, name: str, words: Words) -> None:
    """G11: push what G10 has pulled."""
    if reader.retracted:
        reader.retracted = False
        push(reader, reader.retraction_mm, reader.retraction_feed)


def _retraction(reader: Reader, name: str, words: Words) -> None:
    """M207: how much G10 pulls (S, mm) and how fast (F, mm/min)."""
    values = dict(words)
    if not reader.retracted:
        reader.retraction_mm = max(0.0, values.get("S", reader.retraction_mm))
    if values.get("F", 0.0) > 0:
        reader.retraction_feed = values["F"]


def _tool_heat(reader: Reader, name: str, words: Words) -> None:
    """M568 (RepRapFirmware): S sets the tool's temperature, A0 switches its heater off."""
    values = dict(words)
    if "S" in values or values.get("A") == 0.0:
        _note(reader, "M104", [("S", 0.0 if values.get("A") == 0.0 else values["S"])])


def _wait(reader: Reader, name: str, words: Words) -> None:
    """M116 (RepRapFirmware): wait for all heaters that are on."""
    for code, target in (("M190", reader.bed_c), ("M109", reader.nozzle_c)):
        if target > 0:
            reader.note(code, target, "S")


def _accelerate(reader: Reader, name: str, words: Words) -> None:
    """M204: P while filament moves, T while it stands still, S both; what is not above 0 changes nothing."""
    for letter, value in words:
        if value > 0 and letter in "PS":
            reader.printing = value * reader.modes.unit_mm
        if value > 0 and letter in "TS":
            reader.travelling = value * reader.modes.unit_mm


def _override(reader: Reader, name: str, words: Words) -> None:
    """M220, M221: S percent of every feed, of all filament; what is not above 0 changes nothing."""
    percent = dict(words).get("S", 0.0)
    if percent > 0 and name == "M220":
        reader.feed_share = percent / 100.0
    elif percent > 0:
        reader.flow = percent / 100.0


def _volumetric(reader: Reader, name: str, words: Words) -> None:
    """M200: with D, the filament's diameter, E words are mm3 from here on; D0 or S0: millimetres again."""
    values = dict(words)
    diameter = values.get("D", 0.0) * reader.modes.unit_mm
    if diameter > 0 or "D" in values or values.get("S") == 0.0:
        reader.filament_mm2 = pi * max(diameter, 0.0) ** 2 / 4.0 if values.get("S") != 0.0 else 0.0


def _nothing(reader: Reader, name: str, words: Words) -> None:
    """Codes without a bearing on motion or heat."""


def _probe(reader: Reader, name: str, words: Words) -> None:
    """Levelling: moves that only the machine knows."""
    reader.ignore(name)


Action = Callable[[Reader, str, Words], None]
ACTIONS: tuple[tuple[Action, str], ...] = (
    (_move, "G0 G1"),
    (_arc, "G2 G3"),
    (_mode, " ".join(COMMANDS)),
    (_note, "G4 M0 M1 M226 M600 M18 M84 M104 M106 M107 M109 M140 M190 M400"),
    (_nothing, "G17 G40 G43 G49 G53 G54 G61 G64 G80 G91.1 G92.1 G92.2 M6"),
    (_nothing, "M17 M73 M105 M110 M115 M117 M118 M155 M201 M203 M205 M126 M127 M208 M486 M502 M572 M900"),
    (_accelerate, "M204"),
    (_override, "M220 M221"),
    (_volumetric, "M200"),
    (_home, "G28"),
    (_set, "G92"),
    (_offset, "G10"),
    (_recover, "G11"),
    (_retraction, "M207"),
    (_tool_heat, "M568"),
    (_wait, "M116"),
    (_probe, "G29 G32 G34"),
)
# What may stand behind a command besides words with numbers: of G codes only these take letters alone, of M codes those that set
# what the dry run counts with take none; firmwares differ in what they make of the rest.
BARE_WORDS = frozenset({"G28", "G29", "G32", "G34"})
VALUED = frozenset({"M82", "M83", "M104", "M109", "M140", "M190", "M200", "M204", "M207", "M220", "M221", "M568"})
CODES: dict[str, Action] = {code: action for action, codes in ACTIONS for code in codes.split()}
