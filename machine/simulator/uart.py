"""A UART between host and simulated printer: bytes take their time both ways, and nobody asks whether the other end has room."""

from math import inf

from machine.firmware.line import BYTE_BITS
from machine.simulator.cable import Cable

ADAPTER_BYTES = 512  # what a USB adapter keeps (CH340, FTDI: 128 to 512)


class _Wire:
    """One direction: bytes leave one after the other, each as long as the baud rate says."""

    def __init__(self, byte_s: float) -> None:
        self._byte_s = byte_s
        self._bytes = bytearray()
        self._first_s = 0.0  # when the first of the bytes will have arrived
        self._free_s = 0.0  # when the last byte of all has left

    def put(self, data: bytes, now_s: float) -> None:
        """Bytes that are handed over at a time."""
        if data:
            if not self._bytes:
                self._first_s = max(now_s, self._free_s) + self._byte_s
            self._bytes += data
            self._free_s = self._first_s + (len(self._bytes) - 1) * self._byte_s

    def take(self, now_s: float) -> bytes:
        """The bytes that have arrived by a time."""
        if not self._bytes or self._first_s > now_s:
            return b""
        count = int((now_s - self._first_s) / self._byte_s + 1e-6) + 1
        arrived = bytes(self._bytes[:count])
        del self._bytes[:count]
        self._first_s += len(arrived) * self._byte_s
        return arrived

    def clear(self) -> None:
        """What is on its way is lost."""
        self._bytes.clear()
        self._free_s = 0.0

    def __len__(self) -> int:
        return len(self._bytes)

    def line_s(self) -> float:
        """When the next newline will have arrived, or the last byte where none comes; inf: nothing is on its way."""
        if not self._bytes:
            return inf
        end = self._bytes.find(b"\n")
        return self._first_s + (end if end >= 0 else len(self._bytes) - 1) * self._byte_s


class Uart:
    """exchange() as of a Cable, at a baud rate: what arrives when depends on the bytes' own time, not on how often it is called.

    Between two calls everything happens at the moment it would on a real line: the printer gets a line when its newline
    has arrived, its answer sets out then, and an `ok` that waits for a free place of the planner when that is free. While
    it says something it reads nothing (Marlin's TX_BUFFER_SIZE is 0), only its receive ring fills. Flow is not controlled: what
    the ring (BuildOptions.rx_ring) cannot hold is lost.
    """

    def __init__(self, cable: Cable, baud: int) -> None:
        if baud <= 0:
            raise ValueError(f"baud is {baud}: it must be above 0")
        self._cable = cable
        self._byte_s = BYTE_BITS / baud
        self._in, self._out = _Wire(self._byte_s), _Wire(self._byte_s)
        self._now_s = self._sends_until_s = 0.0

    def exchange(self, data: bytes, now_s: float) -> bytes:
        """What has arrived at the host by now; data: what it writes now."""
        while (at_s := self._next_s()) < now_s:
            self._exchange_at(at_s)
        self._in.put(data, now_s)
        if self._sends_until_s <= now_s:
            self._exchange_at(now_s)
        return self._out.take(now_s)

    def due_s(self, now_s: float) -> float:
        """When something happens without further bytes; inf: never."""
        del now_s
        return min(self._next_s(), self._out.line_s())

    def reads_nothing(self, now_s: float) -> bool:
        """Whether an adapter's own buffer would take no more bytes of the host."""
        del now_s
        return len(self._in) >= ADAPTER_BYTES

    def _next_s(self) -> float:
        """When the printer is next given something, or does something by itself."""
        return max(self._now_s, self._sends_until_s, min(self._in.line_s(), self._cable.due_s(self._now_s)))

    def clear(self) -> None:
        """Forget what is on its way: the cable is out."""
        self._in.clear()
        self._out.clear()

    def _exchange_at(self, at_s: float) -> None:
        """The printer gets what has arrived by a time and answers."""
        self._now_s = at_s
        if answers := self._cable.exchange(self._in.take(at_s), at_s):
            self._out.put(answers, at_s)
            self._sends_until_s = at_s + len(answers) * self._byte_s
