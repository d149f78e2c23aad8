"""Medium: what a stream runs on, so that a printer, a simulated one in memory, real and virtual time serve alike."""

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
    """An open line to a printer; every method raises PortError when the printer cannot be reached any more."""

    name: str

    def write(self, data: bytes) -> None:
        """Send all bytes."""

    def read(self) -> bytes:
        """The bytes that have come; waits a little for the first, so that a loop around it does not spin."""

    def discard(self) -> None:
        """Forget bytes that were handed over but not sent yet."""

    def close(self) -> None:
        """Close; closing twice is allowed."""


@dataclass(frozen=True)
class Medium:
    """Access to lines and to the clock."""

    open: Callable[[str, int], Wire] = open_port  # a line by its name, at a baud rate; raises PortError
    now_s: Callable[[], float] = monotonic
    wait: Callable[[float], None] = sleep
    devices: Callable[[], tuple[SerialDevice, ...]] = serial_devices  # where a lost port may have come back
    # The longest wait for a port that was lost in mid-print: a person finds the plug in two minutes, and a hot nozzle should not
    # stand in the print for longer.
    lost_s: float = 120.0
    timing: Timing = field(default_factory=Timing)


SERIAL = Medium()


def reopen(find: Callable[[], str | None], baud: int, medium: Medium, on_turn: Callable[[], None], end_s: float) -> Wire | None:
    """The wire to the printer once it is there again, None when it is not by end_s.

    find: the name of its port, None while it has none. on_turn() may raise to end the wait.
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
