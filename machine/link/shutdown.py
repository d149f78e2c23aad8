"""Leaving a printer safely in mid-print: moves stopped, heaters and fan off, the tip lifted; and the emergency stop."""

from collections.abc import Callable
from dataclasses import dataclass

from machine.link.events import FirmwareFault, Ok, Position, Temperature, read_event
from machine.link.medium import Medium, Wire
from profiles.errors import PortError

# The newline ends a half line. The lines carry no numbers, so they are understood whatever was lost before: M108 ends a wait
# for heat and M410 a move where the firmware reads them out of turn. Nothing homes or turns the table: the head may be
# inside the part.
ORDERS = b"\nM108\nM410\nM104 S0\nM140 S0\nM107\nM105\n"
AGAIN_S = 2.0  # noise may eat an order; without the proof they are given again this often
OLD_WORDS_S = 1.0  # a report from before the orders proves nothing; a printer that never falls silent is not waited for
SETTLE_S = 20.0  # lines that the printer had already taken are run first
LIFT_S = 10.0  # a lift of some millimetres at any Z axis' speed
STOP = b"\nM112\n"  # without number: an emergency parser reads it from the raw bytes, any other firmware as a line of its own
STOP_AGAIN_S, STOP_MOST_S = 0.5, 2.0
HELD_BYTES = 4096


@dataclass
class Listener:
    """What a wire says, line by line, outside of a conversation."""

    wire: Wire
    medium: Medium
    heed: Callable[[], None] = lambda: None  # once a turn; may raise to end the listening
    _half: bytes = b""

    def until(self, end_s: float, wanted: Callable[[bytes], bool]) -> bool:
        """Listen until a line is wanted (True) or the time has come (False)."""
        while self.medium.now_s() < end_s:
            self.heed()
            *lines, self._half = (self._half + self.wire.read()).split(b"\n")
            self._half = self._half[-HELD_BYTES:]
            if any(wanted(line) for line in lines):
                return True
        return False


def heaters_off(wire: Wire, medium: Medium, patience_s: float = SETTLE_S) -> bool:
    """Stop the printer and switch the heaters off; True when its own report shows targets of 0.

    Raises PortError when the port is gone.
    """
    wire.discard()
    began_s = medium.now_s()
    while wire.read() and medium.now_s() - began_s < OLD_WORDS_S:
        pass
    listener, end_s = Listener(wire, medium), began_s + patience_s
    while (now_s := medium.now_s()) < end_s:
        wire.write(ORDERS)
        if listener.until(min(now_s + AGAIN_S, end_s), _cold):
            return True
    return False


def lift(wire: Wire, medium: Medium, words: str, feed_mm_min: float) -> Position | None:
    """A step away from the print; words: of G1, relative. Where the printer says it stands then. Raises PortError."""
    places: list[Position] = []

    def done(line: bytes) -> bool:
        event = read_event(line)
        place = event if isinstance(event, Position) else event.position if isinstance(event, Ok) else None
        places.extend([place] if place is not None else [])
        return isinstance(event, Ok) and event.temperature is not None

    wire.write(f"\nM83\nG91\nG1 {words} F{feed_mm_min:.0f}\nG90\nM400\nM114\nM105\n".encode("ascii"))
    arrived = Listener(wire, medium).until(medium.now_s() + LIFT_S, done)
    return places[-1] if arrived and places else None


def emergency_stop(wire: Wire, medium: Medium) -> bool:
    """M112 ahead of everything that waits to be sent, and once more; True when the printer says that it has halted."""
    try:
        wire.discard()
        wire.write(STOP)
        began_s, listener = medium.now_s(), Listener(wire, medium)
        if listener.until(began_s + STOP_AGAIN_S, _halted):
            return True
        wire.write(STOP)
        return listener.until(began_s + STOP_MOST_S, _halted)
    except PortError:
        return False


def _halted(line: bytes) -> bool:
    return isinstance(read_event(line), FirmwareFault)


def _cold(line: bytes) -> bool:
    event = read_event(line)
    report = event.temperature if isinstance(event, Ok) else event
    return isinstance(report, Temperature) and report.nozzle_target_c == 0 and report.bed_target_c in (0, None)
