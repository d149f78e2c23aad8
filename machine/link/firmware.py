"""A Marlin-like firmware without I/O: bytes in, bytes out, time is virtual and handed in.

Its habits are Marlin's (gcode/queue.cpp, bugfix-2.1.x of 2024-09), the awkward ones above all: line numbers and checksums with
its exact words, a repeat of the last line swallowed in silence, `ok` = taken, withheld while the planner is full.
"""

import re
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf

from machine.dialects import DIALECTS
from machine.link.commands import COMMANDS, Body, move, words_of
from machine.link.framing import checksum
from machine.link.macros import NAME, VALUE, command_of
from machine.link.record import Record, moves_of
from profiles.machine import Machine

BUFSIZE = 4  # lines waiting, the one at work included
MAX_CMD_SIZE = 96
HALF_BYTES = 1024
UNREAD_LINES = 20
BUSY_S = 2.0  # Marlin's HOST_KEEPALIVE interval
CHATTER_S = 3600.0  # of a longer wait only the last hour is talked through: a jump over years must not fill the memory
DIGITS = re.compile(rb"\s*([-+]?\d+)")
COMMAND = re.compile(r"([GMT])\s*0*(\d+(?:\.\d+)?)")
URGENT = re.compile(rb"\s*(?:N\d+\s*)?M(112|108|410)(?!\d)")
BANNER = "start\nMarlin bugfix-2.1.x (simulated)\necho: Last Updated: 2024-09-29 | Author: (none, default config)\n"


@dataclass(frozen=True)
class Habits:
    """Build options of a firmware. rx_ring: bytes of a UART's receive ring that overflows; None: USB, which waits."""

    advanced_ok: bool = True
    emergency_parser: bool = True
    busy: bool = True
    autoreport: bool = True
    rx_ring: int | None = None


class Firmware:
    """receive() hands bytes over, advance() lets time pass and returns what the printer says meanwhile."""

    def __init__(self, machine: Machine, habits: Habits | None = None, busy_s: float = BUSY_S) -> None:
        self._habits = habits or Habits()
        self._said: list[str] = []
        self.body = Body(machine, self._said.append)
        self._busy_every_s = busy_s
        self._longest = DIALECTS[machine.dialect].longest_line
        self._busy_s = inf
        self._lines: deque[bytes] = deque()
        self._half = b""
        self._read = 0
        self._scanned = b""
        self._queue: deque[tuple[str, str]] = deque()
        self._last = 0
        self._wake_s: float | None = None
        self._work: Iterator[float] | None = None
        self._lost_bytes = 0
        self._taken = self._watched = 0
        self.watch: Callable[[int], bool] | None = None  # told each line's count before it begins; True: advance() returns first
        self.dead = False

    def receive(self, data: bytes) -> None:
        """Bytes arrive on the line."""
        if self.dead:
            return
        if self._habits.emergency_parser:
            self._read_urgent(data)
        if self._habits.rx_ring is not None:
            waiting = len(self._half) + sum(len(line) + 1 for line in self._lines) - self._read
            kept = data[: max(0, self._habits.rx_ring - 1 - waiting)]
            self._lost_bytes += len(data) - len(kept)
            data = kept
        *lines, self._half = (self._half + data.replace(b"\r", b"\n")).split(b"\n")
        self._lines.extend(lines)
        if len(self._half) > HALF_BYTES:  # a line without end: what is too long for a command is not kept
            self._half = self._half[: self._longest]

    @property
    def has_ring(self) -> bool:
        """Whether bytes arrive in a ring that overflows; over USB the host waits instead."""
        return self._habits.rx_ring is not None

    @property
    def full(self) -> bool:
        """Over USB: nothing more is read until there is room again."""
        return not self.has_ring and len(self._lines) > UNREAD_LINES

    def advance(self, until_s: float = inf) -> bytes:
        """Work until a virtual time; with inf until there is nothing to do, the clock jumping over all waits."""
        body = self.body
        while not self.dead:
            self._fetch()
            if self._wake_s is not None:
                if self._wake_s > until_s:
                    self._pass(until_s)
                    break
                self._pass(self._wake_s)
                self._wake_s = None
            elif self._queue:
                if self.watch is not None and self._work is None and self._watched == self._taken:
                    self._watched += 1
                    if self.watch(self._watched):
                        break
                self._run()
            else:
                if until_s < inf:
                    self._pass(until_s)
                break
        if until_s < inf:
            body.now_s = max(body.now_s, until_s)
        said = "".join([f"{line}\n" for line in self._said])
        self._said.clear()
        return said.encode("ascii", "replace")

    def next_s(self) -> float:
        """The virtual time at which something happens without further bytes; inf when nothing will."""
        if self.dead:
            return inf
        if self._wake_s is None:
            return self.body.now_s if self._queue or self._lines else self.body.report_s
        return min(self._wake_s, self.body.report_s, self._busy_s)

    def reset(self, banner: bool = True) -> None:
        """The board restarts: counter, queues, position and temperatures are lost."""
        body = self.body
        body.note("reset")
        body.off()
        body.motion.native[:] = [0.0] * 6
        body.motion.shift[:] = [0.0] * 6
        body.motion.relative = body.motion.filament_relative = body.motion.inches = False
        body.report_s, body.report_every_s, body.waits_for_heat = inf, 0.0, False
        self._forget()
        self._last, self.dead = 0, False
        if banner:
            self._said += BANNER.splitlines()

    @property
    def last_number(self) -> int:
        """Number of the last numbered line that was taken."""
        return self._last

    def record(self) -> Record:
        """What was done so far."""
        body = self.body
        start, end, feed, begin, duration = moves_of(body.motion.rows)
        return Record(
            machine=body.machine,
            start=start,
            end=end,
            feed_mm_s=feed,
            begin_s=begin,
            duration_s=duration,
            events=tuple(body.events),
            nozzle_target_c=body.nozzle.target_c,
            bed_target_c=body.bed.target_c,
            fan=body.fan,
            clamped=body.motion.clamped,
            unknown=body.unknown,
            lines=self._taken,
            lost_bytes=self._lost_bytes,
        )

    def _forget(self) -> None:
        self._lines.clear()
        self._queue.clear()
        self._half = self._scanned = b""
        self._read = 0
        self._wake_s = self._work = None
        self._busy_s = inf
        self._watched = self._taken

    def _read_urgent(self, data: bytes) -> None:
        """The emergency parser reads M112, M108 and M410 from the raw bytes, whatever waits before them."""
        scanned = self._scanned + data
        end = scanned.rfind(b"\n") + 1
        self._scanned = scanned[end:][-MAX_CMD_SIZE:]
        if b"M112" not in scanned and b"M108" not in scanned and b"M410" not in scanned:
            return
        for line in scanned[:end].split(b"\n"):
            if found := URGENT.match(line):
                self._do_urgent(found[1])

    def _do_urgent(self, number: bytes) -> None:
        body = self.body
        if number == b"112":
            self._shut_down("M112", "echo:M112 Shutdown")
        elif number == b"108":
            body.impatient = True
            if body.waits_for_heat:
                self._wake_s = body.now_s
        else:
            body.motion.halt(body.now_s)
            if self._wake_s is not None:
                self._wake_s = body.now_s

    def kill(self, error: str) -> None:
        """The firmware stops for ever with its own words, heaters off."""
        self._shut_down(error, f"Error:{error}")

    def _shut_down(self, event: str, told: str) -> None:
        self.body.note(event)
        self.body.off()
        self._said += [told, "Error:Printer halted. kill() called!", "//action:poweroff"]
        self._forget()
        self.dead = True

    def _fetch(self) -> None:
        """Move lines from the receive ring into the queue while it has room, checking number and checksum."""
        while self._lines and len(self._queue) < BUFSIZE:
            self._read = 0
            line = self._lines.popleft().partition(b";")[0][: self._longest].lstrip(b" ")
            if not line:
                continue
            label = ""
            if line[:1] == b"N":
                complaint = self._complaint(line)
                if complaint == "":
                    continue
                if complaint is not None:
                    self._ask_again(complaint)
                    break
                label = f" N{self._last}"
                line = line[1 : line.rindex(b"*")].lstrip(b"-+0123456789").lstrip(b" ")
            self._queue.append((label, line.decode("ascii", "replace").rstrip()))
        if not self._lines and len(self._queue) < BUFSIZE:
            self._read = len(self._half)  # taken from the ring, put together elsewhere

    def _complaint(self, line: bytes) -> str | None:
        """What is wrong with a numbered line; "" for a repeat that Marlin drops in silence, None when it is taken."""
        star = line.rfind(b"*")
        renumbers = b"M110" in line
        second = line.find(b"N", line.find(b"M110")) if renumbers else -1
        found = DIGITS.match(line, 1 + max(second, 0))
        number = int(found[1]) if found else 0
        if not renumbers and number != self._last + 1:
            return "" if self._last - 1 <= number <= self._last else "Line Number is not Last Line Number+1"
        if star < 0:
            return "No Checksum with line number"
        told = DIGITS.match(line, star + 1)
        if (int(told[1]) if told else 0) != checksum(line[:star]):
            return "checksum mismatch"
        self._last = number
        return None

    def _ask_again(self, complaint: str) -> None:
        self._said += [f"Error:{complaint}, Last Line: {self._last}", f"Resend: {self._last + 1}", "ok"]
        self._lines.clear()
        self._half = b""
        self._read = 0

    def _run(self) -> None:
        """Begin or go on with the oldest line of the queue."""
        body = self.body
        label, text = self._queue[0]
        name, rest = _parted(text)
        if name in ("G1", "G0"):
            if not body.motion.free(body.now_s):
                self._sleep(body.motion.next_free_s())
                return
            move(body, words_of(rest))
            self._finish(label)
            return
        if self._work is None:
            answer = self._begin(text, name, rest)
            if self.dead:
                return
            if answer is None or isinstance(answer, str):
                self._finish(label, answer)
                return
            self._work = answer
        wake_s = next(self._work, None)
        if wake_s is None:
            self._work = None
            self._finish(label)
        else:
            self._sleep(wake_s)

    def _begin(self, text: str, name: str, rest: str) -> Iterator[float] | str | None:
        if name == "M112":
            self._shut_down("M112", "echo:M112 Shutdown")
            return None
        if name == "M115":
            self._introduce()
            return None
        if DIALECTS[self.body.machine.dialect].macros and (found := NAME.match(text)):
            macro = command_of(found[0].upper())
            if macro is not None:
                return macro(self.body, dict(VALUE.findall(text[found.end() :])))
        command = COMMANDS.get(name)
        if command is None:
            self.body.unknown += 1
            self._said.append(f'echo:Unknown command: "{text}"')
            return None
        return command(self.body, {} if name == "M117" else words_of(rest), name + rest)

    def _introduce(self) -> None:
        habits = self._habits
        letters = self.body.motion.letters[3:5]
        self._said += [
            "FIRMWARE_NAME:Marlin bugfix-2.1.x (simulated) PROTOCOL_VERSION:1.0 MACHINE_TYPE:tiltprint EXTRUDER_COUNT:1 "
            f"AXIS_COUNT:5 ROTARY:{''.join(letters)}",
            "Cap:SERIAL_XON_XOFF:0",
            f"Cap:AUTOREPORT_TEMP:{int(habits.autoreport)}",
            f"Cap:EMERGENCY_PARSER:{int(habits.emergency_parser)}",
            "Cap:PROGRESS:0",
        ]

    def _finish(self, label: str, answer: str | None = None) -> None:
        self._queue.popleft()
        self._taken += 1
        self._busy_s = inf
        if answer is not None:
            self._said.append(answer)
        elif self._habits.advanced_ok:
            free = min(self.body.motion.free(self.body.now_s), 15)
            self._said.append(f"ok{label} P{free} B{BUFSIZE - 1 - len(self._queue)}")
        else:
            self._said.append("ok")

    def _sleep(self, wake_s: float) -> None:
        """Look again at wake_s; the first such wait of a line starts the clock of the busy messages."""
        if self._busy_s == inf:
            self._busy_s = self.body.now_s + self._busy_every_s
        if self._wake_s is None:
            self._wake_s = wake_s

    def _pass(self, to_s: float) -> None:
        """Let the clock run, saying on the way what is due."""
        body = self.body
        while True:
            busy_s = self._busy_s if self._wake_s is not None and self._habits.busy and not body.waits_for_heat else inf
            due_s = min(busy_s, body.report_s)
            if due_s > to_s or due_s == inf:
                break
            body.now_s = max(body.now_s, due_s, to_s - CHATTER_S)
            if due_s == busy_s:
                self._said.append("echo:busy: processing")
                self._busy_s = body.now_s + self._busy_every_s
            else:
                self._said.append(f" {body.temperatures()}")
                body.report_s = body.now_s + body.report_every_s
        body.now_s = max(body.now_s, to_s)


def _parted(text: str) -> tuple[str, str]:
    """Name and rest of a command; leading zeros and a missing blank are allowed: "G01X5" is G1."""
    if text[2:3] == " " and text[1:2].isdigit():
        return text[:2], text[2:]
    found = COMMAND.match(text)
    return (f"{found[1]}{found[2]}", text[found.end() :]) if found else ("", text)
