"""Print server: a G-code file as it is uploaded, and the interface of every kind of server."""

import re
import unicodedata
from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from io import BytesIO
from itertools import accumulate
from typing import BinaryIO

from machine.gcode.line_text import plain_line
from machine.link.identification import Answer
from machine.link.pending_commands import Command
from machine.link.print_state import PrintStatus
from machine.printing.servers.http import HttpSession
from profiles.errors import ServerError

LONGEST_NAME = 80  # RepRapFirmware allows 120 characters for a whole path
SUFFIX = ".gcode"
TAKEN = (".gcode", ".gco", ".g")  # OctoPrint accepts no others for programs
STRANGE = re.compile(r"[^A-Za-z0-9._-]+")
Sent = Callable[[int], None]  # called with the number of bytes sent


class GcodeUpload:
    """A program and its name on the server.

    Its lines are the text that was dry-run: without comments in parentheses, which the server or its firmware would execute.
    Raises GcodeError for lines that the dry run refuses too.
    """

    def __init__(self, name: str, lines: Iterable[str]) -> None:
        encoded = [f"{plain_line(line)}\n".encode() for line in lines]
        self.name = server_name(name)
        self.content = b"".join(encoded)
        self._ends = list(accumulate(map(len, encoded)))

    def line_at(self, position: int) -> int:
        """Number of complete lines before a byte position."""
        return bisect_right(self._ends, position)

    def read_by(self, sent: Sent) -> BinaryIO:
        """The content as a file that calls sent() with the bytes read so far, before each read and at the end."""
        return _ReportedBytes(self.content, sent)


class _ReportedBytes(BytesIO):
    def __init__(self, content: bytes, sent: Sent) -> None:
        super().__init__(content)
        self._sent = sent

    def read(self, size: int | None = -1) -> bytes:
        self._sent(self.tell())
        return super().read(size)


def server_name(name: str) -> str:
    """File name for any server: letters without accents, digits, . _ and -, ending in .gcode.

    Klipper reads it from between quotes, RepRapFirmware from FAT names; OctoPrint replaces other characters.
    """
    stem, suffix = name.removeprefix("demo:"), ""
    for ending in (*TAKEN, ".nc", ".ngc"):
        if stem.lower().endswith(ending):
            stem, suffix = stem[: -len(ending)], stem[-len(ending) :].lower()
            break
    plain = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode()
    plain = STRANGE.sub("_", plain).strip("._-")[:LONGEST_NAME]
    return (plain or "print") + (suffix if suffix in TAKEN else SUFFIX)


@dataclass(frozen=True)
class Identity:
    """Identity of a server or printer. text: server, version and firmware, "" for a printer at a port; printer: its answer at a
    port, None if unknown.

    steppers: names of the [manual_stepper] sections, commands: all commands and macros, in capitals; None if not reported.
    """

    text: str
    printer: Answer | None = None
    steppers: frozenset[str] | None = None
    commands: frozenset[str] | None = None


class PrintServer(HttpSession, ABC):
    """A print server. All methods raise ServerError; status() and orders may come from any thread."""

    tells_percents = False  # whether status() reports feed and flow
    hides_answers = False  # whether it keeps the firmware's answers to itself: an unknown command then seems to be carried out
    babystep = ""  # its firmware's command for {} mm of Z; "": that of the machine's profile

    @abstractmethod
    def greet(self) -> Identity:
        """Check the kind of server and the key, and identify the firmware."""

    @abstractmethod
    def status(self) -> PrintStatus:
        """Status of its print."""

    def webcam(self) -> str:
        """URL of its camera's picture; "" if it has none or does not report it."""
        return ""

    def file_in_print(self) -> str:
        """Name, as returned by upload(), of the file it prints; "" if it does not report it."""
        return self.status().file

    @abstractmethod
    def has(self, file: str) -> bool:
        """Whether it holds a file of this name."""

    @abstractmethod
    def upload(self, upload: GcodeUpload, sent: Sent) -> str:
        """Upload a file and return its name on the server; an incomplete file is never kept."""

    @abstractmethod
    def start(self, file: str) -> None:
        """Start printing a stored file."""

    @abstractmethod
    def order(self, command: Command) -> None:
        """Give PAUSE, RESUME, CANCEL or EMERGENCY_STOP."""

    @abstractmethod
    def command(self, line: str) -> None:
        """Execute a line of G-code."""

    def settings(self) -> str:
        """Settings of its firmware as JSON, one line per answer."""
        raise ServerError(f"{self.name} does not know its firmware's settings: ask the printer at its own port")
