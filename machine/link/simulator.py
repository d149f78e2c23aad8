"""A simulated printer on a real pseudo-terminal: the firmware in a thread, reached through a device path like any printer."""

import os
import select
import threading
from collections.abc import Iterable
from math import inf
from time import monotonic
from types import TracebackType
from typing import Self

from machine.link.faults import Fault, NoisyLine
from machine.link.firmware import BUSY_S, Firmware, Habits
from machine.link.record import Record
from profiles.errors import PortError
from profiles.machine import Machine

READ_BYTES = 4096
UNREAD_BYTES = 1 << 20  # answers kept for a host that does not read; older ones are dropped beyond


class SimulatedPrinter:
    """`with SimulatedPrinter(machine) as printer:` open printer.path with pyserial, look at printer.record afterwards.

    speed: virtual seconds in a real one; inf never sleeps, the clock jumps over every wait. Raises PortError on a system
    without pseudo-terminals.
    """

    def __init__(self, machine: Machine, speed: float = inf, habits: Habits | None = None, faults: Iterable[Fault] = ()) -> None:
        if not speed > 0:
            raise ValueError(f"speed is {speed:g}: it must be above 0")
        # `busy:` must come in real time, or a slow simulation would look dead to the sender.
        self._firmware = Firmware(machine, habits, BUSY_S * min(1.0, speed))
        self._speed = speed
        self._lock = threading.Lock()
        faults = tuple(faults)
        self._noise = NoisyLine(faults, self._firmware.reset) if faults else None
        self._out = b""
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        try:
            import tty

            self._master, self._slave = os.openpty()
        except (ImportError, OSError) as error:
            raise PortError(f"the simulated printer needs a pseudo-terminal, which this system does not give ({error})") from None
        # Raw: no echo, no change of newlines. The own slave end stays open, so that the terminal outlives each host.
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._end, self._wake = os.pipe()
        self._began_s = monotonic()
        self._thread = threading.Thread(target=self._serve, name="simulated printer", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        os.write(self._wake, b"x")
        if self._thread is not None:
            self._thread.join()
        for descriptor in (self._master, self._slave, self._end, self._wake):
            os.close(descriptor)

    @property
    def record(self) -> Record:
        """What has been executed so far."""
        with self._lock:
            return self._firmware.record()

    def _serve(self) -> None:
        """Read, work, answer, until __exit__ writes to the pipe."""
        data = b""
        while True:
            with self._lock:
                answer = self._turn(data)
            self._answer(answer)
            readable, _, _ = select.select([self._master, self._end], [self._master] if self._out else [], [], self._pause_s())
            if self._end in readable:
                return
            data = self._read() if readable else b""

    def _turn(self, data: bytes) -> bytes:
        if data and self._noise is not None:
            data = self._noise.to_printer(data)
        if self._speed == inf:
            self._firmware.receive(data)
            answer = self._firmware.advance()
        else:
            now_s = (monotonic() - self._began_s) * self._speed
            answer = self._firmware.advance(now_s)
            self._firmware.receive(data)
            answer += self._firmware.advance(now_s)
        return self._noise.to_host(answer) if answer and self._noise is not None else answer

    def _pause_s(self) -> float | None:
        """How long nothing happens unless the host says something; None: for ever."""
        if self._speed == inf:
            return None
        due_s = self._firmware.next_s()
        return None if due_s == inf else max(0.0, due_s / self._speed - (monotonic() - self._began_s))

    def _read(self) -> bytes:
        try:
            return os.read(self._master, READ_BYTES)
        except (BlockingIOError, OSError):
            return b""

    def _answer(self, answer: bytes) -> None:
        if not answer and not self._out:
            return
        self._out = (self._out + answer)[-UNREAD_BYTES:]
        try:
            self._out = self._out[os.write(self._master, self._out) :]
        except BlockingIOError:
            return
