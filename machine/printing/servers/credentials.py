"""Credentials: the key of a print server and whose certificates are trusted, from the user's own file or a variable.

    [servers."octopi.local"]          host, or host:port, as in the address
    key = "..."                       API key of OctoPrint or Moonraker, password of a Duet
    ca_file = "workshop-ca.pem"       for https: trust the certificates of this authority alone

Neither is an argument, where every user of the computer could read it.
"""

import os
import stat
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from machine.printing.destination import Server
from profiles.errors import ServerError
from profiles.folders import settings_folder
from profiles.places import parse

VARIABLE = "TILTPRINT_SERVER_KEY"
FILE = "servers.toml"
KEYS = ("key", "ca_file")


@dataclass(frozen=True)
class Credentials:
    """key: "" when there is none; ca_file: None: the authorities that this computer trusts."""

    key: str = field(default="", repr=False)
    ca_file: Path | None = None


def servers_file() -> Path:
    """The user's file of print servers; it need not be there."""
    return settings_folder() / FILE


def how_to_give_a_key(address: Server) -> str:
    """Where the key of a server belongs, for a person."""
    return f'give it as key = "..." below [servers."{address.host}"] in {servers_file()}, or in the variable {VARIABLE}'


def read_credentials(address: Server) -> Credentials:
    """What is known of a server; the variable's key goes before the file's. Raises ServerError, ProfileError."""
    file = servers_file()
    table = _table(file, address) if file.is_file() else {}
    key = os.environ.get(VARIABLE, "") or table.get("key", "")
    if not (key.isascii() and key.isprintable()):
        raise ServerError(f"the key for {address.name} has characters that no key has: letters, digits and signs are allowed")
    ca_file = table.get("ca_file")
    try:
        return Credentials(key.strip(), None if ca_file is None else file.parent / Path(ca_file).expanduser())
    except RuntimeError:
        raise ServerError(f"ca_file {ca_file} for {address.name}: no home folder of that user is known") from None


def _table(file: Path, address: Server) -> dict[str, str]:
    _check_private(file)
    document = parse(file, "file of servers")
    servers = document.get("servers", {})
    if unknown := [key for key in document if key != "servers"]:
        raise ServerError(f'{file}: {unknown[0]!r} is not known: [servers."HOST"] is expected')
    if not isinstance(servers, dict) or not all(isinstance(table, dict) for table in servers.values()):
        raise ServerError(f'{file}: servers must be tables of their own: [servers."HOST"] is expected')
    for name, table in servers.items():
        _check_table(file, name, table)
    known = {name.lower(): table for name, table in servers.items()}  # as the address has its host
    return next((known[name] for name in address.hosts if name in known), {})


def _check_table(file: Path, name: str, table: dict[str, Any]) -> None:
    for key, value in table.items():
        if key not in KEYS:
            raise ServerError(f'{file}: [servers."{name}"] has {key!r}: {" and ".join(KEYS)} are known')
        if not isinstance(value, str):
            raise ServerError(f'{file}: {key} of [servers."{name}"] must be a text in quotes')


def _check_private(file: Path) -> None:
    """Refuse a file that others can read; Windows keeps a user's folders to the user."""
    if os.name == "posix" and stat.S_IMODE(file.stat().st_mode) & 0o077:
        raise ServerError(f"{file} holds keys and can be read or written by others: chmod 600 {file} makes it yours alone")
