"""Receiver of a simulated firmware: bytes become commands by line numbers and checksums, or urgent orders at once."""

import re
from collections import deque

from machine.firmware.firmware import SimulationRules
from machine.link.protocol.framing import checksum

HALF_BYTES = 1024
MISSING = "Missing checksum"  # message of OctoPrint's virtual printer with forceChecksum; nothing follows
CHECKSUM_BYTES = 128  # bytes folded at once for the checksum
MOVE = re.compile(rb"N([0-9]+) (G[01] [^*;]*)\*([0-9]{1,3})")  # nearly every line
DIGITS = re.compile(rb"\s*([-+]?\d+)")
ORDER_BYTES = 96  # more of a line is ignored
ORDER = re.compile(rb"\s*(?:N-?\d+\s*)?(?:(M(?:108|112|410|876)|[SPR]000)(?!\d))")
SIGNS = (b"M1", b"M4", b"M8", b"000")


class Receiver:
    """Receives lines. rx_ring: bytes of a receive ring that may overflow, None: unlimited. longest: characters kept of a line;
    insists: refuse lines without number and checksum.

    last: number of the last accepted line; lines: those waiting.
    """

    def __init__(self, rules: SimulationRules, longest: int, rx_ring: int | None, insists: bool = False) -> None:
        self._rules, self._longest, self._rx_ring, self._insists = rules, longest, rx_ring, insists
        self.last = self.lost_bytes = 0
        self.lines: deque[bytes] = deque()
        self._half = self._urgent_half = b""
        self._read = 0  # bytes of the oldest line that have left the ring

    def __len__(self) -> int:
        return len(self.lines)

    def receive(self, data: bytes) -> list[bytes]:
        """Receive bytes; returns the lines that they complete."""
        if self._rx_ring is not None:
            waiting = len(self._half) + sum(len(line) + 1 for line in self.lines) - self._read
            fitting = data[: max(0, self._rx_ring - 1 - waiting)]
            self.lost_bytes += len(data) - len(fitting)
            data = fitting
        *lines, self._half = (self._half + data.replace(b"\r", b"\n")).split(b"\n")
        self.lines.extend(lines)
        if len(self._half) > HALF_BYTES:  # an endless line: bytes beyond a command's length are dropped
            self._half = self._half[:CHECKSUM_BYTES]
        return lines

    def urgent_orders(self, data: bytes) -> list[str]:
        """Orders that an emergency parser finds at the beginning of lines completed by these bytes, without checking numbers and
        checksums."""
        scanned = self._urgent_half + data
        end = scanned.rfind(b"\n") + 1
        self._urgent_half = scanned[end:][:ORDER_BYTES]
        if not any(sign in scanned for sign in SIGNS):
            return []
        return [order[1].decode() for line in scanned[:end].splitlines() if (order := ORDER.match(line))]

    def forget(self) -> None:
        """Discard what has come, by a restart or stop of the board."""
        self._drop()
        self._urgent_half = b""

    def _drop(self) -> None:
        self.lines.clear()
        self._half = b""
        self._read = 0

    def idle(self) -> None:
        """Empty the ring: the main loop has taken the unfinished line into another buffer."""
        self._read = len(self._half)

    def take(self) -> tuple[str, str] | str | None:
        """The oldest line: its label for ADVANCED_OK and its command, or its error; None: nothing to do."""
        self._read = 0
        line = self.lines.popleft()
        if (move := MOVE.fullmatch(line)) and self._rules.numbers == "resend" and len(line) <= self._longest:
            number, command, given = move.groups()
            if int(number) == self.last + 1 and int(given) == checksum(line[: move.end(2)]):
                self.last += 1
                return f" N{self.last}", command.decode("ascii", "replace").rstrip()
        if b";" in line:
            line = line[: line.index(b";")]
        line = line[: self._longest].lstrip(b" ")
        if not line and self._rules.answers_blank:
            return "", ""
        if not line:
            return MISSING if self._insists else None
        label = ""
        if line[:1] == b"N":
            if self._rules.numbers != "resend":
                line = self._strip_number(line)
                return ("", line.decode("ascii", "replace").rstrip()) if line else None
            complaint = self._complaint(line)
            if complaint is not None:
                return complaint or None
            label = f" N{self.last}"
            line = line[1 : line.rindex(b"*")].lstrip(b"-+0123456789").lstrip(b" ")
        elif self._insists:
            return MISSING
        elif b"*" in line:
            line = line[: line.rindex(b"*")]
        return label, line.decode("ascii", "replace").rstrip()

    def ask_again(self, complaint: str, ok: bool) -> list[str]:
        """The answer to a bad line; everything received after it is discarded, unless it merely lacks a checksum."""
        if complaint == MISSING:
            return [f"Error: {MISSING}"]
        self._drop()
        return [f"Error:{complaint}, Last Line: {self.last}", f"Resend: {self.last + 1}", *(["ok"] if ok else [])]

    def _strip_number(self, line: bytes) -> bytes:
        """The command of a numbered line for a firmware without resends; b"": it is silently dropped."""
        star = line.rfind(b"*")
        if self._rules.numbers == "drop" and (b"\x7f" in line or (star >= 0 and not _checksum_matches(line, star))):
            return b""
        return (line[1:star] if star >= 0 else line[1:]).lstrip(b"-+0123456789").lstrip(b" ")

    def _complaint(self, line: bytes) -> str | None:
        """The error of a numbered line; "" for a repeat that Marlin drops silently, None when it is accepted."""
        star = line.rfind(b"*")
        renumbers = b"M110" in line
        second = line.find(b"N", line.find(b"M110")) if renumbers else 0
        digits = DIGITS.match(line, 1 + max(second, 0))
        number = int(digits[1]) if digits else 0
        if not renumbers and number != self.last + 1:
            return "" if self.last - 1 <= number <= self.last else "Line Number is not Last Line Number+1"
        if star < 0:
            return "No Checksum with line number"
        if not _checksum_matches(line, star):
            return "checksum mismatch"
        self.last = number
        return None


def _checksum_matches(line: bytes, star: int) -> bool:
    """Whether the checksum after the star is right; a CRC of five digits (RepRapFirmware) is trusted."""
    digits = DIGITS.match(line, star + 1)
    return (0 if digits is None else int(digits[1])) == checksum(line[:star]) or (digits is not None and len(digits[1]) == 5)
