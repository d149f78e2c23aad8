"""G-code upload: a program as a server takes it: bytes, a name that every server can keep, checksums."""

import hashlib
import re
import unicodedata
import zlib
from bisect import bisect_right
from collections.abc import Callable, Iterable
from io import BytesIO
from itertools import accumulate
from typing import BinaryIO

from machine.gcode.line_text import plain_line

LONGEST_NAME = 80  # RepRapFirmware keeps 120 characters of a whole path
SUFFIX = ".gcode"
TAKEN = (".gcode", ".gco", ".g")  # OctoPrint takes no others for programs
STRANGE = re.compile(r"[^A-Za-z0-9._-]+")
Sent = Callable[[int], None]  # told how many bytes have gone


class GcodeUpload:
    """A program under the name it will have there.

    Its lines are those that were dry-run, with the text that the dry run has read: without remarks in parentheses, which the
    server or its firmware would execute. Raises GcodeError for a line that the dry run refuses, too.
    """

    def __init__(self, name: str, lines: Iterable[str]) -> None:
        encoded = [f"{plain_line(line)}\n".encode() for line in lines]
        self.name = server_name(name)
        self.content = b"".join(encoded)
        self._ends = list(accumulate(map(len, encoded)))

    def line_at(self, position: int) -> int:
        """How many whole lines of the file lie before a byte position."""
        return bisect_right(self._ends, position)

    @property
    def sha256(self) -> str:
        """The digest of the content, hexadecimal."""
        return hashlib.sha256(self.content).hexdigest()

    @property
    def crc32(self) -> str:
        """The checksum of the content, eight hexadecimal digits: DuetSoftwareFramework compares them as text."""
        return f"{zlib.crc32(self.content):08x}"

    def read_by(self, sent: Sent) -> BinaryIO:
        """The content as a file; calls sent() with the bytes read so far, before each piece and at the end."""
        return _ReportedBytes(self.content, sent)


class _ReportedBytes(BytesIO):
    def __init__(self, content: bytes, sent: Sent) -> None:
        super().__init__(content)
        self._sent = sent

    def read(self, size: int | None = -1) -> bytes:
        self._sent(self.tell())
        return super().read(size)


def server_name(name: str) -> str:
    """The name that a file gets on any server: letters without accents, digits, . _ and -, ending in .gcode.

    Klipper reads it from between quotes, RepRapFirmware from a card with FAT names, OctoPrint replaces what it does not like.
    """
    stem, suffix = name.removeprefix("demo:"), ""
    for ending in (*TAKEN, ".nc", ".ngc"):
        if stem.lower().endswith(ending):
            stem, suffix = stem[: -len(ending)], stem[-len(ending) :].lower()
            break
    plain = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode()
    plain = STRANGE.sub("_", plain).strip("._-")[:LONGEST_NAME]
    return (plain or "print") + (suffix if suffix in TAKEN else SUFFIX)
