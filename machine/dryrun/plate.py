"""Plate: whether what should stick to the plate is laid on it."""

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, per_part
from machine.parsed import ParsedProgram
from mdp.mesh import Floats
from profiles.machine import Table
from profiles.profile import Profile

ROUNDING_MM = 0.02
PURGE = "Custom"  # what a start block pushes out beside the plate is meant to fall


def findings(program: ParsedProgram, segments: Floats, rows: NDArray[np.int64], profile: Profile) -> list[Finding]:
    """Strokes of the layer on the plate that lie beyond its edge: an error a part, with the farthest.

    segments: (m, 2, 3) deposited, workpiece frame; rows: (m,) their rows in the program.
    """
    heights = np.where(program.height_mm[rows] > 0, program.height_mm[rows], profile.process.first_layer_height_mm)
    purge = np.array([name == PURGE for name in program.types], dtype=np.bool_)
    lowest = segments[:, :, 2].max(axis=1) <= heights + ROUNDING_MM
    over, edge = _over_mm(segments[:, :, :2], profile.machine.table)
    beyond = lowest & ~purge[program.type[rows]] & (over > ROUNDING_MM)
    marked, badness = np.zeros(len(program.line), dtype=np.bool_), np.zeros(len(program.line))
    marked[rows[beyond]] = True
    badness[rows] = over
    message = f"the first layer reaches {{value}} mm over the plate's edge, {edge} (moves: {{count}})"
    return per_part(program, marked, badness, "error", "off-plate", message)


def _over_mm(points: Floats, table: Table) -> tuple[Floats, str]:
    """(m,) how far the farther end of (m, 2, 2) segments lies over the edge, below 0 on the plate; the edge in words."""
    if table.size_mm is None:
        over: Floats = np.hypot(points[:, :, 0], points[:, :, 1]).max(axis=1, initial=0.0) - table.radius_mm
        return over, f"{table.radius_mm:g} mm from its middle"
    x, y = table.size_mm
    over = (np.abs(points) - 0.5 * np.array([x, y])).max(axis=(1, 2), initial=-np.inf)
    return over, f"it measures {x:g} x {y:g} mm"
