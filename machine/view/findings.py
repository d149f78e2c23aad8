"""Findings: what the dry run complains about, with the place on the path where each begins."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.dryrun import DryRun
from machine.dryrun.findings import Finding
from machine.gcode.reader.parsed import MoveKind, ParsedProgram
from machine.kinematics.table import workpiece_path
from profiles.machine import Machine

MACHINES_OWN = frozenset({"axis-limit", "axis-speed", "collision", "contact", "off-plate", "uncalibrated"})


def relevant_findings(run: DryRun, known: bool) -> list[Finding]:
    """The findings in their order; known: False leaves out what only the right machine could tell."""
    return [finding for finding in run.findings if known or finding.code not in MACHINES_OWN]


def finding_records(run: DryRun, machine: Machine, known: bool, shown: NDArray[np.int64]) -> list[dict[str, Any]]:
    """The relevant findings as the page has them; row: where it is shown, -1 for a finding about the whole."""
    program = run.program
    records = []
    for finding in relevant_findings(run, known):
        row = _row(program, finding)
        shown_row = min(int(np.searchsorted(shown, row)), len(shown) - 1) if row < len(program.line) else -1
        points: dict[str, Any] = {"workpiece_mm": None, "machine_mm": None}
        if shown_row >= 0:
            at = program.end[row : row + 1]
            points = {"workpiece_mm": workpiece_path(machine, at)[0].tolist(), "machine_mm": at[0, :3].tolist()}
        records.append(
            {
                "severity": finding.severity, "code": finding.code, "message": finding.message, "line": finding.line,
                "part": finding.part, "layer": finding.layer, "row": shown_row,
            } | points
        )  # fmt: skip
    return records


def _row(program: ParsedProgram, finding: Finding) -> int:
    """The first row from the finding's line on, or of the layer it names when that lies elsewhere; n for one about the whole."""
    if finding.line <= 0:
        return len(program.line)
    row = int(np.searchsorted(program.line, finding.line))
    there = (program.part == finding.part) & (program.layer == finding.layer)
    if finding.layer > 0 and there.any() and not there[row : row + 1].any():
        strokes = np.flatnonzero(there & (program.kind == MoveKind.EXTRUDE))
        return int(strokes[0]) if len(strokes) else int(np.argmax(there))
    return row
