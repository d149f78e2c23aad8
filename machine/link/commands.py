"""The commands that a simulated printer of each firmware family knows."""

from functools import cache

from machine.link.body import Command
from machine.link.habits import manner_of
from machine.link.heating import HEATING
from machine.link.moving import MOVING
from machine.link.telling import TELLING

COMMANDS: dict[str, Command] = {**MOVING, **HEATING, **TELLING}
TEXTS = ("M117", "M118")  # what follows them are no words


@cache
def commands_of(dialect: str) -> dict[str, Command]:
    """What the firmware of a dialect knows."""
    lacks = manner_of(dialect).lacks
    return {name: command for name, command in COMMANDS.items() if name not in lacks}
