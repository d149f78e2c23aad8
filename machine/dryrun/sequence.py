"""Sequence: findings about the order of parts and layers, and about filament pulled back and pushed again."""

import numpy as np

from machine.dryrun.findings import Finding
from machine.reader.parsed import MoveKind, ParsedProgram
from profiles.profile import Profile
from slicer.paths import Kind

SLACK_MM = 0.02


def findings(program: ParsedProgram, profile: Profile) -> list[Finding]:
    """Errors of code order and retraction."""
    return [*_parts(program), *_layers(program), *_unbalanced_retractions(program, profile), *_oozing(program)]


def _place(program: ParsedProgram, row: int) -> tuple[int, int, int]:
    return int(program.line[row]), int(program.part[row]), int(program.layer[row])


def _parts(program: ParsedProgram) -> list[Finding]:
    """The first part that comes after a part with a greater number."""
    extruding = np.flatnonzero((program.kind == MoveKind.EXTRUDE) & (program.part > 0))
    falling = np.flatnonzero(np.diff(program.part[extruding]) < 0)
    if not len(falling):
        return []
    row, before = int(extruding[falling[0] + 1]), int(program.part[extruding[falling[0]]])
    message = f"part {program.part[row]} is printed after part {before}: parts are printed in the order of their numbers"
    return [Finding("error", "order", *_place(program, row), message)]


def _layers(program: ParsedProgram) -> list[Finding]:
    """In every part the first layer that lies lower than the one before it."""
    rows = np.flatnonzero((program.kind == MoveKind.EXTRUDE) & (program.part > 0) & ~program.rows_of_types(Kind.PURGE.value))
    z, height = program.end[rows, 2], program.height_mm[rows]
    same = (np.diff(program.part[rows]) == 0) & np.all(program.end[rows[1:], 3:] == program.end[rows[:-1], 3:], axis=1)
    lower = np.flatnonzero(same & (np.diff(program.layer[rows]) != 0) & (np.diff(z) < -0.25 * height[1:] - SLACK_MM))
    problems = []
    for part in np.unique(program.part[rows[lower + 1]]):
        k = int(lower[program.part[rows[lower + 1]] == part][0])
        message = f"layer {program.layer[rows[k + 1]]} lies {z[k] - z[k + 1]:.2f} mm lower than the layer before it"
        problems.append(Finding("error", "order", *_place(program, int(rows[k + 1])), message))
    return problems


def _unbalanced_retractions(program: ParsedProgram, profile: Profile) -> list[Finding]:
    """Filament pushed at standstill that was not pulled back before, and beads begun with filament still pulled back.

    Nothing is said of a program that never pulls back; what the start block does is its own affair.
    """
    e, material = program.e_mm, profile.material
    rows = np.flatnonzero((np.abs(e) > 1e-9) & (program.part > 0))
    if not (e[rows] < 0.0).any():
        return []
    pushing = program.kind[rows] == MoveKind.EXTRUDE
    # What is done between two beads must come to nothing, or to the extra push after it.
    run = np.cumsum(pushing)
    balance = np.bincount(run, weights=np.where(pushing, 0.0, -e[rows]))
    stood = np.bincount(run, weights=~pushing) > 0
    turns = np.cumsum(program.kind == MoveKind.ROTATE)[rows]
    turned = np.diff(turns[np.searchsorted(run, np.arange(len(balance) + 1)).clip(max=len(run) - 1)]) > 0
    extra = np.where(turned, max(material.prime_extra_mm, material.retract_prime_extra_mm), material.retract_prime_extra_mm)
    inner = np.arange(len(balance))
    over = stood & (balance < -extra - SLACK_MM) & (inner > 0)
    under = stood & (balance > SLACK_MM) & (inner < run[-1])
    problems = []
    for wrong, sentence in (
        (over, "{:.3f} mm more filament is pushed than was pulled back"),
        (under, "{:.3f} mm of filament stay pulled back"),
    ):
        runs = np.flatnonzero(wrong)
        for part in np.unique(program.part[rows[np.searchsorted(run, runs)]]):
            mine = [r for r in runs if program.part[rows[np.searchsorted(run, r)]] == part]
            worst = max(abs(balance[r]) for r in mine)
            row = int(rows[np.searchsorted(run, mine[0], side="right") - 1])
            message = f"{sentence.format(worst)} before the next bead (places: {len(mine)})"
            problems.append(Finding("error", "retraction", *_place(program, row), message))
    return problems


def _oozing(program: ParsedProgram) -> list[Finding]:
    """The first turn of the table, in a program that pulls filament back, before which it was not."""
    if not (program.e_mm < -1e-9).any():
        return []
    beads = program.kind == MoveKind.EXTRUDE
    pulled = np.cumsum(np.where(beads, 0.0, -program.e_mm))
    last = np.maximum.accumulate(np.where(beads, np.arange(len(beads)), -1))
    loose = (program.kind == MoveKind.ROTATE) & (program.part > 0) & (last >= 0) & (pulled - pulled[last] < SLACK_MM)
    row = int(np.flatnonzero(loose)[0]) if loose.any() else -1
    message = "the table turns while the filament is not pulled back"
    return [Finding("error", "retraction", *_place(program, row), message)] if row >= 0 else []
