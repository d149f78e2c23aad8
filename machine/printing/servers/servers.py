"""Print servers: their kinds, the dialects each prints, their keys, and a session with one.

The key of a print server and the trusted authority come from the user's file or a variable:

    [servers."octopi.local"]          host, or host:port, as in the address
    key = "..."                       API key of OctoPrint or Moonraker, password of a Duet
    ca_file = "workshop-ca.pem"       for https: trust only certificates of this authority

Neither is an argument, which every user of the computer could read.
"""

import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from machine.firmware import dialects
from machine.printing.destination import NAMES, Server
from machine.printing.servers.duet import Duet
from machine.printing.servers.http import VARIABLE, Tell, servers_file
from machine.printing.servers.moonraker import Moonraker
from machine.printing.servers.octoprint import OctoPrint
from machine.printing.servers.server import PrintServer
from profiles.errors import ServerError
from profiles.messages import phrase
from profiles.places import parse, shipped, tables

KINDS: Mapping[str, type[PrintServer]] = {"octoprint": OctoPrint, "moonraker": Moonraker, "duet": Duet}
# Dialects of a server's firmware; OctoPrint drives any firmware with a serial port.
DIALECTS = {"moonraker": ("klipper", "klipper_steppers"), "duet": ("reprapfirmware",)}
KEYS = ("key", "ca_file")


def dialect_mismatch(address: Server, machine: str, dialect: str) -> str:
    """Why a server cannot print a dialect; "" when it can."""
    allowed = DIALECTS.get(address.kind) or tuple(name for name, dialect in dialects().items() if dialect.serial)
    if dialect in allowed:
        return ""
    machines = {name: tables("machine", name).get("machine", {}).get("dialect") for name in shipped("machine")}
    named = ", ".join(name for name, written in machines.items() if written in allowed)
    return (
        f"{machine} writes for {dialect}, but {NAMES[address.kind]} prints {' or '.join(allowed)}: "
        f"{phrase('machine of those', '--machine must be one of those')}, as {named}"
    )


@contextmanager
def open_server(address: Server, tell: Tell | None = None) -> Iterator[PrintServer]:
    """A session with a server. tell: called with the traffic, without keys. Raises ServerError, ProfileError."""
    server = KINDS[address.kind](address, *read_credentials(address), tell)
    try:
        yield server
    finally:
        server.close()


def read_credentials(address: Server) -> tuple[str, Path | None]:
    """The key of a server and the file of the only authority to trust; "" and None by default.

    A key in the variable takes precedence over the file. Raises ServerError, ProfileError.
    """
    file = servers_file()
    table = _table(file, address) if file.is_file() else {}
    key = os.environ.get(VARIABLE, "") or table.get("key", "")
    if not (key.isascii() and key.isprintable()):
        raise ServerError(f"the key for {address.name} has characters that no key has: letters, digits and signs are allowed")
    ca_file = table.get("ca_file")
    try:
        return key.strip(), None if ca_file is None else file.parent / Path(ca_file).expanduser()
    except RuntimeError:
        raise ServerError(f"ca_file {ca_file} for {address.name}: no home folder of that user is known") from None


def _table(file: Path, address: Server) -> dict[str, str]:
    """The entry of a server in the user's file, {} without one. Raises ServerError for an invalid file or one that others can
    read; on Windows a user's folders are private anyway."""
    if os.name == "posix" and stat.S_IMODE(file.stat().st_mode) & 0o077:
        raise ServerError(f"{file} holds keys and can be read or written by others: chmod 600 {file} makes it yours alone")
    document = parse(file, "file of servers")
    servers = document.get("servers", {})
    if unknown := [key for key in document if key != "servers"]:
        raise ServerError(f'{file}: {unknown[0]!r} is not known: [servers."HOST"] is expected')
    if not isinstance(servers, dict) or not all(isinstance(table, dict) for table in servers.values()):
        raise ServerError(f'{file}: servers must be tables of their own: [servers."HOST"] is expected')
    for name, key, value in ((name, key, value) for name, table in servers.items() for key, value in table.items()):
        if key not in KEYS:
            raise ServerError(f'{file}: [servers."{name}"] has {key!r}: {" and ".join(KEYS)} are known')
        if not isinstance(value, str):
            raise ServerError(f'{file}: {key} of [servers."{name}"] must be a text in quotes')
    # host names in lower case, as in the address
    known: dict[str, dict[str, str]] = {name.lower(): table for name, table in servers.items()}
    return known.get(f"{address.host}:{address.port}", known.get(address.host, {}))
