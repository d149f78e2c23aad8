"""Table: the rows of a reader as arrays in axis positions, feeds in the terms of the timeline."""

import numpy as np
from numpy.typing import NDArray

from machine.kinematics.coordinates import axis_positions
from machine.planning.timing import axis_speeds
from machine.reader.parsed import Event, MoveKind, ParsedProgram
from machine.reader.state import ROW, Reader
from mdp.mesh import Floats

STILL = 1e-9
SWAY_MM = 0.05  # a followed turn, which goes in straight steps and rounded places, lets the head leave its place by less


def parsed_program(reader: Reader) -> ParsedProgram:
    """All that was read."""
    table = np.array(reader.rows, dtype=np.float64).reshape(-1, ROW)
    start, end, feed = table[:, 1:6], table[:, 7:12], table[:, 13]
    e_mm = table[:, 12] - table[:, 6]
    events = tuple(reader.events)
    asked = _feed_length(np.column_stack([end - start, e_mm]), reader.dialect.largest_delta)
    rows = np.flatnonzero(table[:, 20] > 0)
    if len(rows):
        start, end = start.copy(), end.copy()
        for side in (start, end):
            side[rows, :3] = axis_positions(reader.machine, side[rows])
        keep = _turn_starts(start, end, e_mm, rows, events)
    change = np.column_stack([end - start, e_mm])
    feed = _feeds(feed, asked, change, axis_speeds(reader.machine))
    if len(rows):
        start, end, e_mm, feed, table, events = _merge_turns(keep, start, end, e_mm, feed, change, table, events)
        change = np.column_stack([end - start, e_mm])
    whole = table[:, [0, 14, 15, 16]].astype(np.int64)
    return ParsedProgram(
        line=whole[:, 0], start=start, end=end, e_mm=e_mm, filament_mm=np.cumsum(e_mm), feed=feed, kind=_kinds(change),
        part=whole[:, 1], layer=whole[:, 2], type=whole[:, 3], types=tuple(reader.types),
        width_mm=table[:, 17], height_mm=table[:, 18], acceleration=table[:, 19],
        events=events, ignored=reader.ignored,
        layers=reader.layers, parts=tuple(dict.fromkeys(reader.parts)), unsupported=tuple(reader.unsupported),
        announced=reader.announced, part_totals=tuple(reader.part_totals),
    )  # fmt: skip


def _kinds(change: Floats) -> NDArray[np.int8]:
    moved = np.abs(change) > STILL
    travelled = moved[:, :3].any(axis=1)
    return np.select(
        [moved[:, 3:5].any(axis=1), travelled & (change[:, 5] > STILL), ~travelled & moved[:, 5]],
        [MoveKind.ROTATE, MoveKind.EXTRUDE, MoveKind.RETRACT],
        MoveKind.TRAVEL,
    ).astype(np.int8)


def _feed_length(change: Floats, largest: bool = False) -> Floats:
    """(n,) what F counts along (n, 6) changes: X Y Z; where they stand still the rotary axes; else filament.

    largest: of a pure turn only the axis that goes farthest (Klipper), else sqrt(tilt^2 + turn^2) (NIST RS274).
    """
    path = np.sqrt((change[:, :3] ** 2).sum(axis=1))
    turned = np.abs(change[:, 3:5]).max(axis=1, initial=0.0) if largest else np.hypot(change[:, 3], change[:, 4])
    length: Floats = np.where(path > STILL, path, np.where(turned > STILL, turned, np.abs(change[:, 5])))
    return length


def _feeds(feed: Floats, asked: Floats, change: Floats, speeds: Floats) -> Floats:
    """Units per minute along what NIST counts, from the firmware's own measure, inverse time, or as fast as the axes can."""
    length = _feed_length(change)
    other = (feed < 0) | np.isinf(feed) | (np.abs(asked - length) > STILL)
    if not other.any():
        return feed
    rows = np.flatnonzero(other)
    given, of, want = feed[rows], length[rows], asked[rows]
    with np.errstate(divide="ignore", invalid="ignore"):
        fastest = 60.0 * of / (np.abs(change[rows]) / speeds).max(axis=1)
        minutes = np.where(given < 0, -1.0 / given, want / given)
        along = np.where(minutes > 0, of / minutes, fastest)
    feed = feed.copy()
    along = np.where(np.isinf(given), fastest, along)
    feed[rows] = np.where(np.isfinite(along) & (along > 0), along, 1.0)
    return feed


def _turn_starts(
    start: Floats, end: Floats, e_mm: Floats, rows: NDArray[np.int64], events: tuple[Event, ...]
) -> NDArray[np.bool_]:
    """(n,) False for a row that only goes on with the turn of the row before: the head stays, the direction too."""
    turn = end[:, 3:] - start[:, 3:]
    size = np.hypot(turn[:, 0], turn[:, 1])
    pure = np.zeros(len(size), dtype=np.bool_)
    pure[rows] = (
        (size[rows] > STILL) & (e_mm[rows] == 0.0) & (np.abs(end[rows, :3] - start[rows, :3]).max(axis=1, initial=0.0) < SWAY_MM)
    )
    heading = turn / np.maximum(size, STILL)[:, None]
    goes_on = np.zeros(len(size), dtype=np.bool_)
    goes_on[1:] = pure[1:] & pure[:-1] & (np.abs(heading[1:] - heading[:-1]).max(axis=1, initial=0.0) < 0.01)
    goes_on[1:] &= np.abs(start[1:] - end[:-1]).max(axis=1, initial=0.0) < SWAY_MM
    goes_on[[event.row for event in events if event.row < len(size)]] = False
    end[pure, :3] = start[pure, :3]
    for row in np.flatnonzero(goes_on):
        start[row, :3] = end[row, :3] = start[row - 1, :3]
    keep: NDArray[np.bool_] = ~goes_on
    return keep


def _merge_turns(
    keep: NDArray[np.bool_], start: Floats, end: Floats, e_mm: Floats, feed: Floats, change: Floats, table: Floats,
    events: tuple[Event, ...],
) -> tuple[Floats, Floats, Floats, Floats, Floats, tuple[Event, ...]]:  # fmt: skip
    """The rows with each turn in one piece, at the pace of the whole."""
    first = np.flatnonzero(keep)
    last = np.append(first[1:], len(keep)) - 1
    minutes = np.add.reduceat(_feed_length(change) / feed, first)
    place = np.append(np.cumsum(keep) - 1, len(first))
    moved = tuple(Event(e.line, e.code, e.value, e.letters, int(place[e.row])) for e in events)
    joined = first < last
    start, end, e_mm, feed, table = start[first], end[last], e_mm[first], feed[first].copy(), table[first]
    whole = _feed_length(np.column_stack([end - start, e_mm]))
    feed[joined] = whole[joined] / minutes[joined]
    return start, end, e_mm, feed, table, moved
