"""Placement: findings about the places of beads (off the plate, in air, overlapping) and about the head in earlier plastic."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, Severity, at_row, by_part, per_part
from machine.dryrun.replay import Contacts
from machine.dryrun.strokes import CROSSING_MM, ON_PLATE, SUPPORT, Beads, highest_of
from machine.gcode.reader.parsed import ParsedProgram, pieces
from machine.planning.limits import over_edge_mm
from machine.quantities import amount
from mdp.mesh import Floats
from profiles.profile import Profile
from slicer.paths import Kind

HANGING = (Kind.OVERHANG.value, Kind.BRIDGE.value)  # declared as hanging by the slicer
IRONING = Kind.IRONING.value  # passes over existing plastic
PURGE = Kind.PURGE.value  # a start block's purge beside the plate is meant to fall
ERROR_SHARE, WARNING_SHARE = 0.05, 0.01  # shares of a part's length that are in air
LOST_SHARE = 0.5  # share of a part's first layer without anything below it
OVERLAPPING_SHARE = 0.4  # share of a layer's length
LEAST_MM = 10.0
STRETCH_MM = 30.0  # length of consecutive beads in air
HANGING_SHARE = 0.8  # share of a move's length
ROUNDING_MM = 0.02


def findings(program: ParsedProgram, deposited: Beads, contacts: Contacts) -> Iterator[Finding]:
    """Errors and warnings of code air, filled, contact and low-travel, one per part; not-tested if the table turns too often."""
    length = np.zeros(len(program.line))
    length[deposited.rows] = deposited.length_mm
    deep = "the head runs {value} mm deep into earlier plastic (moves: {count})"
    into = np.flatnonzero(contacts.depth_mm > 0.0)
    yield from per_part(program, into, contacts.depth_mm[into], deep, code="contact")
    yield from _too_low(program, contacts)
    yield from _in_air(program, length, contacts)
    yield from _in_plastic(program, length, contacts)
    if contacts.untested_row >= 0:
        message = "the table turns too often: later moves were not tested against earlier plastic"
        yield at_row(program, contacts.untested_row, "warning", "not-tested", message)


def _too_low(program: ParsedProgram, contacts: Contacts) -> Iterator[Finding]:
    """In every part the first move to or from a turn of the table that does not pass above the print."""
    for rows in by_part(program, np.flatnonzero(contacts.close_mm > 0.0)):
        left = max(CROSSING_MM - float(contacts.close_mm[rows].max()), 0.0)
        message = (
            f"the tip crosses the print {amount(left)} mm above it on the way to or from a turn of the table, {CROSSING_MM:g} mm "
            f"are needed (moves: {len(rows)})"
        )
        yield at_row(program, int(rows[0]), "error", "low-travel", message)


def _in_air(program: ParsedProgram, length: Floats, contacts: Contacts) -> Iterator[Finding]:
    """Parts with too much undeclared overhang, and parts that begin in air."""
    own = ~program.rows_of_types(PURGE)
    hanging = np.where(own & ~program.rows_of_types(*HANGING), contacts.air_mm, 0.0)
    support = program.rows_of_types(*SUPPORT)
    for part in np.unique(program.part[hanging > 0.0]):
        mine = own & (program.part == part)
        whole, loose = float(length[mine].sum()), float(hanging[mine].sum())
        begins = mine & (program.layer == program.layer[mine & (length > 0)].min())
        first = float((contacts.air_mm + contacts.beside_mm)[begins].sum())
        lost = first > max(LEAST_MM, LOST_SHARE * float(length[begins].sum()))
        stretch, at = _longest_mm(hanging, length, mine)
        if not (lost or stretch > STRETCH_MM or loose > max(LEAST_MM, WARNING_SHARE * whole)):
            continue
        grave = lost or loose > ERROR_SHARE * whole or stretch > STRETCH_MM
        severity: Severity = "error" if grave else "warning"
        of_support = float(hanging[mine & support].sum())
        at_once = (
            f", {amount(stretch, 1)} mm of it in one stretch ({STRETCH_MM:g} mm are allowed)" if stretch > STRETCH_MM else ""
        )
        message = (
            f"{amount(loose, 1)} mm of {amount(whole, 0)} mm are extruded into air{at_once}, nothing lies under or beside them: "
        )
        message += f"{amount(loose - of_support, 1)} mm of the part, {amount(of_support, 1)} mm of its support"
        if lost:
            message = f"the part begins in air: {amount(first, 1)} mm of its first layer have nothing under them"
        rows = begins & (contacts.air_mm > 0) if lost else mine & (hanging > 0)
        row = at if stretch > STRETCH_MM and not lost else int(np.flatnonzero(rows)[0])
        yield at_row(program, row, severity, "air", message)


def _longest_mm(hanging: Floats, length: Floats, mine: NDArray[np.bool_]) -> tuple[float, int]:
    """Length of the longest stretch of consecutive moves in air, and its first row."""
    rows = np.flatnonzero(mine & (hanging > 0.0))
    rows = rows[(hanging[rows] > HANGING_SHARE * length[rows]) & (length[rows] > 0)]
    group = np.cumsum(np.diff(rows, prepend=rows[:1]) > 1)
    stretches = np.bincount(group, weights=hanging[rows], minlength=1)
    longest = int(stretches.argmax())
    return float(stretches[longest]), int(rows[np.argmax(group == longest)]) if len(rows) else 0


def _in_plastic(program: ParsedProgram, length: Floats, contacts: Contacts) -> Iterator[Finding]:
    """In every part the first layer in which a large fraction of the beads overlaps earlier plastic."""
    counted = ~program.rows_of_types(PURGE, IRONING) & (length > 0)
    overlapping, whole = np.zeros((2, program.layer_key_count))
    for some in pieces(len(counted)):
        rows = some.start + np.flatnonzero(counted[some])
        np.add.at(overlapping, program.layer_keys(rows), contacts.overlapping_mm[rows])
        np.add.at(whole, program.layer_keys(rows), length[rows])
    bad = np.flatnonzero((overlapping > LEAST_MM) & (overlapping > OVERLAPPING_SHARE * whole))
    filled = np.flatnonzero(counted & (contacts.overlapping_mm > 0))
    for rows in by_part(program, filled[np.isin(program.layer_keys(filled), bad)]):
        groups = np.unique(program.layer_keys(rows))
        message = f"{amount(overlapping[groups].sum(), 1)} mm are extruded where plastic already is (layers: {len(groups)})"
        yield at_row(program, int(rows[0]), "error", "filled", message)


def unsupported_mm(program: ParsedProgram, deposited: Beads, contacts: Contacts) -> tuple[float, float, float]:
    """Lengths, mm: extruded, in air without the slicer's declaration, and in air with it."""
    own = ~program.rows_of_types(PURGE)
    reported = program.rows_of_types(*HANGING)
    length = deposited.length_mm[own[deposited.rows]]
    return float(length.sum()), float(contacts.air_mm[own & ~reported].sum()), float(contacts.air_mm[own & reported].sum())


def off_plate(program: ParsedProgram, deposited: Beads, profile: Profile) -> Iterator[Finding]:
    """Errors, one per part, for strokes of the layer on the plate that lie beyond its edge, with the farthest."""
    remark_mm = program.remarks.height_mm
    heights = np.where(remark_mm > 0, remark_mm, profile.process.first_layer_height_mm)
    purge, beyond, over_mm, edge = program.rows_of_types(PURGE), [np.zeros(0, np.int64)], [np.zeros(0)], ""
    most_mm = heights.max(initial=0.0) + ROUNDING_MM
    for some, box in deposited.boxes():
        if box[0, 2] > most_mm:
            continue
        segments, rows = deposited.segments(some), deposited.rows[some]
        low = np.flatnonzero((highest_of(segments) <= heights[program.remark[rows]] + ROUNDING_MM) & ~purge[rows])
        ends, edge = over_edge_mm(segments[low, :, :2], profile.machine.table)
        over = ends.max(axis=1, initial=-np.inf)
        beyond.append(rows[low[over > ROUNDING_MM]])
        over_mm.append(over[over > ROUNDING_MM])
    message = f"the first layer reaches {{value}} mm over the plate's edge, {edge} (moves: {{count}})"
    return per_part(program, np.concatenate(beyond), np.concatenate(over_mm), message, code="off-plate")


def purged_into(program: ParsedProgram, deposited: Beads) -> list[Finding]:
    """Error for a purge on the plate in the way of first-layer beads, which would stand on it while the tip runs through it."""
    purge = program.rows_of_types(PURGE)[deposited.rows]
    if not purge.any():
        return []
    low, low_mm = np.zeros(len(purge), np.bool_), ON_PLATE * np.maximum(deposited.sizes[:, 1], ROUNDING_MM)
    most_mm = low_mm.max()
    for some, box in deposited.boxes():
        if box[0, 2] <= most_mm:
            low[some] = highest_of(deposited.segments(some)) <= low_mm[deposited.size[some]]
    purged, laid = np.flatnonzero(low & purge), np.flatnonzero(low & ~purge)
    if not len(purged) or not len(laid):
        return []
    half_mm = 0.5 * deposited.width_mm
    reach_mm = float(half_mm[purged].max() + half_mm[laid].max()) - ROUNDING_MM
    import shapely  # takes 30 ms to load; only programs with a purge need it

    lines, beads = (shapely.linestrings(deposited.segments(which)[:, :, :2]) for which in (purged, laid))
    line, bead = shapely.STRtree(beads).query(lines, "dwithin", reach_mm)
    between_mm = shapely.distance(lines[line], beads[bead]) - half_mm[purged[line]] - half_mm[laid[bead]]
    overlapping = np.flatnonzero(between_mm < -ROUNDING_MM)
    if not len(overlapping):
        return []
    first = overlapping[np.lexsort((between_mm[overlapping], line[overlapping]))[0]]
    x, y = shapely.get_coordinates(shapely.shortest_line(lines[line[first]], beads[bead[first]]))[0]
    row, crossed = (int(deposited.rows[place]) for place in (purged[line[first]], laid[bead[first]]))
    message = f"the purge at X{x:.1f} Y{y:.1f} lies where line {program.line[crossed]} lays the first layer"
    return [at_row(program, row, "error", "purge", message)]
