"""Server: what every kind of print server can be asked for, and where a print on one stands."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

from machine.link.print_state import PrintStatus
from machine.printing.servers.gcode_upload import GcodeUpload, Sent
from machine.printing.servers.http import HttpSession
from profiles.errors import ServerError


@dataclass(frozen=True)
class ServerIdentity:
    """Who answers. text: server, version and what it drives; firmware: as M115 names it, "" when it does not tell.

    letters: axes of the printer; limits: letter -> least and greatest place, mm or deg; steppers: names of the [manual_stepper]
    sections, commands: names of all commands and macros, in capitals; None where there is no such thing.
    """

    text: str
    firmware: str = ""
    letters: str = ""
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)
    steppers: frozenset[str] | None = None
    commands: frozenset[str] | None = None


class PrintServer(ABC):
    """One print server. name: as the user names it; key_header: which header carries a key. All raise ServerError; status() and
    orders may come from any thread.
    """

    key_header = ""
    tells_percents = False  # whether status() tells feed and flow

    def __init__(self, http: HttpSession) -> None:
        self._http, self.name = http, http.name
        if self.key_header and http.credentials.key:
            http.set_header(self.key_header, http.credentials.key)

    def close(self) -> None:
        """Leave."""
        self._http.close()

    @abstractmethod
    def greet(self) -> ServerIdentity:
        """Make sure that it is such a server, that the key is good, and learn what it drives."""

    @abstractmethod
    def status(self) -> PrintStatus:
        """Where it stands."""

    def webcam(self) -> str:
        """Where its camera gives a picture; "": it has none, or does not tell."""
        return ""

    def file_in_print(self) -> str:
        """The file that it prints now, by the name that upload() returns; "" where it does not tell."""
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
    def pause(self) -> None:
        """Pause the print."""

    @abstractmethod
    def resume(self) -> None:
        """Go on with it."""

    @abstractmethod
    def cancel(self) -> None:
        """End it."""

    @abstractmethod
    def command(self, line: str) -> None:
        """Have a line of G-code executed."""

    def settings(self) -> str:
        """What its firmware tells of its settings, as JSON, a line for each answer."""
        raise ServerError(f"{self.name} does not know its firmware's settings: ask the printer at its own port")

    @abstractmethod
    def emergency_stop(self) -> None:
        """Halt at once."""
