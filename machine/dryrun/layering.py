"""Layering: findings about layers that do not lie on each other: one is missing, or part of one is printed too high.

Two signs: a bead that begins above all that its part has laid before, by the heights that the file tells; and a layer most of
whose beads have nothing under them, by the plastic that lies there.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, at_row, by_part
from machine.dryrun.replay import Contacts
from machine.dryrun.strokes import Beads
from machine.reader.parsed import ParsedProgram
from mdp.mesh import Floats
from slicer.paths import ON_PLATE_MM, Kind

SUPPORT = (Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value)
LOOSE = (Kind.OVERHANG.value, Kind.BRIDGE.value, Kind.IRONING.value, Kind.PURGE.value, Kind.SKIRT.value, *SUPPORT)
SLACK_MM, SLACK_SHARE = 0.02, 0.1  # of a layer's height
STAND_OFF_MM = 0.5  # at most between a part and the support below it
NEW_OBJECT_MM = 1.0  # a fall of more begins another object beside the first one
FLOATING_SHARE = 0.5  # of a layer's length
LEAST_MM = 10.0
SEEN_SHARE = 0.6  # of a layer's height: what begins so much too high hangs in the air of the replay
CRUMB_MM = 1.0  # so little laid in a layer is the tip of something too fine to print, whatever lies below it


def findings(program: ParsedProgram, deposited: Beads, contacts: Contacts) -> list[Finding]:
    """Errors of code gap, in every part the first sign."""
    signs = [*_too_high(program, deposited, contacts), *_floating(program, deposited, contacts)]
    first: dict[int, Finding] = {}
    for sign in sorted(signs, key=lambda finding: finding.line):
        first.setdefault(sign.part, sign)
    return list(first.values())


def _too_high(program: ParsedProgram, deposited: Beads, contacts: Contacts) -> list[Finding]:
    """In every part the first bead whose underside lies above all that was laid before it, by the heights told.

    What stands off by most of a layer may stand on support that ends as high as the part does there: the replay knows.
    """
    sized = (program.height_mm[deposited.rows] > 0) & ~program.rows_of_types(Kind.PURGE.value)[deposited.rows]
    rows = deposited.rows[sized]
    length_mm = deposited.length_mm[sized]
    in_air = ((contacts.air_mm + contacts.beside_mm > 0.0) & ~program.rows_of_types(*LOOSE))[rows]
    groups = np.split(np.arange(len(rows)), np.flatnonzero((np.diff(program.part[rows]) != 0) | program.turned_between(rows)) + 1)
    problems, seen = [], set()
    for group in groups:
        part = int(program.part[rows[group[0]]]) if len(group) else 0
        if not len(group) or part in seen:
            continue
        mine = rows[group]
        gap = _gaps(program, mine)
        laid_mm = np.bincount(program.layer[mine], weights=length_mm[group])[program.layer[mine]]
        height_mm = program.height_mm[mine]
        hangs = (gap < SEEN_SHARE * height_mm) | in_air[group]
        high = np.flatnonzero((gap > np.maximum(SLACK_MM, SLACK_SHARE * height_mm)) & (laid_mm > CRUMB_MM) & hangs)
        if len(high):
            seen.add(part)
            row, layers = int(mine[high[0]]), len(np.unique(program.layer[mine[high]]))
            message = (
                f"layer {program.layer[row]} begins {gap[high[0]]:.2f} mm above all that lies below it: it should lie on it "
                f"(layers: {layers})"
            )
            problems.append(at_row(program, row, "error", "gap", message))
    return problems


def _gaps(program: ParsedProgram, rows: NDArray[np.int64]) -> Floats:
    """(m,) by how much the underside of each bead of a part lies above all of the layers before; support keeps its distance.

    What its own layer has laid does not count: support laid first would hide a layer that is raised with it.
    """
    ends = np.stack([program.start[rows, 2], program.end[rows, 2]])
    underside, top = ends.min(axis=0) - program.height_mm[rows], ends.max(axis=0)
    objects = np.cumsum(np.diff(top, prepend=top[0]) < -NEW_OBJECT_MM)
    support = program.rows_of_types(*SUPPORT)[rows]
    gaps = np.zeros(len(rows))
    for number in np.unique(objects):
        own = np.flatnonzero(objects == number)
        highest = np.maximum.accumulate(top[own])
        of_part = np.maximum.accumulate(np.where(support[own], -np.inf, top[own]))
        begins = np.diff(program.layer[rows[own]], prepend=-1) != 0
        first = np.maximum.accumulate(np.where(begins, np.arange(len(own)), 0))
        before, part_before = (np.concatenate([[np.inf], values])[first] for values in (highest, of_part))
        gap = underside[own] - before
        stands_off = (support[own] | (part_before < before - SLACK_MM)) & (gap < STAND_OFF_MM)
        gaps[own] = np.where(stands_off, 0.0, gap)
    return gaps


def _begins(program: ParsedProgram, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(m,) which beads are of their part's first layer, of which another finding tells."""
    parts, part = np.unique(program.part[rows], return_inverse=True)
    first = np.full(len(parts), np.iinfo(np.int64).max)
    np.minimum.at(first, part, program.layer[rows])
    begins: NDArray[np.bool_] = program.layer[rows] == first[part]
    return begins


def _floating(program: ParsedProgram, deposited: Beads, contacts: Contacts) -> Iterator[Finding]:
    """In every part the first layer of which more than half has nothing under it, though it is no bridge and no overhang.

    What spans the cells of sparse infill is a bridge, however much of a layer that is (machine.dryrun.replay).
    """
    rows = deposited.rows
    low = np.minimum(deposited.segments_mm[:, 0, 2], deposited.segments_mm[:, 1, 2]) - deposited.height_mm < ON_PLATE_MM
    counted = ~program.rows_of_types(*LOOSE)[rows] & ~low & ~_begins(program, rows)
    rows, length = rows[counted], deposited.length_mm[counted]
    group = program.layer_keys(rows)
    loose = np.bincount(group, weights=contacts.air_mm[rows] + contacts.beside_mm[rows])
    air = np.bincount(group, weights=contacts.air_mm[rows])
    whole = np.bincount(group, weights=length)
    bad = np.flatnonzero((loose > FLOATING_SHARE * whole) & (whole > LEAST_MM) & (air > 0.0))
    for mine in by_part(program, rows[np.isin(group, bad)]):
        layer = program.layer_keys(mine).min()
        row = int(mine[np.argmax(program.layer_keys(mine) == layer)])
        message = (
            f"{loose[layer]:.1f} mm of the {whole[layer]:.1f} mm of layer {program.layer[row]} have nothing under them, in "
            f"stretches longer than sparse infill's cells are wide: a layer below it is missing"
        )
        yield at_row(program, row, "error", "gap", message)
