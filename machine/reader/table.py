"""Table: the rows of a reader as arrays in axis positions, feeds in the terms of the timeline."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.gcode.modes import E_AXIS
from machine.kinematics.coordinates import axis_positions
from machine.planning.timing import axis_speeds, lengths
from machine.reader.parsed import Event, MoveKind, ParsedProgram, Remarks
from machine.reader.state import ACCELERATION, AFTER, BEFORE, FEED, FOLLOWED, HEIGHT, LAYER, LINE, PART, ROW, TYPE, WIDTH, Reader
from mdp.mesh import Floats

E_BEFORE, E_AFTER = BEFORE + E_AXIS, AFTER + E_AXIS
AT_ONCE = 16_384  # rows
TOLD = (PART, LAYER, TYPE, WIDTH, HEIGHT, ACCELERATION)  # as in Remarks
COLUMNS: dict[str, type[np.generic]] = {
    "line": np.int32, "e_mm": np.float64, "feed": np.float64, "kind": np.int8, "remark": np.int32,
}  # fmt: skip
STILL = 1e-9
SWAY_MM = 0.05  # a followed turn, which goes in straight steps and rounded places, lets the head leave its place by less


@dataclass(frozen=True, eq=False)
class _Rows:
    """n rows in axis positions. read: (n, ROW) what the reader has of each; start, end: (n, 5); feed: (n,)."""

    read: Floats
    start: Floats
    end: Floats
    feed: Floats
    events: tuple[Event, ...]

    @property
    def e_mm(self) -> Floats:
        """(n,) filament pushed."""
        pushed: Floats = self.read[:, E_AFTER] - self.read[:, E_BEFORE]
        return pushed

    def change(self) -> Floats:
        """(n, 6) of X Y Z tilt turn E."""
        return np.column_stack([self.end - self.start, self.e_mm])


class Table:
    """The rows of a reader as they come, in columns: what the reader has of a row takes twice as much.

    There is room for a row a line; arcs, which have several, make more. Where every row begins at the end of the one before it,
    as nearly always, starts and ends are the same places.
    """

    def __init__(self, reader: Reader, room: int) -> None:
        self._reader, self._count, self._events = reader, 0, list[Event]()
        self._places, self._starts = np.empty((room + 1, E_AXIS)), np.empty((0, E_AXIS))
        self._columns = {name: np.empty(room, kind) for name, kind in COLUMNS.items()}
        self._remarks, self._told = [np.empty((0, len(TOLD)))], np.full((1, len(TOLD)), np.nan)

    def take_some(self) -> None:
        """Take the rows once there are many, after a bead: no turn goes on there."""
        rows = self._reader.rows
        if len(rows) >= AT_ONCE * ROW and not self._reader.turning and rows[E_BEFORE - ROW] != rows[E_AFTER - ROW]:
            self._take()

    def _take(self) -> None:
        """Take all rows that the reader has now from it."""
        reader = self._reader
        read = np.array(reader.rows, dtype=np.float64).reshape(-1, ROW)
        events = [replace(event, row=event.row - reader.taken) for event in reader.events]
        reader.taken += len(read)
        del reader.rows[:], reader.events[:]
        rows = _in_axis_positions(read, tuple(events), reader)
        begin, end = self._count, self._count + len(rows.read)
        self._events += [replace(event, row=begin + event.row) for event in rows.events]
        self._make_room(end)
        self._place(rows)
        values = {"line": rows.read[:, LINE], "e_mm": rows.e_mm, "feed": rows.feed, "kind": _kinds(rows.change())}
        for name, column in (values | {"remark": self._remark(rows.read[:, TOLD])}).items():
            self._columns[name][begin:end] = column
        self._count = end

    def _place(self, rows: _Rows) -> None:
        """Starts and ends of further rows."""
        begin, end = self._count, self._count + len(rows.read)
        if begin == end:
            return
        if not begin:
            self._places[0] = rows.start[0]
        before = np.vstack([self._places[begin], rows.end[:-1]])
        if not len(self._starts) and not np.array_equal(rows.start, before):
            self._starts = np.empty((len(self._places) - 1, E_AXIS))
            self._starts[:begin] = self._places[:begin]
        if len(self._starts):
            self._starts[begin:end] = rows.start
        self._places[begin + 1 : end + 1] = rows.end

    def _remark(self, told: Floats) -> NDArray[np.int64]:
        """(k,) which remarks hold for some rows, given what has been told of each: those that follow each other often have the
        same.
        """
        new = (told != np.vstack([self._told, told[:-1]])[: len(told)]).any(axis=1)
        known = sum(map(len, self._remarks))
        self._remarks.append(told[new])
        self._told = told[-1:] if len(told) else self._told
        return np.cumsum(new) + (known - 1)

    def _make_room(self, count: int) -> None:
        if count < len(self._places):
            return
        self._places = _longer(self._places, 2 * count + 1)
        self._starts = _longer(self._starts, 2 * count) if len(self._starts) else self._starts
        self._columns = {name: _longer(column, 2 * count) for name, column in self._columns.items()}

    def program(self) -> ParsedProgram:
        """All that was read."""
        self._take()
        reader, count, told = self._reader, self._count, np.concatenate(self._remarks).T
        return ParsedProgram(
            **{name: column[:count] for name, column in self._columns.items()},
            start=(self._starts if len(self._starts) else self._places)[:count], end=self._places[1 : count + 1],
            remarks=Remarks(*told[:3].astype(np.int32), *told[3:]), types=tuple(reader.types),
            events=tuple(self._events), ignored=reader.ignored, replaced=tuple(reader.replaced),
            layers=reader.layers, parts=tuple(dict.fromkeys(reader.parts)), unsupported=tuple(reader.unsupported),
            announced=reader.announced, part_totals=tuple(reader.part_totals),
        )  # fmt: skip


def _longer(column: NDArray[Any], length: int) -> NDArray[Any]:
    """An array with room for more."""
    longer = np.empty((length, *column.shape[1:]), column.dtype)
    longer[: len(column)] = column
    return longer


def _in_axis_positions(read: Floats, events: tuple[Event, ...], reader: Reader) -> _Rows:
    """Rows that were read, as the machine's axes go."""
    start, end = (read[:, first : first + E_AXIS] for first in (BEFORE, AFTER))
    rows = _Rows(read, start, end, read[:, FEED], events)
    asked = _feed_length(rows.change(), reader.dialect.largest_delta)
    followed = np.flatnonzero(read[:, FOLLOWED] > 0)
    if len(followed):
        rows = replace(rows, start=rows.start.copy(), end=rows.end.copy())
        for side in (rows.start, rows.end):
            side[followed, :3] = axis_positions(reader.machine, side[followed])
        keep = _turn_starts(rows, followed)
    change = rows.change()
    rows = replace(rows, feed=_feeds(rows.feed, asked, change, axis_speeds(reader.machine)))
    return _merge_turns(keep, rows, change) if len(followed) else rows


def _kinds(change: Floats) -> NDArray[np.int8]:
    moved = np.abs(change) > STILL
    travelled = moved[:, :3].any(axis=1)
    return np.select(
        [moved[:, 3:5].any(axis=1), travelled & (change[:, 5] > STILL), ~travelled & moved[:, 5]],
        [MoveKind.ROTATE, MoveKind.EXTRUDE, MoveKind.RETRACT],
        MoveKind.TRAVEL,
    ).astype(np.int8)


def _feed_length(change: Floats, largest: bool = False) -> Floats:
    """(n,) what F counts along (n, 6) changes, by the rule of NIST RS274.

    largest: of a pure turn only the axis that goes farthest (Klipper).
    """
    length, measure = lengths(change)
    return np.where(measure == 1, np.abs(change[:, 3:5]).max(axis=1, initial=0.0), length) if largest else length


def _feeds(feed: Floats, asked: Floats, change: Floats, speeds: Floats) -> Floats:
    """Units per minute along what NIST counts, from the firmware's own measure, inverse time, or as fast as the axes can."""
    length = _feed_length(change)
    differs = (feed < 0) | np.isinf(feed) | (np.abs(asked - length) > STILL)
    if not differs.any():
        return feed
    rows = np.flatnonzero(differs)
    given, of, want = feed[rows], length[rows], asked[rows]
    with np.errstate(divide="ignore", invalid="ignore"):
        fastest = 60.0 * of / (np.abs(change[rows]) / speeds).max(axis=1)
        minutes = np.where(given < 0, -1.0 / given, want / given)
        along = np.where(minutes > 0, of / minutes, fastest)
    feed = feed.copy()
    along = np.where(np.isinf(given), fastest, along)
    feed[rows] = np.where(np.isfinite(along) & (along > 0), along, 1.0)
    return feed


def _turn_starts(rows: _Rows, followed: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(n,) False for a row that only goes on with the turn of the row before: the head stays, the direction too."""
    start, end = rows.start, rows.end
    turn = end[:, 3:] - start[:, 3:]
    size = np.hypot(turn[:, 0], turn[:, 1])
    sway = np.abs(end[followed, :3] - start[followed, :3]).max(axis=1, initial=0.0)
    pure = np.zeros(len(size), dtype=np.bool_)
    pure[followed] = (size[followed] > STILL) & (rows.e_mm[followed] == 0.0) & (sway < SWAY_MM)
    heading = turn / np.maximum(size, STILL)[:, None]
    goes_on = np.zeros(len(size), dtype=np.bool_)
    goes_on[1:] = pure[1:] & pure[:-1] & (np.abs(heading[1:] - heading[:-1]).max(axis=1, initial=0.0) < 0.01)
    goes_on[1:] &= np.abs(start[1:] - end[:-1]).max(axis=1, initial=0.0) < SWAY_MM
    goes_on[[event.row for event in rows.events if event.row < len(size)]] = False
    end[pure, :3] = start[pure, :3]
    for row in np.flatnonzero(goes_on):
        start[row, :3] = end[row, :3] = start[row - 1, :3]
    return ~goes_on


def _merge_turns(keep: NDArray[np.bool_], rows: _Rows, change: Floats) -> _Rows:
    """The rows with each turn in one piece, at the pace of the whole."""
    first = np.flatnonzero(keep)
    last = np.append(first[1:], len(keep)) - 1
    minutes = np.add.reduceat(_feed_length(change) / rows.feed, first)
    merged_row = np.append(np.cumsum(keep) - 1, len(first))
    events = tuple(replace(event, row=int(merged_row[event.row])) for event in rows.events)
    merged = _Rows(rows.read[first], rows.start[first], rows.end[last], rows.feed[first], events)
    joined = first < last
    merged.feed[joined] = _feed_length(merged.change())[joined] / minutes[joined]
    return merged
