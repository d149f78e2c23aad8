"""Layering: findings about layers that do not lie on each other: a layer is missing, or a piece of one is printed too high.

Two signs: a bead that begins above everything its part has printed before, by the file's heights; and a layer most of whose beads
have no plastic below them.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, at_row, by_part
from machine.dryrun.replay import Contacts
from machine.dryrun.strokes import SUPPORT, Beads
from machine.gcode.reader.parsed import Indices32, ParsedProgram, Remarks, pieces
from machine.quantities import amount
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from slicer.paths import ON_PLATE_MM, Kind

LOOSE = (Kind.OVERHANG.value, Kind.BRIDGE.value, Kind.IRONING.value, Kind.PURGE.value, Kind.SKIRT.value, *SUPPORT)
SLACK_MM, SLACK_SHARE = 0.02, 0.1  # tolerance on a layer's height, mm and as a share of it
STAND_OFF_MM = 0.5  # greatest distance between a part and the support below it
FARTHEST_SUPPORT_MM = 2.0  # from a bridge above it, the most that process.support_gap_mm allows
NEW_OBJECT_MM = 1.0  # a larger fall begins another object beside the first one
FLOATING_SHARE = 0.5  # share of a layer's length
LEAST_MM = 10.0
SEEN_SHARE = 0.6  # share of a layer's height: the replay sees a larger gap as air
CRUMB_MM = 1.0  # a shorter layer is the tip of something too fine to print


def findings(program: ParsedProgram, deposited: Beads, contacts: Contacts) -> list[Finding]:
    """Errors with the code gap: the first one in each part."""
    signs = [*_too_high(program, deposited, contacts), *_floating(program, deposited, contacts)]
    first: dict[int, Finding] = {}
    for sign in sorted(signs, key=lambda finding: finding.line):
        first.setdefault(sign.part, sign)
    return list(first.values())


def _too_high(program: ParsedProgram, deposited: Beads, contacts: Contacts) -> list[Finding]:
    """In every part the first bead whose underside is above all earlier beads, by the heights in comments.

    A gap of most of a layer may be above support that ends at the part's height: the replay decides.
    """
    sized = (program.remarks.height_mm > 0)[program.remark] & ~program.rows_of_types(Kind.PURGE.value)
    rows = deposited.rows[sized[deposited.rows]]
    part_of, ends = program.remarks.part, []
    for some in pieces(len(rows) - 1):
        mine = rows[some.start : some.stop + 1]
        begins = (np.diff(part_of[program.remark[mine]]) != 0) | program.turned_between(mine)
        ends += (some.start + 1 + np.flatnonzero(begins)).tolist()
    support, loose = program.rows_of_types(*SUPPORT, Kind.SKIRT.value), program.rows_of_types(*LOOSE)
    spanning = program.rows_of_types(Kind.OVERHANG.value, Kind.BRIDGE.value)
    problems, seen = [], set()
    for begin, end in pairwise([0, *ends, len(rows)]):
        mine = rows[begin:end]
        part = program.part_and_layer(mine[0])[0] if len(mine) else 0
        if not len(mine) or part in seen:
            continue
        gap = _gaps((program.start, program.end), mine, program.remark, program.remarks, support)
        high = mine[gap > 0.0]
        if not len(high):
            continue
        remark, gap = program.remark[high], gap[gap > 0.0]
        in_air = ((contacts.air_mm[high] + contacts.beside_mm[high]) > 0.0) & ~loose[high]
        # Whatever carries the ends of a bridge is below it, or is support with its gap, rounded up to a layer.
        in_air |= spanning[high] & (gap > FARTHEST_SUPPORT_MM + program.remarks.height_mm[remark])
        layer, lengths_mm = program.remarks.layer, deposited.length_mm[np.searchsorted(deposited.rows, mine)]
        laid_mm = np.bincount(layer[program.remark[mine]], weights=lengths_mm)
        hangs = (gap < SEEN_SHARE * program.remarks.height_mm[remark]) | in_air
        gaps = np.flatnonzero((laid_mm > CRUMB_MM)[layer[remark]] & hangs)
        if len(gaps):
            seen.add(part)
            row, layers = int(high[gaps[0]]), len(np.unique(layer[remark[gaps]]))
            message = (
                f"layer {layer[program.remark[row]]} begins {amount(gap[gaps[0]])} mm above all that lies below: it should lie "
                f"on it (layers: {layers})"
            )
            problems.append(at_row(program, row, "error", "gap", message))
    return problems


@kernel
def _gaps(ends: tuple[Floats, Floats], rows: Indices, remarks: Indices32, stated: Remarks, support: NDArray[np.bool_]) -> Floats:
    """(m,) excessive height of the underside of each bead of a part above all earlier layers, else 0; support keeps its distance.

    Its own layer does not count: support printed first would hide a layer that is raised with it.
    """
    gaps, last_mm, layer = np.empty(len(rows)), np.inf, -1
    highest = of_part = before = part_before = -np.inf
    for k in range(len(rows)):
        row = rows[k]
        a, b, height_mm, its_layer = ends[0][row, 2], ends[1][row, 2], stated.height_mm[remarks[row]], stated.layer[remarks[row]]
        top = max(a, b)
        if k == 0 or top - last_mm < -NEW_OBJECT_MM:
            highest, of_part, before, part_before = -np.inf, -np.inf, np.inf, np.inf
        elif its_layer != layer:
            before, part_before = highest, of_part
        gap = min(a, b) - height_mm - before
        stands_off = (support[row] or part_before < before - SLACK_MM) and gap < STAND_OFF_MM
        lies = stands_off or gap <= max(SLACK_MM, SLACK_SHARE * height_mm)
        gaps[k], last_mm, layer = (0.0 if lies else gap), top, its_layer
        highest = max(highest, top)
        if not support[row]:
            of_part = max(of_part, top)
    return gaps


def _begins(program: ParsedProgram, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(k,) mask of remarks of each part's first layer with beads, which another finding covers."""
    (part, layer), laid = program.remarks[:2], np.zeros(len(program.remarks.part), dtype=np.bool_)
    laid[program.remark[rows]] = True
    first = np.full(int(part.max(initial=0)) + 1, np.iinfo(np.int64).max)
    np.minimum.at(first, part[laid], layer[laid])
    begins: NDArray[np.bool_] = layer == first[part]
    return begins


def _floating(program: ParsedProgram, deposited: Beads, contacts: Contacts) -> Iterator[Finding]:
    """In every part the first layer more than half of which has nothing below it, except bridges and overhangs.

    Anything that spans the cells of sparse infill is a bridge, however large (machine.dryrun.replay).
    """
    counted = ~program.rows_of_types(*LOOSE)[deposited.rows] & ~_begins(program, deposited.rows)[program.remark[deposited.rows]]
    (loose, air, whole), tallest_mm = np.zeros((3, program.layer_key_count)), deposited.sizes[:, 1].max(initial=0.0)
    for some, box in deposited.boxes():
        if box[0, 2] - tallest_mm < ON_PLATE_MM:
            lowest_mm = deposited.segments(some)[:, :, 2].min(axis=1)
            counted[some] &= lowest_mm - deposited.sizes[deposited.size[some], 1] >= ON_PLATE_MM
        rows = deposited.rows[some][counted[some]]
        group, air_mm = program.layer_keys(rows), contacts.air_mm[rows]
        np.add.at(loose, group, air_mm + contacts.beside_mm[rows])
        np.add.at(air, group, air_mm)
        np.add.at(whole, group, deposited.length_mm[some][counted[some]])
    bad = np.flatnonzero((loose > FLOATING_SHARE * whole) & (whole > LEAST_MM) & (air > 0.0))
    if not len(bad):
        return
    rows = deposited.rows[counted]
    for mine in by_part(program, rows[np.isin(program.layer_keys(rows), bad)]):
        layer = program.layer_keys(mine).min()
        row = int(mine[np.argmax(program.layer_keys(mine) == layer)])
        part_mm, whole_mm = amount(loose[layer], 1), amount(whole[layer], 1)
        message = (
            f"{part_mm} mm of the {whole_mm} mm of layer {program.layer[row]} have nothing under them, in "
            f"stretches longer than sparse infill's cells are wide: a layer below it is missing"
        )
        yield at_row(program, row, "error", "gap", message)
