"""State: what the firmware knows while a text is read, and the rows and events so far."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

from machine.firmware import Dialect, dialect_of
from machine.gcode.modes import E_AXIS, Modes, axes_of
from machine.gcode.part_totals import PartTotals
from machine.gcode.words import Word
from machine.reader.parsed import OWN, Event, Unheld
from machine.reader.table import Table
from profiles.machine import Machine

DEFAULT_FEED = 1500.0
Words = list[Word]


@dataclass(slots=True)
class Reader:
    """Position X Y Z tilt turn E, modes, and what the comments said.

    at: X Y Z tilt turn as the program counts them, all filament pushed so far. A row's feed below 0 is one over its minutes
    (G93), inf: as fast as the axes can.
    """

    machine: Machine
    dialect: Dialect
    modes: Modes
    letters: Mapping[str, int]
    home: list[float]
    at: list[float]
    table: Table
    feed_share: float = 1.0  # of M220, by which every F is multiplied
    flow: float = 1.0  # of M221, by which all filament that moves push is
    filament_mm2: float = 0.0  # of M200: E words are then mm3
    followed: bool = False
    printing: float = inf
    travelling: float = inf
    motion: str = ""
    retraction_mm: float = 3.0  # of G10 until M207 tells: Marlin's default
    retraction_feed: float = 2700.0
    retracted: bool = False
    nozzle_c: float = 0.0
    bed_c: float = 0.0
    ended: int = 0
    part: int = 0
    layer: int = 0
    layers: int = 0
    type: int = 0
    width: float = 0.0
    height: float = 0.0
    number: int = 0
    condition: int | None = None  # how far the condition is indented on which the lines below it depend (RepRapFirmware)
    turning: list[tuple[int, float, float]] = field(default_factory=list)
    types: dict[str, int] = field(default_factory=lambda: {"": 0})
    parts: list[int] = field(default_factory=list)
    announced: int = 0
    part_totals: list[PartTotals] = field(default_factory=list)
    switches: list[int] = field(default_factory=list)  # rows from which on X Y Z are places on the table, or no more
    events: list[Event] = field(default_factory=list)
    ignored: dict[str, tuple[int, int]] = field(default_factory=dict)
    replaced: list[tuple[int, str]] = field(default_factory=list)  # lines whose text is shown otherwise than written
    unsupported: list[Unheld] = field(default_factory=list)

    def row(self, before: list[float], feed: float) -> None:
        """A move from a place to where the machine is now."""
        acceleration = self.printing if self.at[E_AXIS] != before[E_AXIS] else self.travelling
        remark = (self.part, self.layer, self.type, self.width, self.height, acceleration)
        self.table.add(self.number, before, self.at, feed, remark)

    def note(self, code: str, value: float, letters: str) -> None:
        """Put an event on record, before the next row."""
        self.events.append(Event(self.number, code, value, letters, self.table.rows))

    def ignore(self, code: str) -> None:
        """Count what is not understood and does not move."""
        first, count = self.ignored.get(code, (self.number, 0))
        self.ignored[code] = (first, count + 1)

    def own(self, code: str) -> None:
        """Count a macro of the machine's own, which may home and heat unseen, and put it on record."""
        self.ignore(code)
        self.note(OWN, 0.0, code)


def reader_of(machine: Machine, room: int) -> Reader:
    """A reader that has read nothing, with room for so many rows: the machine stands at home."""
    modes = Modes(axes_of(machine), feed=DEFAULT_FEED, strict=True)
    linear = [min(max(0.0, axis.limits_mm[0]), axis.limits_mm[1]) for axis in (machine.x, machine.y, machine.z)]
    home = [*linear, machine.tilt.zero_deg, machine.turn.zero_deg, 0.0]
    return Reader(machine, dialect_of(machine), modes, modes.axes.words, home, home.copy(), Table(room))
