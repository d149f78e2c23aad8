"""Rescue: a printer whose sender has died has its heaters switched off, or is stopped at once, on a connection of its own.

A print server goes on printing by itself: it is only asked what it does, unless a person wants it stopped or cancelled.
"""

from machine.link.medium import SERIAL
from machine.link.pending_commands import Command
from machine.link.port import open_port
from machine.link.shutdown import Heaters, emergency_stop, heaters_off
from machine.printing.destination import SerialPort, Server
from machine.printing.servers.follow import UNCONFIRMED
from machine.printing.servers.servers import open_server
from profiles.errors import PortError, ServerError, UserError

CANCEL_THERE = "if it is to be cancelled, do that on the server's own page"
ROUNDED_S = 1.0  # servers tell whole seconds
STOPPED = "emergency stop: {server} has taken it; restart the printer before the next print"


def rescue(at: SerialPort | Server, emergency: bool) -> str:
    """Open the port anew and give the orders; what became of them as a sentence. emergency: by M112.

    Homing that is under way is cut short, whereupon Marlin halts: its heaters are off then, too.
    """
    if isinstance(at, Server):
        return _rescue_server(at, emergency)
    try:
        with open_port(at.name, at.baud) as wire:
            if not emergency:
                heaters = heaters_off(wire, SERIAL)
                unproved = heaters is Heaters.UNPROVED
                return "its heaters may still be on: cut the printer's power" if unproved else heaters.value
            halted = emergency_stop(wire, SERIAL)
    except PortError as error:
        return f"{error}; cut the printer's power"
    return (
        "emergency stop: the printer has halted" if halted else "emergency stop: the printer did not confirm M112: cut the power"
    )


def cancel_on_server(at: Server, file: str, away_s: float) -> bool:
    """Cancel a print that nobody follows any more, if it certainly is the one that was left.

    file: its name on the server; away_s: how long ago it was last seen printing. Returns False when nothing is printed there.
    Raises ServerError, and cancels nothing, when the server is unreachable or what it prints may be somebody else's.
    """
    with open_server(at) as server:
        server.greet()
        status = server.status()
        if not status.state.is_printing:
            return False
        printed = status.file or server.file_in_print()
        if not printed:
            raise ServerError(f"{at.name} does not say which file it prints, it may not be {file}: {CANCEL_THERE}")
        if printed != file:
            raise ServerError(f"{at.name} prints {printed} now, not {file}")
        if status.elapsed_s + ROUNDED_S < away_s:  # begun after the one that was left was last seen
            raise ServerError(f"{at.name} may have begun to print {file} again since: {CANCEL_THERE}")
        server.order(Command.CANCEL)
        return True


def _rescue_server(at: Server, emergency: bool) -> str:
    try:
        with open_server(at) as server:
            if emergency:
                server.order(Command.EMERGENCY_STOP)
                return STOPPED.format(server=at.name)
            server.greet()
            status = server.status()
    except UserError as error:
        if emergency:
            return UNCONFIRMED.format(server=at.name, error=error)
        return f"{error}; what {at.name} prints goes on without this program: look at the printer"
    if status.state.is_printing:
        now = f"{at.name} is {status.state} {status.file or 'a file'}"
        return f"{now} and goes on without this program: its own page commands it"
    return f"{at.name} prints nothing now ({status.message or status.state})"
