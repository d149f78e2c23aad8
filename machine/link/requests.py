"""Requests: what becomes of a person's wish while a print runs: a command, a change of state, or a sentence why not."""

import re

from machine.link.framing import REFUSED, command_of, name_of
from machine.link.modal import WORD, Axes
from profiles.errors import LocalProtocolError

# Marlin takes 10 to 999 per cent. Beyond 300 the planner starves, beyond 200 the extruder slips.
FEED_PERCENT, FLOW_PERCENT = (10.0, 300.0), (10.0, 200.0)
# Commands that would make the rest of the program mean something else.
CHANGES = {
    "G20", "G21", "G90", "G91", "G92", "G93", "G94", "M82", "M83", "G43.4", "G49", "G53", "G54", "M428", "M429", "M850", "M851",
    "M206", "M500", "M501", "M502", "T0", "T1",
}  # fmt: skip
MOTORS = {"M17", "M18", "M84", "M85"}
MOVES = {"G0", "G1", "G2", "G3", "G5", "G10", "G11", "G12", "G27", "G29", "G30", "G60", "G61", "M600", "M701", "M702"}


def words(command: str) -> list[tuple[str, float]]:
    """Letters and numbers of a command."""
    return [(letter, float(value)) for letter, value in WORD.findall(command)]


def percent(value: float, bounds: tuple[float, float]) -> str | None:
    """Why a per cent value cannot be had, None when it can."""
    low, high = bounds
    return None if low <= value <= high else f"{value:g} % is not possible: {low:g} to {high:g} % are allowed"


def refusal(text: str, axes: Axes, paused: bool, limit: int) -> str | None:
    """Why a person's command may not be sent now, None when it may.

    During a pause filament may be pushed and pulled, so that it can be changed; nothing else moves under the sender's hands.
    """
    try:
        command = command_of(text, 0, limit)
    except LocalProtocolError as error:
        return str(error).replace("line 0", "the command")
    if not command:
        return "there is no command in it"
    name = name_of(command.upper())
    if name in REFUSED:
        return f"{name} {REFUSED[name]}"
    if name in ("G28", "G34", "MANUAL_STEPPER") or name.startswith("HOME"):
        return f"{name} homes or turns an axis: the tip may stand inside the print"
    if name in MOTORS:
        return f"{name} lets the motors go: the print would lose its place"
    if name in CHANGES or re.fullmatch(r"T\d+", name):
        return f"{name} changes what the rest of the program means"
    if name in MOVES and not (paused and _filament_only(command, axes)):
        return f"{name} moves the machine: during a pause filament alone may move, else nothing"
    return None


def _filament_only(command: str, axes: Axes) -> bool:
    """Whether a move has no word of an axis."""
    words = set(re.findall(r"[A-Z]", command.upper()[2:]))
    return name_of(command.upper()) in ("G0", "G1") and "E" in words and words <= {"E", "F"}
