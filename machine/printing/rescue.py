"""Rescue: switch off the heaters of a printer whose sender has died, or stop it at once, over a new connection.

A print server continues by itself: it is only queried, unless the user wants the print stopped or cancelled.
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
ROUNDED_S = 1.0  # servers report whole seconds
STOPPED = "emergency stop: {server} has taken it; restart the printer before the next print"


def rescue(at: SerialPort | Server, emergency: bool) -> str:
    """Reopen the port, make the printer safe and return the result as a sentence. emergency: by M112.

    Homing in progress is aborted, upon which Marlin halts with its heaters off.
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
    """Cancel a print that this program no longer follows, if it is certain that the server still prints it; False if it prints
    nothing.

    file: its name on the server; away_s: seconds since it was last seen printing. Raises ServerError, and cancels nothing, when
    the server is unreachable or may be printing something else.
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
        if status.elapsed_s + ROUNDED_S < away_s:  # started after the abandoned print was last seen
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
        return f"{error}; what {at.name} prints continues without this program: look at the printer"
    if status.state.is_printing:
        now = f"{at.name} is {status.state} {status.file or 'a file'}"
        return f"{now} and continues without this program: control it on the server's page"
    return f"{at.name} prints nothing now ({status.message or status.state})"
