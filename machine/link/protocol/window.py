"""Window: the lines in flight and their limit, the lines that have arrived, and those kept for repeats."""

from collections import deque
from typing import NamedTuple

from machine.firmware.firmware import FRAME_BYTES, LineRules
from machine.gcode.commands import command_in
from machine.link.protocol.framing import LINE_LIMIT, frame

GREETING_LINES = 2  # M115 and M105 are lines 1 and 2; a later Resend for one of them means that the printer restarted
HISTORY = 512  # lines kept for a repeat: far more than any printer's buffers hold
FIRST_NUMBER_AGAIN = 1000  # restarted numbers begin here: a printer that requests line 1 or 2 has restarted
CLEAN_LINES = 8  # acknowledgements awaited one by one before the window opens
# After each error four times as many: with a refused line the printer discards what it has of the next one, and may run the rest
# of it unchecked. A window of one line avoids this, and costs a tenth of the speed.
CAUTION_MOST = 8192
PLACES_MOST = 16  # Marlin's BUFSIZE is 4 to 16; a greater number is a damaged answer
NEAR = 8  # one acknowledgement too many or few is usual after noise; a Resend for a line further back is questioned


class LineInFlight(NamedTuple):
    """A line sent and not acknowledged yet."""

    number: int
    size: int
    asks_temperature: bool
    slow_timeout_s: float  # 0 for a quick command
    sent_s: float


class Window:
    """Lines counted from 1: `sent` is the last one sent, `acknowledged` the last one known to have arrived.

    The wire numbers equal these counts until they restart, and then differ by a constant. limit: characters of a line in the
    firmware's buffer; rx_bytes: size of its receive buffer; numbered: its answers name their lines.
    """

    def __init__(self, limit: int = LINE_LIMIT, rx_bytes: int = LineRules.rx_bytes) -> None:
        self._limit = limit
        self.rx_bytes = rx_bytes
        self.sent = 0
        self.acknowledged = 0
        self.flight: deque[LineInFlight] = deque()
        self._bytes = 0
        self._before = 0
        self._history: dict[int, bytes] = {}
        self.numbered = False
        self._free = self._clean = 0
        self._caution = CLEAN_LINES

    def reset(self, first: int = 1) -> None:
        """Start over with no line sent. first: wire number of the first line."""
        self.clear_flight()
        self.sent = self.acknowledged = 0
        self._before = 1 - first
        self._history.clear()

    def wire_number(self, number: int) -> int:
        """Wire number of a line."""
        return number - self._before

    def line_number(self, wire_number: int) -> int:
        """The line with a wire number."""
        return wire_number + self._before

    @property
    def last_acknowledged(self) -> int:
        """Wire number of the last acknowledged line."""
        return self.wire_number(self.acknowledged)

    def restart_numbers(self) -> None:
        """Give the next line the wire number FIRST_NUMBER_AGAIN + 1. Nothing may be in flight."""
        self._before = self.sent - FIRST_NUMBER_AGAIN
        self._history.clear()

    def can_mean(self, number: int) -> bool:
        """Whether a Resend can mean this line: it is kept or the next one, not far back and not of the greeting."""
        known = number in self._history or number == self.sent + 1
        return known and number > self.acknowledged - NEAR and self.wire_number(number) > GREETING_LINES

    def learn(self, rx_free: int | None) -> None:
        """Note a numbered answer, perhaps with the free places of the printer's queue."""
        self.numbered = True
        if rx_free is not None:
            self._free = max(self._free, min(rx_free + 1, PLACES_MOST))  # B still counts the line itself

    def slow_down(self) -> None:
        """Send lines one by one for a while, after a missing answer."""
        self._clean = 0

    def back_off(self) -> None:
        """Send lines one by one for longer than last time, after a refused line."""
        self._clean = 0
        self._caution = min(4 * self._caution, CAUTION_MOST)

    def places(self, rules: LineRules, emergency_parser: bool) -> int:
        """Number of lines in flight. Without an emergency parser one place stays free, for a printer to see an M112 at once."""
        if self._clean < self._caution:
            return 1
        if not self.numbered:
            return rules.places_plain
        if not self._free:
            return rules.places
        return self._free if emergency_parser else max(1, self._free - 1)

    def has_space(self, command: str, rules: LineRules, emergency_parser: bool) -> bool:
        """Whether a command may follow those in flight."""
        flight = self.flight
        if not flight:
            return True
        if len(flight) >= self.places(rules, emergency_parser) or flight[-1].slow_timeout_s or not self.fits_buffer(command):
            return False
        return not _slow_timeout_s(command)

    @property
    def at_slow_command(self) -> bool:
        """Whether a slow command is in flight."""
        return any(line.slow_timeout_s for line in self.flight)

    def fits_buffer(self, command: str) -> bool:
        """Whether a command fits the receive buffer even if everything in flight is still in it."""
        return self._bytes + len(command) + FRAME_BYTES + len(str(self.sent + 1 - self._before)) <= self.rx_bytes

    def send(self, command: str, now_s: float = 0.0) -> bytes:
        """Number a command and keep it for repeats; returns its bytes."""
        framed = frame(self.sent + 1 - self._before, command, self._limit)
        self.sent += 1
        self._history[self.sent] = framed
        self._history.pop(self.sent - HISTORY, None)
        self._add_in_flight(self.sent, framed, command, now_s)
        return framed

    def repeat(self, number: int, now_s: float = 0.0) -> bytes:
        """Bytes of an earlier line, in flight again."""
        framed = self._history[number]
        self._add_in_flight(number, framed, _unframed(framed), now_s)
        return framed

    def acknowledge(self, number: int | None) -> int:
        """Note that this line and all before it have arrived; returns their number, 0 when it is not in flight."""
        flight = self.flight
        if number is None or not flight or not flight[0].number <= number <= flight[-1].number:
            return 0
        count = 0
        while flight and flight[0].number <= number:
            self._bytes -= flight.popleft().size
            count += 1
        if number > self.acknowledged:
            self.acknowledged = number
        self._clean += count
        return count

    def clear_flight(self) -> None:
        """Note that nothing is in flight."""
        self.flight.clear()
        self._bytes = 0

    def oldest_question(self) -> int | None:
        """Number of the oldest M105 in flight."""
        return next((line.number for line in self.flight if line.asks_temperature), None)

    def command(self, number: int) -> str:
        """The command of a line that is kept, else ""."""
        framed = self._history.get(number)
        return "" if framed is None else _unframed(framed)

    def _add_in_flight(self, number: int, framed: bytes, command: str, now_s: float) -> None:
        self.flight.append(LineInFlight(number, len(framed), command == "M105", _slow_timeout_s(command), now_s))
        self._bytes += len(framed)


def _unframed(framed: bytes) -> str:
    """The command in a framed line."""
    return framed[framed.index(b" ") + 1 : framed.rindex(b"*")].decode("ascii")


def _slow_timeout_s(command: str) -> float:
    """Time limit for the answer to a slow command, s; 0 for a quick one. A slow command is sent alone."""
    if command[0] == "G" and command[1:2] in ("0", "1"):  # most lines of a program, never slow
        return 0.0
    return command_in(command).answer_s
