"""config.g: RepRapFirmware's settings as commands, with the macros it calls.

GCodes/GCodes2.cpp, GCodes3.cpp (DoDriveMapping) and Heating/Heat.cpp (fc1cd16c): M203 and M566 count in mm or deg a minute,
M203 S1 and M205 a second, M201 a second squared; M208 has both limits with a colon between, or one with S1 for the least and S0
for the greatest; M584 makes letters, R1 and R2 such as turn; M143 limits heater 1 where it names none; M563 H says which heater a
tool has, M140 H which the bed, -1 none.
"""

import re
from collections.abc import Callable, Iterator

from machine.detect.duet_board import MINUTE_S, TURNING, DuetBoard
from machine.detect.found import ACCELERATION, LIMITS, PRINTING, SPEED, ConfigText, Found, Reading, limits, rounded
from profiles.errors import ProfileError

COMMENT = re.compile(r'"[^"]*"|;.*')
COMMAND = re.compile(r"\s*([GM]\d+(?:\.\d+)?)\b(.*)")
NUMBERS = r"-?(?:\d+\.?\d*|\.\d+)"
PARAMETER = re.compile(rf"'?([A-Za-z])\s*({NUMBERS}(?::{NUMBERS})*)")
EXPRESSION = re.compile(r"'?[A-Za-z]\s*\{")
BLOCKS = ("if", "elif", "else", "while")
MACRO = re.compile(r'M98\s+P\s*"([^"]+)"')
NAME = re.compile(r'^\s*M550\s+P\s*"([^"]+)"', re.MULTILINE)
MOST_INCLUDED = 100

Parameters = dict[str, list[float]]  # letter -> its numbers, several with colons between


def read_commands(config: ConfigText) -> Found:
    """What a config.g tells. Raises ProfileError."""
    board, ends, unread = DuetBoard(), dict[str, list[float | None]](), 0
    for command, parameters, expressions in _commands(config, [0]):
        unread += expressions
        if command == "M208":
            _take_ends(ends, parameters)
        elif take := TAKEN.get(command):
            take(board, parameters)
    for letter, (low, high) in ends.items():
        if low is not None and high is not None:
            board.axes.setdefault(letter, {})[LIMITS] = limits(f"{config.name}: axis {letter}", low, high, "M208")
    _keep_made(board)
    name = NAME.search(config.text)
    board.name = name[1] if name else ""
    if unread:
        board.remarks.append(f"what it has in braces ({unread}) only the board works out: --port duet:HOST asks it")
    return board.found("M566", "M143")


def _keep_made(board: DuetBoard) -> None:
    """Only axes that M584 makes, where it is there: the firmware passes over what is said of other letters."""
    if not board.turns:
        return
    made = (*PRINTING, "E", *board.turns)
    board.axes = {letter: board.axes.get(letter, {}) for letter in made if letter in board.axes or letter in board.turns}
    silent = [letter for letter in board.turns if SPEED not in board.axes[letter]]
    if silent:
        board.remarks.append(f"M584 makes {' and '.join(silent)}, of which no M203 tells the speed")


def _speeds(board: DuetBoard, parameters: Parameters) -> None:
    """M203."""
    unit_s = 1.0 if parameters.get("S") == [1.0] else MINUTE_S
    for letter, numbers in parameters.items():
        if letter not in "SI":  # the least speed
            board.axes.setdefault(letter, {})[SPEED] = Reading(rounded(numbers[0] / unit_s), "M203")


def _accelerations(board: DuetBoard, parameters: Parameters) -> None:
    """M201."""
    for letter, numbers in parameters.items():
        board.axes.setdefault(letter, {})[ACCELERATION] = Reading(rounded(numbers[0]), "M201")


def _jerks(board: DuetBoard, parameters: Parameters, unit_s: float) -> None:
    """M566, M205."""
    board.jerks_mm_s |= {letter: numbers[0] / unit_s for letter, numbers in parameters.items()}


def _letters(board: DuetBoard, parameters: Parameters) -> None:
    """M584."""
    wraps = parameters.get("R", [-1.0])[0]  # 0: linear
    for letter in parameters:
        if letter not in (*PRINTING, *"ERSP"):
            board.turns[letter] = letter in TURNING if wraps < 0.0 else wraps > 0.0


def _heat_limit(board: DuetBoard, parameters: Parameters) -> None:
    """M143."""
    if "S" in parameters:
        board.heaters_c[int(parameters.get("H", [1.0])[0])] = parameters["S"][0]


def _tool(board: DuetBoard, parameters: Parameters) -> None:
    """M563: of the first tool."""
    if "H" in parameters and parameters.get("P", [0.0])[0] == 0.0:
        board.nozzle = int(parameters["H"][0])


def _bed(board: DuetBoard, parameters: Parameters) -> None:
    """M140."""
    if "H" in parameters and parameters.get("P", [0.0])[0] == 0.0:
        board.bed = int(parameters["H"][0])


def _probe(board: DuetBoard, parameters: Parameters) -> None:
    """M558."""
    board.probe = int(parameters.get("P", [0.0])[0])


TAKEN: dict[str, Callable[[DuetBoard, Parameters], None]] = {
    "M140": _bed,
    "M143": _heat_limit,
    "M201": _accelerations,
    "M203": _speeds,
    "M205": lambda board, parameters: _jerks(board, parameters, 1.0),
    "M558": _probe,
    "M563": _tool,
    "M566": lambda board, parameters: _jerks(board, parameters, MINUTE_S),
    "M584": _letters,
}


def _take_ends(ends: dict[str, list[float | None]], parameters: Parameters) -> None:
    """M208."""
    least = parameters.get("S") == [1.0]
    for letter, numbers in parameters.items():
        if letter != "S":
            both = ends.setdefault(letter, [None, None])
            both[:] = numbers[:2] if len(numbers) > 1 else (numbers[0], both[1]) if least else (both[0], numbers[0])


def _commands(config: ConfigText, count: list[int]) -> Iterator[tuple[str, Parameters, int]]:
    """Every command with the numbers of its letters, and how many letters have an expression; what stands under a condition is
    passed over, a macro beside the file is read where it is called. count: of files so far."""
    count[0] += 1
    if count[0] > MOST_INCLUDED:
        raise ProfileError(f"{config.name}: more than {MOST_INCLUDED} macros are called: does one call itself?")
    condition: int | None = None  # how far that line stands in
    for line in config.text.splitlines():
        indent = len(line) - len(line.lstrip())
        if condition is not None and (indent > condition or not line.strip()):
            continue
        first = line.split()[:1]
        condition = indent if first and first[0] in BLOCKS else None
        if macro := MACRO.match(line.strip()):
            yield from _macro(config, macro[1], count)
            continue
        plain = COMMENT.sub(lambda part: "" if part[0].startswith(";") else '""', line)
        if command := COMMAND.match(plain):
            found = PARAMETER.findall(command[2])
            parameters = {letter.upper(): [float(number) for number in numbers.split(":")] for letter, numbers in found}
            yield command[1], parameters, len(EXPRESSION.findall(command[2]))


def _macro(config: ConfigText, path: str, count: list[int]) -> Iterator[tuple[str, Parameters, int]]:
    """Of a macro; one that does not lie beside the file is passed over."""
    for other in config.beside(path.rpartition("/")[2]):
        yield from _commands(other, count)
