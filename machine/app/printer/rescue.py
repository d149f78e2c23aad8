"""Rescue: a printer whose sender has died: its heaters switched off, or stopped at once, by whoever opens its port next."""

from machine.link.medium import SERIAL
from machine.link.port import open_port
from machine.link.shutdown import Heaters, emergency_stop, heaters_off
from profiles.errors import PortError


def rescue(port: str, baud: int, emergency: bool) -> str:
    """Open the port anew and give the orders; what became of them as a sentence. emergency: by M112.

    Homing that is under way is cut short, whereupon Marlin halts: its heaters are off then, too.
    """
    try:
        with open_port(port, baud) as wire:
            if not emergency:
                return _SENTENCES[heaters_off(wire, SERIAL)]
            halted = emergency_stop(wire, SERIAL)
    except PortError as error:
        return f"{error}; cut the printer's power"
    return (
        "emergency stop: the printer has halted" if halted else "emergency stop: the printer did not confirm M112: cut the power"
    )


_SENTENCES = {
    Heaters.OFF: "the printer reports its heaters off",
    Heaters.HALTED: "the printer has halted and switched its heaters off by itself",
    Heaters.UNPROVED: "its heaters may still be on: cut the printer's power",
}
