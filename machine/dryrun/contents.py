"""Contents: findings about parts whose beads do not come to what the file tells of them, and about parts that are missing."""

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, at_row
from machine.gcode.contents import Contents
from machine.reader.parsed import MoveKind, ParsedProgram
from slicer.paths import Kind

PLACE_MM = 0.02  # rounded coordinates, arcs read as chords, followed places taken back to axis positions
FILAMENT_SHARE, FILAMENT_MM = 2e-3, 0.05


def findings(program: ParsedProgram) -> list[Finding]:
    """Errors of code contents and missing."""
    beads = (program.kind == MoveKind.EXTRUDE) & (program.part > 0) & ~program.rows_of_types(Kind.PURGE.value)
    problems = _missing(program, beads)
    for told in program.contents:
        rows = np.flatnonzero(beads & (program.part == told.part))
        if len(rows):
            problems += _of_part(program, rows, told)
    return problems


def _missing(program: ParsedProgram, beads: NDArray[np.bool_]) -> list[Finding]:
    """The parts of which nothing is printed, of those that `;PART:1 of 3` tells."""
    printed = set(np.unique(program.part[beads]).tolist())
    absent = [index for index in range(1, program.announced + 1) if index not in printed]
    if not absent:
        return []
    line = int(program.line[-1]) if len(program.line) else 0
    names = f"part {absent[0]}" if len(absent) == 1 else f"parts {', '.join(map(str, absent[:10]))}"
    message = f"nothing of {names} is printed: the file tells of {program.announced} parts, beads are laid of {len(printed)}"
    return [Finding("error", "missing", line, absent[0], 0, message)]


def _of_part(program: ParsedProgram, rows: NDArray[np.int64], told: Contents) -> list[Finding]:
    """What differs in a part: its layers, its filament, where it lies."""
    problems = []
    layers = len(np.unique(program.layer[rows]))
    if layers != told.layers:
        message = f"beads are laid in {layers} layers of part {told.part}, the file tells of {told.layers}"
        problems.append(at_row(program, int(rows[-1]), "error", "contents", message))
    pushed = float(program.e_mm[rows].sum())
    if abs(pushed - told.filament_mm) > max(FILAMENT_MM, FILAMENT_SHARE * told.filament_mm):
        message = f"part {told.part} pushes {pushed:.2f} mm of filament, the file tells of {told.filament_mm:.2f} mm"
        problems.append(at_row(program, int(rows[0]), "error", "contents", message))
    ends = np.stack([program.start[rows, :3], program.end[rows, :3]])
    bounds = np.stack([ends.min(axis=(0, 1)), ends.max(axis=(0, 1))])
    apart = bounds - told.bounds_mm
    if np.abs(apart).max() <= PLACE_MM:
        return problems
    side, axis = (int(v) for v in np.unravel_index(np.abs(apart).argmax(), apart.shape))
    extreme = np.abs(ends[:, :, axis] - bounds[side, axis]).min(axis=0).argmin()
    moved = f"part {told.part} lies {abs(apart[side, axis]):.2f} mm aside" if _is_shift(apart) else f"part {told.part} reaches"
    message = (
        f"{moved} to {'XYZ'[axis]}{bounds[side, axis]:.3f}, the file tells of {'XYZ'[axis]}{told.bounds_mm[side, axis]:.3f} "
        f"({PLACE_MM:g} mm are allowed)"
    )
    row = int(rows[0] if _is_shift(apart) else rows[extreme])
    return [*problems, at_row(program, row, "error", "contents", message)]


def _is_shift(apart: NDArray[np.float64]) -> bool:
    """True where both sides of a part are moved alike."""
    return bool(np.abs(apart[0] - apart[1]).max() <= PLACE_MM)
