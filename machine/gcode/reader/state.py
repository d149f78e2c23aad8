"""Reader state: the firmware's state while a text is read, and rows and events in columns that a kernel can write to."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from machine.firmware import Dialect, dialect_of
from machine.gcode.commands import BED, NOZZLE
from machine.gcode.modes import E_AXIS, Modes, axes_of
from machine.gcode.reader.parsed import OWN, Event
from machine.gcode.settings import PartTotals
from mdp.mesh import Floats
from profiles.machine import Machine
from slicer.paths import Unsupported

DEFAULT_FEED = 1500.0
REMARK_COLUMNS = 6  # columns of remark_rows: part, layer, type, width, height, acceleration
ROOM = 1024  # remarks
Words = Mapping[str, float]  # words of one command; the last one of a repeated letter


class Columns(NamedTuple):
    """Space for rows. places: (room + 1, 5), row k ends at k + 1; starts: (room, 5) starts of rows, (0, 5) as long as each starts
    at the end of the one before it, as is usual; remark_rows: (k, REMARK_COLUMNS) space for remarks."""

    line: NDArray[np.int32]
    e_mm: Floats
    feed: Floats
    remark: NDArray[np.int32]
    places: Floats
    starts: Floats
    remark_rows: Floats


@dataclass(slots=True)
class Reader:
    """Position X Y Z tilt turn E, modes, the state set by comments, and the rows so far.

    at: X Y Z tilt turn as the program counts them, all filament pushed so far. A row's feed below 0 is one over its minutes
    (G93), inf: as fast as the axes can. Consecutive rows often share a remark, with the values of comments and M204.
    """

    machine: Machine
    dialect: Dialect
    modes: Modes
    letters: Mapping[str, int]
    home: list[float]
    at: list[float]
    columns: Columns
    rows: int = 0
    remarks: int = 0
    feed_share: float = 1.0  # set by M220: factor on every F
    flow: float = 1.0  # set by M221: factor on all filament
    filament_mm2: float = 0.0  # set by M200: E words are then mm³
    followed: bool = False
    printing: float = inf
    travelling: float = inf
    motion: str = ""
    retraction_mm: float = 3.0  # retraction by G10 until M207 sets it: Marlin's default
    retraction_feed: float = 2700.0
    retracted: bool = False
    nozzle_c: float = 0.0
    bed_c: float = 0.0
    ended: bool = False
    part: int = 0
    layer: int = 0
    layers: int = 0
    type: int = 0
    width: float = 0.0
    height: float = 0.0
    number: int = 0
    condition: int | None = None  # indent of the condition on which the lines below it depend (RepRapFirmware)
    turning: list[tuple[int, float, float]] = field(default_factory=list)
    types: dict[str, int] = field(default_factory=lambda: {"": 0})
    parts: list[int] = field(default_factory=list)
    announced: int = 0
    part_totals: list[PartTotals] = field(default_factory=list)
    switches: list[int] = field(default_factory=list)  # rows from which X Y Z are positions relative to the table, or no longer
    events: list[Event] = field(default_factory=list)
    ignored: dict[str, tuple[int, int]] = field(default_factory=dict)
    replaced: list[tuple[int, str]] = field(default_factory=list)  # lines whose displayed text differs from the file
    unsupported: list[tuple[int, int, Unsupported]] = field(default_factory=list)

    def make_room(self, place: list[float], rows: int) -> None:
        """Make space for further rows, the first of which starts at a position (X Y Z tilt turn, then anything)."""
        count, columns, room = self.rows, self.columns, len(self.columns.places) - 1
        if count + rows > room:
            fixed = ("remark_rows",) if len(columns.starts) else ("remark_rows", "starts")
            longer = {n: _longer(c, 2 * (count + rows) + 1) for n, c in columns._asdict().items() if n not in fixed}
            columns = columns._replace(**longer)
        if self.remarks == len(columns.remark_rows):
            columns = columns._replace(remark_rows=_longer(columns.remark_rows, 2 * self.remarks))
        if count == 0:
            columns.places[0] = place[:E_AXIS]
        elif not len(columns.starts) and columns.places[count].tolist() != place[:E_AXIS]:
            columns = columns._replace(starts=_longer(columns.places[:count], len(columns.line)))
        self.columns = columns

    def row(self, before: list[float], feed: float) -> None:
        """Add a move from a position to the current one."""
        self.make_room(before, 1)
        columns, row = self.columns, self.rows
        acceleration = self.printing if self.at[E_AXIS] != before[E_AXIS] else self.travelling
        remark = [self.part, self.layer, self.type, self.width, self.height, acceleration]
        if not self.remarks or columns.remark_rows[self.remarks - 1].tolist() != remark:
            columns.remark_rows[self.remarks] = remark
            self.remarks += 1
        columns.line[row], columns.feed[row], columns.remark[row] = self.number, feed, self.remarks - 1
        columns.e_mm[row] = self.at[E_AXIS] - before[E_AXIS]
        columns.places[row + 1] = self.at[:E_AXIS]
        if len(columns.starts):
            columns.starts[row] = before[:E_AXIS]
        self.rows += 1

    def note(self, code: str, value: float = 0.0, letters: str = "") -> None:
        """Record an event before the next row; heater targets are remembered."""
        if code in NOZZLE:
            self.nozzle_c = value
        elif code in BED:
            self.bed_c = value
        self.events.append(Event(self.number, code, value, letters, self.rows))

    def ignore(self, code: str) -> None:
        """Count an unknown command that moves nothing."""
        first, count = self.ignored.get(code, (self.number, 0))
        self.ignored[code] = (first, count + 1)

    def own(self, code: str) -> None:
        """Count and record a macro defined by the machine, which may home and heat unseen."""
        self.ignore(code)
        self.note(OWN, letters=code)


def reader_of(machine: Machine, room: int) -> Reader:
    """An empty reader with space for `room` rows; the machine is at home."""
    modes = Modes(axes_of(machine), feed=DEFAULT_FEED, strict=True)
    linear = [min(max(0.0, axis.limits_mm[0]), axis.limits_mm[1]) for axis in (machine.x, machine.y, machine.z)]
    home = [*linear, machine.tilt.zero_deg, machine.turn.zero_deg, 0.0]
    columns = Columns(
        np.empty(room, np.int32), np.empty(room), np.empty(room), np.empty(room, np.int32),
        np.empty((room + 1, E_AXIS)), np.empty((0, E_AXIS)), np.empty((ROOM, REMARK_COLUMNS)),
    )  # fmt: skip
    return Reader(machine, dialect_of(machine), modes, modes.axes.words, home, home.copy(), columns)


def _longer(column: NDArray[Any], length: int) -> NDArray[Any]:
    """A copy of an array with more space."""
    longer = np.empty((length, *column.shape[1:]), column.dtype)
    longer[: len(column)] = column
    return longer
