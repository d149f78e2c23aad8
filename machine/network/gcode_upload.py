"""G-code upload: a program as a server takes it: bytes, a name that every server can keep, checksums, a multipart form."""

import hashlib
import re
import unicodedata
import zlib
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from itertools import accumulate

PIECE = 65536
LONGEST_NAME = 80  # RepRapFirmware keeps 120 characters of a whole path
SUFFIX = ".gcode"
TAKEN = (".gcode", ".gco", ".g")  # OctoPrint takes no others for programs
STRANGE = re.compile(r"[^A-Za-z0-9._-]+")
Sent = Callable[[int], None]  # told how many bytes have gone


class GcodeUpload:
    """A program under the name it will have there. The lines are those that were dry-run, so nothing else can be printed."""

    def __init__(self, name: str, lines: Iterable[str]) -> None:
        encoded = [f"{line}\n".encode() for line in lines]
        self.name = server_name(name)
        self.content = b"".join(encoded)
        self._ends = list(accumulate(map(len, encoded)))

    def line_at(self, position: int) -> int:
        """How many whole lines of the file lie before a byte position."""
        return bisect_right(self._ends, position)

    @cached_property
    def sha256(self) -> str:
        """Of the content, hexadecimal."""
        return hashlib.sha256(self.content).hexdigest()

    @property
    def crc32(self) -> str:
        """Of the content, eight hexadecimal digits: DuetSoftwareFramework compares them as text."""
        return f"{zlib.crc32(self.content):08x}"

    def pieces(self, sent: Sent, head: bytes = b"", tail: bytes = b"") -> Iterator[bytes]:
        """The content between head and tail piece by piece; sent() is told how much of it has gone before each."""
        yield head
        for start in range(0, len(self.content), PIECE):
            sent(start)
            yield self.content[start : start + PIECE]
        sent(len(self.content))
        yield tail

    def form(self, fields: Mapping[str, str], sent: Sent) -> tuple[Iterator[bytes], int, dict[str, str]]:
        """The file as `file` in a multipart form after the fields: pieces, length in bytes, headers (RFC 7578).

        The boundary is the content's own hash, which cannot stand in it.
        """
        boundary = f"tiltprint-{self.sha256}"
        begin = f"--{boundary}\r\nContent-Disposition: form-data; name="
        texts = [f'{begin}"{key}"\r\n\r\n{value}\r\n' for key, value in fields.items()]
        file = f'{begin}"file"; filename="{self.name}"\r\n'
        head = ("".join(texts) + file + "Content-Type: application/octet-stream\r\n\r\n").encode()
        tail = f"\r\n--{boundary}--\r\n".encode()
        length = len(head) + len(self.content) + len(tail)
        return self.pieces(sent, head, tail), length, {"Content-Type": f"multipart/form-data; boundary={boundary}"}


def server_name(name: str) -> str:
    """The name that a file gets on any server: letters without accents, digits, . _ and -, ending in .gcode.

    Klipper reads it from between quotes, RepRapFirmware from a card with FAT names, OctoPrint replaces what it does not like.
    """
    stem, suffix = name.removeprefix("demo:"), ""
    for each in (*TAKEN, ".nc", ".ngc"):
        if stem.lower().endswith(each):
            stem, suffix = stem[: -len(each)], stem[-len(each) :].lower()
            break
    plain = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode()
    plain = STRANGE.sub("_", plain).strip("._-")[:LONGEST_NAME]
    return (plain or "print") + (suffix if suffix in TAKEN else SUFFIX)
