"""Pen: the firmware's state after the lines written so far, and the formatting of further moves.

A kernel formats many moves at once, which are nearly all lines of a program; single words, and the lines that turn the table in
each firmware's way, are formatted one by one.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import ceil, hypot
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.firmware import Dialect
from machine.gcode.lines import Bytes, Texts
from machine.kinematics.table import axis_positions, followed_places
from machine.planning.moves import RICHER
from mdp.kernels.kernel import helper, kernel, no_nrt
from mdp.mesh import Floats, Indices
from mdp.pose import Pose
from profiles.machine import Machine
from slicer.strokes.travels import distance

Whole = NDArray[np.int64]

LONGEST = 128  # characters of a line: five words of at most 20 digits with sign and point, and the command
SPACE, MINUS, POINT, ZERO, LINE_END, FEED = 32, 45, 46, 48, 10, 70
COORDINATE_DIGITS, FILAMENT_DIGITS = 3, 5  # after the point
PUSHING, TRAVELLING, STANDING = range(3)  # kinds of paths: strokes and wipes, travels, retractions
X, Y, Z, PUSHED, F = range(5)  # known to the firmware
STEPS = 20  # a short stroke slows down in steps of a twentieth, or the speeds of similar strokes would flicker
UNKNOWN = -(10**12)
STROKE = np.frombuffer(b"G1", np.uint8)
STEP_DEG = 1.0  # step of a followed turn: between steps the tip deviates by a thousandth of its distance to the axes


class Paths(NamedTuple):
    """Moves to write.

    points_mm: (n, 3) in file coordinates; filament_mm: (n,) pushed on the way to each; starts: (m + 1,) first point of each path;
    does: (m,) PUSHING, TRAVELLING or STANDING; speed: (m,) units/s; most_mm_s: (m,) planned filament speed, RICHER times which is
    the limit for written lines.
    """

    points_mm: Floats
    filament_mm: Floats
    starts: Indices
    does: NDArray[np.int8]
    speed: Floats
    most_mm_s: Floats


@kernel
def _write(
    paths: Paths, texts: Texts, travel: Bytes, letter: int, relative: bool, known: Whole, filament_mm: Floats, text: Bytes
) -> int:
    """Fill in the text and return its length."""
    at = 0
    for path in range(len(paths.starts) - 1):
        at = _copy(texts.content, texts.start[path], texts.start[path + 1], text, at)
        first, end = paths.starts[path], paths.starts[path + 1]
        if paths.does[path] == STANDING:
            filament_mm[0] += paths.filament_mm[first]
            at = _copy(STROKE, 0, len(STROKE), text, at)
            at = _filament(letter, relative, filament_mm[0], known, text, at)
            at = _feed(paths.speed[path], known, text, at)
            text[at] = LINE_END
            at += 1
            continue
        pushing = paths.does[path] == PUSHING
        more, densest = _stretch(paths.points_mm, paths.filament_mm, first, end) if pushing else (0.0, 0.0)
        too_fast = paths.speed[path] * densest / (paths.most_mm_s[path] * RICHER) if pushing else 0.0
        slower = ceil(too_fast * STEPS) / STEPS if too_fast > 1.0 else 1.0
        written, base, pushed = False, filament_mm[0], 0.0
        for k in range(first + 1, end):
            if pushing:
                pushed += _step_mm(paths.points_mm, paths.filament_mm, k, more)
                filament_mm[0] = base + pushed
            stands = True
            for axis in range(3):
                stands = stands and _thousandths(paths.points_mm[k, axis]) == known[axis]
            if stands:
                continue
            command = STROKE if pushing else travel
            at = _copy(command, 0, len(command), text, at)
            for axis in range(3):
                value = _thousandths(paths.points_mm[k, axis])
                if value != known[axis]:
                    known[axis] = value
                    at = _word(88 + axis, value, COORDINATE_DIGITS, text, at)
            if pushing:
                at = _filament(letter, relative, filament_mm[0], known, text, at)
            if not written:
                at, written = _feed(paths.speed[path] / slower, known, text, at), True
            text[at] = LINE_END
            at += 1
    return _copy(texts.content, texts.start[len(paths.starts) - 1], texts.start[len(paths.starts)], text, at)


@helper
def _stretch(points_mm: Floats, filament_mm: Floats, first: int, end: int) -> tuple[float, float]:
    """Factor that scales each step's filament in proportion to its written length with a constant sum, and the greatest filament
    per written mm.

    A factor of 0: nothing is redistributed. Otherwise a step of a few thousandths, which rounding halves, would double the
    extruder's speed.
    """
    whole = shared = densest = 0.0
    for k in range(first + 1, end):
        whole += filament_mm[k]
        shared += _step_mm(points_mm, filament_mm, k, 1.0)
        exact_mm = distance(points_mm, k - 1, k)
        densest = max(densest, abs(filament_mm[k]) / exact_mm) if exact_mm > 1e-9 else densest
    if shared == 0.0:
        return 0.0, 0.0
    return whole / shared, densest * whole / shared


@no_nrt
def _step_mm(points_mm: Floats, filament_mm: Floats, k: int, more: float) -> float:
    """Filament of the step to point k as it is written; more: factor on the shared filament; 0: each step keeps its own."""
    if more == 0.0:
        return float(filament_mm[k])
    written = 0.0
    for axis in range(3):
        written += ((np.rint(points_mm[k, axis] * 1000.0) - np.rint(points_mm[k - 1, axis] * 1000.0)) / 1000.0) ** 2
    return float(filament_mm[k] * np.sqrt(written) / max(distance(points_mm, k - 1, k), 1e-12) * more)


@no_nrt
def _thousandths(value_mm: float) -> int:
    return int(np.rint(value_mm * 1000.0))


@no_nrt
def _filament(letter: int, relative: bool, filament_mm: float, known: Whole, text: Bytes, at: int) -> int:
    """Write the filament word up to the amount pushed: a step, or the sum if the firmware has no relative filament."""
    pushed = int(np.rint(filament_mm * 1e5))
    value = pushed - known[PUSHED] if relative else pushed
    known[PUSHED] = pushed
    return _word(letter, value, FILAMENT_DIGITS, text, at)


@no_nrt
def _feed(units_s: float, known: Whole, text: Bytes, at: int) -> int:
    """Write the F word if it changes."""
    feed = max(int(np.rint(60.0 * units_s)), 1)
    if feed == known[F]:
        return at
    known[F] = feed
    return _word(FEED, feed, 0, text, at)


@no_nrt
def _copy(what: Bytes, first: int, end: int, text: Bytes, at: int) -> int:
    for k in range(first, end):
        text[at] = what[k]
        at += 1
    return at


@no_nrt
def _word(letter: int, value: int, digits: int, text: Bytes, at: int) -> int:
    """Write a blank, a letter and an integer with a decimal point before its last digits; returns the end of the text."""
    text[at], text[at + 1] = SPACE, letter
    at += 2
    if value < 0:
        text[at] = MINUS
        at, value = at + 1, -value
    count, rest = digits + 1, value
    for _ in range(digits + 1):
        rest //= 10
    while rest > 0:
        rest //= 10
        count += 1
    end = at + count + (1 if digits > 0 else 0)
    after = end
    for k in range(count):
        if k == digits and digits > 0:
            end -= 1
            text[end] = POINT
        end -= 1
        text[end] = ZERO + value % 10
        value //= 10
    return after


@dataclass
class Pen:
    """State of the output. pose: of the table; known: (5,) X Y Z in thousandths of a mm, filament in 1e-5 mm and F in units/min
    that the firmware knows; pushed_mm: (1,) unrounded filament so far; kind: number of the last stroke's kind, -1: none."""

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
        """(3,) X Y Z in file coordinates."""
        place: Floats = self.known[X:PUSHED] / 1000.0
        return place

    def file_coordinates(self, points_mm: Floats) -> Floats:
        """(n, 3) axis positions in file coordinates."""
        return followed_places(self.machine, self.pose, points_mm) if self.machine.coordinates == "workpiece" else points_mm

    def paths(self, paths: Paths, texts: Texts) -> str:
        """The lines of many moves with their ends: changed coordinates, then filament, then a changed F.

        texts: m + 1 of lines between the m paths, one before each and one after the last. A point at the tip's position gives no
        line; its filament is added to the next one.
        """
        travel, letter = np.frombuffer(self.dialect.travel.encode(), np.uint8), ord(self.filament_letter)
        text = np.empty(LONGEST * int(paths.starts[-1] - paths.starts[0]) + len(texts.content), np.uint8)
        size = _write(paths, texts, travel, letter, self.dialect.filament_relative, self.known, self.pushed_mm, text)
        return text[:size].tobytes().decode("utf-8")

    def filament(self, pushed_mm: float) -> str:
        """The filament word for a length to push: a step, or the sum if the firmware has no relative filament."""
        self.pushed_mm[0] += pushed_mm
        e = round(float(self.pushed_mm[0]) * 1e5)
        step, self.known[PUSHED] = e - int(self.known[PUSHED]), e
        return f" {self.filament_letter}{(step if self.dialect.filament_relative else e) / 1e5:.5f}"

    def speed(self, units_s: float) -> str:
        """The F word if it changes, else ""."""
        feed = max(1, round(60.0 * units_s))
        if feed == self.known[F]:
            return ""
        self.known[F] = feed
        return f" F{feed}"

    def coordinates(self, place_mm: Floats) -> str:
        """The words of the changed coordinates; place_mm: (3,) in file coordinates."""
        text = ""
        for axis, value in enumerate(np.rint(place_mm * 1000.0).astype(np.int64).tolist()):
            if value != self.known[axis]:
                self.known[axis] = value
                text += f" {'XYZ'[axis]}{value / 1000:.3f}"
        return text


def angle(degrees: float) -> str:
    """An angle as text."""
    return f"{round(degrees * 1e4) / 1e4:.4f}"


def number(value: float) -> str:
    """A number without trailing zeros."""
    return f"{value:.5f}".rstrip("0").rstrip(".")


def turn(to: Pose, speed_deg_s: float, pen: Pen) -> Iterator[str]:
    """Turn the table from pen.pose to a pose at a speed along sqrt(tilt^2 + turn^2), with the head at rest."""
    if pen.machine.shape == "fixed":
        return
    tilt_deg, turn_deg = to.tilt_deg - pen.pose.tilt_deg, to.turn_deg - pen.pose.turn_deg
    if pen.dialect.steppers:
        yield from _stepped(to, tilt_deg, turn_deg, speed_deg_s, pen)
    elif pen.machine.coordinates == "workpiece" and (tilt_deg or turn_deg):
        yield from _followed(to, hypot(tilt_deg, turn_deg) / speed_deg_s, pen)
    else:
        pen.known[F] = 0  # the line has an F of its own
        along = hypot(tilt_deg, turn_deg)
        share = max(abs(tilt_deg), abs(turn_deg)) / along if pen.dialect.largest_delta and along > 0 else 1.0
        yield f"{pen.dialect.travel}{_words(to, pen)}{pen.speed(speed_deg_s * share)}"
    pen.pose = to
    pen.known[F] = 0


def _words(pose: Pose, pen: Pen) -> str:
    return f" {pen.machine.tilt.letter}{angle(pose.tilt_deg)} {pen.machine.turn.letter}{angle(pose.turn_deg)}"


def _stepped(to: Pose, tilt_deg: float, turn_deg: float, speed_deg_s: float, pen: Pen) -> Iterator[str]:
    """MANUAL_STEPPER lines, one per axis: both start together, and proportional speeds and accelerations end them together.

    Only the last line, that of the longer move, waits.
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
    """A turn under a firmware that keeps the tip on the table: small steps whose positions keep the head in place."""
    machine, begin = pen.machine, pen.pose
    # the file's positions are rounded
    head = axis_positions(machine, np.array([[*pen.place_mm, begin.tilt_deg, begin.turn_deg]]))
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
