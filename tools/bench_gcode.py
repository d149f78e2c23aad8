"""Bench of G-code: a print of a million strokes written and read back; processor seconds and memory."""

import argparse
import resource
import time

import numpy as np

from machine.firmware import dialects
from machine.gcode.reader.parse import parse_gcode
from machine.gcode.writer import elapsed_s, write_gcode
from machine.planning.moves import MARK, REORIENT, TRAVEL, BeginLayer, BeginPart, MachineProgram, Mark, Moves, Reorient
from mdp.mesh import Floats
from mdp.pose import Pose
from profiles.profile import load
from slicer.paths import NUMBER, Kind

STROKES, PER_STROKE, LAYERS_A_PART = 5000, 200, 50


def program() -> MachineProgram:
    """Five parts at five poses, twenty strokes of 200 short lines a layer."""
    chance = np.random.default_rng(1)
    start = np.array([[0.0, 0.0, 10.0]])
    pieces, marks = [_moves(TRAVEL, start, 10.0), _moves(TRAVEL, start, 10.0)], list[Mark]()
    for k in range(STROKES):
        layer, part = k // 20, k // (20 * LAYERS_A_PART)
        if k % (20 * LAYERS_A_PART) == 0:
            pose = Pose(5.0 * part, 10.0 * part)
            pieces += [_moves(REORIENT, start, 20.0), _moves(MARK, start[:0], 0.0)]
            marks += [Reorient(pose, 20.0), BeginPart(part + 1, pose, LAYERS_A_PART)]
        if k % 20 == 0:
            pieces.append(_moves(MARK, start[:0], 0.0))
            marks.append(BeginLayer(part + 1, layer % LAYERS_A_PART + 1, 0.2 * layer + 0.2, 0.2, 1.0))
        angle = np.cumsum(chance.uniform(0, 0.05, PER_STROKE + 1))
        points = np.column_stack([40 * np.cos(angle), 40 * np.sin(angle), np.full(PER_STROKE + 1, 0.2 * (layer + 1))])
        pieces.append(_moves(NUMBER[Kind.INNER_WALL], points, 40.0, 0.05, 0.45))
    return MachineProgram.of("bench", pieces, marks)


def _moves(what: int, points: Floats, speed: float, filament_mm: float = 0.0, width_mm: float = np.nan) -> Moves:
    """One move that pushes as much filament on the way to each of its points but the first."""
    pushed = np.where(np.arange(len(points)) > 0, filament_mm, 0.0)
    return Moves(np.column_stack([points, pushed]), np.array([[what, len(points), speed, width_mm, np.nan, np.inf]]))


def main() -> None:
    """Write and read, and tell how long each took."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dialect", choices=dialects(), nargs="?", default="marlin")
    parser.add_argument("coordinates", choices=("table", "workpiece"), nargs="?", default="table")
    given = parser.parse_args()
    blocks = ["machine.gcode.start=", "machine.gcode.end="]  # the example's own are Marlin's
    profile = load(settings=[f"machine.dialect={given.dialect}", f"machine.coordinates={given.coordinates}", *blocks])
    planned = program()
    marks = [time.process_time()]
    elapsed_s(planned, profile)
    marks.append(time.process_time())
    lines = write_gcode(planned, profile)
    marks.append(time.process_time())
    parsed = parse_gcode(lines, profile.machine)
    marks.append(time.process_time())
    clock, write, parse = np.diff(marks)
    write -= clock  # write_gcode works out the clock, too
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{given.dialect} {given.coordinates}: {len(lines)} lines, {len(parsed.line)} moves")
    print(f"clock {clock:.1f} s, write {write:.1f} s, parse {parse:.1f} s, peak {peak:.0f} MB")


if __name__ == "__main__":
    main()
