"""Reconnect: waiting for a printer whose port has vanished, a loose plug, a sleeping hub, to come back as the same device."""

import os
from collections.abc import Callable
from pathlib import Path

from machine.link.medium import Medium, Wire
from profiles.errors import PortError

BY_ID = Path("/dev/serial/by-id")
EVERY_S = 0.2


def lasting_name(port: str) -> str:
    """The name by which a device is found again: an adapter that is plugged in again may become another /dev/tty."""
    try:
        target = os.path.realpath(port)
        return next((str(link) for link in sorted(BY_ID.iterdir()) if os.path.realpath(link) == target), port)
    except OSError:
        return port


def found_again(name: str, baud: int, medium: Medium, heed: Callable[[], None]) -> Wire | None:
    """The wire to the printer once it is there again, None when it stays away too long. heed() may raise to end the wait."""
    end_s = medium.now_s() + medium.lost_s
    while medium.now_s() < end_s:
        heed()
        medium.wait(EVERY_S)
        try:
            return medium.open(name, baud)
        except PortError:
            continue
    return None
