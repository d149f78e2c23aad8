"""Plate: whether what should stick to the plate is laid on it."""

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, per_part
from machine.parsed import ParsedProgram
from mdp.mesh import Floats
from profiles.profile import Profile

ROUNDING_MM = 0.02
PURGE = "Custom"  # what a start block pushes out beside the plate is meant to fall


def findings(program: ParsedProgram, segments: Floats, rows: NDArray[np.int64], profile: Profile) -> list[Finding]:
    """Strokes of the layer on the plate that lie beyond its edge: an error a part, with the greatest radius.

    segments: (m, 2, 3) deposited, workpiece frame; rows: (m,) their rows in the program.
    """
    heights = np.where(program.height_mm[rows] > 0, program.height_mm[rows], profile.process.first_layer_height_mm)
    purge = np.array([name == PURGE for name in program.types], dtype=np.bool_)
    lowest = segments[:, :, 2].max(axis=1) <= heights + ROUNDING_MM
    radii = np.hypot(segments[:, :, 0], segments[:, :, 1]).max(axis=1, initial=0.0)
    radius = profile.machine.table.radius_mm
    beyond = lowest & ~purge[program.type[rows]] & (radii > radius + ROUNDING_MM)
    marked, badness = np.zeros(len(program.line), dtype=np.bool_), np.zeros(len(program.line))
    marked[rows[beyond]] = True
    badness[rows] = radii
    message = f"the first layer reaches {{value}} mm from the middle, the plate's radius is {radius:g} mm (moves: {{count}})"
    return per_part(program, marked, badness, "error", "off-plate", message)
