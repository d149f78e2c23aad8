"""Sequence: findings about the order of parts and layers, and about retractions."""

from collections.abc import Iterator

import numpy as np

from machine.dryrun.findings import Finding, at_row, by_part
from machine.gcode.reader.parsed import MoveKind, ParsedProgram, pieces
from machine.quantities import amount
from profiles.profile import Profile
from slicer.paths import Kind

SLACK_MM = 0.02
MOST_PULLED_MM = 15.0  # twice the need of the longest Bowden tubes


def findings(program: ParsedProgram, profile: Profile) -> list[Finding]:
    """Errors of code order and retraction."""
    return [
        *_parts(program),
        *_layers(program),
        *_unbalanced_retractions(program, profile),
        *_far_pulled(program),
        *_oozing(program),
    ]


def _parts(program: ParsedProgram) -> list[Finding]:
    """The first part printed after a part with a greater number."""
    extruding = np.flatnonzero((program.kind == MoveKind.EXTRUDE) & (program.remarks.part > 0)[program.remark])
    falling = np.flatnonzero(np.diff(program.remarks.part[program.remark[extruding]]) < 0)
    if not len(falling):
        return []
    row, before = int(extruding[falling[0] + 1]), int(program.part[extruding[falling[0]]])
    message = f"part {program.part[row]} is printed after part {before}: parts are printed in the order of their numbers"
    return [at_row(program, row, "error", "order", message)]


def _layers(program: ParsedProgram) -> Iterator[Finding]:
    """In every part the first layer that is lower than the one before it."""
    rows = np.flatnonzero((program.kind == MoveKind.EXTRUDE) & (program.part > 0) & ~program.rows_of_types(Kind.PURGE.value))
    (part, layer), height_mm, lower = program.remarks[:2], program.remarks.height_mm, [np.zeros(0, dtype=np.int64)]
    for some in pieces(len(rows) - 1):
        mine = rows[some.start : some.stop + 1]
        remark, z_mm = program.remark[mine], program.end[mine, 2]
        other_layer = (np.diff(part[remark]) == 0) & (np.diff(layer[remark]) != 0) & ~program.turned_between(mine)
        lower.append(some.start + np.flatnonzero(other_layer & (np.diff(z_mm) < -0.25 * height_mm[remark[1:]] - SLACK_MM)))
    for mine in by_part(program, np.concatenate(lower) + 1, rows):
        k = int(mine[0]) - 1
        fall_mm = program.end[rows[k], 2] - program.end[rows[k + 1], 2]
        message = f"layer {program.layer[rows[k + 1]]} lies {amount(fall_mm)} mm lower than the layer before it"
        yield at_row(program, int(rows[k + 1]), "error", "order", message)


def _unbalanced_retractions(program: ParsedProgram, profile: Profile) -> Iterator[Finding]:
    """Errors for filament pushed at standstill without an earlier retraction, and for beads begun while retracted.

    Programs without retractions and the moves of the start block are exempt.
    """
    e, material = program.e_mm, profile.material
    counted = (program.remarks.part + program.remarks.layer > 0)[program.remark]
    purge = np.flatnonzero((program.kind == MoveKind.EXTRUDE) & ~counted)
    if program.parts and len(purge):  # the first part of a tiltprint program primes what its purge retracted
        counted[purge[-1] + 1 :] = True
    rows = np.flatnonzero((np.abs(e) > 1e-9) & counted)
    if not (e[rows] < 0.0).any():
        return
    pushing = program.kind[rows] == MoveKind.EXTRUDE
    # The moves between two beads must sum to zero, or to the extra prime after them.
    run = np.cumsum(pushing, dtype=np.int32)
    still = np.flatnonzero(~pushing)
    runs, which = np.unique(run[still], return_inverse=True)
    balance = np.bincount(which, weights=-e[rows[still]])
    ends = np.stack([np.searchsorted(run, runs), np.searchsorted(run, runs, side="right").clip(max=len(run) - 1)])
    turned = np.diff(np.searchsorted(np.flatnonzero(program.kind == MoveKind.ROTATE), rows[ends], side="right"), axis=0)[0] > 0
    extra = np.where(turned, max(material.prime_extra_mm, material.retract_prime_extra_mm), material.retract_prime_extra_mm)
    over = (balance < -extra - SLACK_MM) & (runs > 0)
    under = (balance > SLACK_MM) & (runs < run[-1])
    for wrong, sentence, next_bead in (
        (over, "{:.3f} mm more filament is pushed than was pulled back", 0),
        (under, "{:.3f} mm of filament stay pulled back", 1),
    ):
        places = rows[np.searchsorted(run, runs[wrong], side="right") - 1 + next_bead]
        for mine in by_part(program, np.arange(len(places)), places):
            worst = float(np.abs(balance[wrong][mine]).max())
            message = f"{sentence.format(worst)} before the next bead (places: {len(mine)})"
            yield at_row(program, int(places[mine[0]]), "error", "retraction", message)


def _far_pulled(program: ParsedProgram) -> Iterator[Finding]:
    """In every part the first retraction between two beads that is longer than a hot end."""
    is_bead = (program.kind == MoveKind.EXTRUDE) & (program.remarks.part + program.remarks.layer > 0)[program.remark]
    beads = np.flatnonzero(is_bead)
    if len(beads) < 2:
        return
    rows, filament_mm = beads[0] + np.flatnonzero(~is_bead[beads[0] : beads[-1]]), program.filament_mm
    pulled = filament_mm[beads[np.searchsorted(beads, rows) - 1]] - filament_mm[rows]  # since the bead before each row
    far = np.flatnonzero(pulled > MOST_PULLED_MM)
    for mine in by_part(program, far, rows):
        row, pulled_mm = int(rows[mine[0]]), float(pulled[mine[0]])
        message = (
            f"{amount(pulled_mm, 1)} mm of filament are pulled back, {MOST_PULLED_MM:g} mm are allowed: more leaves the hot end"
        )
        yield at_row(program, row, "error", "retraction", message)


def _oozing(program: ParsedProgram) -> list[Finding]:
    """The first turn of the table without a retraction before it, in a program that retracts."""
    if not (program.e_mm < -1e-9).any():
        return []
    turns = np.flatnonzero(program.kind == MoveKind.ROTATE)
    turns = turns[program.remarks.part[program.remark[turns]] > 0]
    if not len(turns):
        return []
    beads = program.kind == MoveKind.EXTRUDE
    pulled, laid = np.cumsum(np.where(beads, 0.0, -program.e_mm)), np.flatnonzero(beads)
    after = np.searchsorted(laid, turns)
    turns, after = turns[after > 0], after[after > 0]
    loose = turns[pulled[turns] - pulled[laid[after - 1]] < SLACK_MM]
    message = "the table turns while the filament is not pulled back"
    return [at_row(program, int(loose[0]), "error", "retraction", message)] if len(loose) else []
