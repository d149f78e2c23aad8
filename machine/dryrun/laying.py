"""Laying: findings about where beads are laid: in air, in plastic already there; and the head run into earlier plastic."""

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, Severity, per_part
from machine.dryrun.ground import Ground, Laid
from machine.parsed import ParsedProgram
from mdp.mesh import Floats
from slicer.paths import Kind

TOLD = (Kind.OVERHANG.value, Kind.BRIDGE.value)  # the slicer itself says that these hang
PURGE = "Custom"  # what a start block pushes out beside the plate is meant to fall
ERROR_SHARE, WARNING_SHARE = 0.05, 0.01  # of a part's length in air
LOST_SHARE = 0.5  # of a part's first layer without anything under it
TAKEN_SHARE = 0.4  # of a layer's length in room already filled
LEAST_MM = 10.0


def findings(program: ParsedProgram, deposited: Laid, ground: Ground) -> list[Finding]:
    """Errors and warnings of code air, filled and contact, one a part; not-tested where the table turns too often."""
    length = np.zeros(len(program.line))
    length[deposited.rows] = np.linalg.norm(deposited.segments_mm[:, 1] - deposited.segments_mm[:, 0], axis=1)
    deep = "the head runs {value} mm deep into earlier plastic (moves: {count})"
    found = per_part(program, ground.depth_mm > 0.0, ground.depth_mm, "error", "contact", deep)
    found += [*_in_air(program, length, ground), *_in_plastic(program, length, ground)]
    if ground.untested_row >= 0:
        row = ground.untested_row
        message = "the table turns too often: from here on no move was tried against earlier plastic"
        place = (int(program.line[row]), int(program.part[row]), int(program.layer[row]))
        found.append(Finding("warning", "not-tested", *place, message))
    return found


def _in_air(program: ParsedProgram, length: Floats, ground: Ground) -> list[Finding]:
    """Parts with too much that hangs where the slicer has not said so, and parts that begin in air."""
    own = ~_named(program, (PURGE,))
    hanging = np.where(own & ~_named(program, TOLD), ground.air_mm, 0.0)
    found = []
    for part in np.unique(program.part[hanging > 0.0]):
        mine = own & (program.part == part)
        whole, loose = float(length[mine].sum()), float(hanging[mine].sum())
        begins = mine & (program.layer == program.layer[mine & (length > 0)].min())
        first = float((ground.air_mm + ground.beside_mm)[begins].sum())
        lost = first > max(LEAST_MM, LOST_SHARE * float(length[begins].sum()))
        if not (lost or loose > max(LEAST_MM, WARNING_SHARE * whole)):
            continue
        severity: Severity = "error" if lost or loose > ERROR_SHARE * whole else "warning"
        message = f"{loose:.1f} mm of {whole:.0f} mm are extruded into air, nothing lies under or beside them"
        if lost:
            message = f"the part begins in air: {first:.1f} mm of its first layer have nothing under them"
        found.append(_at(program, begins & (ground.air_mm > 0) if lost else mine & (hanging > 0), severity, "air", message))
    return found


def _in_plastic(program: ParsedProgram, length: Floats, ground: Ground) -> list[Finding]:
    """The first layer of every part in which a great share of the beads finds its room taken."""
    counted = ~_named(program, (PURGE,)) & (length > 0)
    group = program.part * (int(program.layer.max(initial=0)) + 1) + program.layer
    taken = np.bincount(group[counted], weights=ground.taken_mm[counted])
    whole = np.bincount(group[counted], weights=length[counted])
    bad = np.flatnonzero((taken > LEAST_MM) & (taken > TAKEN_SHARE * whole))
    found = []
    for first in dict.fromkeys(int(program.part[np.flatnonzero(group == g)[0]]) for g in bad):
        groups = [g for g in bad if program.part[np.flatnonzero(group == g)[0]] == first]
        amount = float(taken[groups].sum())
        message = f"{amount:.1f} mm are extruded where plastic already is (layers: {len(groups)})"
        rows = counted & np.isin(group, groups) & (ground.taken_mm > 0)
        found.append(_at(program, rows, "error", "filled", message))
    return found


def _named(program: ParsedProgram, names: tuple[str, ...]) -> NDArray[np.bool_]:
    marked: NDArray[np.bool_] = np.array([name in names for name in program.types], dtype=np.bool_)[program.type]
    return marked


def _at(program: ParsedProgram, rows: NDArray[np.bool_], severity: Severity, code: str, message: str) -> Finding:
    row = int(np.flatnonzero(rows)[0])
    return Finding(severity, code, int(program.line[row]), int(program.part[row]), int(program.layer[row]), message)


def unsupported_mm(program: ParsedProgram, deposited: Laid, ground: Ground) -> tuple[float, float, float]:
    """Lengths, mm: extruded, in air where the slicer has not said so, in air where it has."""
    own = ~_named(program, (PURGE,))
    told = _named(program, TOLD)
    length = np.linalg.norm(deposited.segments_mm[:, 1] - deposited.segments_mm[:, 0], axis=1)[own[deposited.rows]]
    return float(length.sum()), float(ground.air_mm[own & ~told].sum()), float(ground.air_mm[own & told].sum())
