"""The lines between sender and printer: which are in flight, which were acknowledged, which can be repeated."""

from collections import deque
from dataclasses import dataclass

from machine.link.framing import LINE_LIMIT, frame, name_of

RX_BYTES = 127  # an AVR's 128-byte receive ring holds one byte less; a fuller one loses bytes without a word
HISTORY = 512  # lines kept for a repeat: far more than any printer's buffers hold

# Commands whose `ok` takes its time, with the most it may take, s. They are sent alone.
BUDGET_S = {
    "G4": 3600.0,
    "G28": 600.0,
    "G29": 1800.0,
    "M109": 3600.0,
    "M190": 3600.0,
    "M191": 3600.0,
    "M303": 3600.0,
    "M400": 3600.0,
    "M600": 86400.0,
}


@dataclass(frozen=True, slots=True)
class Sent:
    """A line in flight."""

    number: int
    size: int
    asks_temperature: bool
    budget_s: float


class Window:
    """Wire numbers run from 1; `sent` is the last one given, `acknowledged` the last one known to have arrived.

    limit: characters of a line that the firmware keeps.
    """

    def __init__(self, limit: int = LINE_LIMIT) -> None:
        self._limit = limit
        self.sent = 0
        self.acknowledged = 0
        self.flight: deque[Sent] = deque()
        self._bytes = 0
        self._history: dict[int, bytes] = {}

    def reset(self) -> None:
        """Numbers begin anew."""
        self.ground()
        self.sent = self.acknowledged = 0
        self._history.clear()

    def room(self, command: str, lines: int) -> bool:
        """Whether a command may follow what is in flight, at most `lines` of them together."""
        flight = self.flight
        if not flight:
            return True
        if len(flight) >= lines or flight[-1].budget_s or self._bytes + len(command) + 16 > RX_BYTES:
            return False
        return not budget_s(command)

    def launch(self, command: str) -> bytes:
        """Give a command the next number, keep it for repeats; its bytes."""
        framed = frame(self.sent + 1, command, self._limit)
        self.sent += 1
        self._history[self.sent] = framed
        self._history.pop(self.sent - HISTORY, None)
        self._fly(self.sent, framed, command)
        return framed

    def repeat(self, number: int) -> bytes:
        """The bytes of an earlier line, in flight again."""
        framed = self._history[number]
        self._fly(number, framed, framed[framed.index(b" ") + 1 : framed.rindex(b"*")].decode("ascii"))
        return framed

    def acknowledge(self, number: int | None) -> int:
        """This line and all before it have arrived; how many that were, 0 when it is not in flight."""
        flight = self.flight
        if number is None or not flight or not flight[0].number <= number <= flight[-1].number:
            return 0
        count = 0
        while flight and flight[0].number <= number:
            self._bytes -= flight.popleft().size
            count += 1
        self.acknowledged = max(self.acknowledged, number)
        return count

    def ground(self) -> None:
        """Nothing is in flight any more."""
        self.flight.clear()
        self._bytes = 0

    def question(self) -> int | None:
        """The oldest M105 in flight."""
        return next((line.number for line in self.flight if line.asks_temperature), None)

    def _fly(self, number: int, framed: bytes, command: str) -> None:
        self.flight.append(Sent(number, len(framed), command == "M105", budget_s(command)))
        self._bytes += len(framed)


def budget_s(command: str) -> float:
    """The time budget of a slow command, 0 for a quick one."""
    if command[0] == "G" and command[1:2] in ("0", "1"):  # most lines of a program; none of these is slow
        return 0.0
    return BUDGET_S.get(name_of(command), 0.0)
