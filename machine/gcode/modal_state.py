"""ModalState: what a firmware remembers of the commands it was given, so that a print can go on as if nothing had happened.

Positions are those of the program (what M114 tells), rotary axes unwrapped; None where the sender cannot know them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

from machine.gcode.commands import EVERY, PATHS, command_named
from machine.gcode.modes import COMMANDS, E_AXIS, Axes, Modes
from machine.gcode.words import Word, read_letters, read_number, read_values, read_words, split_command

Coordinates = tuple[float | None, ...]  # X Y Z tilt turn E


@dataclass
class ModalState:
    """take() every command in order; lines() says it all again."""

    axes: Axes
    at: list[float | None] = field(default_factory=lambda: [None] * 6)
    nozzle_c: float = 0.0
    bed_c: float = 0.0
    fans: dict[str, str] = field(default_factory=dict)
    settings: dict[str, str] = field(default_factory=dict)
    pulled_mm: float = 0.0  # filament that stands further back than it has stood
    pushed_mm: float = 0.0  # filament that the newest command pushes; inf: some, nobody can know how much
    modes: Modes = field(init=False)

    def __post_init__(self) -> None:
        self.modes = Modes(self.axes)

    def coordinates(self) -> Coordinates:
        """Where the axes stand."""
        return tuple(self.at)

    @property
    def follows(self) -> bool:
        """Whether X Y Z are places on the table now (TCP)."""
        return self.settings.get("follow") == self.axes.follow_on != ""

    def take(self, command: str) -> bool:
        """Take note of a command; True when it moves an axis or filament."""
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
        if name in COMMANDS:
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
        elif name and name in (axes.follow_on, axes.follow_off):
            self.settings["follow"] = name
            return True
        elif command_named(name).modal:
            self.settings[name + "".join(sorted(letter for letter, _ in words))] = command
        return False

    def lines(self) -> list[str]:
        """Commands that bring a firmware to this state, positions left out but for the filament's."""
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
        """Whether a command is a move that has a word for filament."""
        name, rest = split_command(command.upper())
        return name in PATHS and any(self.axes.words.get(letter) == E_AXIS for letter, _ in read_words(rest))

    def _move(self, rest: str) -> bool:
        at, words = self.at, read_words(rest)
        before = at[E_AXIS]
        moved = self.modes.move(at, words)
        after = at[E_AXIS]
        self.pushed_mm = after - before if before is not None and after is not None else self._unsummed(words)
        if self.pulled_mm or self.pushed_mm < 0.0:
            self.pulled_mm = max(0.0, round(self.pulled_mm - self.pushed_mm, 9))  # what sums of words leave over is nothing
        return moved

    def _unsummed(self, words: list[Word]) -> float:
        """Filament that a move pushes where it is not known where the filament has stood."""
        pushed = [value * self.modes.unit_mm for letter, value in words if self.axes.words.get(letter) == E_AXIS]
        return sum(pushed) if self.modes.steps[E_AXIS] or not pushed else inf

    def _turn(self, values: Mapping[str, str]) -> bool:
        """A MANUAL_STEPPER."""
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
