"""Destination of a print: the simulated printer, a printer at a serial port, or a print server.

The port's name is parsed here, once; all other code uses the value.
"""

import re
from dataclasses import dataclass
from difflib import get_close_matches
from ipaddress import IPv6Address
from math import isfinite
from pathlib import Path
from typing import ClassVar

from machine.firmware.firmware import check_baud
from machine.pipeline.requests import BAUD, SIMULATED
from profiles.errors import PrinterError, ServerError
from profiles.messages import option

# Default ports: haproxy before OctoPrint (OctoPi), Moonraker's [server] port, a Duet.
PORTS = {"octoprint": 80, "moonraker": 7125, "duet": 80}
NAMES = {"octoprint": "OctoPrint", "moonraker": "Moonraker", "duet": "a Duet"}
TLS_PORT = 443
SERVERS = "octoprint:HOST, moonraker:HOST or duet:HOST"
EXPECTED = f"{SERVERS}, HOST being a name, an IP address or http(s)://HOST:PORT, is expected"
LINES = ("socket", "rfc2217")
ADDRESSES = ", ".join(f"{line}://HOST:PORT" for line in LINES)
ADDRESS = re.compile(r"(?:([^:/?#]*)://)?(\[[^\]/?#]*\]|[^:/?#]*)(:[^/?#]*)?(/[^?#]*)?(.*)", re.DOTALL)
# Paths may contain colons, such as /dev/serial/by-path; any other name with a colon is an unknown kind of line, thus a mistake.
DEVICE = re.compile(rf"(?:(?i:{'|'.join(LINES)})://|[^:]*[/\\]).*|[^:]+")
NUMBER = re.compile(r":0*[1-9]\d{0,4}", re.ASCII)
LABEL = re.compile(r"[\w-]{1,63}")  # one label of a host name, in any script


@dataclass(frozen=True)
class Simulated:
    """The simulated printer on a pseudo-terminal. speed: times real time, 0: as fast as possible."""

    speed: float = 0.0
    name: ClassVar[str] = SIMULATED


@dataclass(frozen=True)
class SerialPort:
    """A printer at a device, or behind socket://HOST:PORT or rfc2217://HOST:PORT. name: as the user wrote it."""

    name: str
    baud: int = BAUD

    @property
    def is_rate_limited(self) -> bool:
        """Whether the baud rate limits throughput: not over native USB, a network or a pseudo-terminal."""
        if "://" in self.name:
            return False
        device = Path(self.name).resolve()  # a stable name under /dev/serial/by-id is a link
        return device.parent.name != "pts" and not device.name.startswith(("ttyACM", "cu.usbmodem"))


@dataclass(frozen=True)
class Server:
    """A print server, which receives whole files and prints them by itself. kind: octoprint, moonraker or duet; name: the address
    as the user wrote it, for messages; path: prefix of every request's path."""

    kind: str
    scheme: str
    host: str
    port: int
    path: str
    name: str

    @property
    def url(self) -> str:
        """Base URL without a trailing slash."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}{self.path}"


Destination = Simulated | SerialPort | Server
AtPrinter = Simulated | SerialPort  # with a direct line to the printer


def parse_destination(port: str, baud: int = BAUD, speed: float = 0.0) -> Destination:
    """Parse a port's name. Raises ServerError, PrinterError for what is impossible, such as a name that no device can have."""
    if is_server_address(port):
        return parse_server_address(port)
    check_baud(baud)
    if not (isfinite(speed) and speed >= 0):
        raise PrinterError(f"{option('sim-speed')} is {speed:g}: it must be 0 (as fast as possible) or a number above")
    if port.lower() == SIMULATED:
        return Simulated(speed)
    if not DEVICE.fullmatch(port) or not port.isprintable() or port != port.strip():
        shown = f"...@{port.rpartition('@')[2]}" if "@" in port else port  # the text before it may be a password
        raise PrinterError(f"port {_plain(shown)!r} is not a port: a device, {SIMULATED}, {ADDRESSES}, {SERVERS} is expected")
    if get_close_matches(port.lower(), [SIMULATED]) and not Path(port).exists():
        raise PrinterError(f"port {_plain(port)} does not exist: did you mean {SIMULATED}, the simulated printer?")
    return SerialPort(port, baud)


def parse_printer(port: str, baud: int = BAUD, speed: float = 0.0) -> AtPrinter:
    """Parse the name of a printer's own port. Raises PrinterError, and ServerError for a print server."""
    return at_printer(parse_destination(port, baud, speed))


def at_printer(destination: Destination) -> AtPrinter:
    """The destination, if it is a printer's own port. Raises ServerError for a print server."""
    if isinstance(destination, Server):
        raise ServerError(
            f"{option('port', destination.name)} is a print server, which takes whole files by print and send: "
            "a printer's port is expected"
        )
    return destination


def is_server_address(text: str) -> bool:
    """Whether a port's name is the address of a print server."""
    return text.partition(":")[0].lower() in PORTS and ":" in text


def parse_server_address(text: str) -> Server:
    """Parse the address of a print server. Raises ServerError."""
    kind, _, address = text.partition(":")
    kind = kind.lower()
    if "@" in address:  # never repeat it: the text before it may be a password
        raise ServerError("server address: it must not hold a name or password: keys have a file of their own")
    parts = ADDRESS.fullmatch(address)
    if not is_server_address(text) or parts is None:
        raise ServerError(f"server address {_plain(text)!r}: {EXPECTED}")
    scheme, host, port, path, rest = parts.groups("")
    if scheme.lower() not in ("", "http", "https"):
        raise ServerError(f"server address {_plain(text)!r} begins with {_plain(scheme)}://: http:// or https:// is expected")
    if not _is_host(host) or path.startswith("//"):  # http://http://h
        raise ServerError(f"server address {_plain(text)!r} names no host: {EXPECTED}")
    if port not in ("", ":") and not (NUMBER.fullmatch(port) and int(port[1:]) < 65536):
        raise ServerError(f"server address {_plain(text)!r}: {_plain(port[1:])} is not a port number: {EXPECTED}")
    if rest or not path.isprintable():
        raise ServerError(f"server address {_plain(text)!r}: nothing may follow the path: {EXPECTED}")
    usual = TLS_PORT if scheme.lower() == "https" else PORTS[kind]
    return Server(kind, scheme.lower() or "http", host.strip("[]").lower(), int(port[1:] or usual), path.rstrip("/"), text)


def _is_host(host: str) -> bool:
    """Whether a text is an IPv6 address in brackets, a host name or an IPv4 address."""
    if host.startswith("["):
        try:
            IPv6Address(host[1:-1])
        except ValueError:
            return False
        return True
    return all(LABEL.fullmatch(label) for label in host.removesuffix(".").split("."))


def _plain(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text[:100])
