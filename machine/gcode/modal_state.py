"""ModalState: what a firmware remembers of the commands it was given, so that a print can go on as if nothing had happened.

Positions are those of the program (what M114 tells), rotary axes unwrapped; None where the sender cannot know them.
"""

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
        text = command.upper()
        self.pushed_mm = 0.0
        if text[:3] == "G1 ":  # nearly every line
            return self._move(text[2:])
        name, rest = split_command(text)
        if name in PATHS:
            return self._move(rest)
        action = ACTIONS.get(name)
        if action is not None:
            return action(self, name, rest)
        if name and name in (self.axes.follow_on, self.axes.follow_off):
            self.settings["follow"] = name
            return True
        if command_named(name).modal:
            self.settings[name + "".join(sorted(letter for letter, _ in read_words(rest)))] = command
        elif name.startswith("HOME_"):
            for letter in name[5:]:
                self._forget(letter)
            return True
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

    def _forget(self, letter: str) -> None:
        if letter in self.axes.letters[:E_AXIS]:
            self.at[self.axes.letters.index(letter)] = None

    def _mode(self, name: str, rest: str) -> bool:
        self.modes.set(name)
        return False

    def _home(self, name: str, rest: str) -> bool:
        named = [letter for letter in read_letters(rest) if letter in self.axes.letters[:E_AXIS]]
        for letter in named or self.axes.letters[:E_AXIS]:
            self._forget(letter)
        return True

    def _call_it(self, name: str, rest: str) -> bool:
        for axis, coordinate in self.modes.named(read_words(rest)):
            self.at[axis] = coordinate
        return False

    def _heat(self, name: str, rest: str) -> bool:
        words = dict(read_words(rest))
        target = words.get("S", words.get("R"))
        if target is not None and EVERY[name].heats == "bed":
            self.bed_c = target
        elif target is not None:
            self.nozzle_c = target
        return False

    def _blow(self, name: str, rest: str) -> bool:
        fan = dict(read_words(rest)).get("P", 0.0)
        self.fans[f"{fan:g}"] = f"{name} {rest.strip()}".strip()
        return False

    def _stepper(self, name: str, rest: str) -> bool:
        values = read_values(rest)
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

    def _heater(self, name: str, rest: str) -> bool:
        values = read_values(rest)
        target = read_number(values.get("TARGET", "")) or 0.0
        if values.get("HEATER") == "EXTRUDER":
            self.nozzle_c = target
        elif values.get("HEATER") == "HEATER_BED":
            self.bed_c = target
        return False

    def _off(self, name: str, rest: str) -> bool:
        self.nozzle_c = self.bed_c = 0.0
        return False


ACTIONS = (
    dict.fromkeys(COMMANDS, ModalState._mode)
    | {name: ModalState._heat for name, command in EVERY.items() if command.heats in ("nozzle", "bed")}
    | dict.fromkeys(("M106", "M107"), ModalState._blow)
    | {
        "G28": ModalState._home,
        "G92": ModalState._call_it,
        "MANUAL_STEPPER": ModalState._stepper,
        "SET_HEATER_TEMPERATURE": ModalState._heater,
        "TURN_OFF_HEATERS": ModalState._off,
    }
)
