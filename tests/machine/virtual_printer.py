"""A simulated printer in memory with its own clock, and random faults for it.

A print of hours takes seconds and every run is the same.
"""

import random
from collections.abc import Sequence
from math import inf

from machine.link.medium import Medium
from machine.link.port import READ_S, WRITE_S
from machine.simulator.board import BuildOptions, build_options
from machine.simulator.cable import Cable, Uart
from machine.simulator.contact import ProbedTable
from machine.simulator.faults import BYTE_KINDS, KINDS, OK_KINDS, Fault, FaultScript, Kind
from machine.simulator.firmware import SimulatedFirmware
from machine.simulator.record import Record
from profiles.errors import PortError
from profiles.machine import Machine

TURN_S = 1e-4  # duration of a turn of the host: time passes even if an answer is always ready
PATH = "virtual"
LINE_BYTES = 36  # of a stroke on the wire, so that byte faults hit the lines
MOST_S = 3.0  # maximum duration of random delays and stalls
HEALED: tuple[Kind, ...] = (*BYTE_KINDS[:3], *OK_KINDS, "spurious resend")  # a sender recovers from these without stopping


class EndlessError(Exception):
    """The permitted virtual time is over."""


class VirtualPrinter:
    """`print_lines(lines, PATH, medium=printer.medium)`: the host's time is this printer's, and passes only while the host waits.

    faults, baud, table: see SimulatedPrinter. After most_s the host is stopped with EndlessError, because it hangs.
    """

    def __init__(
        self,
        machine: Machine,
        build: BuildOptions | None = None,
        faults: FaultScript | None = None,
        baud: int | None = None,
        most_s: float = inf,
        table: ProbedTable | None = None,
    ) -> None:
        self.firmware = SimulatedFirmware(machine, build or build_options(machine, baud), table=table)
        self.now_s = 0.0
        self._most_s = most_s
        self._cable = Cable(self.firmware, faults, speed=1.0)
        self._line = self._cable if baud is None else Uart(self._cable, baud)
        self.medium = Medium(self._open, lambda: self.now_s, self._pass)

    @property
    def record(self) -> Record:
        """The record of the moves executed until now."""
        return self.firmware.record()

    def _open(self, name: str, baud: int) -> "_Line":
        del baud
        if not self._cable.connected(self.now_s):
            self._pass(READ_S)
            raise PortError(f"port {name} does not exist: no serial port was found")
        return _Line(self, name)

    def _pass(self, seconds: float) -> None:
        self.now_s += seconds
        if self.now_s > self._most_s:
            raise EndlessError(f"{self._most_s:g} s of virtual time are over")

    def exchange(self, data: bytes, seconds: float) -> bytes:
        """Send bytes and wait up to this number of seconds for an answer; OSError while the cable is unplugged."""
        end_s = self.now_s + seconds
        self._pass(TURN_S)
        received = self._exchange_now(data)
        while not received and self.now_s < end_s:
            self._pass(max(min(self._line.due_s(self.now_s), end_s) - self.now_s, TURN_S))
            received = self._exchange_now(b"")
        return received

    @property
    def blocked(self) -> bool:
        """Whether the printer reads nothing, so that writing blocks."""
        return self._cable.blocked(self.now_s) and not self.firmware.has_ring

    def _exchange_now(self, data: bytes) -> bytes:
        if not self._cable.connected(self.now_s):
            self._line.clear()
            raise OSError
        return self._line.exchange(data, self.now_s)


class _Line:
    """One opening of the port."""

    def __init__(self, printer: VirtualPrinter, name: str) -> None:
        self.name = name
        self._printer = printer
        self._received = b""
        self._gone = False

    def write(self, data: bytes) -> None:
        """Send all bytes."""
        if self._printer.blocked:
            self._exchange(b"", WRITE_S)
            if self._printer.blocked:
                raise PortError(f"the printer at {self.name} has stopped reading: it took no bytes for {WRITE_S:g} s")
        self._received += self._exchange(data, 0.0)

    def read(self) -> bytes:
        """The bytes received; waits up to READ_S for the first."""
        received, self._received = self._received, b""
        return received or self._exchange(b"", READ_S)

    def discard(self) -> None:
        """Nothing is buffered."""

    def close(self) -> None:
        """Bytes that come while the port is closed are lost."""
        self._gone = True

    def _exchange(self, data: bytes, seconds: float) -> bytes:
        try:
            if self._gone:
                raise OSError
            return self._printer.exchange(data, seconds)
        except OSError:
            self._gone = True
            raise PortError(f"the connection at {self.name} was lost: is the cable or the printer unplugged?") from None


def random_script(
    seed: int, count: int, lines: range, kinds: Sequence[Kind] = KINDS, line_bytes: int = LINE_BYTES
) -> FaultScript:
    """`count` faults of these kinds at random places of those lines, reproducible by the seed.

    line_bytes: length of a line on the wire, so that byte faults hit the lines. Answers are assumed to be half as long. One in
    eight of the stalls, blocks and disconnections lasts forever.
    """
    rng = random.Random(seed)
    return FaultScript(tuple(_random_fault(rng, rng.choice(kinds), lines, line_bytes) for _ in range(count)), seed)


def _random_fault(rng: random.Random, kind: Kind, lines: range, line_bytes: int) -> Fault:
    line, to_host = rng.choice(lines), rng.random() < 0.5
    seconds = inf if rng.random() < 0.125 and kind != "delay" else rng.uniform(0.05, MOST_S)
    if kind in BYTE_KINDS:
        at = int((line + rng.random()) * line_bytes / (2 if to_host else 1))
        return Fault(kind, at, to_host, rng.randrange(8), seconds=seconds)
    value = max(1, line - rng.randint(-2, 12)) if kind == "spurious resend" else None
    return Fault(kind, line, value=value, seconds=seconds)
