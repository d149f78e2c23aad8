"""Contact: the head against what was printed at earlier poses of the table, on every straight move.

By construction nothing printed stands above the base plane of the part being printed, so this finds what breaks that rule:
supports, skirts, wrong orders, and any program made elsewhere.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from machine.dryrun.findings import MOST, Finding, cut_short
from machine.kinematics.table import machine_points
from machine.parsed import MoveKind, ParsedProgram
from mdp.mesh import Floats
from mdp.pose import Pose
from profiles.machine import Machine

CELL_MM = 0.5
SAMPLE_MM = 1.0


@dataclass(frozen=True, eq=False)
class Stretch:
    """Consecutive rows of straight moves at one pose."""

    rows: NDArray[np.int64]
    pose: Pose


def stretches(program: ParsedProgram) -> list[Stretch]:
    """The straight moves between turns of the table."""
    turned = np.any(np.diff(program.end[:, 3:], axis=0, prepend=program.start[:1, 3:]) != 0, axis=1)
    found = []
    for rows in np.split(np.arange(len(turned)), np.flatnonzero(turned)):
        straight = rows[program.kind[rows] != MoveKind.ROTATE]
        if len(straight):
            found.append(Stretch(straight, Pose(*(float(v) for v in program.end[straight[0], 3:]))))
    return found


def findings(program: ParsedProgram, deposited: Floats, deposited_row: NDArray[np.int64], machine: Machine) -> list[Finding]:
    """Where the head runs deeper than a bead's width into earlier plastic; deposited: (m, 2, 3) segments, workpiece frame."""
    found: list[Finding] = []
    for stretch in stretches(program):
        if len(found) >= MOST:
            return [*found, cut_short(program, int(stretch.rows[0]), "moves over earlier plastic")]
        before = int(np.searchsorted(deposited_row, stretch.rows[0]))
        if before:
            width = float(program.width_mm[deposited_row[:before]].max()) or machine.head.nozzle_mm
            found += _stretch(program, stretch, deposited[:before], width, machine)
    return found


def _stretch(program: ParsedProgram, stretch: Stretch, earlier: Floats, width_mm: float, machine: Machine) -> list[Finding]:
    start, end = program.start[stretch.rows, :3], program.end[stretch.rows, :3]
    lowest = np.minimum(start[:, 2], end[:, 2])
    ends = machine_points(machine, stretch.pose, earlier.reshape(-1, 3)).reshape(-1, 2, 3)
    high = ends[:, :, 2].max(axis=1) > lowest.min() + width_mm
    if not high.any():
        return []
    peaks = _peaks(ends[high])
    low = lowest + width_mm < peaks[:, 2].max()
    silhouette = np.array(machine.head.silhouette_mm)
    boxes = np.array([[*box.min_mm, *box.max_mm] for box in machine.head.boxes]).reshape(-1, 6)
    depth = _depths(start[low], end[low], peaks, silhouette, boxes, SAMPLE_MM)
    deep = depth > width_mm
    if not deep.any():
        return []
    row = int(stretch.rows[low][deep][0])
    where = f"{machine.tilt.letter}{stretch.pose.tilt_deg:.3f} {machine.turn.letter}{stretch.pose.turn_deg:.3f}"
    message = f"the head runs {depth.max():.2f} mm deep into earlier plastic at {where} (moves: {int(deep.sum())})"
    return [Finding("error", "contact", int(program.line[row]), int(program.part[row]), int(program.layer[row]), message)]


def _peaks(segments: Floats) -> Floats:
    """(k, 3) the highest point of (m, 2, 3) segments in every cell of a lattice over X and Y."""
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    counts = np.ceil(length / CELL_MM).astype(np.int64) + 1
    which = np.repeat(np.arange(len(segments)), counts)
    step = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    share = (step / np.maximum(counts[which] - 1, 1))[:, None]
    points = segments[which, 0] + share * (segments[which, 1] - segments[which, 0])
    order = np.lexsort((-points[:, 2], *np.floor(points[:, :2] / CELL_MM).T))
    cells = np.floor(points[order, :2] / CELL_MM)
    first = np.any(np.diff(cells, axis=0, prepend=np.inf) != 0, axis=1)
    peaks: Floats = points[order][first]
    return peaks


@njit(cache=True)
def _depths(start, end, peaks, silhouette, boxes, sample_mm):  # type: ignore[no-untyped-def]
    """(n,) how deep the head goes into the peaks at most along each move; 0 when it stays clear."""
    depths = np.zeros(len(start))
    widest, top = silhouette[-1, 0], peaks[:, 2].max()
    for i in range(len(start)):
        delta = end[i] - start[i]
        count = int(np.sqrt((delta**2).sum()) / sample_mm) + 1
        for k in range(count + 1):
            tip = start[i] + delta * (k / count)
            if tip[2] >= top:
                continue
            for p in range(len(peaks)):
                rise = peaks[p, 2] - tip[2]
                if rise <= depths[i]:
                    continue
                dx, dy = peaks[p, 0] - tip[0], peaks[p, 1] - tip[1]
                r = np.sqrt(dx * dx + dy * dy)
                if r <= widest:
                    height = silhouette[0, 1] if r <= silhouette[0, 0] else np.interp(r, silhouette[:, 0], silhouette[:, 1])
                    depths[i] = max(depths[i], rise - height)
                for b in range(len(boxes)):
                    over = boxes[b, 0] <= dx <= boxes[b, 3] and boxes[b, 1] <= dy <= boxes[b, 4]
                    if over and rise < boxes[b, 5]:
                        depths[i] = max(depths[i], rise - boxes[b, 2])
    return depths
