"""Pen: what the firmware knows after the lines written so far, and the lines of moves that follow from it."""

from dataclasses import dataclass, field
from math import ceil

import numpy as np

from machine.firmware import Dialect
from machine.gcode.path_text import PathWords, as_bytes, path_text
from machine.kinematics.coordinates import followed_places
from mdp.mesh import Floats
from mdp.pose import Pose
from profiles.machine import Machine
from slicer.paths import Kind

UNKNOWN = -(10**12)
SAME = 1.001  # less than the firmware and the dry run care for
STEPS = 20  # a short stroke that must go slower does so by twentieths, or the speeds of its like would flicker


@dataclass
class Pen:
    """Positions in thousandths of a mm as the file calls them, filament in 1e-5 mm, words; pose: where the table stands."""

    dialect: Dialect
    machine: Machine
    filament_letter: str
    pose: Pose
    x: int = UNKNOWN
    y: int = UNKNOWN
    z: int = UNKNOWN
    feed: int = 0
    pushed: int = 0
    filament_mm: float = 0.0
    kind: Kind | None = None
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

    def file_coordinates(self, points_mm: Floats) -> Floats:
        """(n, 3) axis positions as the file calls them."""
        return followed_places(self.machine, self.pose, points_mm) if self.machine.coordinates == "workpiece" else points_mm

    def filament(self) -> str:
        """The filament's word up to what has been pushed: a step, or the sum where the firmware knows no steps."""
        e = round(self.filament_mm * 1e5)
        step, self.pushed = e - self.pushed, e
        return f" {self.filament_letter}{(step if self.dialect.filament_relative else e) / 1e5:.5f}"

    def speed(self, units_s: float) -> str:
        """The F word where it changes."""
        feed = max(1, round(60.0 * units_s))
        if feed == self.feed:
            return ""
        self.feed = feed
        return f" F{feed}"

    def coordinates(self, x: int, y: int, z: int) -> str:
        """The words of the coordinates that change."""
        text = ""
        if x != self.x:
            text = f" X{x / 1000:.3f}"
            self.x = x
        if y != self.y:
            text += f" Y{y / 1000:.3f}"
            self.y = y
        if z != self.z:
            text += f" Z{z / 1000:.3f}"
            self.z = z
        return text


def write_path(points_mm: Floats, filament_mm: Floats, speed_mm_s: float, pen: Pen) -> str:
    """The text of a path, one line a point, as the file calls them; a point that rounds to where the tip is gives its filament to
    the next line."""
    rounded = np.rint(points_mm * 1000.0)
    steps_mm, slower = share_filament(points_mm, rounded, filament_mm)
    filament = pen.filament_mm + np.cumsum(steps_mm)
    pen.filament_mm = float(filament[-1])
    ending = pen.speed(speed_mm_s / slower)
    words = PathWords(as_bytes("G1"), ord(pen.filament_letter), pen.dialect.filament_relative, as_bytes(ending))
    known = np.array([pen.x, pen.y, pen.z, pen.pushed])
    text = path_text(rounded[1:].astype(np.int64), np.rint(filament * 1e5).astype(np.int64), words, known)
    pen.x, pen.y, pen.z, pen.pushed = known.tolist()
    if ending and not text:
        pen.feed = 0
    return text


def share_filament(points_mm: Floats, rounded: Floats, filament_mm: Floats) -> tuple[Floats, float]:
    """(n - 1,) filament of each step in proportion to its length as written, the sum kept; how much slower it must go for that.

    Else a step of a few thousandths, which rounding makes shorter by half, would ask the extruder for double its speed.
    """
    steps = np.array([points_mm[1:] - points_mm[:-1], (rounded[1:] - rounded[:-1]) / 1000.0])
    exact, written = np.sqrt(np.einsum("ijk,ijk->ij", steps, steps))
    shared = filament_mm * written / np.maximum(exact, 1e-12)
    whole, shared_whole = float(filament_mm.sum()), float(shared.sum())
    if shared_whole == 0.0:
        return filament_mm, 1.0
    more = whole / shared_whole
    return shared * more, ceil(more * STEPS) / STEPS if more > SAME else 1.0


def thousandths(points_mm: Floats) -> list[list[int]]:
    """Points as the whole numbers that are written."""
    rounded: list[list[int]] = np.rint(points_mm * 1000.0).astype(np.int64).tolist()
    return rounded


def angle(degrees: float) -> str:
    """An angle as it is written."""
    return f"{round(degrees * 1e4) / 1e4:.4f}"


def number(value: float) -> str:
    """A number without needless zeros."""
    return f"{value:.5f}".rstrip("0").rstrip(".")
