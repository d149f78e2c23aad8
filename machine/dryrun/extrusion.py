"""Extrusion: findings about beads with more or less plastic than their width and height need, and about extruding travels.

A bead's cross-section follows from the width and height in the file (PrusaSlicer's ;WIDTH and ;HEIGHT, which give its own files'
filament within 0.3 %); without these, from other beads of its kind.
"""

from collections.abc import Iterator
from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.dryrun.findings import Finding, Severity, at_row, by_part
from machine.dryrun.strokes import Beads, parts_on_plate
from machine.gcode.reader.parsed import MoveKind, ParsedProgram, pieces
from mdp.mesh import Floats, Indices
from profiles.profile import Profile
from slicer.paths import Kind

UNEVEN = (Kind.GAP.value, Kind.IRONING.value, Kind.PURGE.value, Kind.BRIDGE.value)  # deliberately wider or thinner than stated
LAYER_MOST, UNTOLD_MOST = 1.15, 1.5  # ratio of a layer's plastic to that of other layers
FILE_LEAST, FILE_MOST = 0.7, 1.4  # the file's plastic over that of its own widths and heights
ROW_LEAST, ROW_MOST, ROW_MM = 0.4, 2.0, 1.0
ODD_MM = 8.0  # length of odd beads in a part that is reported
LAYER_MM = 20.0
CLIMBING = 0.3  # share of a layer's height
SPARE_MM3 = 0.5
FAST = 0.95  # share of the travels' usual speed
FASTER = 1.3  # than all but a few strokes
FEW = 0.03


def findings(program: ParsedProgram, deposited: Beads, profile: Profile) -> Iterator[Finding]:
    """Errors with the codes extrusion and extruding-travel; without width comments, warnings about whole layers."""
    if not len(deposited.rows):
        return
    remarks = program.remarks
    sized = ((remarks.width_mm > 0) & (remarks.height_mm > 0))[program.remark[deposited.rows]]
    uneven = program.rows_of_types(*UNEVEN)[deposited.rows] | _fills_grooves(program, deposited.rows, profile)
    on_plate = parts_on_plate(program, deposited)
    counted = ~uneven & ~_climbs(program, deposited)
    length = deposited.length_mm
    yield from _fast(program, deposited.rows, length)
    counted &= length > 0
    spare = profile.material.prime_extra_mm * pi * profile.material.diameter_mm**2 / 4.0 + SPARE_MM3
    for known, most in ((True, LAYER_MOST), (False, UNTOLD_MOST)):
        mine = counted & (sized == known)
        if mine.any():
            area_mm2 = _area(program, deposited.rows[mine], on_plate, profile) if known else np.ones(len(remarks.part))
            beads = Counted(program, deposited.rows, length, mine, area_mm2, profile.material.diameter_mm)
            whole_file = _whole_file(beads, profile) if known else []
            yield from whole_file or (_odd(beads) if known else ())
            yield from _layers(beads, spare, most)


class Counted(NamedTuple):
    """Beads whose plastic is compared with their remarks: (m,) rows, lengths, and a mask of those that count.

    area_mm2: (k,) cross-section of each remark; diameter_mm: of the filament.
    """

    program: ParsedProgram
    rows: NDArray[np.int64]
    length_mm: Floats
    mine: NDArray[np.bool_]
    area_mm2: Floats
    diameter_mm: float

    def plastic(self, which: Indices) -> tuple[Floats, Floats]:
        """Plastic that (j,) of the m beads push and that they need, mm³."""
        rows = self.rows[which]
        pushed = self.program.e_mm[rows]
        pushed *= pi
        pushed *= self.diameter_mm**2
        pushed /= 4.0
        needed = self.area_mm2[self.program.remark[rows]]
        needed *= self.length_mm[which]
        return pushed, needed

    def some(self) -> Iterator[tuple[Indices, Floats, Floats]]:
        """The counted beads in pieces: their indices among the m, and their plastic, pushed and needed."""
        for some in pieces(len(self.mine)):
            which = some.start + np.flatnonzero(self.mine[some])
            yield which, *self.plastic(which)


def _climbs(program: ParsedProgram, deposited: Beads) -> NDArray[np.bool_]:
    """(m,) mask of beads in rising layers, as of a vase, whose first and last turns get less and less plastic."""
    rows = deposited.rows
    low, high = np.full((2, program.layer_key_count), [[np.inf], [-np.inf]])
    for some in pieces(len(rows)):
        group, z_mm = program.layer_keys(rows[some]), program.end[rows[some], 2]
        np.minimum.at(low, group, z_mm)
        np.maximum.at(high, group, z_mm)
    climbs = np.empty(len(rows), dtype=np.bool_)
    for some in pieces(len(rows)):
        climbed = (high - low)[program.layer_keys(rows[some])]
        climbs[some] = climbed > CLIMBING * deposited.sizes[deposited.size[some], 1]
    return climbs


def _fills_grooves(program: ParsedProgram, rows: NDArray[np.int64], profile: Profile) -> NDArray[np.bool_]:
    """(m,) mask of beads in a first layer on grooves, which they fill too: the interface balance checks them instead."""
    fills = np.zeros(len(rows), np.bool_)
    for part in np.unique(program.part[rows[program.part[rows] > 1]]):
        if profile.of_part(int(part)).process.interlock == "grooves":
            fills |= (program.part[rows] == part) & (program.layer[rows] == 1)
    return fills


def _area(program: ParsedProgram, rows: NDArray[np.int64], begin: list[int], profile: Profile) -> Floats:
    """(k,) cross-section for the stated width and height of each remark, with the flow factors of the profile and of its parts.
    rows: of beads, the lowest layer of which is on the plate; begin: further parts whose first layer is on the plate."""
    remarks = program.remarks
    width, height = remarks.width_mm, remarks.height_mm
    area = pi * np.minimum(width, height) * height / 4.0 + np.maximum(width - height, 0.0) * height
    on_plate = (remarks.layer == remarks.layer[program.remark[rows]].min()) & (remarks.part <= 1)
    on_plate |= np.isin(remarks.part, begin) & (remarks.layer == 1)
    factor = np.where(on_plate, profile.process.first_layer_flow, 1.0)
    for part in np.setdiff1d(remarks.part[remarks.part > 1], begin):
        on_part = (remarks.part == part) & (remarks.layer == 1)
        factor[on_part] = profile.of_part(int(part)).process.interface_flow
    needed: Floats = area * factor * profile.material.flow
    return needed


def _whole_file(beads: Counted, profile: Profile) -> list[Finding]:
    """Finding for a file with far too much or too little plastic everywhere."""
    pushed, needed = np.sum([(pushed.sum(), needed.sum()) for _, pushed, needed in beads.some()], axis=0)
    share = float(pushed / max(needed, 1e-9))
    if FILE_LEAST <= share <= FILE_MOST:
        return []
    message = (
        f"the file pushes {share:.2f} of the plastic that its own widths and heights need, {FILE_LEAST:g} to {FILE_MOST:g} "
        f"are allowed, with filament of {profile.material.diameter_mm:g} mm"
    )
    return [at_row(beads.program, int(beads.rows[beads.mine.argmax()]), "error", "extrusion", message)]


def _odd(beads: Counted) -> Iterator[Finding]:
    """Findings for single moves far from their stated cross-section, in parts with at least ODD_MM of them."""
    places, shares = [], []
    for which, pushed, needed in beads.some():
        share = pushed / needed
        odd = (beads.length_mm[which] > ROW_MM) & ((share < ROW_LEAST) | (share > ROW_MOST))
        places.append(which[odd])
        shares.append(share[odd])
    at, share = np.concatenate(places), np.concatenate(shares)
    for mine in by_part(beads.program, np.arange(len(at)), beads.rows[at]):
        if beads.length_mm[at[mine]].sum() < ODD_MM:
            continue
        worst = float(share[mine][np.abs(np.log(np.maximum(share[mine], 1e-6))).argmax()])
        message = (
            f"a move pushes {worst:.2f} of the plastic that its width and height need, {ROW_LEAST:g} to {ROW_MOST:g} are allowed "
            f"(moves: {len(mine)})"
        )
        yield at_row(beads.program, int(beads.rows[at[mine[0]]]), "error", "extrusion", message)


def _layers(beads: Counted, spare: float, most: float) -> Iterator[Finding]:
    """In every part the first layer that gets more or less plastic than the file's layers do, by kind.

    spare: mm³ that a layer may get in addition, which ooze after a turn of the table. A warning if the file states no widths.
    """
    program = beads.program
    severity: Severity = "error" if most == LAYER_MOST else "warning"
    usual = np.ones(len(program.types))
    for kind in range(len(usual)):
        of_kind = (program.remarks.type == kind)[program.remark[beads.rows]]
        if len(which := np.flatnonzero(beads.mine & of_kind)):
            pushed, needed = beads.plastic(which)
            pushed /= needed
            usual[kind] = _weighted_median(pushed, needed)
    got, due, long = np.zeros((3, program.layer_key_count))
    for which, pushed, needed in beads.some():
        rows = beads.rows[which]
        group = program.layer_keys(rows)
        np.add.at(got, group, pushed)
        np.add.at(due, group, needed * usual[program.remarks.type[program.remark[rows]]])
        np.add.at(long, group, beads.length_mm[which])
    share = got / np.maximum(due, 1e-12)
    bad = np.flatnonzero((long > LAYER_MM) & (np.abs(got - due) > spare) & ((share > most) | (share < 1.0 / most)))
    if not len(bad):
        return
    rows = beads.rows[beads.mine]
    group = program.layer_keys(rows)
    for mine in by_part(program, np.flatnonzero(np.isin(group, bad)), rows):
        layers = np.unique(group[mine])
        row = int(rows[mine[np.argmax(group[mine] == layers[0])]])
        message = (
            f"layer {program.layer[row]} gets {share[layers[0]]:.2f} of the plastic that such beads get in the rest of the file, "
            f"{1 / most:.2f} to {most:.2f} are allowed (layers: {len(layers)})"
        )
        yield at_row(program, row, severity, "extrusion", message)


def _weighted_median(values: Floats, weights: Floats) -> float:
    order = np.argsort(values)
    sums = weights[order]
    np.cumsum(sums, out=sums)
    return float(values[order[np.searchsorted(sums, 0.5 * sums[-1])]])


def _fast(program: ParsedProgram, rows: NDArray[np.int64], length: Floats) -> Iterator[Finding]:
    """Strokes as fast as travels, if other strokes are slower; purges may be as fast on a slow machine."""
    travels = np.flatnonzero((program.kind == MoveKind.TRAVEL) & (program.e_mm == 0.0))
    across = np.hypot(*(program.end[travels] - program.start[travels])[:, :2].T)
    if not (across > ROW_MM).any():
        return
    usual = _weighted_median(program.feed[travels], np.where(across > ROW_MM, across, 0.0))
    feed = program.feed[rows]
    fast = (feed > FAST * usual) & (length > ROW_MM) & ~program.rows_of_types(Kind.PURGE.value)[rows]
    if not fast.any() or fast.mean() > FEW or usual * FAST < FASTER * np.quantile(feed[~fast], 1.0 - FEW):
        return
    for mine in by_part(program, rows[fast]):
        message = (
            f"a move pushes filament at {program.feed[mine[0]] / 60:.0f} mm/s, the speed of the travels (moves: {len(mine)}): "
            "filament flows during a travel"
        )
        yield at_row(program, int(mine[0]), "error", "extruding-travel", message)
