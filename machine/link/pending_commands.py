"""Pending commands: requests of the user or the printer to a running print, not carried out yet.

Any thread makes requests through a Control; PendingCommands, in the port's thread, refuses or holds them.
"""

import re
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum, auto
from threading import Event as Flag

from machine.gcode.commands import command_in
from machine.gcode.modes import Axes, ModalState
from machine.gcode.words import read_words, split_command
from machine.link.print_state import AWAY, PrintState
from machine.link.protocol.framing import LINE_LIMIT, command_of
from profiles.errors import LocalProtocolError

MOST_AT_ONCE = 16  # requests taken per turn: a flood of requests must not hold up the print
# Marlin allows 10 to 999 per cent; beyond 300 the planner starves, beyond 200 the extruder slips.
FEED_PERCENT, FLOW_PERCENT = (10.0, 300.0), (10.0, 200.0)
KEEPS_OFFSET = " MOVE=1"  # ends the command of a firmware (Klipper) whose Z offset outlasts homing, and so the print
MOST_OFFSET_MM = 2.0  # the whole Z offset of a print: an error beyond this is one of homing


class Command(Enum):
    """Commands to a running print."""

    PAUSE = auto()
    RESUME = auto()
    CANCEL = auto()
    EMERGENCY_STOP = auto()
    FEED = auto()  # value: per cent of the programmed feed rates
    FLOW = auto()  # value: per cent of the programmed filament
    BABYSTEP = auto()  # value: mm by which to raise the tip along the tool: machine Z, however the table is tilted
    LINE = auto()  # text: a line of G-code from the user


@dataclass(frozen=True)
class PendingCommand:
    """A command with its value or text."""

    command: Command
    value: float = 100.0
    text: str = ""


class Control:
    """Requests in order, an emergency stop first. Call ask() from any thread, take() from the stream's.

    stop: when set, it ends the print like CANCEL.
    """

    def __init__(self, stop: Flag | None = None) -> None:
        self.stop = stop or Flag()
        self._waiting: deque[PendingCommand] = deque()

    def ask(self, command: Command, value: float = 100.0, text: str = "") -> None:
        """Add a request."""
        add = self._waiting.appendleft if command is Command.EMERGENCY_STOP else self._waiting.append
        add(PendingCommand(command, value, text))

    def take(self) -> PendingCommand | None:
        """Remove and return the oldest request; None when there is none."""
        return self._waiting.popleft() if self._waiting else None


class CancelledError(Exception):
    """The stop flag was set, or the user or the printer requested the end."""


class EmergencyError(Exception):
    """The user requested the emergency stop."""


@dataclass
class PendingCommands:
    """The accepted requests."""

    axes: Axes
    limit: int = LINE_LIMIT
    control: Control = field(default_factory=Control)
    pause_s: float | None = None  # when a pause was requested
    resume: bool = False  # the print is to continue
    lines: deque[str] = field(default_factory=deque)  # to be sent between those of the program
    feed_percent: float = 100.0
    flow_percent: float = 100.0
    babystep: str = ""  # the firmware's command for {} mm; "": it has none
    z_offset_mm: float = 0.0  # as requested
    sent_offset_mm: float = 0.0  # as far as it was sent
    message: str = ""  # why the newest request was refused

    def poll(self, state: PrintState, now_s: float) -> None:
        """Take the new requests. Raises CancelledError, EmergencyError."""
        if self.control.stop.is_set():
            raise CancelledError
        for _ in range(MOST_AT_ONCE):
            request = self.control.take()
            if request is None:
                return
            self.accept(request, state, now_s)

    def heed_emergency(self) -> None:
        """Discard requests, for a print that is ending. Raises EmergencyError for an emergency stop."""
        while (request := self.control.take()) is not None:
            if request.command is Command.EMERGENCY_STOP:
                raise EmergencyError

    def accept(self, request: PendingCommand, state: PrintState, now_s: float) -> None:
        """Take one request. Raises CancelledError, EmergencyError."""
        command = request.command
        if command is Command.EMERGENCY_STOP:
            raise EmergencyError
        if command is Command.CANCEL:
            raise CancelledError
        if command is Command.PAUSE:
            self.pause_s = now_s if self.pause_s is None else self.pause_s
        elif command is Command.RESUME and state in AWAY:
            self.resume = True
        elif command is Command.RESUME:
            self.pause_s = None
        elif command is Command.LINE:
            self._queue_line(request.text, state)
        elif state is PrintState.FINISHING:
            self.message = "the print is finishing: nothing can be changed"
        elif command is Command.BABYSTEP:
            self._shift(request.value)
        else:
            self._override(command, request.value)

    def next_lines(self, modal: ModalState) -> Iterator[str]:
        """The user's commands to send now; settings that they change hold for the rest of the print."""
        while self.lines:
            command = self.lines.popleft()
            before, _, after = self.babystep.partition("{}")
            if self.babystep and command.startswith(before) and command.endswith(after):
                self.sent_offset_mm += float(command.removeprefix(before).removesuffix(after))
            self.note_override(command)
            yield command
            if not command_in(command).moves:
                modal.take(command)

    def begin_offset(self, babystep: str, offset_mm: float) -> None:
        """Note the firmware's command for a Z offset, now that it is known, and the offset of an interrupted print. Requests that
        turn out to be impossible are dropped with a message."""
        before, _, after = self.babystep.partition("{}")
        wanted_mm = round(self.z_offset_mm + offset_mm, 3)
        if self.z_offset_mm and (refusal := offset_refusal(wanted_mm, babystep)):
            kept = (line for line in self.lines if not (line.startswith(before) and line.endswith(after)))
            self.lines, wanted_mm, self.message = deque(kept), offset_mm, refusal
        self.babystep, self.z_offset_mm, self.sent_offset_mm = babystep, wanted_mm, offset_mm

    def end_pause(self) -> None:
        """Note the end of the pause."""
        self.pause_s, self.resume = None, False

    def note_override(self, command: str) -> None:
        """Note an M220 or M221 of the program or the user; no firmware accepts 0."""
        name, rest = split_command(command.upper())
        value = dict(read_words(rest)).get("S", 0.0) if name in ("M220", "M221") else 0.0
        if value > 0 and name == "M220":
            self.feed_percent = value
        elif value > 0:
            self.flow_percent = value

    def undo_overrides(self) -> list[str]:
        """Commands that reset the sent overrides, which the firmware would keep for the next print."""
        undone = percents_undone(self.feed_percent, self.flow_percent)
        offset_mm = round(self.sent_offset_mm, 3)
        return [*undone, offset_undone(offset_mm, self.babystep)] if offset_mm else undone

    @property
    def kept(self) -> str:
        """A sentence on the settings that the firmware keeps for the next print if this one stops now; "" for none."""
        return kept_settings(self.feed_percent, self.flow_percent, round(self.sent_offset_mm, 3), self.babystep)

    def _queue_line(self, text: str, state: PrintState) -> None:
        why = line_refusal(text, self.axes, state is PrintState.PAUSED, self.limit)
        self.message = "" if why is None else f"not sent: {text.strip()[:40]!r}: {why}"
        if why is None:
            self.lines.append(command_of(text, "the command", self.limit))

    def _shift(self, by_mm: float) -> None:
        by_mm = round(by_mm, 3)  # as it is sent
        wanted_mm = round(self.z_offset_mm + by_mm, 3)
        self.message = offset_refusal(wanted_mm, self.babystep) or ""
        if not self.message:
            self.z_offset_mm = wanted_mm
            self.lines.append(self.babystep.format(f"{by_mm:.3f}"))

    def _override(self, command: Command, value: float) -> None:
        feed = command is Command.FEED
        self.message = percent_refusal(value, FEED_PERCENT if feed else FLOW_PERCENT) or ""
        if self.message:
            return
        if feed:
            self.feed_percent = value
        else:
            self.flow_percent = value
        self.lines.append(f"{'M220' if feed else 'M221'} S{value:g}")


def percent_refusal(value: float, bounds: tuple[float, float]) -> str | None:
    """Why a percentage is refused; None when it is allowed."""
    low, high = bounds
    return None if low <= value <= high else f"{value:g} % is not possible: {low:g} to {high:g} % are allowed"


def offset_refusal(wanted_mm: float, babystep: str) -> str | None:
    """Why a Z offset cannot be had, None when it can. babystep: the firmware's command for it."""
    if not babystep:
        return "no Z offset: this firmware cannot shift Z now (Marlin needs BABYSTEPPING, and Z homed since it started)"
    allowed = f"{-MOST_OFFSET_MM:g} to {MOST_OFFSET_MM:g} mm are allowed"
    return None if abs(wanted_mm) <= MOST_OFFSET_MM else f"a Z offset of {wanted_mm:.3g} mm is not possible: {allowed}"


def offset_undone(offset_mm: float, babystep: str) -> str:
    """The command that takes a Z offset back; Klipper's does not move, because the motors may be off by now."""
    return babystep.format(f"{-offset_mm:.3f}").removesuffix(KEEPS_OFFSET)


def percents_undone(feed_percent: float, flow_percent: float) -> list[str]:
    """The commands that set feed and flow back to 100 %."""
    return [f"{name} S100" for name, value in (("M220", feed_percent), ("M221", flow_percent)) if value != 100.0]


def kept_settings(feed_percent: float, flow_percent: float, offset_mm: float, babystep: str) -> str:
    """A sentence on the user's settings that a firmware keeps for the next print, with the commands that undo them; "" for none.
    Every firmware keeps feed and flow; babystep: its command for a Z offset, which most reset by homing."""
    undone = percents_undone(feed_percent, flow_percent)
    percents = (("feed", feed_percent), ("flow", flow_percent))
    settings = [f"the {name} of {value:g} %" for name, value in percents if value != 100.0]
    if offset_mm and babystep.endswith(KEEPS_OFFSET):
        undone.append(offset_undone(offset_mm, babystep))
        settings.append(f"the Z offset of {offset_mm:+g} mm")
    return f"the printer keeps {' and '.join(settings)}: before another print send it {' and '.join(undone)}" if undone else ""


def line_refusal(text: str, axes: Axes, paused: bool, limit: int) -> str | None:
    """Why the user's command may not be sent now; None when it may.

    During a pause filament may be pushed and pulled to change it; every other move is refused.
    """
    try:
        command = command_of(text, "the command", limit)
    except LocalProtocolError as error:
        return str(error)
    if not command:
        return "there is no command in it"
    name, row = split_command(command.upper())[0], command_in(command)
    if row.homes or row.moves == "table" or row.probes:
        return f"{name} homes, probes or turns an axis: the tip may stand inside the print"
    if row.motors:
        return f"{name} switches the motors: the print would lose its position"
    if row.changes:
        return f"{name} changes what the rest of the program means"
    if row.moves and not (paused and _filament_only(command)):
        return f"{name} moves the machine: during a pause filament alone may move, else nothing"
    return None


def _filament_only(command: str) -> bool:
    """Whether a move has no axis word."""
    words = set(re.findall(r"[A-Z]", command.upper()[2:]))
    return split_command(command.upper())[0] in ("G0", "G1") and "E" in words and words <= {"E", "F"}
