"""Destination: where a print goes: the simulated printer, a printer at a serial port, or a print server.

What a person names as a port is read here, once; everything behind that asks the value.
"""

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import ClassVar
from urllib.parse import SplitResult, urlsplit

from machine.firmware.firmware import check_baud
from machine.pipeline.requests import BAUD, SIMULATED
from profiles.errors import PrinterError, ServerError
from profiles.messages import option

# The port that a server listens at where none is given: haproxy before OctoPrint (OctoPi), Moonraker's [server] port, a Duet.
PORTS = {"octoprint": 80, "moonraker": 7125, "duet": 80}
NAMES = {"octoprint": "OctoPrint", "moonraker": "Moonraker", "duet": "a Duet"}
TLS_PORT = 443
SCHEMES = ("http", "https")
EXPECTED = "octoprint:HOST, moonraker:HOST or duet:HOST, HOST being a name, an IP address or http(s)://HOST:PORT, is expected"


@dataclass(frozen=True)
class Simulated:
    """The simulated printer on a pseudo-terminal. speed: times real time, 0: as fast as it can."""

    speed: float = 0.0
    name: ClassVar[str] = SIMULATED

    @property
    def title(self) -> str:
        """The name in a title."""
        return "the simulated printer"


@dataclass(frozen=True)
class SerialPort:
    """A printer at a device, or behind socket://HOST:PORT or rfc2217://HOST:PORT. name: as the user names it."""

    name: str
    baud: int = BAUD

    @property
    def title(self) -> str:
        """The name in a title."""
        return self.name

    @property
    def is_rate_limited(self) -> bool:
        """Whether bytes take the time that the baud rate says: not over native USB, a network or a pseudo-terminal."""
        if "://" in self.name:
            return False
        device = Path(self.name).resolve()  # of a stable name under /dev/serial/by-id
        return device.parent.name != "pts" and not device.name.startswith(("ttyACM", "cu.usbmodem"))


@dataclass(frozen=True)
class Server:
    """A print server, which takes whole files and prints them by itself.

    kind: octoprint, moonraker or duet; name: the address as it was given, for messages; path: before that of every request.
    """

    kind: str
    scheme: str
    host: str
    port: int
    path: str
    name: str

    @property
    def url(self) -> str:
        """Without a slash at its end."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}{self.path}"

    @property
    def hosts(self) -> tuple[str, str]:
        """Names in the user's file of servers: host and port, or the host alone."""
        return f"{self.host}:{self.port}", self.host


Destination = Simulated | SerialPort | Server
AtPrinter = Simulated | SerialPort  # a line to the printer itself


def parse_destination(port: str, baud: int = BAUD, speed: float = 0.0) -> Destination:
    """The destination that --port, --baud and --sim-speed name. Raises ServerError, PrinterError for what is not possible."""
    if is_server_address(port):
        return parse_server_address(port)
    check_baud(baud)
    check_speed(speed)
    return Simulated(speed) if port == SIMULATED else SerialPort(port, baud)


def parse_printer(port: str, baud: int = BAUD, speed: float = 0.0) -> AtPrinter:
    """The destination where a line to a printer itself is needed. Raises ServerError for a print server."""
    return at_printer(parse_destination(port, baud, speed))


def at_printer(destination: Destination) -> AtPrinter:
    """Refuse a print server where a line to a printer itself is needed. Raises ServerError."""
    if isinstance(destination, Server):
        raise ServerError(
            f"{option('port', destination.name)} is a print server, which takes whole files by print and send: "
            "a printer's port is expected"
        )
    return destination


def check_speed(speed: float) -> None:
    """Refuse a speed at which no simulated printer can run. Raises PrinterError."""
    if not (isfinite(speed) and speed >= 0):
        raise PrinterError(f"{option('sim-speed')} is {speed:g}: it must be 0 (as fast as possible) or a number above")


def is_server_address(text: str) -> bool:
    """Whether what a person names as a port is a print server."""
    return text.partition(":")[0].lower() in PORTS and ":" in text


def parse_server_address(text: str) -> Server:
    """The server that is meant. Raises ServerError."""
    kind, colon, rest = text.partition(":")
    kind = kind.lower()
    if "@" in rest:  # never repeated: what stands before it may be a password
        raise ServerError("server address: names and passwords do not belong into it: keys have a file of their own")
    if not colon or kind not in PORTS:
        raise ServerError(f"server address {_plain(text)!r}: {EXPECTED}")
    has_scheme = "://" in rest
    try:
        parts = urlsplit(rest if has_scheme else f"//{rest}")
        port = parts.port
    except ValueError as error:
        raise ServerError(f"server address {_plain(text)!r}: {str(error).lower()}: {EXPECTED}") from None
    if port == 0:
        raise ServerError(f"server address {_plain(text)!r}: port 0 is none: {EXPECTED}")
    _check(parts, text, has_scheme)
    scheme = parts.scheme or "http"
    usual = TLS_PORT if scheme == "https" else PORTS[kind]
    return Server(kind, scheme, parts.hostname or "", port or usual, parts.path.rstrip("/"), text)


def _check(parts: SplitResult, text: str, has_scheme: bool) -> None:
    if has_scheme and parts.scheme not in SCHEMES:
        raise ServerError(f"server address {_plain(text)!r} begins with {parts.scheme}://: http:// or https:// is expected")
    host = parts.hostname or ""
    if not all(c.isalnum() or c in ".-_:%" for c in host) or not all(
        0 < len(label) < 64 for label in host.rstrip(".").split(".")
    ):
        raise ServerError(f"server address {_plain(text)!r} names no host: {EXPECTED}")
    if parts.query or parts.fragment:
        raise ServerError(f"server address {_plain(text)!r}: nothing may follow the path: {EXPECTED}")


def _plain(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:100])
