"""Filling: what share of the model's inside the deposited beads fill.

Judged at the points of a lattice inside the model. A bead is taken as what its neighbours leave of it: a bar as wide and as high
as the bead, lying in its part's own direction; the corners that round beads leave are filled by the plastic they push aside.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.conformity.deposit import AROUND, inside
from machine.dryrun.dryrun import DryRun
from machine.gcode.reader.parsed import pose_runs
from mdp.kernels.arrays import flags, floats, longs
from mdp.kernels.kernel import kernel, no_nrt
from mdp.mesh import Floats, Mesh
from mdp.pose import rotation
from profiles.profile import Profile

POINTS = 200_000
CELL_MM = 2.0
MOST_CELLS = 20_000_000
ROUND_MM = 0.02  # three rounded coordinates, and beads whose tops meet


def filled_share(run: DryRun, mesh: Mesh, profile: Profile, points: int = POINTS) -> float:
    """0 to 1: how much of the closed model, in the workpiece frame, the beads of its own fill (support and skirt aside); 1 where
    it has no inside. points: at about how many that is judged."""
    places = lattice(mesh, points)
    own = np.flatnonzero([name not in AROUND for name in run.segment_type])
    width_mm, height_mm = run.deposited.sizes[run.deposited.size[own]].T
    hit = in_beads(places, run.deposited.segments(own), printing_directions(run, profile)[own], width_mm, height_mm)
    return float(hit.mean()) if len(places) else 1.0


def lattice(mesh: Mesh, points: int) -> Floats:
    """(n, 3) points inside a closed mesh, evenly spread, about `count` of them."""
    low, high = mesh.bounds_mm
    step = float(np.cbrt(max(mesh.volume_mm3, 1e-9) / points))
    axes = [np.arange(a + 0.5 * step, b, step) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    within: Floats = grid[inside(grid, mesh)]
    return within


def printing_directions(run: DryRun, profile: Profile) -> Floats:
    """(m, 3) printing direction of each segment, workpiece frame."""
    ups = np.zeros((len(run.segment_row), 3))
    for rows, pose in pose_runs(run.program):
        first, last = np.searchsorted(run.segment_row, (rows.start, rows.stop))
        ups[first:last] = rotation(profile.machine, pose)[2]
    return ups


def in_beads(places: Floats, segments: Floats, ups: Floats, width: Floats, height: Floats) -> NDArray[np.bool_]:
    """(n,) whether (n, 3) places lie in one of the bars below (m, 2, 3) segments, their tops."""
    if not len(segments) or not len(places):
        return np.zeros(len(places), dtype=np.bool_)
    origin = places.min(axis=0) - 1.0
    size = places.max(axis=0) + 1.0 - origin
    cell = max(CELL_MM, float(np.cbrt(size.prod() / MOST_CELLS)))
    shape = (np.floor(size / cell) + 1).astype(np.int64)
    cells = np.floor((places - origin) / cell).astype(np.int64)
    key = (cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2]
    order = np.argsort(key, kind="stable")
    first = np.searchsorted(key[order], np.arange(shape.prod() + 1))
    marked: NDArray[np.bool_] = _places_in_bars(Places(places, order, first, origin, cell, shape), segments, ups, width, height)
    return marked


class Places(NamedTuple):
    """(n, 3) places sorted into cubes: those of cube k are order[first[k] : first[k + 1]]."""

    points: Floats
    order: NDArray[np.int64]
    first: NDArray[np.int64]
    origin: Floats
    cell: float
    shape: NDArray[np.int64]


class Bar(NamedTuple):
    """What lies below a segment that begins at a and goes along the unit vector d."""

    a: Floats
    d: Floats
    length: float
    up: Floats
    half: float
    height: float


@no_nrt
def _in_bar(p: Floats, bar: Bar) -> bool:
    """True when a point lies in the bar."""
    d, up, half = bar.d, bar.up, bar.half
    x, y, z = p[0] - bar.a[0], p[1] - bar.a[1], p[2] - bar.a[2]
    below = -(x * up[0] + y * up[1] + z * up[2])
    if below < -ROUND_MM or below > bar.height + ROUND_MM:
        return False
    along = x * d[0] + y * d[1] + z * d[2]
    if along < -half or along > bar.length + half:
        return False
    side = x * x + y * y + z * z - along * along - below * below
    return bool(side <= (half + ROUND_MM) * (half + ROUND_MM))


@kernel
def _places_in_bars(places: Places, segments: Floats, ups: Floats, width: Floats, height: Floats) -> NDArray[np.bool_]:
    """(n,) which places lie in a bar: those of the cubes that its box touches are tried, piece by piece."""
    hit, d, low, high = flags(len(places.points)), floats(3, 0.0), longs(3, 0), longs(3, 0)
    origin, cell, shape = places.origin, places.cell, places.shape
    for i in range(len(segments)):
        a, b = segments[i, 0], segments[i, 1]
        for axis in range(3):
            d[axis] = b[axis] - a[axis]
        length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        if length <= 0.0:
            continue
        for axis in range(3):
            d[axis] /= length
        bar = Bar(a, d, length, ups[i], 0.5 * width[i], height[i])
        reach = 0.5 * width[i] + height[i]
        pieces = int(length / cell) + 1
        for k in range(pieces):
            for axis in range(3):
                u, v = a[axis] + d[axis] * length * k / pieces, a[axis] + d[axis] * length * (k + 1) / pieces
                low[axis] = max(int(np.floor((min(u, v) - reach - origin[axis]) / cell)), 0)
                high[axis] = min(int(np.floor((max(u, v) + reach - origin[axis]) / cell)), shape[axis] - 1)
            for x in range(low[0], high[0] + 1):
                for y in range(low[1], high[1] + 1):
                    base = (x * shape[1] + y) * shape[2]
                    for q in range(places.first[base + low[2]], places.first[base + high[2] + 1]):
                        p = places.order[q]
                        if not hit[p] and _in_bar(places.points[p], bar):
                            hit[p] = True
    return hit
