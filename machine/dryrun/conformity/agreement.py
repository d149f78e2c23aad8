"""Agreement: the deposited plastic beside the model it was made from: what is filled, what lies outside, what hangs in air;
and by how much each part lies beside the model.

An outer wall runs half its width inside the surface. What it lies farther in or out, seen along the surface's normal, is a
constant (a compensation, the resolution) and the share of a shift along that normal: a least-squares fit over walls of all
directions tells them apart (the point-to-plane step of Chen and Medioni 1992). Walls along cuts are on no surface and are left
out by their distance; a direction in which no wall faces is not told.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.conformity.deposit import Share, inside_share, nearest_faces, signed
from machine.dryrun.conformity.filling import filled_share, printing_directions
from machine.dryrun.dryrun import DryRun
from machine.dryrun.findings import Finding, at_row
from machine.dryrun.placement import unsupported_mm
from mdp.mesh import Floats, Mesh
from mdp.zone import Modifier
from profiles.part_settings import process_of_part
from profiles.profile import Profile
from slicer.paths import Kind
from slicer.sectioning import reach_mm

WALLS = (Kind.OUTER_WALL.value, "WALL-OUTER", "Outer wall")
MOST_SHIFT_MM = 0.1
NEAR_MM = 1.5  # walls farther from where they should be are not of this surface
LEAST_MM = 0.2  # of a wall's piece
PER_PART = 3000  # pieces
FEWEST = 40
INFORMATION = 0.04  # of the pieces: a direction in which fewer face is not told
TRIMMED = 3.0  # times the usual deviation
ROUNDS = 4
MOST_OUTSIDE = 0.01  # of the extruded length, by more than half a line: seams, brims and thin walls stay far below
LEAST_FILLED = 0.98  # of the model at 100 % infill


@dataclass(frozen=True, eq=False)
class Shift:
    """(3,) mm, workpiece frame, by which a part lies beside the model; row: of its first wall."""

    part: int
    row: int
    by_mm: Floats

    @property
    def size_mm(self) -> float:
        """How far."""
        return float(np.linalg.norm(self.by_mm))


def shifts(run: DryRun, mesh: Mesh, profile: Profile) -> list[Shift]:
    """The shift of every part with enough outer walls against the closed model in the workpiece frame."""
    outer = run.program.rows_of_types(*WALLS)[run.segment_row]
    walls = np.flatnonzero(outer)
    walls = walls[run.deposited.length_mm[walls] > LEAST_MM]
    part = run.program.part[run.segment_row]
    chosen = [_evenly(walls[part[walls] == index]) for index in np.unique(part[walls])]
    if not chosen:
        return []
    pieces = np.concatenate(chosen)
    ups = printing_directions(run, profile)[pieces]
    width, height = run.deposited.sizes[run.deposited.size[pieces]].T
    points = run.deposited.segments(pieces).mean(axis=1) - 0.5 * height[:, None] * ups
    distance, face = nearest_faces(points, mesh, NEAR_MM)
    normals = mesh.normals[face]
    lateral = np.sqrt(np.maximum(0.0, 1.0 - (normals * ups).sum(axis=1) ** 2))
    beside = signed(points, distance, mesh) + 0.5 * width * lateral
    use = (distance < NEAR_MM) & (np.abs(beside) < NEAR_MM) & (lateral > 0.5)
    return [
        Shift(int(part[own[0]]), int(run.segment_row[own[0]]), by)
        for own, mine in zip(chosen, np.split(np.arange(len(pieces)), np.cumsum([len(c) for c in chosen])[:-1]), strict=True)
        if (by := fit_shift(normals[mine][use[mine]], beside[mine][use[mine]])) is not None
    ]


def _shift_findings(run: DryRun, moved: list[Shift]) -> Iterator[Finding]:
    """An error for every part that lies beside the model."""
    for shift in moved:
        if shift.size_mm > MOST_SHIFT_MM:
            by = " ".join(f"{letter}{value:+.2f}" for letter, value in zip("XYZ", shift.by_mm, strict=True))
            allowed = f"{MOST_SHIFT_MM:g} mm are allowed"
            message = f"part {shift.part} lies {shift.size_mm:.2f} mm beside the model, by {by}, {allowed}"
            yield at_row(run.program, shift.row, "error", "shift", message)


def _evenly(own: NDArray[np.int64]) -> NDArray[np.int64]:
    return own if len(own) <= PER_PART else own[np.linspace(0, len(own) - 1, PER_PART).astype(np.int64)]


def fit_shift(normals: Floats, beside: Floats) -> Floats | None:
    """(3,) shift that explains best how far (n,) walls lie outward along (n, 3) normals, beside a constant; None: too few."""
    keep = np.ones(len(beside), dtype=np.bool_)
    shift = np.zeros(3)
    for _ in range(ROUNDS):
        if keep.sum() < FEWEST:
            return None
        facing = normals[keep] - normals[keep].mean(axis=0)
        value, axis = np.linalg.eigh(facing.T @ facing / keep.sum())
        axes = axis[:, value > INFORMATION]
        along, *_ = np.linalg.lstsq(facing @ axes, beside[keep] - beside[keep].mean(), rcond=None)
        shift = axes @ along
        left = beside - normals @ shift
        left -= np.median(left[keep])
        usual = 1.4826 * float(np.median(np.abs(left[keep]))) + 1e-3
        keep = np.abs(left) < TRIMMED * usual + 0.02
    return shift


@dataclass(frozen=True)
class Agreement:
    """Shares 0..1. filled: of the model's inside that lies in a bead; outside: of the extruded length (skirt and support
    aside) that lies more than half a line outside the model, farthest_mm the worst of it; unsupported: of the extruded
    length that hangs in air where the slicer has not said so, reported: where it has. shift_mm: by which the part that lies
    farthest from its place does so.
    """

    filled: float
    outside: float
    farthest_mm: float
    unsupported: float
    reported: float
    shift_mm: float


def agreement(run: DryRun, mesh: Mesh, profile: Profile, modifiers: Sequence[Modifier] = ()) -> tuple[Agreement, DryRun]:
    """How the plastic of a dry run, one that has looked for its findings itself, agrees with the closed model (workpiece frame);
    the run with what that found added. modifiers: where the print has other settings than the profile's.

    Findings: outside and shift (errors), unfilled (warning; only at 100 % infill, for sparse infill is meant to leave room).
    """
    share = inside_share(run, mesh, 0.5 * profile.process.line_width_mm + reach_mm(profile.process))
    filled = filled_share(run, mesh, profile)
    assert run.contacts is not None
    length, loose, reported = unsupported_mm(run.program, run.deposited, run.contacts)
    whole = max(length, 1e-9)
    moved = shifts(run, mesh, profile)
    farthest = max((shift.size_mm for shift in moved), default=0.0)
    result = Agreement(filled, 1.0 - share.share, share.farthest_mm, loose / whole, reported / whole, farthest)
    processes = [profile.of_part(int(part)).process for part in set(run.program.part.tolist())]
    processes += [process_of_part(profile.process, modifier.process) for modifier in modifiers]
    solid = all(process.infill_density >= 1.0 for process in processes)
    problems = [*_findings(run, share, result, solid), *_shift_findings(run, moved)]
    return result, replace(run, findings=(*run.findings, *problems))


def _findings(run: DryRun, share: Share, result: Agreement, solid: bool) -> Iterator[Finding]:
    if result.outside > MOST_OUTSIDE:
        row = int(run.segment_row[np.flatnonzero(share.outside)[0]])
        message = (
            f"{100 * result.outside:.1f} % of the extruded length lie outside the model by more than half a line, "
            f"{result.farthest_mm:.2f} mm and more at the worst"
        )
        yield at_row(run.program, row, "error", "outside", message)
    if solid and result.filled < LEAST_FILLED:
        message = (
            f"the beads fill {100 * result.filled:.1f} % of the model, at 100 % infill {100 * LEAST_FILLED:g} % are expected"
        )
        yield Finding("warning", "unfilled", 0, 0, 0, message)
