"""Command: what one command of a firmware does, as everything that reads, sends or simulates G-code needs to know it.

The rows that all firmwares share are machine.gcode.commands.COMMANDS; what a firmware adds, or has otherwise, stands with it.
"""

from dataclasses import dataclass
from typing import Literal

# The most that a healthy printer needs for its ok, s: beyond it the printer is asked again, and given up after some questions.
HEATING_S = 3600.0  # a big bed in a cold room takes half an hour
PROBING_S = 1800.0  # a mesh of 15 x 15 points
HOMING_S = 600.0  # five axes at the speed of the slowest
PERSON_S = 86400.0  # a person changes the filament
EEPROM_S = 10.0  # while an AVR writes its EEPROM the receive interrupt is off: bytes are lost

# path: X Y Z, rotary axes and filament to a place; filament: that alone; table: a rotary axis alone; other: a cycle of its own
Moves = Literal["", "path", "filament", "table", "other"]
# named: the one that its HEATER names; any: whatever it likes, for it runs a macro, a file or a cycle of its own
Heats = Literal["", "nozzle", "bed", "chamber", "named", "any"]
Waits = Literal["", "heat", "moves", "time", "person"]


@dataclass(frozen=True)
class Command:
    """One row of the table; what is left out is False, "" or 0.

    does: in words.
    moves: what it moves. homes: it seeks the end stops of axes. probes: it seeks contact. Neither may be stopped half way.
    heats: which heater it sets a target for. heats_with: it does so only with one of these words; "": always.
    waits: what its ok waits for. answer_s: how long that may take; 0: it is answered at once.
    motors: it switches motors on or off. changes: it makes the rest of a program mean something else.
    modal: the firmware remembers it, so a pause and a resume say it again. repeatable: done twice in a row it leaves what it
    leaves when done once. shows: it displays or names something, and a print is none the worse without it. tunes: a print goes
    on without it, too, but the person is told.
    refused: why no program may hold it: the sender alone may give it, or nobody.
    """

    does: str
    moves: Moves = ""
    homes: bool = False
    probes: bool = False
    heats: Heats = ""
    heats_with: str = ""
    waits: Waits = ""
    answer_s: float = 0.0
    motors: bool = False
    changes: bool = False
    modal: bool = False
    repeatable: bool = False
    shows: bool = False
    tunes: bool = False
    refused: str = ""
