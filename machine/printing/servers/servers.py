"""Servers: which kinds there are, which firmwares each can print on, and a session with one."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from machine.firmware import dialects
from machine.printing.destination import NAMES, Server
from machine.printing.servers.credentials import read_credentials
from machine.printing.servers.duet import Duet
from machine.printing.servers.http import HttpSession, Tell
from machine.printing.servers.moonraker import Moonraker
from machine.printing.servers.octoprint import OctoPrint
from machine.printing.servers.server import PrintServer
from profiles.messages import phrase
from profiles.places import shipped, tables

KINDS: Mapping[str, Callable[[HttpSession], PrintServer]] = {"octoprint": OctoPrint, "moonraker": Moonraker, "duet": Duet}
# What a server's firmware reads; OctoPrint sends lines to whatever takes them over a serial port.
DIALECTS = {"moonraker": ("klipper", "klipper_steppers"), "duet": ("reprapfirmware",)}


def printable_dialects(kind: str) -> tuple[str, ...]:
    """The dialects of machine.dialect that a kind of server can print."""
    return DIALECTS.get(kind) or tuple(name for name, dialect in dialects().items() if dialect.serial)


def dialect_mismatch(address: Server, machine: str, dialect: str) -> str:
    """Why a server cannot print what is written in a dialect, as a sentence; "" when it can."""
    allowed = printable_dialects(address.kind)
    if dialect in allowed:
        return ""
    named = ", ".join(name for name in shipped("machine") if _dialect(name) in allowed)
    server = NAMES[address.kind]
    return (
        f"{machine} writes for {dialect}, but {server} prints {' or '.join(allowed)}: "
        f"{phrase('machine of those', '--machine must be one of those')}, as {named}"
    )


def _dialect(machine: str) -> str:
    return str(tables("machine", machine).get("machine", {}).get("dialect", ""))


@contextmanager
def open_server(address: Server, tell: Tell | None = None) -> Iterator[PrintServer]:
    """A session with a server. tell: what goes over the line, for a log, without keys. Raises ServerError."""
    server = KINDS[address.kind](HttpSession(address, read_credentials(address), tell))
    try:
        yield server
    finally:
        server.close()
