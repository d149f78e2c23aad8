"""Read beads: the strokes of a G-code file of ours by a reader of its own, for looks that must not share the program's code.

It takes straight moves only, as our profiles write them unless `machine.arcs` is true.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
FILAMENT_LETTER = {"linuxcnc": "U", "grblhal": "U"}
PLATE_FOLLOWED = "workpiece"  # machine.coordinates of a machine whose X Y Z turn with the table


@dataclass(frozen=True, eq=False)
class Beads:
    """Strokes in the order of the file, one row each.

    begin, end: (n, 3) mm in machine axes; mm3: (n,) plastic; part, layer: (n,) counted from 1; kind: (n,) into kinds, the names
    behind ;TYPE:; height_mm, width_mm: (n,) as ;HEIGHT: and ;WIDTH: tell; line: (n,); way: (n,) strokes of one number follow
    each other without a travel between. tilt_deg: of each part, 0 where it is printed upright. settings: the file's own.
    """

    begin: Floats
    end: Floats
    mm3: Floats
    part: NDArray[np.int64]
    layer: NDArray[np.int64]
    kind: NDArray[np.int64]
    height_mm: Floats
    width_mm: Floats
    line: NDArray[np.int64]
    way: NDArray[np.int64]
    kinds: tuple[str, ...]
    tilt_deg: dict[int, float]
    settings: dict[str, str]

    @cached_property
    def length_mm(self) -> Floats:
        """(n,) length of each stroke."""
        return np.linalg.norm(self.end - self.begin, axis=1)

    def is_kind(self, names: Iterable[str]) -> NDArray[np.bool_]:
        """(n,) whether a stroke is of one of these kinds."""
        return np.isin(self.kind, [k for k, name in enumerate(self.kinds) if name in set(names)])

    def number(self, key: str, usual: float) -> float:
        """A setting's number, or the usual one where the file tells none."""
        try:
            return float(self.settings[key])
        except (KeyError, ValueError):
            return usual


def settings_of(lines: Sequence[str]) -> dict[str, str]:
    """What the file tells of its settings, key -> text."""
    pairs = (line[2:].partition(" = ") for line in reversed(lines) if line.startswith("; ") and " = " in line)
    return {key: value for key, _, value in pairs}


def read_beads(lines: Sequence[str]) -> Beads:
    """The strokes of all parts, the purge line and other strokes before the first part left out."""
    settings = settings_of(lines)
    reader = _Reader(FILAMENT_LETTER.get(settings.get("machine.dialect", ""), "E"))
    for number, line in enumerate(lines, 1):
        if line.startswith(";"):
            reader.hear(line)
        elif line.startswith(("G0 ", "G1 ")):
            reader.move(line, number)
        elif line.startswith(("G90", "G91", "M82", "M83", "G92")):
            reader.switch(line)
    rows = np.array(reader.rows, float).reshape(-1, 14)
    area_mm2 = pi * float(settings.get("material.diameter_mm", 1.75)) ** 2 / 4.0
    part, layer, kind, line_number, way = rows[:, 7:12].T.astype(np.int64)
    return Beads(
        *(rows[:, :3], rows[:, 3:6], rows[:, 6] * area_mm2, part, layer, kind, rows[:, 12], rows[:, 13], line_number, way),
        tuple(reader.kinds),
        reader.tilt_deg,
        settings,
    )


class _Reader:
    """What the lines so far have set."""

    def __init__(self, filament: str) -> None:
        self.rows: list[tuple[float, ...]] = []
        self.kinds: dict[str, int] = {"": 0}
        self.tilt_deg: dict[int, float] = {}
        self._filament, self._at = filament, dict.fromkeys("XYZ" + filament, 0.0)
        self._absolute, self._filament_absolute = True, filament == "U"
        self._part = self._layer = self._kind = self._way = 0
        self._height = self._width = 0.0

    def hear(self, comment: str) -> None:
        """A ; comment."""
        word, _, rest = comment[1:].partition(":")
        if word == "PART":
            self._part, self._layer = int(rest.split()[0]), 0
        elif word == "POSE":
            self.tilt_deg[self._part] = float(rest.split()[0][1:])
        elif word == "LAYER_CHANGE":
            self._layer += 1
        elif word == "TYPE":
            self._kind = self.kinds.setdefault(rest, len(self.kinds))
        elif word == "HEIGHT":
            self._height = float(rest)
        elif word == "WIDTH":
            self._width = float(rest)

    def switch(self, line: str) -> None:
        """A command that says what later numbers mean."""
        code, *words = line.split(";")[0].split()
        if code in ("G90", "G91"):
            self._absolute = code == "G90"
        elif code in ("M82", "M83"):
            self._filament_absolute = code == "M82"
        else:
            self._at |= {word[0]: float(word[1:]) for word in words if word[0] in self._at}

    def move(self, line: str, number: int) -> None:
        """G0 or G1; a stroke becomes a row."""
        at, pushed, before = self._at, 0.0, (self._at["X"], self._at["Y"], self._at["Z"])
        for word in line.split(";")[0].split()[1:]:
            letter = word[0]
            if letter == self._filament:
                value = float(word[1:])
                pushed = value - at[letter] if self._filament_absolute else value
                at[letter] = at[letter] + pushed
            elif letter in "XYZ":
                at[letter] = float(word[1:]) if self._absolute else at[letter] + float(word[1:])
        after = (at["X"], at["Y"], at["Z"])
        across = before[:2] != after[:2]
        if pushed <= 0.0 or not across:
            self._way += 1
        elif self._part:
            context = (self._part, self._layer, self._kind, number, self._way, self._height, self._width)
            self.rows.append((*before, *after, pushed, *context))
