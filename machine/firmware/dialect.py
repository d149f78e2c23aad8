"""Dialect: what is written for a firmware, what its words mean when they are read, and what each of its commands does.

The rows that all firmwares share are machine.gcode.commands.COMMANDS; what a firmware adds, or has otherwise, stands with it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
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
# What G90 and G91 mean for the filament: they set its mode too; nothing; G91 makes it relative while it lasts.
FilamentMode = Literal["set", "apart", "carried"]


@dataclass(frozen=True)
class Command:
    """One row of the table of commands; what is left out is False, "" or 0."""

    does: str  # in words
    moves: Moves = ""
    homes: bool = False  # seeks the end stops of axes; like a probing it may not be stopped half way
    probes: bool = False  # seeks contact
    heats: Heats = ""  # the heater that it sets a target for
    heats_with: str = ""  # it does so only with one of these words; "": always
    waits: Waits = ""  # what its ok waits for
    answer_s: float = 0.0  # how long that may take; 0: it is answered at once
    motors: bool = False  # switches motors on or off
    changes: bool = False  # makes the rest of a program mean something else
    modal: bool = False  # the firmware remembers it, so a pause and a resume say it again
    repeatable: bool = False  # done twice in a row it leaves what it leaves when done once
    shows: bool = False  # displays or names something, and a print is none the worse without it
    tunes: bool = False  # a print goes on without it, too, but with a warning
    refused: str = ""  # why no program may hold it: the sender alone may give it, or nobody

    @property
    def must_end(self) -> bool:
        """Whether it is waited for when a print is ended: homing and probing must not be stopped, a dwell cannot be."""
        return self.homes or self.probes or self.waits == "time"


@dataclass(frozen=True)
class Dialect:
    """Words and rules of a firmware; an empty word means that the firmware has none and nothing is written.

    {} takes the value, {name} a placeholder of the profile's blocks. A block is a tuple of lines.
    """

    firmware: str  # what people call it
    longest_line: int  # characters the firmware keeps, line number and checksum included
    nozzle: str  # {} deg C, without waiting
    nozzle_wait: str  # {} deg C, waiting
    fan_on: str  # {} 0 to fan_full
    fan_off: str = "M107"
    fan_full: int = 255
    travel: str = "G0"
    filament: str = "E"  # the first of these letters that no rotary axis has
    filament_relative: bool = True
    modes: tuple[str, ...] = ("G21", "G90", "M83")  # said again after the start block, whatever that has left
    progress: str = ""  # {} percent, {} minutes left
    acceleration: str = ""  # {} of strokes, {} of travels, mm/s2
    pressure_advance: str = ""  # {} of the extruder, s
    babystep: str = ""  # {} mm up in machine Z during a print, coordinates as before: along the tool, whatever the table's pose
    pause: str = "M0"  # waits for a person
    filament_change: str = "M0"  # the same, with what the firmware does for another filament
    layer: str = ""  # {} layer of all layers, from 1
    before_start: tuple[str, ...] = ()
    after_start: tuple[str, ...] = ()
    before_end: tuple[str, ...] = ()
    last: str = ""
    parts: str = ""  # {parts}: how many parts come
    part: str = ""  # {index} from 0, {number} from 1: said before the first stroke for every part
    part_begin: str = ""
    part_end: str = ""
    steppers: bool = False  # rotary axes are turned by MANUAL_STEPPER, not by words of G1
    follow_on: str = ""  # X Y Z mean places on the table from here on (TCP)
    follow_off: str = ""
    follow_from_turn_axis: bool = False  # those places count from where the turn axis meets the table, else from machine zero
    follow_persists: bool = False  # it may still follow the table from an earlier program: follow_off is written first
    follow_keeps_coordinates: bool = False  # switching moves nothing and takes the present X Y Z for the other meaning
    inverse_time: bool = False  # knows G93
    largest_delta: bool = False  # F of a pure turn is the speed of the axis that goes farthest, else along sqrt(tilt^2 + turn^2)
    rapid: bool = False  # G0 goes as fast as the axes can, whatever F says
    filament_mode: FilamentMode = "apart"
    bare_g92: bool = False  # a G92 without words calls every axis 0, else it does nothing
    macros: bool = False  # knows lines of NAME KEY=VALUE
    statements: frozenset[str] = frozenset()  # words in capitals that begin lines which are no commands
    bare_words: bool = True  # takes words without a number, G28 X Y, and an E that no command uses
    lacks: frozenset[str] = frozenset()  # codes of other firmwares' start blocks at which it ends the program
    value_word: str = "S"  # of temperatures and fans
    stands: tuple[str, ...] = ()  # after a restart: the axes stand at {x_mm} {y_mm} {z_mm} {tilt_deg} {turn_deg}
    serial: bool = True  # takes numbered lines with checksums over a serial line and answers ok
    homed_before: bool = False  # runs no program before its axes are homed by hand; G28 means another thing there
    endstop_word: str = ""  # of G1: with 1, 3 or 4 the move ends at an end stop
    wait_for_person: tuple[str, ...] = ("M0 {text}",)  # says {text} and waits; where it can, the tip may be jogged meanwhile
    commands: Mapping[str, Command] = field(default_factory=dict)  # its rows beside those of machine.gcode.commands
