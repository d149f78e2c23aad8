"""Commands: the table of all G-code commands and their effects.

Sender, pause, resume, dry run, calibration and manual control look up here whether a command heats, moves, homes, waits, is
remembered or may be repeated. `Command` documents the columns. Rows of a single firmware are in machine/firmware:
`commands_of(dialect)` is the table of a firmware, EVERY that of all of them. Sources: marlinfw.org/meta/gcode and Marlin's
gcode/gcode.h; docs.duet3d.com/User_manual/Reference/Gcodes and GCodes/GCodes2.cpp; klipper3d.org/G-Codes.html; linuxcnc.org/docs,
gcode and m-code.
"""

import re
from collections import ChainMap
from collections.abc import Mapping
from enum import Enum

from machine.firmware import FIRMWARES
from machine.firmware.dialect import EEPROM_S, HEATING_S, HOMING_S, PERSON_S, PROBING_S, Command, Dialect
from machine.gcode.line_text import MESSAGES, read_line
from machine.gcode.words import MACRO, read_letters, read_number, read_values, read_words, split_command
from profiles.errors import GcodeError

NEXT_COMMAND = re.compile(r"(?=[GM] *[0-9])")
TOOL, HOME = "T", "HOME_"  # rows of T0, T1, ... and of macros such as HOME_AB
TOOLS, HOMES = re.compile(r"T-?\d+"), re.compile(r"HOME_[A-DU-Z]+")
AT_BUTTONS, SENDERS = "waits for the printer's own buttons", "is an order of the sender"

# fmt: off
COMMANDS: dict[str, Command] = {
    # moves
    "G0": Command("travel move", moves="path"),
    "G1": Command("linear move", moves="path"),
    "G2": Command("clockwise arc", moves="path"),
    "G3": Command("counter-clockwise arc", moves="path"),
    "G4": Command("dwell", waits="time", answer_s=HEATING_S, repeatable=True),
    "G5": Command("spline", moves="other"),
    "G10": Command("firmware retraction", moves="filament"),
    "G11": Command("firmware unretraction", moves="filament"),
    "M400": Command("wait until all moves are over", waits="moves", answer_s=HEATING_S, repeatable=True),
    "M410": Command("stop all moves", refused=SENDERS),
    # homing and probing
    "G28": Command("home axes", moves="other", homes=True, answer_s=HOMING_S),
    "G29": Command("probe the bed; it may preheat (PREHEAT_BEFORE_LEVELING) or run mesh.g", moves="other", probes=True,
                   heats="any", answer_s=PROBING_S),
    "G30": Command("probe one point", moves="other", probes=True, answer_s=HOMING_S),
    "G32": Command("level the bed: RepRapFirmware runs bed.g", moves="other", probes=True, heats="any", answer_s=PROBING_S),
    "G33": Command("delta calibration", moves="other", probes=True, answer_s=PROBING_S),
    "G34": Command("align the Z motors", moves="other", probes=True, answer_s=PROBING_S),
    "G38.2": Command("probe towards the workpiece, or fail", moves="other", probes=True),
    "G38.3": Command("probe towards the workpiece", moves="other", probes=True),
    "G38.4": Command("probe away from the workpiece, or fail", moves="other", probes=True),
    "G38.5": Command("probe away from the workpiece", moves="other", probes=True),
    "M119": Command("report the end stops"),
    "M401": Command("deploy the probe"),
    "M402": Command("stow the probe"),
    # modes and coordinates
    "G17": Command("arcs in the plane X Y"),
    "G18": Command("arcs in the plane Z X", changes=True),
    "G19": Command("arcs in the plane Y Z", changes=True),
    "G20": Command("inches", changes=True, repeatable=True),
    "G21": Command("millimetres", changes=True, repeatable=True),
    "G40": Command("cutter compensation off"),
    "G43": Command("tool length offset on", changes=True),
    "G49": Command("tool length offset off", changes=True),
    "G53": Command("machine coordinates", changes=True),
    "G54": Command("first workplace", changes=True),
    "G64": Command("blend corners"),
    "G80": Command("cancel the motion mode"),
    "G90": Command("absolute coordinates", changes=True, repeatable=True),
    "G91": Command("relative coordinates", changes=True, repeatable=True),
    "G91.1": Command("relative arc centres"),
    "G92": Command("set coordinates", changes=True),
    "G92.1": Command("clear the offsets of G92", changes=True),
    "G92.2": Command("suspend the offsets of G92", changes=True),
    "G93": Command("inverse time feed", changes=True),
    "G94": Command("feed per minute", changes=True),
    "M82": Command("absolute filament", changes=True, repeatable=True),
    "M83": Command("relative filament", changes=True, repeatable=True),
    "M206": Command("home offset", changes=True),
    "M211": Command("software limits on or off"),
    "M500": Command("store the settings", changes=True, answer_s=EEPROM_S),
    "M501": Command("load the settings", changes=True),
    "M502": Command("factory settings", changes=True, answer_s=EEPROM_S),
    "M503": Command("report the settings"),
    TOOL: Command("select a tool; RepRapFirmware heats it to its active temperature, 0 until something sets it", changes=True),
    # heat
    "M104": Command("set the nozzle's temperature", heats="nozzle", repeatable=True),
    "M109": Command("set the nozzle's temperature and wait", heats="nozzle", waits="heat", answer_s=HEATING_S, repeatable=True),
    "M140": Command("set the bed's temperature", heats="bed", repeatable=True),
    "M190": Command("set the bed's temperature and wait", heats="bed", waits="heat", answer_s=HEATING_S, repeatable=True),
    "M141": Command("set the chamber's temperature", heats="chamber", repeatable=True),
    "M191": Command("set the chamber's temperature and wait", heats="chamber", waits="heat", answer_s=HEATING_S, repeatable=True),
    "M116": Command("wait for all heaters", waits="heat", answer_s=HEATING_S, repeatable=True),
    "M303": Command("tune a heater, which heats it", heats="any", answer_s=HEATING_S),
    "M105": Command("report temperatures", repeatable=True),
    "M108": Command("end a wait for heat", refused=SENDERS),
    "M155": Command("report temperatures at an interval in seconds", repeatable=True),
    "M301": Command("PID of the nozzle"),
    "M302": Command("allow cold extrusion"),
    "M304": Command("PID of the bed"),
    "M106": Command("fan on", repeatable=True),
    "M107": Command("fan off", repeatable=True),
    # motors
    "M17": Command("motors on", motors=True),
    "M18": Command("motors off", motors=True),
    "M84": Command("motors off, or their idle time", motors=True),
    "M85": Command("idle time until the printer shuts down", motors=True),
    "M80": Command("power supply on"),
    "M81": Command("power supply off"),
    # settings that a print relies on
    "M92": Command("steps per mm"),
    "M200": Command("filament by volume", modal=True),
    "M201": Command("acceleration limits", modal=True, tunes=True),
    "M203": Command("speed limits", modal=True, tunes=True),
    "M204": Command("accelerations", modal=True, tunes=True),
    "M205": Command("jerk", modal=True, tunes=True),
    "M207": Command("length and speed of the firmware's retraction", modal=True),
    "M208": Command("length and speed of the firmware's unretraction"),
    "M220": Command("feed override", modal=True),
    "M221": Command("flow override", modal=True),
    "M572": Command("pressure advance", modal=True, tunes=True),
    "M593": Command("input shaping", tunes=True),
    "M900": Command("linear advance", modal=True, tunes=True),
    "M413": Command("power-loss recovery", tunes=True),
    "M420": Command("use the mesh of the bed"),
    # waiting for the user
    "M0": Command("wait for the user", waits="person", refused=AT_BUTTONS),
    "M1": Command("wait for the user", waits="person", refused=AT_BUTTONS),
    "M125": Command("park and wait for the user", waits="person", answer_s=PERSON_S),
    "M226": Command("pause (RepRapFirmware), wait for a pin (Marlin)", waits="person", answer_s=PERSON_S),
    "M600": Command("change the filament, the nozzle hot", moves="other", heats="any", waits="person", answer_s=PERSON_S),
    "M701": Command("load filament, the nozzle hot", moves="other", heats="any", answer_s=PERSON_S),
    "M702": Command("unload filament, the nozzle hot", moves="other", heats="any", answer_s=PERSON_S),
    # display, names, host messages
    "M73": Command("progress", shows=True, repeatable=True),
    "M110": Command("line number", refused="would break the line numbers"),
    "M112": Command("emergency stop", refused=SENDERS),
    "M114": Command("report the position", repeatable=True),
    "M115": Command("report the firmware"),
    "M117": Command("show a text", shows=True, repeatable=True),
    "M118": Command("send a text to the host", shows=True),
    "M126": Command("open a valve"),
    "M127": Command("close a valve"),
    "M150": Command("lights"),
    "M300": Command("beep", shows=True),
    "M486": Command("name the objects of a print", shows=True, repeatable=True),
    # files and macros with any content
    "M24": Command("start a file of the printer's own", heats="any"),
    "M32": Command("start a file of the printer's own", heats="any"),
    "M25": Command("pause that file"),
    "M27": Command("report where that file is"),
    # ends of a program
    "M2": Command("end of the program"),
    "M30": Command("end of the program (CNC), delete a file (Marlin)"),
    "M6": Command("tool change"),
}
# fmt: on

NOTHING_KNOWN = Command("not known")
EVERY: Mapping[str, Command] = {  # shared rows take precedence, then the first firmware's
    name: command
    for table in (*(dialect.commands for firmware in reversed(FIRMWARES) for dialect in firmware.dialects.values()), COMMANDS)
    for name, command in table.items()
}
PATHS = frozenset(name for name, command in EVERY.items() if command.moves == "path")
# Codes that set a target without waiting, then those that wait for it; readers identify every firmware's heating by these.
NOZZLE, BED = (tuple(name for name, row in COMMANDS.items() if row.heats == heater) for heater in ("nozzle", "bed"))
URGENT = frozenset(name for name, row in COMMANDS.items() if row.refused == SENDERS)  # executed out of turn by a firmware


def commands_of(dialect: Dialect) -> Mapping[str, Command]:
    """The table of one firmware: its own rows before the shared ones."""
    return ChainMap(dict(dialect.commands), COMMANDS)


def command_named(name: str, commands: Mapping[str, Command] = EVERY) -> Command:
    """The row of a name in capitals, "M104" or a macro's; NOTHING_KNOWN for an unknown one."""
    row = commands.get(name)
    if row is None and TOOLS.fullmatch(name):
        row = commands.get(TOOL)
    elif row is None and name.startswith("HOME"):
        row = commands.get(HOME)
    return row or NOTHING_KNOWN


def command_in(line: str) -> Command:
    """The row of the first command in a line without comment, in any spelling: m0104S200 is M104."""
    return command_named(split_command(line.upper())[0])


class Heat(Enum):
    """The effect of a line on the heaters of a machine that must stay cold."""

    COLD = "it neither heats nor waits for heat"
    HEATS = "it sets a heater's target above 0, or waits for heat"
    UNSURE = "it runs a macro, a file or a cycle of the machine's own, or is not known"


def heat_in(line: str, dialect: Dialect) -> Heat:
    """The effect of a line on heaters, in any spelling: m104s200, several commands in a line, a macro's KEY=VALUE."""
    found = {_heat(name, rest, dialect) for name, rest in _commands(line)}
    return next((heat for heat in (Heat.UNSURE, Heat.HEATS) if heat in found), Heat.COLD)


def homes(line: str, dialect: Dialect) -> bool:
    """Whether a line homes axes."""
    return any(command_named(name, commands_of(dialect)).homes for name, _ in _commands(line))


def stands_still(line: str, dialect: Dialect) -> bool:
    """Whether a line is known to move nothing and to keep the meaning of later lines; macros are not."""
    for row in (command_named(name, commands_of(dialect)) for name, _ in _commands(line)):
        stirs = row.moves or row.homes or row.probes or row.motors or row.changes or row.refused or row.heats == "any"
        if stirs or row is NOTHING_KNOWN:
            return False
    return True


def _commands(line: str) -> list[tuple[str, str]]:
    """Name and rest of every command in a line, without displayed text.

    A line that firmwares read differently counts as one unknown command.
    """
    try:
        text = read_line(line).command.upper()
    except GcodeError:
        return [(line.strip().upper(), "")]
    if not text or split_command(text)[0] in MESSAGES:
        return []
    parts = [text] if MACRO.fullmatch(text) else NEXT_COMMAND.split(text)
    return [split_command(part.strip()) for part in parts if part.strip()]


def _heat(name: str, rest: str, dialect: Dialect) -> Heat:
    command = command_named(name, commands_of(dialect))
    is_named = name in commands_of(dialect) or TOOLS.fullmatch(name) or HOMES.fullmatch(name)
    if command is NOTHING_KNOWN or command.heats == "any" or not is_named:
        return Heat.UNSURE
    if command.waits == "heat":
        return Heat.HEATS
    if not command.heats or (command.heats_with and not set(command.heats_with) & set(read_letters(rest))):
        return Heat.COLD
    targets_c: list[float | None] = [value for letter, value in read_words(rest) if letter in ("S", "R", dialect.value_word)]
    targets_c += [read_number(value) for key, value in read_values(rest).items() if key == "TARGET"]
    switches_off = bool(targets_c) and all(target_c is not None and target_c <= 0.0 for target_c in targets_c)
    return Heat.COLD if switches_off else Heat.HEATS
