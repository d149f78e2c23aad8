"""Pen: what the firmware knows after the lines written so far, the words of single lines that follow from it, and the lines that
bring the table to a pose, in each firmware's way."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import ceil, hypot

import numpy as np

from machine.firmware import Dialect
from machine.gcode.lines import Texts
from machine.gcode.path_text import PUSHED, F, Paths, PathWords, Whole, X, path_text
from machine.kinematics.coordinates import axis_positions, followed_places
from mdp.mesh import Floats
from mdp.pose import Pose
from profiles.machine import Machine

UNKNOWN = -(10**12)
STROKE = np.frombuffer(b"G1", np.uint8)
STEP_DEG = 1.0  # a followed turn goes in steps: between them the tip leaves its place by a thousandth of its distance to the axes


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
        travel, letter = np.frombuffer(self.dialect.travel.encode(), np.uint8), ord(self.filament_letter)
        words = PathWords(STROKE, travel, letter, self.dialect.filament_relative)
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


def turn(to: Pose, speed_deg_s: float, pen: Pen) -> Iterator[str]:
    """Turn the table from pen.pose to a pose at a speed along sqrt(tilt^2 + turn^2), the head standing still."""
    if pen.machine.shape == "fixed":
        return
    tilt_deg, turn_deg = to.tilt_deg - pen.pose.tilt_deg, to.turn_deg - pen.pose.turn_deg
    if pen.dialect.steppers:
        yield from _stepped(to, tilt_deg, turn_deg, speed_deg_s, pen)
    elif pen.machine.coordinates == "workpiece" and (tilt_deg or turn_deg):
        yield from _followed(to, hypot(tilt_deg, turn_deg) / speed_deg_s, pen)
    else:
        pen.forget_speed()
        along = hypot(tilt_deg, turn_deg)
        share = max(abs(tilt_deg), abs(turn_deg)) / along if pen.dialect.largest_delta and along > 0 else 1.0
        yield f"{pen.dialect.travel}{_words(to, pen)}{pen.speed(speed_deg_s * share)}"
    pen.pose = to
    pen.forget_speed()


def _words(pose: Pose, pen: Pen) -> str:
    return f" {pen.machine.tilt.letter}{angle(pose.tilt_deg)} {pen.machine.turn.letter}{angle(pose.turn_deg)}"


def _stepped(to: Pose, tilt_deg: float, turn_deg: float, speed_deg_s: float, pen: Pen) -> Iterator[str]:
    """MANUAL_STEPPER, one line an axis: both begin together, and speeds and accelerations in proportion end them together.

    Only the last one is waited for; it is the one that goes farther.
    """
    axes = [
        (abs(tilt_deg), pen.values["tilt_stepper"], to.tilt_deg, pen.machine.tilt),
        (abs(turn_deg), pen.values["turn_stepper"], to.turn_deg, pen.machine.turn),
    ]
    along = hypot(tilt_deg, turn_deg)
    acceleration = min((axis.acceleration_deg_s2 * along / far for far, _, _, axis in axes if far > 0), default=0.0)
    for wait, (far, stepper, value, axis) in enumerate(sorted(axes, key=lambda turned: turned[0])):
        share = far / along if along > 0 else 0.0
        how = f"SPEED={number(max(speed_deg_s * share, 1e-4))} ACCEL={number(max(acceleration * share, 1e-4))}"
        if share == 0.0:
            how = f"SPEED={number(axis.speed_deg_s)}"
        yield f"MANUAL_STEPPER STEPPER={stepper} MOVE={angle(value)} {how} SYNC={wait}"


def _followed(to: Pose, seconds: float, pen: Pen) -> Iterator[str]:
    """A turn under a firmware that keeps the tip on the table: small steps whose places keep the head where it is."""
    machine, begin = pen.machine, pen.pose
    head = axis_positions(machine, np.array([[*pen.place_mm, begin.tilt_deg, begin.turn_deg]]))  # the file's places are rounded
    far = max(abs(to.tilt_deg - begin.tilt_deg), abs(to.turn_deg - begin.turn_deg))
    count = max(1, ceil(far / STEP_DEG))
    if pen.dialect.inverse_time:
        yield "G93"
    for k in range(1, count + 1):
        share = k / count
        tilt_deg = begin.tilt_deg + share * (to.tilt_deg - begin.tilt_deg)
        pose = Pose(tilt_deg, begin.turn_deg + share * (to.turn_deg - begin.turn_deg)) if k < count else to
        before = pen.place_mm
        words = pen.coordinates(followed_places(machine, pose, head)[0])
        moved = float(np.linalg.norm(pen.place_mm - before))
        if pen.dialect.inverse_time:
            feed = f" F{number(60.0 * count / seconds)}"
        else:
            step = moved if moved > 0 else hypot(to.tilt_deg - begin.tilt_deg, to.turn_deg - begin.turn_deg) / count
            feed = f" F{number(max(60.0 * step * count / seconds, 0.001))}"
        yield f"G1{words}{_words(pose, pen)}{feed}"
    if pen.dialect.inverse_time:
        yield "G94"
