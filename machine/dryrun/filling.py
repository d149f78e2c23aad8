"""Filling: the share of the model's inside that the deposited beads fill.

Judged at the points of a lattice inside the model. A bead counts as a bar as wide and as high as itself, in its part's printing
direction; the corners that round beads leave are filled by the plastic they push aside.
"""

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.columns import Lattice, inside_loops
from machine.dryrun.dryrun import DryRun
from mdp.kernels.arrays import floats, longs
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices, Mesh
from mdp.topology.cross_section import cross_sections, loop_edges
from slicer.paths import Kind

AROUND = (Kind.SKIRT.value, Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value, Kind.PURGE.value)
POINTS = 200_000
CELL_MM = 2.0
ROUND_MM = 0.02  # three rounded coordinates, and beads whose tops meet


def of_model(run: DryRun) -> Indices:
    """The segments that belong to the model, not to its support or skirt."""
    return np.flatnonzero(~run.program.rows_of_types(*AROUND)[run.segment_row])


def filled_share(run: DryRun, mesh: Mesh, points: int = POINTS) -> float:
    """0 to 1: the share of the closed model, in the workpiece frame, that its beads fill (support and skirt aside); 1 where it
    has no inside. points: number of lattice points, about."""
    step_mm = float(np.cbrt(max(mesh.volume_mm3, 1e-9) / points))
    low, high = mesh.bounds_mm
    filled, which = np.zeros(np.ceil((high - low) / step_mm - 0.5).astype(np.int64), np.bool_), of_model(run)
    sizes_mm = run.deposited.sizes[run.deposited.size[which]]
    fill(filled, low + 0.5 * step_mm, step_mm, run.deposited.segments(which), run.deposited.directions(which), sizes_mm)
    columns, within = Lattice(low[:2], step_mm, np.array(filled.shape[:2])), np.zeros_like(filled)
    for k, loops in enumerate(cross_sections(mesh, low[2] + step_mm * (np.arange(filled.shape[2]) + 0.5))):
        within[:, :, k] = inside_loops(loop_edges(loops), columns)
    return float(filled[within].mean()) if within.any() else 1.0


@kernel
def fill(filled: NDArray[np.bool_], origin: Floats, step: float, segments: Floats, ups: Floats, sizes: Floats) -> None:
    """Mark the points of a lattice, its least corner at the origin, that lie in one of the bars below (m, 2, 3) segments, their
    tops; ups: (m, 3) printing directions; sizes: (m, 2) widths and heights."""
    d, low, high = floats(3, 0.0), longs(3, 0), longs(3, 0)
    for i in range(len(segments)):
        a, b, up, half, height = segments[i, 0], segments[i, 1], ups[i], 0.5 * sizes[i, 0], sizes[i, 1]
        for axis in range(3):
            d[axis] = b[axis] - a[axis]
        length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        if length <= 0.0:
            continue
        for axis in range(3):
            d[axis] /= length
        reach, pieces = half + height, int(length / CELL_MM) + 1
        for k in range(pieces):
            for axis in range(3):
                u, v = a[axis] + d[axis] * length * k / pieces, a[axis] + d[axis] * length * (k + 1) / pieces
                low[axis] = max(int(np.ceil((min(u, v) - reach - origin[axis]) / step)), 0)
                high[axis] = min(int(np.floor((max(u, v) + reach - origin[axis]) / step)), filled.shape[axis] - 1)
            for p in range(low[0], high[0] + 1):
                x = origin[0] + p * step - a[0]
                for q in range(low[1], high[1] + 1):
                    y = origin[1] + q * step - a[1]
                    for r in range(low[2], high[2] + 1):
                        z = origin[2] + r * step - a[2]
                        below = -(x * up[0] + y * up[1] + z * up[2])
                        if filled[p, q, r] or below < -ROUND_MM or below > height + ROUND_MM:
                            continue
                        along = x * d[0] + y * d[1] + z * d[2]
                        beside = x * x + y * y + z * z - along * along - below * below
                        if -half <= along <= length + half and beside <= (half + ROUND_MM) ** 2:
                            filled[p, q, r] = True
