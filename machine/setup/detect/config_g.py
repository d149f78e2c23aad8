"""config.g: RepRapFirmware's settings as commands, with the macros it calls.

GCodes/GCodes2.cpp, GCodes3.cpp (DoDriveMapping) and Heating/Heat.cpp (fc1cd16c): M203 and M566 are in mm or deg per minute,
M203 S1 and M205 per second, M201 per second squared; M208 has both limits with a colon between, or one with S1 for the least and
S0 for the greatest; M584 makes axes, R1 and R2 rotary ones; M669 K or M665 sets the kinematics; M143 limits heater 1 where it
names none; M563 H names the heater of a tool, M140 H that of the bed, -1 none.
"""

import re
from collections.abc import Iterator

from machine.setup.detect.duet_board import MINUTE_S, DuetBoard
from machine.setup.detect.found import ACCELERATION, LIMITS, PRINTING, SPEED, ConfigText, Found, Reading, limits
from profiles.errors import ProfileError

COMMENT = re.compile(r'"[^"]*"|;.*')
COMMAND = re.compile(r"\s*([GM]\d+(?:\.\d+)?)\b(.*)")
NUMBERS = r"-?(?:\d+\.?\d*|\.\d+)"
PARAMETER = re.compile(rf"(?<!')([A-Za-z])\s*({NUMBERS}(?::{NUMBERS})*)")  # 'a is an axis beside A, which no profile has
EXPRESSION = re.compile(r"'?[A-Za-z]\s*\{")
BLOCKS = ("if", "elif", "else", "while")
MACRO = re.compile(r'M98\s+P\s*"([^"]+)"')
NAME = re.compile(r'^\s*M550\s+P\s*"([^"]+)"', re.MULTILINE)
MOST_INCLUDED = 100
KINEMATICS = dict(  # Movement/Kinematics/Kinematics.h, KinematicsType
    enumerate(("cartesian", "corexy", "corexz", "delta", "scara", "corexyu", "hangprinter", "polar", "corexyuv"))
) | {10: "rotarydelta", 11: "markforged"}

Parameters = dict[str, list[float]]  # letter -> its numbers, several with colons between
Ends = dict[str, list[float | None]]  # letter -> least and greatest


def read_commands(config: ConfigText) -> Found:
    """What a config.g says. Raises ProfileError."""
    board, ends, missing, unread = DuetBoard(), Ends(), list[str](), 0
    for command, parameters, expressions in _commands(config, missing, [0]):
        unread += expressions
        _take(board, ends, command, parameters)
    for letter, (low, high) in ends.items():
        if letter != "S" and low is not None and high is not None:
            board.axes.setdefault(letter, {})[LIMITS] = limits(f"{config.name}: axis {letter}", low, high, "M208")
    if board.turns is not None:  # the firmware ignores settings of axes that M584 does not make
        made = [letter for letter in (*PRINTING, "E", *board.turns) if letter in board.axes or letter in board.turns]
        board.axes = {letter: board.axes.get(letter, {}) for letter in made}
        if silent := [letter for letter in board.turns if SPEED not in board.axes[letter]]:
            board.remarks.append(f"M584 makes {' and '.join(silent)}, of which no M203 tells the speed")
    if name := NAME.search(config.text):
        board.name = name[1]
    if missing:
        board.remarks.append(f"{', '.join(missing)} is not beside it: what stands there is not known")
    if unread:
        board.remarks.append(f"what it has in braces ({unread}) only the board works out: --port duet:HOST asks it")
    return board.found(config.name, "M669", "M566", "M143")


def _take(board: DuetBoard, ends: Ends, command: str, parameters: Parameters) -> None:
    """Take in one command."""
    first = {letter: numbers[0] for letter, numbers in parameters.items()}
    match command:
        case "M201":
            for letter, value in first.items():
                board.axes.setdefault(letter, {})[ACCELERATION] = Reading(value, command)
        case "M203":
            unit_s = 1.0 if first.get("S") == 1.0 else MINUTE_S
            for letter, value in first.items():
                if letter not in "SI":  # I: the least speed
                    board.axes.setdefault(letter, {})[SPEED] = Reading(value / unit_s, command)
        case "M205" | "M566":
            unit_s = 1.0 if command == "M205" else MINUTE_S
            board.jerks_mm_s |= {letter: value / unit_s for letter, value in first.items()}
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
        case "M140" if "H" in first and first.get("P", 0.0) == 0.0:
            board.bed = int(first["H"])
        case "M143" if "S" in first:
            board.heaters_c[int(first.get("H", 1.0))] = first["S"]
        case "M563" if "H" in first and first.get("P", 0.0) == 0.0:  # of the first tool
            board.nozzle = int(first["H"])
        case "M558":
            board.probe = int(first.get("P", 0.0))


def _commands(config: ConfigText, missing: list[str], count: list[int]) -> Iterator[tuple[str, Parameters, int]]:
    """Every command with the numbers of its letters, and how many letters have an expression.

    Lines under a condition are skipped; a macro that lies beside the file is read where it is called. missing: takes up the names
    of macros that do not; count: of files so far.
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
