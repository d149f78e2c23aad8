"""Modal: what a firmware remembers of the commands it was given, so that a print can go on as if nothing had happened.

Positions are those of the program (what M114 tells), rotary axes unwrapped; None where the sender cannot know them.
"""

import re
from dataclasses import dataclass, field
from typing import NamedTuple

from machine.dialects import DIALECTS
from machine.placeholders import stepper
from profiles.machine import Machine

WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")
VALUE = re.compile(r"([A-Z_]+)=(\S+)")
INCH_MM = 25.4
E_AXIS = 5
MOVES = frozenset({"G0", "G1", "G2", "G3"})
KEPT = ("M200", "M201", "M203", "M204", "M205", "M207", "M220", "M221", "SET_VELOCITY_LIMIT", "M900")
FOLLOWING_ON = ("G43.4",)
FOLLOWING = (*FOLLOWING_ON, "G49")

Place = tuple[float | None, ...]  # X Y Z tilt turn E


class Axes(NamedTuple):
    """The letters of a machine's axes, and how G90 and G91 act on filament."""

    letters: tuple[str, ...]
    filament_mode: str
    steppers: tuple[str, str]


def axes_of(machine: Machine | None) -> Axes:
    """The axes of a machine, Marlin's A and C where none is known."""
    if machine is None:
        return Axes(("X", "Y", "Z", "A", "C", "E"), "set", ("", ""))
    letters = ("X", "Y", "Z", machine.tilt.letter, machine.turn.letter, "E")
    names = (stepper(machine.tilt).upper(), stepper(machine.turn).upper())
    return Axes(letters, DIALECTS[machine.dialect].filament_mode, names)


@dataclass
class Modal:
    """take() every command in order; lines() says it all again."""

    axes: Axes
    at: list[float | None] = field(default_factory=lambda: [None] * 6)
    relative: bool = False
    filament_relative: bool = False
    inches: bool = False
    feed: float | None = None  # the number after F, as the program wrote it
    nozzle_c: float = 0.0
    bed_c: float = 0.0
    fans: dict[str, str] = field(default_factory=dict)
    kept: dict[str, str] = field(default_factory=dict)
    pulled_mm: float = 0.0  # filament that stands further back than it has stood
    _index: dict[str, int] = field(init=False)

    def __post_init__(self) -> None:
        self._index = {letter: axis for axis, letter in enumerate(self.axes.letters)}

    def place(self) -> Place:
        """Where the axes stand."""
        return tuple(self.at)

    @property
    def follows(self) -> bool:
        """Whether X Y Z are places on the table now (TCP)."""
        return self.kept.get("follow") in FOLLOWING_ON

    def take(self, command: str) -> bool:
        """Take note of a command; True when it moves an axis or filament."""
        name, _, rest = command.partition(" ")
        if name not in MOVES:
            name, rest = _parted(command)
        if name in MOVES:
            return self._move(rest)
        action = ACTIONS.get(name)
        if action is not None:
            return action(self, name, rest.upper())
        if name in KEPT:
            self.kept[name + "".join(sorted(letter for letter, _ in WORD.findall(rest.upper())))] = command
        elif name.startswith("HOME_"):
            for letter in name[5:]:
                self._forget(letter)
            return True
        return False

    def lines(self) -> list[str]:
        """Commands that bring a firmware to this state, positions left out but for the filament's."""
        said = ["G20" if self.inches else "G21", "G91" if self.relative else "G90"]
        said.append("M83" if self.filament_relative else "M82")
        filament_mm = self.at[E_AXIS]
        if filament_mm is not None:
            said.append(f"G92 E{filament_mm / (INCH_MM if self.inches else 1.0):.5f}")
        if self.feed is not None:
            said.append(f"G1 F{self.feed:g}")
        return [*said, *self.kept.values(), *self.fans.values()]

    def _move(self, rest: str) -> bool:
        at, index, moved = self.at, self._index, False
        for letter, value in _words(rest):
            axis = index.get(letter)
            if axis is None:
                if letter == "F":
                    self.feed = value
                continue
            moved = True
            if self.inches and not 3 <= axis <= 4:
                value *= INCH_MM
            before = at[axis]
            if axis == E_AXIS:
                stepped = self._steps()
                pushed = value if stepped else 0.0 if before is None else value - before
                if self.pulled_mm or pushed < 0.0:
                    self.pulled_mm = max(0.0, self.pulled_mm - pushed)
            else:
                stepped = self.relative
            at[axis] = value if not stepped else None if before is None else before + value
        return moved

    def _steps(self) -> bool:
        return self.filament_relative or (self.relative and self.axes.filament_mode == "carried")

    def _forget(self, letter: str) -> None:
        if letter in self.axes.letters[:E_AXIS]:
            self.at[self.axes.letters.index(letter)] = None

    def _mode(self, name: str, rest: str) -> bool:
        if name in ("G20", "G21"):
            self.inches = name == "G20"
        elif name in ("G90", "G91"):
            self.relative = name == "G91"
            if self.axes.filament_mode == "set":
                self.filament_relative = self.relative
        else:
            self.filament_relative = name == "M83"
        return False

    def _home(self, name: str, rest: str) -> bool:
        named = [letter for letter in re.findall("[A-Z]", rest) if letter in self.axes.letters[:E_AXIS]]
        for letter in named or self.axes.letters[:E_AXIS]:
            self._forget(letter)
        return True

    def _call_it(self, name: str, rest: str) -> bool:
        for letter, value in _words(rest):
            if letter in self.axes.letters:
                axis = self.axes.letters.index(letter)
                self.at[axis] = value * (INCH_MM if self.inches and not 3 <= axis <= 4 else 1.0)
        return False

    def _heat(self, name: str, rest: str) -> bool:
        words = dict(_words(rest))
        target = words.get("S", words.get("R"))
        if target is not None and name in ("M140", "M190"):
            self.bed_c = target
        elif target is not None:
            self.nozzle_c = target
        return False

    def _blow(self, name: str, rest: str) -> bool:
        fan = dict(_words(rest)).get("P", 0.0)
        self.fans[f"{fan:g}"] = f"{name} {rest.strip()}".strip()
        return False

    def _follow(self, name: str, rest: str) -> bool:
        self.kept["follow"] = name
        return True

    def _stepper(self, name: str, rest: str) -> bool:
        values = dict(VALUE.findall(rest))
        if values.get("STEPPER") not in self.axes.steppers:
            return False
        axis = 3 + self.axes.steppers.index(values["STEPPER"])
        for key in ("SET_POSITION", "MOVE"):
            if key in values and re.fullmatch(r"[-+]?\d+\.?\d*", values[key]):
                self.at[axis] = float(values[key])
        if values.get("STOP_ON_ENDSTOP", "0") != "0":
            self.at[axis] = None
        return "MOVE" in values

    def _heater(self, name: str, rest: str) -> bool:
        values = dict(VALUE.findall(rest))
        target = float(values.get("TARGET", "0") if re.fullmatch(r"\d+\.?\d*", values.get("TARGET", "")) else 0.0)
        if values.get("HEATER") == "EXTRUDER":
            self.nozzle_c = target
        elif values.get("HEATER") == "HEATER_BED":
            self.bed_c = target
        return False

    def _off(self, name: str, rest: str) -> bool:
        self.nozzle_c = self.bed_c = 0.0
        return False


def _words(rest: str) -> list[tuple[str, float]]:
    """Letters and numbers; the fast way where blanks part them."""
    try:
        return [(word[0], float(word[1:])) for word in rest.split()]
    except ValueError:
        return [(letter, float(value)) for letter, value in WORD.findall(rest.upper())]


def _parted(command: str) -> tuple[str, str]:
    """Name and rest: "g01x5" is G1, a macro keeps its whole name."""
    upper = command.upper()
    found = re.match(r"([GMT])\s*0*(\d+(?:\.\d+)?)", upper)
    if found and not re.match(r"[A-Z_]{2,}", upper):
        return f"{found[1]}{found[2]}", upper[found.end() :]
    name, _, rest = upper.partition(" ")
    return name, rest


ACTIONS = (
    dict.fromkeys(("G20", "G21", "G90", "G91", "M82", "M83"), Modal._mode)
    | dict.fromkeys(("M104", "M109", "M140", "M190", "M568"), Modal._heat)
    | dict.fromkeys(("M106", "M107"), Modal._blow)
    | dict.fromkeys(FOLLOWING, Modal._follow)
    | {
        "G28": Modal._home,
        "G92": Modal._call_it,
        "MANUAL_STEPPER": Modal._stepper,
        "SET_HEATER_TEMPERATURE": Modal._heater,
        "TURN_OFF_HEATERS": Modal._off,
    }
)
