"""Motion: straight moves, arcs and turns of steppers become rows."""

from math import hypot, inf

import numpy as np

from machine.gcode.arcs import arc_centre, chord_count, chords, sweep_rad
from machine.gcode.modes import E_AXIS
from machine.kinematics.coordinates import axis_positions, followed_places
from machine.reader.state import Reader, Words
from mdp.pose import Pose
from profiles.errors import GcodeError

CHORD_MM = 0.005  # arcs are read as chords that stay so near
ROUND_MM = 0.1  # by how much an arc's radius may differ at its ends


def straight(reader: Reader, words: Words, rapid: bool = False) -> None:
    """G0 and G1: a row, unless only F is given."""
    if reader.turning:
        flush(reader)
    modes, before = reader.modes, reader.at.copy()
    try:
        moved = modes.move(reader.at, words)
    except GcodeError as error:
        raise GcodeError(f"line {reader.number}: {error}") from None
    if not moved:
        return
    if reader.flow != 1.0 or reader.filament_mm2:
        _scale_filament(reader, before[E_AXIS])
    feed = modes.feed * reader.feed_share
    if rapid and reader.dialect.rapid:
        feed = inf
    elif modes.inverse_time:
        if not any(letter == "F" for letter, _ in words):
            raise GcodeError(f"line {reader.number}: after G93 every move needs its own F")
        feed = -feed
    reader.row(before, feed)


def _scale_filament(reader: Reader, before: float) -> None:
    """The extruder turns by more or less where M221 or M200 says so; the program's own sum stays."""
    step = reader.at[E_AXIS] - before
    pushed = step * reader.flow / (reader.filament_mm2 or 1.0)
    reader.at[E_AXIS] = before + pushed
    reader.modes.offset[E_AXIS] -= pushed - step


def arc(reader: Reader, name: str, words: Words) -> None:
    """G2 and G3 in the X Y plane, by I J or R: rows of chords, the other axes going along evenly."""
    clockwise, before = name == "G2", reader.at.copy()
    shape = {letter: value * reader.modes.unit_mm for letter, value in words if letter in "IJR" and letter not in reader.letters}
    known = reader.table.rows
    straight(reader, [(letter, value) for letter, value in words if letter not in shape])
    after = reader.at.copy()
    reader.table.rows = known
    start, end = (before[0], before[1]), (after[0], after[1])
    centre = arc_centre(start, end, shape, clockwise)
    radii = [0.0, 0.0] if centre is None else [hypot(p[0] - centre[0], p[1] - centre[1]) for p in (start, end)]
    if centre is None or min(radii) == 0.0 or abs(radii[0] - radii[1]) > ROUND_MM:
        raise GcodeError(
            f"line {reader.number}: {name} is no arc: I and J, or R, must give a centre as far from its beginning as from its end"
        )
    sweep = sweep_rad(start, end, centre, clockwise)
    points = chords(start, end, centre, sweep, chord_count(max(radii), sweep, CHORD_MM))
    reader.at[:] = before
    feed = reader.modes.feed * reader.feed_share * (-len(points) if reader.modes.inverse_time else 1)
    for k, point in enumerate(points, start=1):
        row_before, share = reader.at.copy(), k / len(points)
        others = [a + share * (b - a) for a, b in zip(before[2:], after[2:], strict=True)]
        reader.at[:] = after if k == len(points) else [*point, *others]
        reader.row(row_before, feed)


def flush(reader: Reader) -> None:
    """The turns of steppers that go on together become one row, as long as the slowest of them."""
    before, minutes = reader.at.copy(), 0.0
    for axis, value, speed_deg_s in reader.turning:
        minutes = max(minutes, abs(value - before[axis]) / speed_deg_s / 60.0)
        reader.at[axis] = value
    reader.turning.clear()
    reader.row(before, -1.0 / minutes if minutes > 0 else inf)


def push(reader: Reader, filament_mm: float, feed: float) -> None:
    """Filament alone: what G10 and G11 do."""
    before = reader.at.copy()
    reader.at[E_AXIS] += filament_mm
    reader.modes.offset[E_AXIS] -= filament_mm
    reader.row(before, feed)


def follow(reader: Reader, on: bool) -> None:
    """From here on X Y Z are places on the table (TCP), or axis positions again; nothing moves."""
    if on != reader.followed:
        reader.followed = on
        reader.switches.append(reader.table.rows)
        coordinates = np.array([reader.at[:5]])
        pose = Pose(reader.at[3], reader.at[4])
        moved = followed_places(reader.machine, pose, coordinates[:, :3]) if on else axis_positions(reader.machine, coordinates)
        reader.at[:3] = moved[0].tolist()
