"""Program: what was read, in axis positions and with feeds in the terms of the timeline."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from machine.kinematics.coordinates import axis_positions
from machine.reader.parsed import MoveKind, ParsedProgram, Remarks
from machine.reader.state import Reader
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from slicer.estimate.timing import axis_speeds, lengths

STILL = 1e-9
SWAY_MM = 0.05  # a followed turn, which goes in straight steps and rounded places, lets the head leave its place by less
TRAVEL, EXTRUDE, RETRACT, ROTATE = (int(kind) for kind in MoveKind)


def program_of(reader: Reader) -> ParsedProgram:
    """All that a reader has read."""
    columns, count = reader.columns, reader.rows
    begins, remark = columns.starts if len(columns.starts) else columns.places, columns.remark_rows[: reader.remarks].T
    program = ParsedProgram(
        line=columns.line[:count], start=begins[:count], end=columns.places[1 : count + 1], e_mm=columns.e_mm[:count],
        feed=columns.feed[:count], kind=np.empty(count, np.int8), remark=columns.remark[:count],
        remarks=Remarks(*remark[:3].astype(np.int32), *remark[3:]), types=tuple(reader.types), events=tuple(reader.events),
        ignored=reader.ignored, replaced=tuple(reader.replaced), layers=reader.layers, parts=tuple(dict.fromkeys(reader.parts)),
        unsupported=tuple(reader.unsupported), announced=reader.announced, part_totals=tuple(reader.part_totals),
    )  # fmt: skip
    followed = np.searchsorted(reader.switches, np.arange(count), side="right") % 2 == 1 if reader.switches else np.zeros(0, bool)
    program = _in_axis_positions(program, np.flatnonzero(followed), reader)
    _tell_kinds(program.start, program.end, program.e_mm, program.kind)
    return program


def _in_axis_positions(program: ParsedProgram, followed: Indices, reader: Reader) -> ParsedProgram:
    """The program whose (m,) followed rows are axis positions too, with feeds by the measure of NIST."""
    asked = (program.feed < 0.0) | np.isinf(program.feed)
    asked[followed] = True
    if reader.dialect.largest_delta:
        asked |= (program.start[:, 3:] != program.end[:, 3:]).any(axis=1)
    odd = np.flatnonzero(asked)
    length, keep = _feed_length(program.changes(odd), reader.dialect.largest_delta), None
    if len(followed):
        program = replace(program, start=program.start.copy(), end=program.end.copy())
        for side in (program.start, program.end):
            side[followed, :3] = axis_positions(reader.machine, side[followed])
        keep = _turn_starts(program, followed)
    program.feed[odd] = _feeds(program.feed[odd], length, program.changes(odd), axis_speeds(reader.machine))
    return program if keep is None else _merge_turns(keep, program)


@kernel
def _tell_kinds(start: Floats, end: Floats, e_mm: Floats, kind: NDArray[np.int8]) -> None:
    """Fills in the MoveKind of each row."""
    for row in range(len(kind)):
        moved = False
        for k in range(3):
            moved = moved or abs(end[row, k] - start[row, k]) > STILL
        kind[row] = TRAVEL
        if abs(end[row, 3] - start[row, 3]) > STILL or abs(end[row, 4] - start[row, 4]) > STILL:
            kind[row] = ROTATE
        elif moved and e_mm[row] > STILL:
            kind[row] = EXTRUDE
        elif not moved and abs(e_mm[row]) > STILL:
            kind[row] = RETRACT


def _feed_length(change: Floats, largest: bool = False) -> Floats:
    """(n,) what F counts along (n, 6) changes, by the rule of NIST RS274.

    largest: of a pure turn only the axis that goes farthest (Klipper).
    """
    length, measure = lengths(change)
    return np.where(measure == 1, np.abs(change[:, 3:5]).max(axis=1, initial=0.0), length) if largest else length


def _feeds(given: Floats, asked: Floats, change: Floats, speeds: Floats) -> Floats:
    """Units per minute along what NIST counts, from feeds along another measure, inverse time, or as fast as the axes can."""
    length = _feed_length(change)
    with np.errstate(divide="ignore", invalid="ignore"):
        fastest = 60.0 * length / (np.abs(change) / speeds).max(axis=1)
        minutes = np.where(given < 0, -1.0 / given, asked / given)
        along = np.where(minutes > 0, length / minutes, fastest)
    along = np.where(np.isinf(given), fastest, along)
    along = np.where(np.isfinite(along) & (along > 0), along, 1.0)
    differs = (given < 0) | np.isinf(given) | (np.abs(asked - length) > STILL)
    return np.where(differs, along, given)


def _turn_starts(program: ParsedProgram, followed: Indices) -> NDArray[np.bool_]:
    """(n,) False for a row that only goes on with the turn of the row before: the head stays, the direction too."""
    start, end = program.start, program.end
    turn = end[:, 3:] - start[:, 3:]
    size = np.hypot(turn[:, 0], turn[:, 1])
    sway = np.abs(end[followed, :3] - start[followed, :3]).max(axis=1, initial=0.0)
    pure = np.zeros(len(size), dtype=np.bool_)
    pure[followed] = (size[followed] > STILL) & (program.e_mm[followed] == 0.0) & (sway < SWAY_MM)
    heading = turn / np.maximum(size, STILL)[:, None]
    goes_on = np.zeros(len(size), dtype=np.bool_)
    goes_on[1:] = pure[1:] & pure[:-1] & (np.abs(heading[1:] - heading[:-1]).max(axis=1, initial=0.0) < 0.01)
    goes_on[1:] &= np.abs(start[1:] - end[:-1]).max(axis=1, initial=0.0) < SWAY_MM
    goes_on[[event.row for event in program.events if event.row < len(size)]] = False
    end[pure, :3] = start[pure, :3]
    for row in np.flatnonzero(goes_on):
        start[row, :3] = end[row, :3] = start[row - 1, :3]
    return ~goes_on


def _merge_turns(keep: NDArray[np.bool_], program: ParsedProgram) -> ParsedProgram:
    """The program with each turn in one row, at the pace of the whole."""
    first = np.flatnonzero(keep)
    last = np.append(first[1:], len(keep)) - 1
    minutes = np.add.reduceat(_feed_length(program.changes()) / program.feed, first)
    merged_row = np.append(np.cumsum(keep) - 1, len(first))
    names = ("line", "start", "e_mm", "feed", "kind", "remark")
    merged = replace(
        program,
        **{name: getattr(program, name)[first] for name in names},
        end=program.end[last],
        events=tuple(replace(event, row=int(merged_row[event.row])) for event in program.events),
    )
    joined = first < last
    merged.feed[joined] = _feed_length(merged.changes())[joined] / minutes[joined]
    return merged
