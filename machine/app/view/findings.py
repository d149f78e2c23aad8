"""Findings: what the dry run complains about, with the place on the path where each begins."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.dryrun import DryRun
from machine.kinematics.table import workpiece_path
from profiles.machine import Machine

MACHINES_OWN = frozenset({"axis-limit", "axis-speed", "collision", "contact", "off-plate", "uncalibrated"})


def placed(run: DryRun, machine: Machine, known: bool, kept: NDArray[np.int64]) -> list[dict[str, Any]]:
    """The findings in their order; row: the first row kept from the finding's line on, -1 for one about the whole.

    known: False leaves out what only the right machine could tell.
    """
    program = run.program
    told = []
    for finding in run.findings if known else [f for f in run.findings if f.code not in MACHINES_OWN]:
        row = int(np.searchsorted(program.line, finding.line)) if finding.line > 0 else len(program.line)
        place = min(int(np.searchsorted(kept, row)), len(kept) - 1) if row < len(program.line) else -1
        places: dict[str, Any] = {"workpiece_mm": None, "machine_mm": None}
        if place >= 0:
            at = program.end[row : row + 1]
            places = {"workpiece_mm": workpiece_path(machine, at)[0].tolist(), "machine_mm": at[0, :3].tolist()}
        told.append(
            {
                "severity": finding.severity, "code": finding.code, "message": finding.message, "line": finding.line,
                "part": finding.part, "layer": finding.layer, "row": place,
            } | places
        )  # fmt: skip
    return told
