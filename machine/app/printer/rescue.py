"""Rescue: a printer whose sender has died: its heaters switched off, or stopped at once, by whoever opens its port next.

A print server goes on printing by itself, as it does when a person leaves it: it is only asked what it does, or stopped.
"""

from machine.link.medium import SERIAL
from machine.link.port import open_port
from machine.link.shutdown import Heaters, emergency_stop, heaters_off
from machine.network.address import is_server_address
from machine.network.follow import UNCONFIRMED
from machine.network.gcode_upload import server_name
from machine.network.server import ACTIVE
from machine.network.servers import open_server
from profiles.errors import PortError, UserError

STOPPED = "emergency stop: {server} has taken it; restart the printer before the next print"


def rescue(port: str, baud: int, emergency: bool) -> str:
    """Open the port anew and give the orders; what became of them as a sentence. emergency: by M112.

    Homing that is under way is cut short, whereupon Marlin halts: its heaters are off then, too.
    """
    if is_server_address(port):
        return _stop_server(port) if emergency else _look_at_server(port)
    try:
        with open_port(port, baud) as wire:
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


def _stop_server(address: str) -> str:
    try:
        with open_server(address) as server:
            server.emergency_stop()
    except UserError as error:
        return UNCONFIRMED.format(server=address, error=error)
    return STOPPED.format(server=address)


def cancel_on_server(address: str, file: str) -> bool:
    """Cancel the print of a file on a server that nobody follows any more; whether nothing of it is printed. Raises UserError."""
    with open_server(address) as server:
        server.greet()
        status = server.status()
        ours = status.file in ("", file, server_name(file))
        if ours and status.phase in ACTIVE:
            server.cancel()
        return ours


def _look_at_server(address: str) -> str:
    try:
        with open_server(address) as server:
            server.greet()
            status = server.status()
    except UserError as error:
        return f"{error}; what {address} prints goes on without this program: look at the printer"
    if status.phase in ACTIVE:
        now = f"{address} is {status.phase.value} {status.file or 'a file'}"
        return f"{now} and goes on without this program: its own page commands it"
    return f"{address} prints nothing now ({status.message or status.phase.value})"
