"""Agreement: the deposited plastic beside the model it was made from: what is filled, what lies outside, what hangs in air."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from machine.dryrun.conformity import registration
from machine.dryrun.conformity.deposit import Share, inside_share
from machine.dryrun.conformity.filling import filled_share
from machine.dryrun.dryrun import DryRun
from machine.dryrun.findings import Finding, at_row
from machine.dryrun.placement import unsupported_mm
from mdp.mesh import Mesh
from mdp.zone import Modifier
from profiles.part_settings import process_of_part
from profiles.profile import Profile
from slicer.sectioning import reach_mm

MOST_OUTSIDE = 0.01  # of the extruded length, by more than half a line: seams, brims and thin walls stay far below
LEAST_FILLED = 0.98  # of the model at 100 % infill


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
    filled = filled_share(run, mesh, profile).share
    assert run.contacts is not None
    length, loose, reported = unsupported_mm(run.program, run.deposited, run.contacts)
    whole = max(length, 1e-9)
    moved = registration.shifts(run, mesh, profile)
    farthest = max((shift.size_mm for shift in moved), default=0.0)
    result = Agreement(filled, 1.0 - share.share, share.farthest_mm, loose / whole, reported / whole, farthest)
    processes = [profile.of_part(int(part)).process for part in set(run.program.part.tolist())]
    processes += [process_of_part(profile.process, modifier.process) for modifier in modifiers]
    solid = all(process.infill_density >= 1.0 for process in processes)
    problems = [*_findings(run, share, result, solid), *registration.findings(run, moved)]
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
