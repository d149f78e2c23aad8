"""The follow command: a print that a server is at already, with the screen and keys of one that was begun here."""

from pathlib import Path

from machine.notices import say
from machine.pipeline.output import check_writable
from machine.printing.attendance import AtServerTerminal, Observers
from machine.printing.network_print import file_name, follow_there, running_print, server_session
from machine.printing.servers.address import parse_server_address
from machine.printing.servers.follow import End


def follow(address: str, log: Path | None = None) -> int:
    """Show and command what a print server prints; 130 when a person has ended it or left. Raises ServerError."""
    parse_server_address(address)
    if log is not None:
        check_writable(log)
    with server_session(address, f"what {address} prints", "print", log) as (server, record):
        say(f"{server.greet().text} answers at {server.name}")
        now = running_print(server)
        say(f"it is {now.phase.value} {file_name(now)}")
        end = follow_there(server, now, Observers(record), AtServerTerminal(server.name))
    return 0 if end is End.DONE else 130
