"""Lift: how high the tip must be for the head to clear what stands beside a limb that is being printed."""

from collections.abc import Sequence
from math import sqrt

import numpy as np

from machine.kinematics.collision import Printed
from mdp.clearance import Standing, highest_in_cells
from mdp.decomposition import Part
from mdp.mesh import Floats
from mdp.pose import UP, Pose
from profiles.machine import Machine
from slicer.interface.interface import frame_change
from slicer.paths import SlicedPart

STEP_MM = 0.5  # between the points that sample ways and beads, and size of the cells in which only the highest point counts


def standing_beads(limb: Part, printed: Sequence[tuple[Part, SlicedPart]], machine: Machine) -> Standing:
    """The printed beads that stand above the base plane of a limb, in its frame.

    Beads less than their width above the plane are left out: they are the steps of the cut face on which the limb stands.
    """
    tops, widest_mm = [np.zeros((0, 3))], 0.0
    for part, piece in printed:
        turn, shift = frame_change(part, limb)
        for layer in piece.layers:
            placed = layer.points_mm @ turn.T + shift
            for a, b, width_mm in zip(
                layer.starts[:-1].tolist(), layer.starts[1:].tolist(), layer.width_mm.tolist(), strict=True
            ):
                if placed[a:b, 2].max() > width_mm:
                    points = _resampled(placed[a:b])
                    tops.append(points[points[:, 2] > width_mm])
                    widest_mm = max(widest_mm, width_mm)
    slack_mm = 0.5 * widest_mm + (1.0 + sqrt(0.5)) * STEP_MM  # half a step of way and of bead, half a cell's diagonal
    return Standing.of(highest_in_cells(np.concatenate(tops), STEP_MM), slack_mm, machine)


def clear_height_mm(standing: Standing, way_mm: Floats, height_mm: float) -> float:
    """The least height of at least height_mm at which the tip may go along a way (n, 2) in the limb's frame."""
    return max(height_mm, float(standing.least_tip_mm(_resampled(way_mm), height_mm).max()))


def _resampled(way_mm: Floats) -> Floats:
    """A way (n, d) with points added so that they are at most STEP_MM apart."""
    steps = np.diff(way_mm, axis=0)
    counts = np.maximum(np.ceil(np.linalg.norm(steps, axis=1) / STEP_MM), 1).astype(np.int64)
    share = (np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)) / np.repeat(counts, counts)
    points: Floats = np.repeat(way_mm[:-1], counts, axis=0) + share[:, None] * np.repeat(steps, counts, axis=0)
    return np.concatenate([points, way_mm[-1:]])


def over_print_mm(machine: Machine, printed: Printed, pose: Pose) -> float:
    """Z at which the tip clears all that is printed, wherever it goes at a pose."""
    return float(printed.reach(machine, pose, UP[None])[0]) + machine.clearance_mm
