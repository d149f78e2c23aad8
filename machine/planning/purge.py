"""Purge: where on the plate a line is printed before the print begins, which fills the nozzle and wipes it."""

from collections.abc import Sequence
from itertools import pairwise, product
from math import sqrt

import numpy as np

from machine.kinematics.table import machine_points, part_shift, workpiece_points
from machine.planning.limits import axis_limits
from machine.planning.moves import MachineProgram
from machine.planning.park_position import is_way_clear
from mdp.decomposition import Part
from mdp.mesh import Floats
from mdp.pose import level
from profiles.machine import Machine
from profiles.profile import Profile
from slicer.paths import NUMBER, Kind, SlicedPart

WIDTH = 2.0  # of the line, in nozzles: a fat bead fills the nozzle soon and is peeled off whole
EDGE_MM, GAP_MM = 1.0, 3.0  # kept to the plate's edge and to what is printed near the plate
LOW_MM = 2.0  # what is printed higher above the plate passes over the line
MOST_LANES, SHORTEST_MM = 4, 10.0
OUTWARD = np.array([[0.0, -1.0], [-1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])  # front, left, right, rear: the front is seen first


def purge_width_mm(profile: Profile) -> float:
    """Width of the line."""
    return WIDTH * profile.machine.head.nozzle_mm


def purge_lanes(parts: Sequence[Part], sliced: Sequence[SlicedPart], profile: Profile) -> Floats | None:
    """(n, 3) machine points of the line, in one lane or folded into up to four, along the plate's edge; None: there is no room.

    It keeps off everything that any part prints near the plate, and the head off the cradle.
    """
    machine, length_mm = profile.machine, profile.machine.purge_mm
    if length_mm <= 0.0:
        return None
    low, width_mm, z_mm = _low_strokes(parts, sliced, machine), purge_width_mm(profile), profile.process.first_layer_height_mm
    pose, (least, most) = level(machine), np.array(list(axis_limits(machine).values())[:3]).T
    for count, outward in product(range(1, MOST_LANES + 1), OUTWARD):
        lanes = _lanes(machine, outward, count, length_mm / count, width_mm)
        if lanes is None or (count > 1 and length_mm / count < SHORTEST_MM) or _touches(low, lanes, 0.5 * width_mm + GAP_MM):
            continue
        points = machine_points(machine, pose, np.column_stack([lanes, np.full(len(lanes), z_mm)]))
        reached = bool(((points >= least) & (points <= most)).all())
        if reached and all(is_way_clear(machine, pose, a, b) for a, b in pairwise(points)):
            return points
    return None


def has_purge(program: MachineProgram) -> bool:
    """Whether a program prints the line."""
    return bool((program.what == NUMBER[Kind.PURGE]).any())


def _low_strokes(parts: Sequence[Part], sliced: Sequence[SlicedPart], machine: Machine) -> Floats:
    """(m, 2, 2) ends, seen from above, of all beads near the plate, workpiece frame."""
    beads = [np.zeros((0, 2, 2))]
    for piece in sliced:
        part = next(part for part in parts if part.index == piece.index)
        ends = np.cumsum(np.concatenate([np.diff(layer.starts) for layer in piece.layers])) - 1
        placed = workpiece_points(machine, part.pose, piece.points_mm + part_shift(machine, part.pose, part.base.offset_mm))
        low = np.minimum(placed[:-1, 2], placed[1:, 2]) < LOW_MM
        low[ends[:-1]] = False  # nothing leads from a stroke's last point to the next stroke
        beads.append(np.stack([placed[:-1][low, :2], placed[1:][low, :2]], axis=1))
    return np.concatenate(beads)


def _lanes(machine: Machine, outward: Floats, count: int, length_mm: float, width_mm: float) -> Floats | None:
    """(2 count, 2) workpiece points of lanes across a direction, as far out on the plate as they fit."""
    half, deep = 0.5 * (length_mm + width_mm), count * width_mm
    if machine.table.size_mm is None:
        radius = machine.table.radius_mm - EDGE_MM
        edge = sqrt(radius**2 - half**2) if half < radius else 0.0
    else:
        along, across = (float(np.abs(outward) @ machine.table.size_mm[::step]) for step in (1, -1))
        edge = 0.5 * along - EDGE_MM if half <= 0.5 * across - EDGE_MM else 0.0
    if edge - deep <= 0.0:
        return None
    sideways = np.array([-outward[1], outward[0]])
    away = edge - width_mm * (np.repeat(np.arange(count), 2) + 0.5)
    turns = 0.5 * length_mm * np.array([-1.0, 1.0, 1.0, -1.0] * count)[: 2 * count]
    lanes: Floats = away[:, None] * outward + turns[:, None] * sideways
    return lanes


def _touches(beads: Floats, lanes: Floats, gap_mm: float) -> bool:
    """Whether any bead meets the lanes' box grown by a gap."""
    low, high = lanes.min(axis=0) - gap_mm, lanes.max(axis=0) + gap_mm
    begin, step = beads[:, 0], beads[:, 1] - beads[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        first, last = (low - begin) / step, (high - begin) / step
    parallel = np.abs(step) < 1e-12
    inside = (begin >= low) & (begin <= high)
    enter = np.where(parallel, np.where(inside, -np.inf, np.inf), np.minimum(first, last)).max(axis=1, initial=-np.inf)
    leave = np.where(parallel, np.where(inside, np.inf, -np.inf), np.maximum(first, last)).min(axis=1, initial=np.inf)
    return bool(((enter <= leave) & (enter <= 1.0) & (leave >= 0.0)).any())
