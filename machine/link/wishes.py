"""Wishes: what a person or the printer has asked of a running print and what of it is still to be done."""

from collections import deque
from dataclasses import dataclass, field
from threading import Event as Flag

from machine.link import requests
from machine.link.control import Control, Request, Wish
from machine.link.framing import LINE_LIMIT
from machine.link.modal import Axes

AT_ONCE = 16  # wishes heeded in a turn: what asks without end must not hold up the print
AWAY = ("pausing", "paused")


class CancelledError(Exception):
    """The stop flag was set, or a person or the printer asked for the end."""


class EmergencyError(Exception):
    """A person asked for the emergency stop."""


@dataclass
class Wishes:
    """pause_s: since when a pause is wanted; resume: the print is to go on; lines: commands to be sent between those of the
    program; message: why the newest wish cannot be granted.
    """

    axes: Axes
    limit: int = LINE_LIMIT
    control: Control | None = None
    stop: Flag | None = None
    pause_s: float | None = None
    resume: bool = False
    lines: deque[str] = field(default_factory=deque)
    feed_percent: float = 100.0
    flow_percent: float = 100.0
    message: str = ""

    def heed(self, state: str, now_s: float) -> None:
        """Take what was asked since. Raises CancelledError, EmergencyError."""
        if self.stop is not None and self.stop.is_set():
            raise CancelledError
        for _ in range(AT_ONCE):
            request = None if self.control is None else self.control.take()
            if request is None:
                return
            self.grant(request, state, now_s)

    def grant(self, request: Request, state: str, now_s: float) -> None:
        """Take one wish. Raises CancelledError, EmergencyError."""
        wish = request.wish
        if wish is Wish.EMERGENCY_STOP:
            raise EmergencyError
        if wish is Wish.CANCEL:
            raise CancelledError
        if wish is Wish.PAUSE:
            self.pause_s = now_s if self.pause_s is None else self.pause_s
        elif wish is Wish.RESUME and state in AWAY:
            self.resume = True
        elif wish is Wish.RESUME:
            self.pause_s = None
        elif wish is Wish.LINE:
            self._line(request.text, state)
        else:
            self._override(wish, request.value)

    def resumed(self) -> None:
        """The pause is over."""
        self.pause_s, self.resume = None, False

    def told(self, command: str) -> None:
        """Take note of an M220 or M221 of the program itself; no firmware goes down to 0."""
        value = dict(requests.words(command)).get("S", 0.0)
        if value > 0 and command.startswith("M220"):
            self.feed_percent = value
        elif value > 0:
            self.flow_percent = value

    def undone(self) -> list[str]:
        """Commands that take the overrides back: the firmware would keep them for the next print."""
        pairs = (("M220", self.feed_percent), ("M221", self.flow_percent))
        return [f"{name} S100" for name, value in pairs if value != 100.0]

    def _line(self, text: str, state: str) -> None:
        why = requests.refusal(text, self.axes, state == "paused", self.limit)
        self.message = "" if why is None else f"not sent: {text.strip()[:40]!r}: {why}"
        if why is None:
            self.lines.append(text.partition(";")[0].strip())

    def _override(self, wish: Wish, value: float) -> None:
        feed = wish is Wish.FEED
        self.message = requests.percent(value, requests.FEED_PERCENT if feed else requests.FLOW_PERCENT) or ""
        if self.message:
            return
        if feed:
            self.feed_percent = value
        else:
            self.flow_percent = value
        self.lines.append(f"{'M220' if feed else 'M221'} S{value:g}")
