"""RepRapFirmware 3: config.g, or its object model as answered by M409 and rr_model, a line of JSON for each key.

Platform/Platform.cpp, Heating/Heat.cpp and Heater.cpp (fc1cd16c): speed and jerk of an axis are per minute, acceleration per
second squared; heat.bedHeaters and a tool's heaters are indices into heat.heaters, whose max is the greatest temperature.

config.g has the settings as commands, with the macros it calls. GCodes/GCodes2.cpp, GCodes3.cpp (DoDriveMapping): M203 and M566
are in mm or deg per minute, M203 S1 and M205 per second, M201 per second squared; M208 has both limits separated by a colon, or
one with S1 for the least and S0 for the greatest; M584 makes axes, R1 and R2 rotary ones; M669 K or M665 sets the kinematics;
M143 limits heater 1 by default; M563 H names the heater of a tool, M140 H that of the bed, -1 none.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from machine.printing.servers.http import number, table
from machine.setup.detect.found import (
    ACCELERATION,
    EXTRUDER,
    LIMITS,
    MOST_INCLUDED,
    PRINTING,
    SPEED,
    AxisReadings,
    ConfigText,
    Found,
    Reading,
    axis_readings,
    has_box,
    reading,
)
from profiles.errors import ProfileError
from profiles.messages import option

OWN = re.compile(r"^\s*M(?:566|584|574|950|563|143|669)\b", re.MULTILINE)  # commands that no other firmware has
MODEL = re.compile(r'^\s*\{"key":\s*"', re.MULTILINE)

Table = Mapping[str, Any]
COMMENT = re.compile(r'"[^"]*"|;.*')
COMMAND = re.compile(r"\s*([GM]\d+(?:\.\d+)?)\b(.*)")
NUMBERS = r"-?(?:\d+\.?\d*|\.\d+)"
PARAMETER = re.compile(rf"(?<!')([A-Za-z])\s*({NUMBERS}(?::{NUMBERS})*)")  # 'a is an axis distinct from A, which no profile has
EXPRESSION = re.compile(r"'?[A-Za-z]\s*\{")
BLOCKS = ("if", "elif", "else", "while")
MACRO = re.compile(r'M98\s+P\s*"([^"]+)"')
NAME = re.compile(r'^\s*M550\s+P\s*"([^"]+)"', re.MULTILINE)
KINEMATICS = dict(  # Movement/Kinematics/Kinematics.h, KinematicsType
    enumerate(("cartesian", "corexy", "corexz", "delta", "scara", "corexyu", "hangprinter", "polar", "corexyuv"))
) | {10: "rotarydelta", 11: "markforged"}

MINUTE_S = 60.0
# Command -> key of each axis, the seconds of its unit, and letters that are not axes; S1 among these: per second.
RATES = {"M201": (ACCELERATION, 1.0, ""), "M203": (SPEED, MINUTE_S, "SI")}
JERKS = {"M205": 1.0, "M566": MINUTE_S}  # command -> the seconds of its unit
HEATERS = {"M140": "bed", "M563": "nozzle"}  # command -> the field set by H of the bed, of the first tool

Parameters = dict[str, list[float]]  # letter -> its numbers, separated by colons
Ends = dict[str, list[float | None]]  # letter -> least and greatest
TURNING = "ABCD"  # GCodes3.cpp, DoDriveMapping: axes with these letters are rotary unless R0 says otherwise
PROBES = {  # Endstops/EndstopDefs.h, ZProbeType
    1: "an analogue probe",
    5: "a switch as its probe",
    8: "a switch as its probe",
    9: "a BLTouch as its probe",
    10: "the stall of its Z motors as its probe",
    11: "a scanning probe",
}


@dataclass
class DuetBoard:
    """The values read so far.

    axes: by letter, E for the filament; jerks_mm_s: by letter; heaters_c: greatest temperature by heater; nozzle, bed: their
    heaters, bed below 0: none; turns: the axes of M584 -> whether they are rotary, None if not stated; kinematics: by its name in
    found.KINEMATICS; probe: its type.
    """

    firmware: str = "RepRapFirmware"
    name: str = ""
    axes: dict[str, AxisReadings] = field(default_factory=dict)
    jerks_mm_s: dict[str, float] = field(default_factory=dict)
    heaters_c: dict[int, float] = field(default_factory=dict)
    nozzle: int = 1
    bed: int = 0
    turns: dict[str, bool | None] | None = None
    kinematics: str = "cartesian"
    probe: int = 0
    remarks: list[str] = field(default_factory=list)

    def found(self, file: str, kinematics_source: str, jerk_source: str, heat_source: str) -> Found:
        """The values as found in a file. Raises ProfileError for unknown kinematics."""
        if not has_box(self.kinematics, f"{file}: {kinematics_source}"):
            self.remarks.append(f"its kinematics are {self.kinematics}: how far X, Y and Z reach stands in no axis of them")
            for letter in PRINTING:
                self.axes.get(letter, {}).pop(LIMITS, None)
        others = {letter: (self.turns or {}).get(letter) for letter in self.axes if letter not in (*PRINTING, "E")}
        rotary = "".join(letter for letter, turns in others.items() if turns or (turns is None and letter in TURNING))
        doubtful = {
            letter: f"{file}: nothing says whether {letter} turns, as R1 of M584 does"
            for letter, turns in others.items()
            if turns is None and letter not in TURNING
        }
        settings = self._settings(jerk_source, heat_source)
        probe = PROBES.get(self.probe, "")
        return Found(self.firmware, "reprapfirmware", self.axes, rotary, doubtful, settings, {}, self.name, probe, self.remarks)

    def _settings(self, jerk_source: str, heat_source: str) -> dict[str, Reading]:
        settings: dict[str, Reading] = {}
        level = [self.jerks_mm_s[letter] for letter in "XY" if letter in self.jerks_mm_s]
        if level:
            settings["junction_speed_mm_s"] = Reading(min(level), jerk_source)
        filament = self.axes.get("E", {})
        settings |= {key: filament[word] for key, word in EXTRUDER.items() if word in filament}
        for key, heater in (("nozzle_limit_c", self.nozzle), ("bed_limit_c", self.bed)):
            if heater in self.heaters_c:
                settings[key] = Reading(self.heaters_c[heater], heat_source)
        if self.bed < 0:
            settings["bed_limit_c"] = Reading(0.0, "it has no heated bed")
        return settings


def recognise(text: str) -> bool:
    """Whether a text is a config.g, or answers to M409."""
    return MODEL.search(text) is not None or (OWN.search(text) is not None and "echo:" not in text)


def read(config: ConfigText) -> Found:
    """The values in a config.g or in answers to M409. Raises ProfileError."""
    return _read_model(config) if MODEL.search(config.text) else _read_commands(config)


def _read_model(config: ConfigText) -> Found:
    model = _model(config)
    board = DuetBoard()
    for axis in _tables(model.get("move.axes")):
        letter = str(axis.get("letter") or "")
        source = f"move.axes, {letter}"
        board.axes[letter] = _drive(axis, f"{config.name}: axis {letter}", source)
        if (jerk := number(axis.get("jerk"))) is not None:
            board.jerks_mm_s[letter] = jerk / MINUTE_S
    for extruder in _tables(model.get("move.extruders"))[:1]:
        board.axes["E"] = _drive(extruder, "", "move.extruders")
    heat, tools = table(model.get("heat")), _tables(model.get("tools"))
    heaters = heat.get("heaters")
    limits_c = [number(table(heater).get("max")) for heater in (heaters if isinstance(heaters, list) else [])]  # some are null
    board.heaters_c = {index: limit for index, limit in enumerate(limits_c) if limit is not None}
    board.bed = _first(heat.get("bedHeaters"), -1)
    board.nozzle = _first(tools[0].get("heaters") if tools else None, board.nozzle)
    probes = _tables(model.get("sensors.probes"))
    board.probe = int(number(probes[0].get("type")) or 0) if probes else 0
    main, network = table(model.get("boards[0]")), table(model.get("network"))
    board.name = str(network.get("name") or "")
    kinematics = table(model.get("move.kinematics")).get("name") or board.kinematics
    board.kinematics = str(kinematics).lower().replace(" ", "")
    board.firmware = f"{main.get('firmwareName') or board.firmware} {main.get('firmwareVersion') or ''}".strip()
    return board.found(config.name, "move.kinematics", "move.axes, jerk", "heat.heaters, max")


def _model(config: ConfigText) -> dict[str, Any]:
    """Key -> its value; the pages of an array are joined."""
    model: dict[str, Any] = {}
    for line in config.text.split("\n"):
        if not MODEL.match(line):
            continue
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError):
            raise ProfileError(f"{config.name}: an answer to M409 is cut off or damaged") from None
        key, value = str(table(answer).get("key")), table(answer).get("result")
        paged = isinstance(model.get(key), list) and isinstance(value, list)
        model[key] = model[key] + value if paged else value
    return model


def _drive(drive: Table, name: str, source: str) -> AxisReadings:
    speed, acceleration, low, high = (number(drive.get(field)) for field in ("speed", "acceleration", "min", "max"))
    rates = reading(speed, source, 1.0 / MINUTE_S), reading(acceleration, source)
    return axis_readings(name, *rates, low, high, source)


def _tables(value: Any) -> list[Table]:
    return [entry for entry in value if isinstance(entry, Mapping)] if isinstance(value, list) else []


def _first(values: Any, otherwise: int) -> int:
    return values[0] if isinstance(values, list) and values and isinstance(values[0], int) else otherwise


def _read_commands(config: ConfigText) -> Found:
    """The values in a config.g. Raises ProfileError."""
    board, ends, missing, unread = DuetBoard(), Ends(), list[str](), 0
    for command, parameters, expressions in _commands(config, missing, [0]):
        unread += expressions
        _take(board, ends, command, parameters)
    for letter, (low, high) in ends.items():
        if letter != "S" and low is not None and high is not None:
            reach = axis_readings(f"{config.name}: axis {letter}", None, None, low, high, "M208")
            board.axes[letter] = board.axes.get(letter, {}) | reach
    if board.turns is not None:  # the firmware ignores settings of axes that M584 does not make
        made = [letter for letter in (*PRINTING, "E", *board.turns) if letter in board.axes or letter in board.turns]
        board.axes = {letter: board.axes.get(letter, {}) for letter in made}
        if silent := [letter for letter in board.turns if SPEED not in board.axes[letter]]:
            board.remarks.append(f"M584 makes {' and '.join(silent)}, whose speed no M203 gives")
    if name := NAME.search(config.text):
        board.name = name[1]
    if missing:
        board.remarks.append(f"{', '.join(missing)} is not beside it: its settings are unknown")
    if unread:
        board.remarks.append(f"only the board evaluates what it has in braces ({unread}): {option('port')} duet:HOST queries it")
    return board.found(config.name, "M669", "M566", "M143")


def _take(board: DuetBoard, ends: Ends, command: str, parameters: Parameters) -> None:
    """Apply one command."""
    first = {letter: numbers[0] for letter, numbers in parameters.items()}
    if command in RATES:
        key, unit_s, others = RATES[command]
        unit_s = 1.0 if "S" in others and first.get("S") == 1.0 else unit_s
        for letter, value in first.items():
            if letter not in others:
                board.axes.setdefault(letter, {})[key] = Reading(value / unit_s, command)
    elif command in JERKS:
        board.jerks_mm_s |= {letter: value / JERKS[command] for letter, value in first.items()}
    elif command in HEATERS and "H" in first and first.get("P", 0.0) == 0.0:
        setattr(board, HEATERS[command], int(first["H"]))
    else:
        _take_other(board, ends, command, parameters, first)


def _take_other(board: DuetBoard, ends: Ends, command: str, parameters: Parameters, first: Mapping[str, float]) -> None:
    """Apply a command that has a rule of its own."""
    match command:
        case "M208":
            for letter, numbers in parameters.items():
                both = ends.setdefault(letter, [None, None])
                if len(numbers) > 1:
                    both[:] = numbers[:2]
                else:
                    both[0 if first.get("S") == 1.0 else 1] = numbers[0]
        case "M584":
            turns = first["R"] > 0.0 if "R" in first else None
            made = {letter: turns for letter in first if letter not in (*PRINTING, *"ERSP")}
            board.turns = {**(board.turns or {}), **made}
        case "M665" if "L" in first:  # the length of a delta's rods
            board.kinematics = "delta"
        case "M669" if "K" in first:
            board.kinematics = KINEMATICS.get(int(first["K"]), f"K{first['K']:g}")
        case "M143" if "S" in first:
            board.heaters_c[int(first.get("H", 1.0))] = first["S"]
        case "M558":
            board.probe = int(first.get("P", 0.0))


def _commands(config: ConfigText, missing: list[str], count: list[int]) -> Iterator[tuple[str, Parameters, int]]:
    """Each command with the numbers of its letters, and its number of letters with an expression.

    Lines under a condition are skipped; a macro beside the file is read where it is called. missing: collects names of macros
    that do not exist; count: of files so far.
    """
    count[0] += 1
    if count[0] > MOST_INCLUDED:
        raise ProfileError(f"{config.name}: more than {MOST_INCLUDED} macros are called: does one call itself?")
    condition: int | None = None  # its indentation
    for line in config.text.split("\n"):
        indent = len(line) - len(line.lstrip())
        if condition is not None and (indent > condition or not line.strip()):
            continue
        first = line.split()[:1]
        condition = indent if first and first[0] in BLOCKS else None
        if macro := MACRO.match(line.strip()):
            name = macro[1].rpartition("/")[2]
            others = config.beside(name)
            missing.extend([] if others else [name])
            for other in others:
                yield from _commands(other, missing, count)
            continue
        plain = COMMENT.sub(lambda part: "" if part[0].startswith(";") else '""', line)
        if command := COMMAND.match(plain):
            found = PARAMETER.findall(command[2])
            parameters = {letter.upper(): [float(number) for number in numbers.split(":")] for letter, numbers in found}
            yield command[1], parameters, len(EXPRESSION.findall(command[2]))
