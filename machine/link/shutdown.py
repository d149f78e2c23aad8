"""Leaving a printer safely in mid-print: moves stopped, heaters and fan off, the tip lifted; and the emergency stop."""

from collections.abc import Callable
from dataclasses import dataclass

from machine.link.medium import Medium, Wire
from machine.link.protocol.events import FirmwareFault, Ok, Position, Temperature, read_event
from profiles.errors import PortError

# The newline ends a half line. The lines carry no numbers, so they are understood whatever was lost before: M108 ends a wait
# for heat and M410 a move where the firmware reads them out of turn. Nothing homes or turns the table: the head may be
# inside the part.
ORDERS = b"\nM108\nM410\nM104 S0\nM140 S0\nM107\nM105\n"
AGAIN_S = 2.0  # noise may eat an order; without the proof they are given again this often
OLD_REPORTS_S = 1.0  # a report from before the orders proves nothing; a printer that never falls silent is not waited for
SETTLE_S = 20.0  # lines that the printer had already taken are run first
LIFT_S = 10.0  # a lift of some millimetres at any Z axis' speed
STOP = b"\nM112\n"  # without number: an emergency parser reads it from the raw bytes, any other firmware as a line of its own
STOP_AGAIN_S, STOP_MOST_S = 0.5, 2.0
PARTIAL_BYTES = 4096


@dataclass
class Listener:
    """What a wire says, line by line, outside of a conversation."""

    wire: Wire
    medium: Medium
    on_turn: Callable[[], None] = lambda: None  # may raise to end the listening
    _partial: bytes = b""

    def wait_for(self, is_wanted: Callable[[bytes], bool], end_s: float) -> bool:
        """Listen until a line is wanted (True) or the time has come (False)."""
        while self.medium.now_s() < end_s:
            self.on_turn()
            *lines, self._partial = (self._partial + self.wire.read()).split(b"\n")
            self._partial = self._partial[-PARTIAL_BYTES:]
            if any(is_wanted(line) for line in lines):
                return True
        return False


def heaters_off(wire: Wire, medium: Medium, timeout_s: float = SETTLE_S) -> bool:
    """Stop the printer and switch the heaters off; True when its own report shows targets of 0.

    Raises PortError when the port is gone.
    """
    wire.discard()
    start_s = medium.now_s()
    while wire.read() and medium.now_s() - start_s < OLD_REPORTS_S:
        pass
    listener, end_s = Listener(wire, medium), start_s + timeout_s
    while (now_s := medium.now_s()) < end_s:
        wire.write(ORDERS)
        if listener.wait_for(_shows_heaters_off, min(now_s + AGAIN_S, end_s)):
            return True
    return False


def lift_tip(wire: Wire, medium: Medium, words: str, feed_mm_min: float) -> Position | None:
    """A step away from the print; words: of G1, relative. Where the printer says it stands then. Raises PortError."""
    positions: list[Position] = []

    def reports_done(line: bytes) -> bool:
        event = read_event(line)
        position = event if isinstance(event, Position) else event.position if isinstance(event, Ok) else None
        positions.extend([position] if position is not None else [])
        return isinstance(event, Ok) and event.temperature is not None

    wire.write(f"\nM83\nG91\nG1 {words} F{feed_mm_min:.0f}\nG90\nM400\nM114\nM105\n".encode("ascii"))
    arrived = Listener(wire, medium).wait_for(reports_done, medium.now_s() + LIFT_S)
    return positions[-1] if arrived and positions else None


def emergency_stop(wire: Wire, medium: Medium) -> bool:
    """M112 ahead of everything that waits to be sent, and once more; True when the printer says that it has halted."""
    try:
        wire.discard()
        wire.write(STOP)
        start_s, listener = medium.now_s(), Listener(wire, medium)
        if listener.wait_for(_shows_halt, start_s + STOP_AGAIN_S):
            return True
        wire.write(STOP)
        return listener.wait_for(_shows_halt, start_s + STOP_MOST_S)
    except PortError:
        return False


def _shows_halt(line: bytes) -> bool:
    return isinstance(read_event(line), FirmwareFault)


def _shows_heaters_off(line: bytes) -> bool:
    event = read_event(line)
    report = event.temperature if isinstance(event, Ok) else event
    return isinstance(report, Temperature) and report.nozzle_target_c == 0 and report.bed_target_c in (0, None)
