"""Simulated printer on a real pseudo-terminal: the firmware in a thread, reached through a device path like any printer.

Without pseudo-terminals it listens on a TCP port of this computer. The host opens a Terminal or a Server.
"""

import os
import select
import socket
import threading
from collections import deque
from collections.abc import Iterable
from contextlib import suppress
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
from profiles.errors import PortError, reason
from profiles.machine import Machine

UNREAD_BYTES = 1 << 20  # answers kept for a host that does not read; older ones are dropped beyond
READ_BYTES = 4096
TAKEN, MOST_OTHERS = b"echo:busy: another program talks to this simulated printer\n", 8
TERMINALS = ("/dev/pts/", "/dev/tty")


class SimulatedPrinter:
    """`with SimulatedPrinter(machine) as printer:` open printer.path with pyserial, then examine printer.record.

    speed: virtual seconds per real second; inf never sleeps and skips every wait. faults: to inject; after a disconnection the
    terminal is gone (reading fails) and returns at a new printer.path, or behind the same symbolic link. at: path of that link,
    or a TCP port number of this computer (0: a free one) instead of a terminal; path is then a socket:// address. baud: every
    byte takes the time of 10 bits, both ways, and what exceeds a ring of machine.receive_bytes is lost (explicit builds define it
    themselves); None: USB, as fast as the system, and the host waits. The rate at which a host opens the path has no effect.
    kept_moves: least number of recorded moves, None: all (120 bytes each). table: surface for its probe, None: no probe. Without
    pseudo-terminals path is a socket:// address, too. Raises PortError for a link or port that is taken, and for a link on a
    system without terminals.
    """

    def __init__(
        self,
        machine: Machine,
        speed: float = inf,
        *,
        build: BuildOptions | None = None,
        faults: FaultScript | Iterable[Fault] = (),
        at: Path | int | None = None,
        baud: int | None = None,
        kept_moves: int | None = None,
        table: ProbedTable | None = None,
    ) -> None:
        if not speed > 0:
            raise ValueError(f"speed is {speed:g}: it must be above 0")
        # `busy:` must come in real time, or the sender would give a slow simulation up.
        self._firmware = SimulatedFirmware(
            machine, build or build_options(machine, baud), BUSY_S * min(1.0, speed), kept_moves, table
        )
        self._cable = Cable(self._firmware, faults if isinstance(faults, FaultScript) else FaultScript(tuple(faults)), speed)
        self._line = self._cable if baud is None else Uart(self._cable, baud)
        self._lock = threading.Lock()
        self._at = at
        self._out = b""
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        self._terminal: Terminal | Server
        if isinstance(self._at, Path) or (self._at is None and terminals_exist()):
            self._terminal = Terminal(self._at)
        else:
            self._terminal = Server(self._at or 0)
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
        """The path to open; it may change after a disconnection."""
        return self._terminal.path

    @property
    def record(self) -> Record:
        """The record so far."""
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
        """Time until something happens without the host, s; None: for ever."""
        due_s = self._line.due_s(now_s)
        return None if due_s == inf else max(0.0, due_s - (monotonic() - self._began_s))

    def _answer(self, answer: bytes) -> None:
        if answer or self._out:
            self._out = (self._out + answer)[-UNREAD_BYTES:]
            self._out = self._out[self._terminal.write(self._out) :]


class Terminal:
    """A raw pseudo-terminal. link: a symbolic link to keep on its path. Raises PortError when something else is there."""

    def __init__(self, link: Path | None = None) -> None:
        if link is not None and (link.exists() or link.is_symlink()) and not _leads_to_a_terminal(link):
            raise PortError(f"{link} exists and is not a link to a terminal: the simulated printer does not replace it")
        self._link = link
        self._master = self._slave = -1
        self._device = self.path = ""

    def open(self) -> None:
        """Open the terminal; after close() the path changes, unless a link leads to it. Raises PortError on systems without
        terminals."""
        try:
            import tty

            self._master, self._slave = os.openpty()
        except (ImportError, AttributeError, OSError) as error:
            raise PortError(f"the simulated printer needs a pseudo-terminal, which this system does not give ({error})") from None
        # Raw: no echo, no conversion of newlines. The slave end stays open, so that the terminal outlives each host.
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._device = os.ttyname(self._slave)
        if self._link is not None:
            self._make_link(self._link)
        self.path = str(self._link or self._device)  # at once: another thread may read it

    def close(self) -> None:
        """Unplug the cable: the host's next read or write fails."""
        if self._master < 0:
            return
        self._unlink()
        for descriptor in (self._master, self._slave):
            os.close(descriptor)
        self._master = self._slave = -1

    def readable_ends(self) -> list[int]:
        """Descriptors that become readable when the host sends."""
        return [self._master] if self._master >= 0 else []

    def writable_ends(self) -> list[int]:
        """Descriptors that become writable when the host has read."""
        return self.readable_ends()

    def read(self) -> bytes:
        """The bytes that the host has written."""
        try:
            return os.read(self._master, READ_BYTES)
        except (BlockingIOError, OSError):
            return b""

    def write(self, data: bytes) -> int:
        """Write to the host; returns the number of bytes accepted."""
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0

    def _make_link(self, link: Path) -> None:
        beside = link.with_name(f".{link.name}.{os.getpid()}")
        try:
            beside.symlink_to(self._device)
            beside.replace(link)
        except OSError as error:
            self.close()
            raise PortError(f"the link {link} cannot be made: {reason(error)}") from None

    def _unlink(self) -> None:
        """Remove the link, unless another simulated printer has taken it over."""
        if self._link is not None and self._link.is_symlink() and os.readlink(self._link) == self._device:
            self._link.unlink()


def terminals_exist() -> bool:
    """Whether this system has pseudo-terminals; Windows has none."""
    try:
        import tty  # noqa: F401 - missing without termios
    except ImportError:
        return False
    return hasattr(os, "openpty")


def _leads_to_a_terminal(link: Path) -> bool:
    """Whether a path is a link to a terminal, perhaps a dead one."""
    return link.is_symlink() and os.readlink(link).startswith(TERMINALS)


class Server:
    """A TCP port of this computer for one host at a time, others are refused; number 0 takes a free one."""

    def __init__(self, number: int) -> None:
        try:
            self._server = socket.create_server(("localhost", number))
        except OSError as error:
            raise PortError(f"TCP port {number} cannot be listened on: {reason(error)}") from None
        self._server.setblocking(False)
        self._host: socket.socket | None = None
        self._others: deque[socket.socket] = deque()  # to be refused
        self._open = False
        self.path = f"socket://localhost:{self._server.getsockname()[1]}"

    def open(self) -> None:
        """Let a host in."""
        self._open = True

    def close(self) -> None:
        """Cut the host off."""
        self._open = False
        self._hang_up()

    def end(self) -> None:
        """Close the port for good."""
        self.close()
        self._server.close()

    def readable_ends(self) -> list[int]:
        """Descriptors that become readable when a host connects or sends."""
        if not self._open:
            return []
        hosts = [*self._others, *([] if self._host is None else [self._host])]
        return [self._server.fileno(), *(host.fileno() for host in hosts)]

    def writable_ends(self) -> list[int]:
        """Descriptors that become writable when the host has read."""
        return [] if self._host is None else [self._host.fileno()]

    def read(self) -> bytes:
        """The bytes that the host has written; empty when a host connects or leaves."""
        try:
            if self._host is None:
                self._host, _ = self._server.accept()
                self._host.setblocking(False)
                self._host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                return b""
            self._turn_away()
            data = self._host.recv(READ_BYTES)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self._hang_up()
        return data

    def _turn_away(self) -> None:
        """Report to other hosts, as soon as they send a query, that the printer is taken."""
        with suppress(OSError):
            host, _ = self._server.accept()
            host.setblocking(False)
            self._others.append(host)
        for host in [*self._others]:
            with suppress(OSError):
                if host.recv(READ_BYTES):
                    host.sendall(TAKEN)
                    continue
                self._others.remove(host)
                host.close()
        while len(self._others) > MOST_OTHERS:
            self._others.popleft().close()

    def write(self, data: bytes) -> int:
        """Write to the host; returns the number of bytes accepted; without a host they are lost."""
        try:
            return len(data) if self._host is None else self._host.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            self._hang_up()
            return len(data)

    def _hang_up(self) -> None:
        for gone in [*([] if self._host is None else [self._host]), *self._others]:
            gone.close()
        self._host = None
        self._others.clear()  # the next one to connect gets the printer
