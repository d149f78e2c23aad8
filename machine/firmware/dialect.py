"""Dialect: words written for a firmware, their meaning when read, and the effect of its commands.

Rows shared by all firmwares are in machine.gcode.commands.COMMANDS; those that a firmware adds or changes are in its module.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

# Longest time to the ok of a healthy printer, s: beyond it the printer is queried, and given up after some queries.
HEATING_S = 3600.0  # a big bed in a cold room takes half an hour
PROBING_S = 1800.0  # a mesh of 15 x 15 points
HOMING_S = 600.0  # five axes at the speed of the slowest
PERSON_S = 86400.0  # the user changes the filament
EEPROM_S = 10.0  # while an AVR writes its EEPROM the receive interrupt is off and bytes are lost

# path: X Y Z, rotary axes and filament to a position; filament: only that; table: a rotary axis only; other: its own cycle
Moves = Literal["", "path", "filament", "table", "other"]
# named: the heater in its HEATER word; any: unknown: it runs a macro, a file or a cycle of its own
Heats = Literal["", "nozzle", "bed", "chamber", "named", "any"]
Waits = Literal["", "heat", "moves", "time", "person"]
# Effect of G90 and G91 on the filament: set: they set its mode too; apart: none; carried: G91 makes it relative meanwhile.
FilamentMode = Literal["set", "apart", "carried"]


@dataclass(frozen=True)
class Command:
    """A row of the table of commands; defaults are False, "" or 0."""

    does: str  # in words
    moves: Moves = ""
    homes: bool = False  # seeks the end stops of axes; like a probing it must not be interrupted
    probes: bool = False  # seeks contact
    heats: Heats = ""  # the heater whose target it sets
    heats_with: str = ""  # only with one of these words; "": always
    waits: Waits = ""  # what its ok waits for
    answer_s: float = 0.0  # the longest that takes; 0: answered at once
    motors: bool = False  # switches motors on or off
    changes: bool = False  # changes the meaning of the rest of a program
    modal: bool = False  # remembered by the firmware, so that pause and resume repeat it
    repeatable: bool = False  # executed twice it has the same effect as once
    shows: bool = False  # displays or names something that a print can do without
    tunes: bool = False  # a print continues without it, too, but with a warning
    refused: str = ""  # why no program may contain it

    @property
    def must_end(self) -> bool:
        """Whether the end of a print must wait for it: homing and probing must not be stopped, a dwell cannot be."""
        return self.homes or self.probes or self.waits == "time"


@dataclass(frozen=True)
class Dialect:
    """Words and rules of a firmware; an empty word means that the firmware has none and nothing is written.

    {} is replaced by the value, {name} by a placeholder of the profile's blocks. A block is a tuple of lines.
    """

    firmware: str  # its usual name
    longest_line: int  # characters that the firmware keeps, line number and checksum included
    nozzle: str  # {} deg C, without waiting
    nozzle_wait: str  # {} deg C, waiting
    fan_on: str  # {} 0 to fan_full
    fan_off: str = "M107"
    fan_full: int = 255
    travel: str = "G0"
    filament: str = "E"  # the first of these letters that is not a rotary axis
    filament_relative: bool = True
    modes: tuple[str, ...] = ("G21", "G90", "M83")  # repeated after the start block, which may have changed them
    progress: str = ""  # {} percent, {} minutes left
    acceleration: str = ""  # {} of strokes, {} of travels, mm/s2
    pressure_advance: str = ""  # {} of the extruder, s
    babystep: str = ""  # {} mm up in machine Z during a print, coordinates as before: along the tool, whatever the table's pose
    babystep_homed: bool = False  # only after Z was homed; ignored before
    pause: str = "M0"  # waits for the user
    filament_change: str = "M0"  # as pause, with the firmware's actions for a filament change
    layer: str = ""  # {} layer of all layers, from 1
    before_start: tuple[str, ...] = ()
    after_start: tuple[str, ...] = ()
    before_end: tuple[str, ...] = ()
    last: str = ""
    parts: str = ""  # {parts}: number of parts
    part: str = ""  # {index} from 0, {number} from 1: written before the first stroke for every part
    part_begin: str = ""
    part_end: str = ""
    steppers: bool = False  # rotary axes move by MANUAL_STEPPER, not by words of G1
    follow_on: str = ""  # later X Y Z are positions relative to the table (TCP)
    follow_off: str = ""
    follow_from_turn_axis: bool = False  # these positions are relative to the turn axis on the table, else to machine zero
    follow_persists: bool = False  # following may persist from an earlier program: follow_off is written first
    follow_keeps_coordinates: bool = False  # switching moves nothing and reinterprets the present X Y Z
    inverse_time: bool = False  # supports G93
    largest_delta: bool = False  # F of a pure turn is the speed of the axis that moves farthest, else along sqrt(tilt^2 + turn^2)
    rapid: bool = False  # G0 moves as fast as the axes can, whatever F says
    filament_mode: FilamentMode = "apart"
    bare_g92: bool = False  # a G92 without words sets every axis to 0, else it has no effect
    macros: bool = False  # accepts lines of NAME KEY=VALUE
    statements: frozenset[str] = frozenset()  # words in capitals that begin lines other than commands
    bare_words: bool = True  # accepts words without a number, G28 X Y, and an E that no command uses
    lacks: frozenset[str] = frozenset()  # codes in other firmwares' start blocks at which it ends the program
    value_word: str = "S"  # letter of the value in commands for temperatures and fans
    stands: tuple[str, ...] = ()  # after a restart: sets the axes to {x_mm} {y_mm} {z_mm} {tilt_deg} {turn_deg}
    serial: bool = True  # accepts numbered lines with checksums over a serial line and answers ok
    homed_before: bool = False  # runs no program before its axes are homed by hand; G28 has another meaning
    endstop_word: str = ""  # letter in G1: with 1, 3 or 4 the move ends at an end stop
    # displays {text} and waits; the user may jog the tip meanwhile if the firmware can
    wait_for_person: tuple[str, ...] = ("M0 {text}",)
    commands: Mapping[str, Command] = field(default_factory=dict)  # its rows besides those of machine.gcode.commands
