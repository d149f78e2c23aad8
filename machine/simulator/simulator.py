"""A simulated printer on a real pseudo-terminal: the firmware in a thread, reached through a device path like any printer.

Where there are no pseudo-terminals it listens on a TCP port of this computer.
"""

import select
import socket
import threading
from collections.abc import Iterable
from math import inf
from pathlib import Path
from time import monotonic
from typing import Any, Self

from machine.simulator.board import BuildOptions, build_options
from machine.simulator.cable import Cable, Uart
from machine.simulator.contact import ProbedTable
from machine.simulator.faults import Fault, FaultScript
from machine.simulator.firmware import BUSY_S, SimulatedFirmware
from machine.simulator.record import Record
from machine.simulator.terminal import Server, Terminal, terminals_exist
from profiles.machine import Machine

UNREAD_BYTES = 1 << 20  # answers kept for a host that does not read; older ones are dropped beyond


class SimulatedPrinter:
    """`with SimulatedPrinter(machine) as printer:` open printer.path with pyserial, look at printer.record afterwards.

    speed: virtual seconds in a real one; inf never sleeps, the clock jumps over every wait. faults: what goes wrong; after a
    disconnection the terminal is gone (reading fails) and comes back at a new printer.path, or behind the same `link` (a symbolic
    link to keep). tcp: a port number of this computer (0: a free one) instead of a terminal; path is then a socket:// address.
    baud: every byte takes the time of 10 bits, both ways, and what a ring of machine.receive_bytes cannot hold is lost (build
    of your own say it themselves); None: USB, as fast as the system, and the host waits. The rate a host opens the path
    with means nothing. kept_moves: how many moves the record holds at least, None: all (120 bytes a move).
    table: what its probe meets, None: it has none.
    Without pseudo-terminals path is a socket:// address, too. Raises PortError for a link or port that is taken, and for a link
    where there are no terminals.
    """

    def __init__(
        self,
        machine: Machine,
        speed: float = inf,
        *,
        build: BuildOptions | None = None,
        faults: FaultScript | Iterable[Fault] = (),
        link: Path | None = None,
        tcp: int | None = None,
        baud: int | None = None,
        kept_moves: int | None = None,
        table: ProbedTable | None = None,
    ) -> None:
        if not speed > 0:
            raise ValueError(f"speed is {speed:g}: it must be above 0")
        # `busy:` must come in real time, or a slow simulation would look dead to the sender.
        self._firmware = SimulatedFirmware(
            machine, build or build_options(machine, baud), BUSY_S * min(1.0, speed), kept_moves, table
        )
        self._cable = Cable(self._firmware, faults if isinstance(faults, FaultScript) else FaultScript(tuple(faults)), speed)
        self._line = self._cable if baud is None else Uart(self._cable, baud)
        self._lock = threading.Lock()
        self._link, self._tcp = link, tcp
        self._out = b""
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        by_terminal = self._tcp is None and (self._link is not None or terminals_exist())
        self._terminal: Terminal | Server = Terminal(self._link) if by_terminal else Server(self._tcp or 0)
        self._terminal.open()
        self._end, self._wake = socket.socketpair()  # Windows cannot wait for pipes
        self._began_s = monotonic()
        self._thread = threading.Thread(target=self._serve, name="simulated printer", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._wake.send(b"x")
        if self._thread is not None:
            self._thread.join()
        self._terminal.close()
        if isinstance(self._terminal, Server):
            self._terminal.end()
        for end in (self._end, self._wake):
            end.close()

    @property
    def path(self) -> str:
        """What to open; another one after a disconnection."""
        return self._terminal.path

    @property
    def record(self) -> Record:
        """What has been executed so far."""
        with self._lock:
            return self._firmware.record()

    def _serve(self) -> None:
        """Read, work, answer, until __exit__ writes to the pipe."""
        data, there = b"", True
        while True:
            now_s = monotonic() - self._began_s
            with self._lock:
                answer = self._line.exchange(data, now_s)
            if there != self._cable.connected(now_s):
                there = not there
                self._plug(there)
            if there:
                self._answer(answer)
            reading = [] if self._line.reads_nothing(now_s) else self._terminal.readable_ends()
            writing = self._terminal.writable_ends() if self._out else []
            waited_for: list[Any] = [*reading, self._end]
            readable, _, _ = select.select(waited_for, writing, [], self._pause_s(now_s))
            if self._end in readable:
                return
            data = self._terminal.read() if readable else b""

    def _plug(self, there: bool) -> None:
        self._out = b""
        self._line.clear()
        if there:
            self._terminal.open()
        else:
            self._terminal.close()

    def _pause_s(self, now_s: float) -> float | None:
        """How long nothing happens unless the host says something; None: for ever."""
        due_s = self._line.due_s(now_s)
        return None if due_s == inf else max(0.0, due_s - (monotonic() - self._began_s))

    def _answer(self, answer: bytes) -> None:
        if answer or self._out:
            self._out = (self._out + answer)[-UNREAD_BYTES:]
            self._out = self._out[self._terminal.write(self._out) :]
