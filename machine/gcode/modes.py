"""Modes: the state set by G20, G21, G90 to G94, M82, M83 and F, the effect of moves on it; and the whole modal state of a
firmware, so that a print can resume unchanged.

The dry run's reader, the host's state and the simulated printer each keep a `Modes`. A position is a list X Y Z tilt turn E as
its owner counts them; the program's coordinates are position + offset.

Marlin: gcode.h, axis_is_relative: G90 and G91 apply to E too, M82 and M83 to E alone. RepRapFirmware: GCodes2.cpp: G90 and G91
leave drivesRelative alone. Klipper: gcode_move.py: E is relative under G91 or M83, and a G92 without words sets all axes to 0.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, NamedTuple

from machine.firmware import Dialect, dialect_of, dialects
from machine.firmware.klipper import stepper_name
from machine.gcode.commands import EVERY, PATHS, command_named
from machine.gcode.words import Word, read_letters, read_number, read_values, read_words, split_command
from profiles.errors import GcodeError
from profiles.machine import Machine

INCH_MM = 25.4
E_AXIS = 5
LINEAR = (0, 1, 2, E_AXIS)  # their words are in inches after G20, degrees never are
MODES = ("G20", "G21", "G90", "G91", "G93", "G94", "M82", "M83")
Coordinates = tuple[float | None, ...]  # X Y Z tilt turn E


class Axes(NamedTuple):
    """The letters of a machine's axes, and the dialect that determines their modes."""

    letters: tuple[str, ...] = ("X", "Y", "Z", "A", "C", "E")  # in the order of a position
    words: Mapping[str, int] = {"X": 0, "Y": 1, "Z": 2, "A": 3, "C": 4, "E": E_AXIS}  # those that a move may have
    dialect: Dialect = dialects()["marlin"]
    steppers: tuple[str, str] = ("", "")  # Klipper's names of the tilt and turn steppers, in capitals

    def __deepcopy__(self, memo: object) -> "Axes":
        return self


def axes_of(machine: Machine | None) -> Axes:
    """The axes of a machine, by default Marlin's with A and C."""
    if machine is None:
        return Axes()
    dialect = dialect_of(machine)
    rotary = {machine.tilt.letter: 3, machine.turn.letter: 4} if machine.tilts and not dialect.steppers else {}
    filament = next(letter for letter in dialect.filament if letter not in rotary)
    letters = ("X", "Y", "Z", machine.tilt.letter, machine.turn.letter, "E")
    steppers = (stepper_name(machine.tilt).upper(), stepper_name(machine.turn).upper())
    return Axes(letters, {"X": 0, "Y": 1, "Z": 2, **rotary, filament: E_AXIS}, dialect, steppers)


@dataclass(slots=True)
class Modes:
    """Modal settings of moves. feed: mm/min (deg/min), or after G93 one over minutes; 0: none yet. strict: move() refuses invalid
    words."""

    axes: Axes
    feed: float = 0.0
    strict: bool = False
    inches: bool = False
    relative: bool = False
    filament_relative: bool = False  # set by M82 and M83, and by G90 and G91 in some firmwares
    inverse_time: bool = False
    offset: list[float] = field(default_factory=lambda: [0.0] * 6)  # offset set by G92: program's coordinate minus position
    units: list[float] = field(default_factory=lambda: [1.0] * 6)  # mm or deg of one unit of a word
    steps: list[bool] = field(default_factory=lambda: [False] * 6)  # whether a word is relative

    def set(self, name: str) -> None:
        """Apply one of MODES."""
        if name in ("G20", "G21"):
            self.inches = name == "G20"
            for axis in LINEAR:
                self.units[axis] = INCH_MM if self.inches else 1.0
            return
        if name in ("G93", "G94"):
            self.inverse_time = name == "G93"
            return
        if name in ("G90", "G91"):
            self.relative = name == "G91"
            if self.axes.dialect.filament_mode == "set":
                self.filament_relative = self.relative
        else:
            self.filament_relative = name == "M83"
        follows = self.relative and self.axes.dialect.filament_mode == "carried"
        self.steps[:] = [*[self.relative] * E_AXIS, self.filament_relative or follows]

    @property
    def unit_mm(self) -> float:
        """mm per unit of length."""
        return self.units[0]

    def move(self, coordinates: list[Any], words: Iterable[Word]) -> bool:
        """Apply the words of a move to `coordinates` and the feed; True when an axis is named.

        None is an unknown coordinate, which a relative move leaves unknown. If strict, raises GcodeError for an F not above 0 and
        for a word that is not an axis; otherwise these change nothing.
        """
        axes, units, steps, offset = self.axes.words, self.units, self.steps, self.offset
        moved = False
        for letter, value in words:
            axis = axes.get(letter)
            if axis is None:
                if letter == "F" and value > 0:
                    self.feed = value if self.inverse_time else value * units[0]
                elif self.strict and letter == "F":
                    raise GcodeError(f"F is {value:g}: a feed must be above 0")
                elif self.strict:
                    known = " ".join(axes)
                    raise GcodeError(f"word {letter}{value:g} of a move is not known: this machine has {known} F")
                continue
            moved = True
            value *= units[axis]
            if not steps[axis]:
                coordinates[axis] = value - offset[axis]
            elif coordinates[axis] is not None:
                coordinates[axis] += value
        return moved

    def named(self, words: Iterable[Word]) -> list[tuple[int, float]]:
        """The axes and coordinates, mm or deg, of a G92."""
        axes = self.axes.words
        coordinates = [(axes[letter], value * self.units[axes[letter]]) for letter, value in words if letter in axes]
        return coordinates or [(axis, 0.0) for axis in axes.values() if self.axes.dialect.bare_g92]


@dataclass
class ModalState:
    """The state of a firmware: take() every command in order; lines() are the commands that restore it. at: the program's
    positions (as M114 reports them), rotary axes unwrapped; None if the sender cannot know them."""

    axes: Axes
    at: list[float | None] = field(default_factory=lambda: [None] * 6)
    nozzle_c: float = 0.0
    bed_c: float = 0.0
    fans: dict[str, str] = field(default_factory=dict)
    settings: dict[str, str] = field(default_factory=dict)
    pulled_mm: float = 0.0  # retracted filament
    pushed_mm: float = 0.0  # by the last command; inf: an unknown amount
    modes: Modes = field(init=False)

    def __post_init__(self) -> None:
        self.modes = Modes(self.axes)

    def coordinates(self) -> Coordinates:
        """The positions of the axes."""
        return tuple(self.at)

    @property
    def follows(self) -> bool:
        """Whether X Y Z are positions relative to the table now (TCP)."""
        return self.settings.get("follow") == self.axes.dialect.follow_on != ""

    def take(self, command: str) -> bool:
        """Apply a command; True when it moves an axis or filament."""
        text, axes = command.upper(), self.axes
        self.pushed_mm = 0.0
        if text[:3] == "G1 ":  # nearly every line
            return self._move(text[2:])
        name, rest = split_command(text)
        if name in PATHS:
            return self._move(rest)
        if name == "G28" or name.startswith("HOME_"):
            named = set(name[5:] if name != "G28" else read_letters(rest)) & set(axes.letters[:E_AXIS])
            for letter in named or (axes.letters[:E_AXIS] if name == "G28" else ()):
                self.at[axes.letters.index(letter)] = None
            return True
        if name == "MANUAL_STEPPER":
            return self._turn(read_values(rest))
        words, heats = read_words(rest), EVERY[name].heats if name in EVERY else ""
        if name in MODES:
            self.modes.set(name)
        elif name == "G92":
            for axis, coordinate in self.modes.named(words):
                self.at[axis] = coordinate
        elif heats in ("nozzle", "bed"):
            values = dict(words)
            self._heat(heats, values.get("S", values.get("R")))
        elif name == "SET_HEATER_TEMPERATURE":
            heater, target = (read_values(rest).get(key, "") for key in ("HEATER", "TARGET"))
            self._heat({"EXTRUDER": "nozzle", "HEATER_BED": "bed"}.get(heater, ""), read_number(target) or 0.0)
        elif name == "TURN_OFF_HEATERS":
            self.nozzle_c = self.bed_c = 0.0
        elif name in ("M106", "M107"):
            self.fans[f"{dict(words).get('P', 0.0):g}"] = f"{name} {rest.strip()}".strip()
        elif name and name in (axes.dialect.follow_on, axes.dialect.follow_off):
            self.settings["follow"] = name
            return True
        elif command_named(name).modal:
            self.settings[name + "".join(sorted(letter for letter, _ in words))] = command
        return False

    def lines(self) -> list[str]:
        """Commands that bring a firmware to this state, without positions except the filament's."""
        modes = self.modes
        lines = ["G20" if modes.inches else "G21", "G91" if modes.relative else "G90"]
        lines.append("M83" if modes.filament_relative else "M82")
        filament_mm = self.at[E_AXIS]
        if filament_mm is not None:
            lines.append(f"G92 E{filament_mm / modes.unit_mm:.5f}")
        if modes.feed > 0:
            lines.append(f"G1 F{modes.feed / modes.unit_mm:g}")
        return [*lines, *self.settings.values(), *self.fans.values()]

    def names_filament(self, command: str) -> bool:
        """Whether a command is a move with a filament word."""
        name, rest = split_command(command.upper())
        return name in PATHS and any(self.axes.words.get(letter) == E_AXIS for letter, _ in read_words(rest))

    def _move(self, rest: str) -> bool:
        at, words = self.at, read_words(rest)
        before = at[E_AXIS]
        moved = self.modes.move(at, words)
        after = at[E_AXIS]
        self.pushed_mm = after - before if before is not None and after is not None else self._unsummed(words)
        if self.pulled_mm or self.pushed_mm < 0.0:
            self.pulled_mm = max(0.0, round(self.pulled_mm - self.pushed_mm, 9))  # rounding errors of sums count as zero
        return moved

    def _unsummed(self, words: list[Word]) -> float:
        """Filament that a move pushes when its starting value is unknown."""
        pushed = [value * self.modes.unit_mm for letter, value in words if self.axes.words.get(letter) == E_AXIS]
        return sum(pushed) if self.modes.steps[E_AXIS] or not pushed else inf

    def _turn(self, values: Mapping[str, str]) -> bool:
        """Apply a MANUAL_STEPPER."""
        if values.get("STEPPER") not in self.axes.steppers:
            return False
        axis = 3 + self.axes.steppers.index(values["STEPPER"])
        for key in ("SET_POSITION", "MOVE"):
            angle = read_number(values.get(key, ""))
            if angle is not None:
                self.at[axis] = angle
        if values.get("STOP_ON_ENDSTOP", "0") != "0":
            self.at[axis] = None
        return "MOVE" in values

    def _heat(self, heater: str, target_c: float | None) -> None:
        if heater == "nozzle" and target_c is not None:
            self.nozzle_c = target_c
        elif heater == "bed" and target_c is not None:
            self.bed_c = target_c
