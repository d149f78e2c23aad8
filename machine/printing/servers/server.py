"""Server: a G-code file as a print server takes it, and what every kind of server can be asked for."""

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

LONGEST_NAME = 80  # RepRapFirmware keeps 120 characters of a whole path
SUFFIX = ".gcode"
TAKEN = (".gcode", ".gco", ".g")  # OctoPrint takes no others for programs
STRANGE = re.compile(r"[^A-Za-z0-9._-]+")
Sent = Callable[[int], None]  # called with how many bytes have gone


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


@dataclass(frozen=True)
class Identity:
    """Who answers. text: a server with its version and what it drives, "" of a printer at a port; printer: its answer, or what
    it would answer at a port, None where that is not known.

    steppers: names of the [manual_stepper] sections, commands: names of all commands and macros, in capitals; None where there
    is no such thing.
    """

    text: str
    printer: Answer | None = None
    steppers: frozenset[str] | None = None
    commands: frozenset[str] | None = None


class PrintServer(HttpSession, ABC):
    """One print server. All methods raise ServerError; status() and orders may come from any thread."""

    tells_percents = False  # whether status() tells feed and flow
    babystep = ""  # its firmware's command for {} mm of Z; "": that of the machine's profile

    @abstractmethod
    def greet(self) -> Identity:
        """Make sure that it is such a server, that the key is good, and learn what it drives."""

    @abstractmethod
    def status(self) -> PrintStatus:
        """The state of its print now."""

    def webcam(self) -> str:
        """The address of its camera's picture; "" where it has none, or does not report it."""
        return ""

    def file_in_print(self) -> str:
        """The file that it prints now, by the name that upload() returns; "" where it does not report it."""
        return self.status().file

    @abstractmethod
    def has(self, file: str) -> bool:
        """Whether it holds a file of this name."""

    @abstractmethod
    def upload(self, upload: GcodeUpload, sent: Sent) -> str:
        """Hand over a file and return the name by which it is printed; half a file is never kept."""

    @abstractmethod
    def start(self, file: str) -> None:
        """Begin to print a file that it holds."""

    @abstractmethod
    def order(self, command: Command) -> None:
        """Pause, resume or cancel the print, or halt at once: PAUSE, RESUME, CANCEL, EMERGENCY_STOP."""

    @abstractmethod
    def command(self, line: str) -> None:
        """Have a line of G-code executed."""

    def settings(self) -> str:
        """The settings of its firmware as JSON, a line for each answer."""
        raise ServerError(f"{self.name} does not know its firmware's settings: ask the printer at its own port")
