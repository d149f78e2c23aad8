"""Print state: where a print stands, from the questions before it to its end, and which state may follow which.

A print at a port, one on a print server and a printer in hand have the same states. `PrintStatus` is a moment of any of them: the
stream and the servers make it, a terminal's screen and the pages show it. `ProgramPosition` follows part and layer by the lines
of the program.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

from machine.gcode.line_text import begins_layer, begun_part, read_line
from machine.gcode.words import read_words, split_command
from machine.link.protocol.events import Temperature

OLD_HEAT_S = 15.0  # a printer reports every few seconds, and is asked when it does not


class PrintState(StrEnum):
    """A state by the word that people read."""

    CHECKING = "checking"  # nothing but questions has gone to the printer
    READY = "ready"  # a print can begin: a person's word is waited for, or a server prints nothing
    UPLOADING = "uploading"  # a print server gets the file
    PRINTING = "printing"
    PAUSING = "pausing"
    PAUSED = "paused"
    RESUMING = "resuming"
    RECONNECTING = "reconnecting"  # the port is lost
    FINISHING = "finishing"  # all lines are sent, the last moves are waited for
    IN_HAND = "in hand"  # nothing is printed: a person heats and moves the machine
    CANCELLING = "cancelling"  # the heaters go off
    DONE = "done"
    CANCELLED = "cancelled"  # by a person
    LEFT = "left"  # a print server goes on with it by itself
    DECLINED = "declined"  # a person did not want it: nothing has moved
    REFUSED = "refused"  # by a check: nothing has moved
    FAILED = "failed"
    OFFLINE = "offline"  # the print server is there, its printer is not

    @property
    def is_over(self) -> bool:
        """Whether a print has ended so."""
        return self in OVER

    @property
    def is_printing(self) -> bool:
        """Whether a print is under way."""
        return self in ACTIVE


S = PrintState
OVER = frozenset({S.DONE, S.CANCELLED, S.LEFT, S.DECLINED, S.REFUSED, S.FAILED})
UNHEARD = frozenset({S.CANCELLING, S.RECONNECTING})  # no report is taken
AWAY = frozenset({S.PAUSING, S.PAUSED})  # the tip, from the print
ACTIVE = frozenset({S.PRINTING, S.PAUSING, S.PAUSED, S.RESUMING, S.RECONNECTING, S.FINISHING, S.CANCELLING})
_ANY = ACTIVE | OVER  # a server tells of its print now and then, so these follow in any order; a cancel may be refused

TABLE: Mapping[PrintState, frozenset[PrintState]] = {
    S.CHECKING: _ANY | {S.READY, S.UPLOADING, S.IN_HAND},
    S.READY: _ANY | {S.UPLOADING},
    S.UPLOADING: _ANY,
    **{state: _ANY | {S.READY, S.OFFLINE} for state in ACTIVE},
    S.IN_HAND: OVER | {S.CANCELLING},
    S.LEFT: frozenset({S.CANCELLING}),  # a print that its server goes on with is stopped after all
    **{state: frozenset() for state in OVER - {S.LEFT}},
    S.OFFLINE: _ANY | {S.READY},
}


def follows(before: PrintState, after: PrintState) -> bool:
    """Whether a state may come after another."""
    return before is after or after in TABLE[before]


@dataclass(frozen=True)
class PrintStatus:
    """A moment of a print. None: not known (yet)."""

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
    layers: int | None = None  # of the part
    file_line: int = 0  # line in the program's file of the newest acknowledged command, from 1
    file: str = ""  # what a print server prints,
    bytes_read: int | None = None  # and how far into it
    at: Mapping[str, float] = field(default_factory=dict)  # where the axes stand, by their letters, mm and deg
    feed_percent: float = 100.0
    flow_percent: float = 100.0
    z_offset_mm: float = 0.0  # by which the tip is higher than programmed, along the tool
    message: str = ""  # the newest word to the person watching
    warning: str = ""  # what that person must know from now on, beside every message; "" when there is none
    heat_age_s: float = 0.0  # since the temperatures were reported
    homed: bool = False  # a printer in hand may be moved

    @property
    def heat_is_old(self) -> bool:
        """Whether the temperatures are only those last known."""
        return self.heat_age_s >= OLD_HEAT_S or self.state in UNHEARD or self.state.is_over

    def json(self) -> dict[str, Any]:
        """The status for a page, where nothing is nested but `at`."""
        values: dict[str, Any] = asdict(self)
        heat: dict[str, float | None] = values.pop("temperature")
        return values | heat | {"heat_is_old": self.heat_is_old}


@dataclass
class ProgramPosition:
    """The sender's place in the program, gathered line by line."""

    part: int | None = None
    parts: int | None = None
    layer: int | None = None
    percent: float | None = None
    minutes_left: float | None = None
    reported_at_s: float = 0.0

    def read_comment(self, line: str) -> bool:
        """Take note of what a line says behind its `;`; whether a layer begins there."""
        comment = read_line(line).comment.strip() if ";" in line else ""
        if not comment:
            return False
        if begins := begins_layer(comment):
            self.layer = 1 if self.layer is None else self.layer + 1
        elif part := begun_part(comment):
            self.part, self.layer, self.parts = part[0], None, part[1] or self.parts
        return begins

    def read_m73(self, command: str, now_s: float) -> None:
        """Take note of the P (per cent done) and R (minutes left) of an M73; nothing of another command."""
        name, rest = split_command(command.upper())
        if name != "M73":
            return
        words = dict(read_words(rest))
        self.percent = words.get("P", self.percent)
        if "R" in words:
            self.minutes_left, self.reported_at_s = words["R"], now_s

    def left_s(self, elapsed_s: float, feed_percent: float) -> float | None:
        """Time left by M73's last word, less what has passed since; None when it has said nothing."""
        if self.minutes_left is None:
            return None
        return max(0.0, 60.0 * self.minutes_left * 100.0 / feed_percent - (elapsed_s - self.reported_at_s))

    def share(self, acknowledged: int, total: int | None) -> float | None:
        """Done so far, 0 to 1: by M73, else by lines."""
        if self.percent is not None:
            return min(1.0, self.percent / 100.0)
        return acknowledged / total if total else None


def last_known(heat: Temperature, age_s: float) -> str:
    """Temperatures behind the last words of a print, for what hears no more of its heaters; "" where none were told."""
    return f"; {heat.words} as last known, {age_s:.0f} s before" if heat.words else ""
