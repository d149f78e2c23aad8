"""Print state: the states of a print, from the checks before it to its end, and their transitions.

Prints at a port, on a print server and manual control share the states. `PrintStatus` is a snapshot of one: the stream and the
servers make it, the terminal and the pages show it. `ProgramPosition` follows part and layer by the program's lines.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from math import floor
from typing import Any

from machine.gcode.line_text import begins_layer, begun_part, read_line
from machine.gcode.words import read_words, split_command
from machine.link.protocol.events import Temperature
from machine.quantities import duration

OLD_HEAT_S = 15.0  # a printer reports every few seconds, or is queried


class PrintState(StrEnum):
    """A state, named as users read it."""

    CHECKING = "checking"  # only queries were sent to the printer
    READY = "ready"  # a print can begin: the user is asked, or a server is idle
    UPLOADING = "uploading"  # to a print server
    PRINTING = "printing"
    PAUSING = "pausing"
    PAUSED = "paused"
    RESUMING = "resuming"
    RECONNECTING = "reconnecting"  # the port is lost
    FINISHING = "finishing"  # all lines are sent, the last moves are awaited
    IN_HAND = "manual control"  # the user heats and moves the machine
    CANCELLING = "cancelling"  # the heaters are being switched off
    DONE = "done"
    CANCELLED = "cancelled"  # by the user
    LEFT = "left"  # a print server continues it by itself
    DECLINED = "declined"  # by the user: nothing has moved
    REFUSED = "refused"  # by a check: nothing has moved
    FAILED = "failed"
    OFFLINE = "offline"  # the print server responds, its printer does not

    @property
    def is_over(self) -> bool:
        """Whether a print has ended in this state."""
        return self in OVER

    @property
    def is_printing(self) -> bool:
        """Whether a print is running."""
        return self in ACTIVE

    @property
    def is_away(self) -> bool:
        """Whether the tip is away from the print, or on its way there."""
        return self in AWAY


S = PrintState
OVER = frozenset({S.DONE, S.CANCELLED, S.LEFT, S.DECLINED, S.REFUSED, S.FAILED})
UNHEARD = frozenset({S.CANCELLING, S.RECONNECTING})  # without reports
AWAY = frozenset({S.PAUSING, S.PAUSED})
ACTIVE = frozenset({S.PRINTING, S.PAUSING, S.PAUSED, S.RESUMING, S.RECONNECTING, S.FINISHING, S.CANCELLING})
_ANY = ACTIVE | OVER  # a server reports from time to time, so these follow in any order; a cancel may be refused

TABLE: Mapping[PrintState, frozenset[PrintState]] = {
    S.CHECKING: _ANY | {S.READY, S.UPLOADING, S.IN_HAND},
    S.READY: _ANY | {S.UPLOADING},
    S.UPLOADING: _ANY,
    **{state: _ANY | {S.READY, S.OFFLINE} for state in ACTIVE},
    S.IN_HAND: OVER | {S.CANCELLING},
    S.LEFT: frozenset({S.CANCELLING}),  # a print that continues on its server is stopped after all
    **{state: frozenset() for state in OVER - {S.LEFT}},
    S.OFFLINE: _ANY | {S.READY},
}


def follows(before: PrintState, after: PrintState) -> bool:
    """Whether a state may follow another."""
    return before is after or after in TABLE[before]


@dataclass(frozen=True)
class PrintStatus:
    """A snapshot of a print. None: unknown (yet)."""

    state: PrintState = PrintState.PRINTING
    elapsed_s: float = 0.0
    temperature: Temperature = field(default_factory=Temperature)
    sent: int = 0
    acknowledged: int = 0
    total: int | None = None
    left_s: float | None = None
    share: float | None = None
    part: int | None = None
    parts: int | None = None
    layer: int | None = None
    layers: int | None = None  # number of layers in the part
    file_line: int = 0  # line of the newest acknowledged command in the program's file, from 1
    file: str = ""  # printed by a print server,
    bytes_read: int | None = None  # and how far it was read
    at: Mapping[str, float] = field(default_factory=dict)  # positions of the axes by their letters, mm and deg
    feed_percent: float = 100.0
    flow_percent: float = 100.0
    z_offset_mm: float = 0.0  # by which the tip is higher than programmed, along the tool
    message: str = ""  # the newest message to the user
    warning: str = ""  # a lasting warning to the user, besides the messages; "" for none
    heat_age_s: float = 0.0  # since the temperatures were reported
    homed: bool = False  # under manual control: it may be moved

    @property
    def heat_is_old(self) -> bool:
        """Whether the temperatures are outdated."""
        return self.heat_age_s >= OLD_HEAT_S or self.state in UNHEARD or self.state.is_over

    def in_words(self, *more: str) -> str:
        """The state with the share that is done, `more`, the time left, and what the user is to know."""
        share = f", {floor(100.0 * self.share)} %" if self.share else ""
        left = f"{duration(self.left_s)} left" if self.left_s else ""
        return " · ".join(filter(None, (f"{self.state}{share}", *more, left, self.message, self.warning)))

    def json(self) -> dict[str, Any]:
        """The status for a page, with `at` as the only nested value, and what the state means: scripts list no states."""
        values: dict[str, Any] = asdict(self)
        heat: dict[str, float | None] = values.pop("temperature")
        state = self.state
        meaning = {"is_over": state.is_over, "is_printing": state.is_printing, "is_away": state.is_away}
        return values | heat | meaning | {"heat_is_old": self.heat_is_old}


@dataclass
class ProgramPosition:
    """The sender's place in the program, updated line by line."""

    part: int | None = None
    parts: int | None = None
    layer: int | None = None
    percent: float | None = None
    minutes_left: float | None = None
    reported_at_s: float = 0.0

    def read_comment(self, line: str) -> bool:
        """Read a line's comment; returns whether a layer begins there."""
        comment = read_line(line).comment.strip() if ";" in line else ""
        if not comment:
            return False
        if begins := begins_layer(comment):
            self.layer = 1 if self.layer is None else self.layer + 1
        elif part := begun_part(comment):
            self.part, self.layer, self.parts = part[0], None, part[1] or self.parts
        return begins

    def read_m73(self, command: str, now_s: float) -> None:
        """Read P (per cent done) and R (minutes left) of an M73; other commands are ignored."""
        name, rest = split_command(command.upper())
        if name != "M73":
            return
        words = dict(read_words(rest))
        self.percent = words.get("P", self.percent)
        if "R" in words:
            self.minutes_left, self.reported_at_s = words["R"], now_s

    def left_s(self, elapsed_s: float, feed_percent: float) -> float | None:
        """Time left by the last M73, less the time since, s; None without one."""
        if self.minutes_left is None:
            return None
        return max(0.0, 60.0 * self.minutes_left * 100.0 / feed_percent - (elapsed_s - self.reported_at_s))

    def share(self, acknowledged: int, total: int | None) -> float | None:
        """Fraction done, 0 to 1: by M73, else by lines."""
        if self.percent is not None:
            return min(1.0, self.percent / 100.0)
        return acknowledged / total if total else None


def last_known(heat: Temperature, age_s: float) -> str:
    """Suffix with the last temperatures, for a print whose heaters are no longer reported; "" without any."""
    return f"; {heat.words} as last known, {age_s:.0f} s before" if heat.words else ""
