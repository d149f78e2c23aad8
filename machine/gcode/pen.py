"""Pen: what the firmware knows after the lines written so far, and the words of single lines that follow from it."""

from dataclasses import dataclass, field

import numpy as np

from machine.firmware import Dialect
from machine.gcode.path_text import PUSHED, F, Paths, PathWords, Texts, Whole, X, as_bytes, path_text
from machine.kinematics.coordinates import followed_places
from mdp.mesh import Floats
from mdp.pose import Pose
from profiles.machine import Machine

UNKNOWN = -(10**12)


@dataclass
class Pen:
    """pose: where the table stands; known: (5,) X Y Z, filament and F, pushed_mm: (1,) filament, as in path_text; kind: number of
    the last stroke's kind, -1: none."""

    dialect: Dialect
    machine: Machine
    filament_letter: str
    pose: Pose
    known: Whole = field(default_factory=lambda: np.array([UNKNOWN, UNKNOWN, UNKNOWN, 0, 0]))
    pushed_mm: Floats = field(default_factory=lambda: np.zeros(1))
    kind: int = -1
    width_mm: float = 0.0
    fan: int = 0
    layer_fan: float = 0.0
    acceleration: int | None = None
    nozzle_c: float = 0.0
    percent: int = -1
    layers: int = 0
    turned: bool = False
    part: int = 0
    labelled: int = 0
    values: dict[str, object] = field(default_factory=dict)

    @property
    def place_mm(self) -> Floats:
        """(3,) X Y Z as the file calls them."""
        place: Floats = self.known[X:PUSHED] / 1000.0
        return place

    def file_coordinates(self, points_mm: Floats) -> Floats:
        """(n, 3) axis positions as the file calls them."""
        return followed_places(self.machine, self.pose, points_mm) if self.machine.coordinates == "workpiece" else points_mm

    def paths(self, paths: Paths, texts: Texts) -> str:
        """The lines of many moves."""
        words = PathWords(
            as_bytes("G1"), as_bytes(self.dialect.travel), ord(self.filament_letter), self.dialect.filament_relative
        )
        return path_text(paths, texts, words, self.known, self.pushed_mm)

    def filament(self, pushed_mm: float) -> str:
        """The filament's word after so much more: a step, or the sum where the firmware knows no steps."""
        self.pushed_mm[0] += pushed_mm
        e = round(float(self.pushed_mm[0]) * 1e5)
        step, self.known[PUSHED] = e - int(self.known[PUSHED]), e
        return f" {self.filament_letter}{(step if self.dialect.filament_relative else e) / 1e5:.5f}"

    def forget_speed(self) -> None:
        """The next line gives its F."""
        self.known[F] = 0

    def speed(self, units_s: float) -> str:
        """The F word where it changes."""
        feed = max(1, round(60.0 * units_s))
        if feed == self.known[F]:
            return ""
        self.known[F] = feed
        return f" F{feed}"

    def coordinates(self, place_mm: Floats) -> str:
        """The words of the coordinates that change; place_mm: (3,) as the file calls them."""
        text = ""
        for axis, value in enumerate(np.rint(place_mm * 1000.0).astype(np.int64).tolist()):
            if value != self.known[axis]:
                self.known[axis] = value
                text += f" {'XYZ'[axis]}{value / 1000:.3f}"
        return text


def angle(degrees: float) -> str:
    """An angle as it is written."""
    return f"{round(degrees * 1e4) / 1e4:.4f}"


def number(value: float) -> str:
    """A number without needless zeros."""
    return f"{value:.5f}".rstrip("0").rstrip(".")
