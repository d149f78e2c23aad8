"""Cable between host and simulated printer: carries bytes both ways and injects the faults of a script."""

import random
from collections import deque
from collections.abc import Iterator
from heapq import merge
from itertools import repeat
from math import inf

from machine.firmware.firmware import BYTE_BITS
from machine.simulator.faults import OK_KINDS, Fault, FaultScript, Unit
from machine.simulator.firmware import SimulatedFirmware

ERROR = "Error:Heating failed, system stopped! Heater_ID: 0"
GARBAGE_BYTES = 20
LATE_S = 1e-9  # the firmware is called this much late, because a clock in another unit is rounded


class _FaultQueue:
    """Places at which faults with the same unit strike, in order."""

    def __init__(self, script: FaultScript, unit: Unit, to_host: bool | None = None) -> None:
        chosen = [k for k, fault in enumerate(script.faults) if fault.counted == unit and to_host in (None, fault.to_host)]
        self._faults = script.faults
        self._strikes = merge(*(zip(script.strikes(k), repeat(k), strict=False) for k in chosen))
        self._next = next(self._strikes, None)

    def __bool__(self) -> bool:
        return self._next is not None

    def before(self, end: int) -> Iterator[tuple[int, Fault]]:
        """Places below `end` with their faults, which are consumed."""
        while self._next is not None and self._next[0] < end:
            place, index = self._next
            self._next = next(self._strikes, None)
            yield place, self._faults[index]


class _Direction:
    """One direction of the cable: number of bytes carried, pending faults, and bytes held back until a time."""

    def __init__(self, faults: _FaultQueue) -> None:
        self.faults = faults
        self.count = 0
        self.open_s = -inf
        self._held: deque[tuple[float, bytes]] = deque()

    def put(self, data: bytes) -> None:
        if data:
            self._held.append((self.open_s, data))

    def take(self, now_s: float) -> bytes:
        """The bytes that have arrived by now; a late byte delays all after it, for order is kept."""
        out = []
        while self._held and self._held[0][0] <= now_s:
            out.append(self._held.popleft()[1])
        return b"".join(out)

    def due_s(self) -> float:
        return self._held[0][0] if self._held else inf

    def clear(self) -> None:
        self._held.clear()
        self.open_s = -inf


class Cable:
    """Cable with faults; exchange() is one turn: the host's bytes reach the firmware, it works, its answers return.

    now_s is the cable's own clock, for delays, stalls and disconnections; speed: seconds of the firmware per second of it, inf:
    the firmware's clock skips every wait.
    """

    def __init__(self, firmware: SimulatedFirmware, script: FaultScript | None = None, speed: float = inf) -> None:
        script = script or FaultScript()
        self._speed = speed
        self._firmware = firmware
        self._in = _Direction(_FaultQueue(script, "byte", False))
        self._out = _Direction(_FaultQueue(script, "byte", True))
        self._answers, self._lines = _FaultQueue(script, "answer"), _FaultQueue(script, "line")
        self._clean = not script.faults
        self._rng = random.Random(script.seed)
        self._answered = 0
        self._ok_faults: deque[Fault] = deque()  # faults that wait for the next `ok`
        self._struck: list[Fault] = []
        self._blocked_s = self._back_s = -inf
        if self._lines:
            firmware.watch = self._watch

    def connected(self, now_s: float) -> bool:
        """Whether the cable is plugged in."""
        return now_s >= self._back_s

    def blocked(self, now_s: float) -> bool:
        """Whether the printer reads nothing."""
        return now_s < self._blocked_s

    def reads_nothing(self, now_s: float) -> bool:
        """Whether the host's bytes are not read, so that its writes block."""
        return self._firmware.full or (self.blocked(now_s) and not self._firmware.has_ring)

    def clear(self) -> None:
        """Do nothing: no bytes are under way between two turns."""

    def due_s(self, now_s: float) -> float:
        """When something happens without further bytes, on the cable's clock; inf: never."""
        firmware_s = inf if self._speed == inf else self._firmware.next_s() / self._speed + LATE_S
        times = (self._in.due_s(), self._out.due_s(), self._blocked_s, self._back_s, firmware_s)
        return min((t for t in times if t > now_s), default=inf)

    def exchange(self, data: bytes, now_s: float = 0.0) -> bytes:
        """Take the host's bytes; returns those that it receives."""
        until_s = inf if self._speed == inf else now_s * self._speed
        if self._clean:
            answers = self._firmware.advance(until_s) if until_s < inf else b""
            self._firmware.receive(data)
            return answers + self._firmware.advance(until_s)
        if self.connected(now_s):
            self._carry(data, self._in, now_s, until_s)
        self._work(now_s, until_s)
        return self._out.take(now_s) if self.connected(now_s) else b""

    def _work(self, now_s: float, until_s: float) -> None:
        """Let the firmware work, then process what has arrived; while it is blocked only its ring, if any, fills."""
        if self.blocked(now_s):
            if self._firmware.has_ring:
                self._firmware.receive(self._in.take(now_s))
            return
        if until_s < inf:
            self._advance(now_s, until_s)
        if received := self._in.take(now_s):
            self._firmware.receive(received)
        self._advance(now_s, until_s)

    def _advance(self, now_s: float, until_s: float) -> None:
        """Advance the firmware; a fault at a line strikes before the line begins."""
        while True:
            answers = self._firmware.advance(until_s)
            if self.connected(now_s):
                self._answer(answers, now_s)
            if not self._struck:
                return
            struck, self._struck = self._struck, []
            for fault in struck:
                self._strike(fault, now_s)
            if self.blocked(now_s):
                return

    def _watch(self, line: int) -> bool:
        self._struck += [fault for _, fault in self._lines.before(line + 1)]
        return bool(self._struck)

    def _carry(self, data: bytes, direction: _Direction, now_s: float, until_s: float = inf) -> None:
        """Pass bytes to a direction, damaged where a fault is due."""
        begin, direction.count, done = direction.count, direction.count + len(data), 0
        for strike, fault in direction.faults.before(direction.count):
            at = max(strike - begin, 0)
            if at < done:
                continue
            direction.put(data[done:at])
            done = at
            if fault.kind == "drop":
                done = at + 1
            elif fault.kind == "duplicate":
                direction.put(data[at : at + 1])
            elif fault.kind == "flip":
                bit = self._rng.randrange(8) if fault.value is None else fault.value
                direction.put(bytes([data[at] ^ 1 << bit]))
                done = at + 1
            elif fault.kind == "delay":
                direction.open_s = max(direction.open_s, now_s + fault.seconds)
            elif fault.kind == "garbage":
                direction.put(self._spurious_bytes(fault))
            else:
                if direction is self._in:
                    self._work(now_s, until_s)
                self._strike(fault, now_s)
                if not self.connected(now_s):
                    return
        direction.put(data[done:])

    def _answer(self, answers: bytes, now_s: float) -> None:
        """Carry the firmware's whole lines to the host."""
        if not (self._answers or self._ok_faults):
            self._carry(answers, self._out, now_s)
            return
        for line in answers.splitlines(keepends=True):
            self._answered += 1
            for _, fault in self._answers.before(self._answered + 1):
                if fault.kind in OK_KINDS:
                    self._ok_faults.append(fault)
                else:
                    self._strike(fault, now_s)
            if not self.connected(now_s):
                return
            wanted = self._ok_faults.popleft() if self._ok_faults and line.startswith(b"ok") else None
            self._carry(line if wanted is None else _damaged_ok(wanted, line), self._out, now_s)

    def _strike(self, fault: Fault, now_s: float) -> None:
        """Inject a fault other than damage to passing bytes."""
        kind, until_s = fault.kind, now_s + fault.seconds
        if kind in ("reset", "silent reset"):
            self._firmware.reset(kind == "reset")
        elif kind == "thermal runaway":
            self._firmware.kill("Thermal Runaway, system stopped! Heater_ID: 0")
        elif kind == "heater failure":
            self._firmware.board.nozzle.fail(self._firmware.board.now_s)
        elif kind == "disconnect":
            self._back_s = until_s
            self._in.clear()
            self._out.clear()
        elif kind == "stall":
            self._out.open_s = max(self._out.open_s, until_s)
        elif kind == "block":
            self._blocked_s = until_s
            if not self._firmware.has_ring:
                self._in.open_s = max(self._in.open_s, until_s)
        else:
            self._out.put(self._spurious_bytes(fault))

    def _spurious_bytes(self, fault: Fault) -> bytes:
        """Bytes for the host that the firmware has not sent."""
        if fault.kind == "spurious resend":
            number = max(1, self._firmware.last_number - self._rng.randint(0, 8)) if fault.value is None else fault.value
            return b"Resend: %d\nok\n" % number
        if fault.kind == "error":
            return f"{fault.text or ERROR}\n".encode("latin-1")
        return fault.text.encode("latin-1") or bytes(self._rng.choice(range(128, 256)) for _ in range(GARBAGE_BYTES))


def _damaged_ok(fault: Fault, line: bytes) -> bytes:
    """The remaining bytes of a damaged `ok`."""
    return {"swallow ok": b"", "truncate ok": b"o\n", "double ok": line + line}[fault.kind]


ADAPTER_BYTES = 512  # buffer of a USB adapter (CH340, FTDI: 128 to 512)


class _Wire:
    """One direction of a UART: bytes leave one by one at the baud rate."""

    def __init__(self, byte_s: float) -> None:
        self._byte_s = byte_s
        self._bytes = bytearray()
        self._first_s = 0.0  # arrival of the first of the bytes
        self._free_s = 0.0  # departure of the last byte

    def put(self, data: bytes, now_s: float) -> None:
        """Add bytes at a time."""
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
        """Drop the bytes under way."""
        self._bytes.clear()
        self._free_s = 0.0

    def __len__(self) -> int:
        return len(self._bytes)

    def line_s(self) -> float:
        """Arrival of the next newline, or of the last byte without one; inf: nothing is under way."""
        if not self._bytes:
            return inf
        end = self._bytes.find(b"\n")
        return self._first_s + (end if end >= 0 else len(self._bytes) - 1) * self._byte_s


class Uart:
    """A cable at a baud rate; arrival times depend on the bytes' duration, not on how often exchange() is called.

    Between two calls everything happens when it would on a real line: the printer gets a line when its newline has arrived, its
    answer starts then, and an `ok` waiting for a free place of the planner when that is free. While it sends it reads nothing
    (Marlin's TX_BUFFER_SIZE is 0), only its receive ring fills. There is no flow control: what exceeds the ring
    (BuildOptions.rx_ring) is lost.
    """

    def __init__(self, cable: Cable, baud: int) -> None:
        if baud <= 0:
            raise ValueError(f"baud is {baud}: it must be above 0")
        self._cable = cable
        self._byte_s = BYTE_BITS / baud
        self._in, self._out = _Wire(self._byte_s), _Wire(self._byte_s)
        self._now_s = self._sends_until_s = 0.0

    def exchange(self, data: bytes, now_s: float) -> bytes:
        """Take the bytes that the host writes now; returns those that have arrived there."""
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
        """Whether an adapter's own buffer is full."""
        del now_s
        return len(self._in) >= ADAPTER_BYTES

    def _next_s(self) -> float:
        """When the printer next receives or sends something."""
        return max(self._now_s, self._sends_until_s, min(self._in.line_s(), self._cable.due_s(self._now_s)))

    def clear(self) -> None:
        """Drop everything under way, when the cable is unplugged."""
        self._in.clear()
        self._out.clear()

    def _exchange_at(self, at_s: float) -> None:
        """Deliver what has arrived by a time, and answer."""
        self._now_s = at_s
        if answers := self._cable.exchange(self._in.take(at_s), at_s):
            self._out.put(answers, at_s)
            self._sends_until_s = at_s + len(answers) * self._byte_s
