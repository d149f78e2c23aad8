"""Medium: the wire and clock of a stream, real or simulated."""

from collections.abc import Callable
from dataclasses import dataclass, field
from time import monotonic, sleep
from typing import Protocol

from machine.link.port import SerialDevice, open_port, serial_devices
from machine.link.protocol.timeout import Timing
from profiles.errors import PortError

EVERY_S = 0.2

Traffic = Callable[[str, bytes], None]  # "<" received or ">" sent, and the bytes


class Wire(Protocol):
    """An open line to a printer; every method raises PortError when the printer is unreachable."""

    name: str

    def write(self, data: bytes) -> None:
        """Send all bytes."""

    def read(self) -> bytes:
        """The bytes received; waits briefly for the first, so that a loop does not spin."""

    def discard(self) -> None:
        """Discard bytes that are not sent yet."""

    def close(self) -> None:
        """Close the line; may be called twice."""


@dataclass(frozen=True)
class Medium:
    """Access to lines and to the clock."""

    open: Callable[[str, int], Wire] = open_port  # opens a line by name and baud rate; raises PortError
    now_s: Callable[[], float] = monotonic
    wait: Callable[[float], None] = sleep
    devices: Callable[[], tuple[SerialDevice, ...]] = serial_devices  # ports at which a lost printer may have come back
    # Longest wait for a port lost during a print: long enough to find the plug, short enough for a hot nozzle in the print.
    lost_s: float = 120.0
    timing: Timing = field(default_factory=Timing)


SERIAL = Medium()


def reopen(find: Callable[[], str | None], baud: int, medium: Medium, on_turn: Callable[[], None], end_s: float) -> Wire | None:
    """The wire to the printer once it is back; None when it is not by end_s.

    find: name of its port, None while it has none. on_turn() may raise to end the wait.
    """
    while medium.now_s() < end_s:
        on_turn()
        medium.wait(EVERY_S)
        if (name := find()) is None:
            continue
        try:
            return medium.open(name, baud)
        except PortError:
            continue
    return None
