"""Reception: the bytes that reach a simulated firmware become commands, by line numbers and checksums as its family does it."""

import re
from collections import deque

from machine.link.framing import checksum
from machine.link.habits import Manner

HALF_BYTES = 1024
LONGEST = 128  # bytes that the checksum is folded from at once
DIGITS = re.compile(rb"\s*([-+]?\d+)")


class Reception:
    """rx_ring: bytes of a receive ring that overflows, None: whatever comes is kept. longest: characters kept of a line.

    last: number of the last numbered line that was taken.
    """

    def __init__(self, manner: Manner, longest: int, rx_ring: int | None) -> None:
        self._manner, self._longest, self._rx_ring = manner, longest, rx_ring
        self.last = self.lost_bytes = 0
        self._lines: deque[bytes] = deque()
        self._half = b""
        self._read = 0  # bytes of the oldest line that have left the ring

    def __len__(self) -> int:
        return len(self._lines)

    def receive(self, data: bytes) -> list[bytes]:
        """Bytes arrive; the lines that they end."""
        if self._rx_ring is not None:
            waiting = len(self._half) + sum(len(line) + 1 for line in self._lines) - self._read
            kept = data[: max(0, self._rx_ring - 1 - waiting)]
            self.lost_bytes += len(data) - len(kept)
            data = kept
        *lines, self._half = (self._half + data.replace(b"\r", b"\n")).split(b"\n")
        self._lines.extend(lines)
        if len(self._half) > HALF_BYTES:  # a line without end: what is too long for a command is not kept
            self._half = self._half[:LONGEST]
        return lines

    def forget(self) -> None:
        """What has come is thrown away."""
        self._lines.clear()
        self._half = b""
        self._read = 0

    def idle(self) -> None:
        """The main loop has taken what there is: the half line is put together elsewhere, the ring is empty."""
        self._read = len(self._half)

    def take(self) -> tuple[str, str] | str | None:
        """The oldest line: its label for ADVANCED_OK and its command, or what is wrong with it; None: nothing to do."""
        self._read = 0
        line = self._lines.popleft().partition(b";")[0][: self._longest].lstrip(b" ")
        if not line:
            return None
        label = ""
        if line[:1] == b"N":
            if self._manner.numbers != "resend":
                line = self._unnumbered(line)
                return ("", line.decode("ascii", "replace").rstrip()) if line else None
            complaint = self._complaint(line)
            if complaint is not None:
                return complaint or None
            label = f" N{self.last}"
            line = line[1 : line.rindex(b"*")].lstrip(b"-+0123456789").lstrip(b" ")
        elif b"*" in line:
            line = line[: line.rindex(b"*")]
        return label, line.decode("ascii", "replace").rstrip()

    def ask_again(self, complaint: str, ok: bool) -> list[str]:
        """What is said of a bad line; all that has come behind it is thrown away."""
        self.forget()
        return [f"Error:{complaint}, Last Line: {self.last}", f"Resend: {self.last + 1}", *(["ok"] if ok else [])]

    def _unnumbered(self, line: bytes) -> bytes:
        """The command of a numbered line where nothing is asked for again; b"": it is dropped without a word."""
        star = line.rfind(b"*")
        if self._manner.numbers == "drop" and (b"\x7f" in line or (star >= 0 and not _sums_up(line, star))):
            return b""
        return (line[1:star] if star >= 0 else line[1:]).lstrip(b"-+0123456789").lstrip(b" ")

    def _complaint(self, line: bytes) -> str | None:
        """What is wrong with a numbered line; "" for a repeat that Marlin drops in silence, None when it is taken."""
        star = line.rfind(b"*")
        renumbers = b"M110" in line
        second = line.find(b"N", line.find(b"M110")) if renumbers else -1
        found = DIGITS.match(line, 1 + max(second, 0))
        number = int(found[1]) if found else 0
        if not renumbers and number != self.last + 1:
            return "" if self.last - 1 <= number <= self.last else "Line Number is not Last Line Number+1"
        if star < 0:
            return "No Checksum with line number"
        if not _sums_up(line, star):
            return "checksum mismatch"
        self.last = number
        return None


def _sums_up(line: bytes, star: int) -> bool:
    """Whether the checksum behind the star is right; a CRC of five digits (RepRapFirmware) is believed."""
    told = DIGITS.match(line, star + 1)
    return (0 if told is None else int(told[1])) == checksum(line[:star]) or (told is not None and len(told[1]) == 5)
