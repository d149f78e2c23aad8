"""Placement: findings about where beads are laid (off the plate, in air, overlapping) and the head in earlier plastic."""

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, Severity, per_part
from machine.dryrun.replay import Beads, Contacts
from machine.reader.parsed import ParsedProgram
from mdp.mesh import Floats
from profiles.machine import Table
from profiles.profile import Profile
from slicer.paths import Kind

HANGING = (Kind.OVERHANG.value, Kind.BRIDGE.value)  # the slicer itself says that these hang
SUPPORT = (Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value)
IRONING = Kind.IRONING.value  # goes over what has been laid
PURGE = Kind.PURGE.value  # what a start block pushes out beside the plate is meant to fall
ERROR_SHARE, WARNING_SHARE = 0.05, 0.01  # of a part's length in air
LOST_SHARE = 0.5  # of a part's first layer without anything under it
OVERLAPPING_SHARE = 0.4  # of a layer's length
LEAST_MM = 10.0
ROUNDING_MM = 0.02


def findings(program: ParsedProgram, deposited: Beads, contacts: Contacts) -> list[Finding]:
    """Errors and warnings of code air, filled and contact, one a part; not-tested where the table turns too often."""
    length = np.zeros(len(program.line))
    length[deposited.rows] = np.linalg.norm(deposited.segments_mm[:, 1] - deposited.segments_mm[:, 0], axis=1)
    deep = "the head runs {value} mm deep into earlier plastic (moves: {count})"
    problems = per_part(program, contacts.depth_mm > 0.0, contacts.depth_mm, "error", "contact", deep)
    problems += [*_in_air(program, length, contacts), *_in_plastic(program, length, contacts)]
    if contacts.untested_row >= 0:
        row = contacts.untested_row
        message = "the table turns too often: from here on no move was tried against earlier plastic"
        place = (int(program.line[row]), int(program.part[row]), int(program.layer[row]))
        problems.append(Finding("warning", "not-tested", *place, message))
    return problems


def _in_air(program: ParsedProgram, length: Floats, contacts: Contacts) -> list[Finding]:
    """Parts with too much that hangs where the slicer has not said so, and parts that begin in air."""
    own = ~program.rows_of_types(PURGE)
    hanging = np.where(own & ~program.rows_of_types(*HANGING), contacts.air_mm, 0.0)
    support = program.rows_of_types(*SUPPORT)
    problems = []
    for part in np.unique(program.part[hanging > 0.0]):
        mine = own & (program.part == part)
        whole, loose = float(length[mine].sum()), float(hanging[mine].sum())
        begins = mine & (program.layer == program.layer[mine & (length > 0)].min())
        first = float((contacts.air_mm + contacts.beside_mm)[begins].sum())
        lost = first > max(LEAST_MM, LOST_SHARE * float(length[begins].sum()))
        if not (lost or loose > max(LEAST_MM, WARNING_SHARE * whole)):
            continue
        severity: Severity = "error" if lost or loose > ERROR_SHARE * whole else "warning"
        of_support = float(hanging[mine & support].sum())
        message = f"{loose:.1f} mm of {whole:.0f} mm are extruded into air, nothing lies under or beside them: "
        message += f"{loose - of_support:.1f} mm of the part, {of_support:.1f} mm of its support"
        if lost:
            message = f"the part begins in air: {first:.1f} mm of its first layer have nothing under them"
        problems.append(_at(program, begins & (contacts.air_mm > 0) if lost else mine & (hanging > 0), severity, "air", message))
    return problems


def _in_plastic(program: ParsedProgram, length: Floats, contacts: Contacts) -> list[Finding]:
    """The first layer of every part in which a great share of the beads finds its room taken."""
    counted = ~program.rows_of_types(PURGE, IRONING) & (length > 0)
    group = program.part * (int(program.layer.max(initial=0)) + 1) + program.layer
    overlapping = np.bincount(group[counted], weights=contacts.overlapping_mm[counted])
    whole = np.bincount(group[counted], weights=length[counted])
    bad = np.flatnonzero((overlapping > LEAST_MM) & (overlapping > OVERLAPPING_SHARE * whole))
    problems = []
    for first in dict.fromkeys(int(program.part[np.flatnonzero(group == g)[0]]) for g in bad):
        groups = [g for g in bad if program.part[np.flatnonzero(group == g)[0]] == first]
        amount = float(overlapping[groups].sum())
        message = f"{amount:.1f} mm are extruded where plastic already is (layers: {len(groups)})"
        rows = counted & np.isin(group, groups) & (contacts.overlapping_mm > 0)
        problems.append(_at(program, rows, "error", "filled", message))
    return problems


def _at(program: ParsedProgram, rows: NDArray[np.bool_], severity: Severity, code: str, message: str) -> Finding:
    row = int(np.flatnonzero(rows)[0])
    return Finding(severity, code, int(program.line[row]), int(program.part[row]), int(program.layer[row]), message)


def unsupported_mm(program: ParsedProgram, deposited: Beads, contacts: Contacts) -> tuple[float, float, float]:
    """Lengths, mm: extruded, in air where the slicer has not said so, in air where it has."""
    own = ~program.rows_of_types(PURGE)
    reported = program.rows_of_types(*HANGING)
    length = np.linalg.norm(deposited.segments_mm[:, 1] - deposited.segments_mm[:, 0], axis=1)[own[deposited.rows]]
    return float(length.sum()), float(contacts.air_mm[own & ~reported].sum()), float(contacts.air_mm[own & reported].sum())


def off_plate(program: ParsedProgram, segments: Floats, rows: NDArray[np.int64], profile: Profile) -> list[Finding]:
    """Strokes of the layer on the plate that lie beyond its edge: an error a part, with the farthest.

    segments: (m, 2, 3) deposited, workpiece frame; rows: (m,) their rows in the program.
    """
    heights = np.where(program.height_mm[rows] > 0, program.height_mm[rows], profile.process.first_layer_height_mm)
    lowest = segments[:, :, 2].max(axis=1) <= heights + ROUNDING_MM
    over, edge = _over_mm(segments[:, :, :2], profile.machine.table)
    beyond = lowest & ~program.rows_of_types(PURGE)[rows] & (over > ROUNDING_MM)
    marked, badness = np.zeros(len(program.line), dtype=np.bool_), np.zeros(len(program.line))
    marked[rows[beyond]] = True
    badness[rows] = over
    message = f"the first layer reaches {{value}} mm over the plate's edge, {edge} (moves: {{count}})"
    return per_part(program, marked, badness, "error", "off-plate", message)


def _over_mm(points: Floats, table: Table) -> tuple[Floats, str]:
    """(m,) how far the farther end of (m, 2, 2) segments lies over the edge, below 0 on the plate; the edge in words."""
    if table.size_mm is None:
        over: Floats = np.hypot(points[:, :, 0], points[:, :, 1]).max(axis=1, initial=0.0) - table.radius_mm
        return over, f"{table.radius_mm:g} mm from its middle"
    x, y = table.size_mm
    over = (np.abs(points) - 0.5 * np.array([x, y])).max(axis=(1, 2), initial=-np.inf)
    return over, f"it measures {x:g} x {y:g} mm"
