"""Urgent orders: what Marlin's emergency parser reads from the raw bytes, whatever waits before them."""

import re

LONGEST = 96  # of a line more is not looked at
ORDER = re.compile(rb"\s*(?:N-?\d+\s*)?(?:(M(?:108|112|410|876)|[SPR]000)(?!\d))")
SIGNS = (b"M1", b"M4", b"M8", b"000")


class Urgent:
    """realtime: S000, P000 and R000 too (REALTIME_REPORTING_COMMANDS)."""

    def __init__(self, realtime: bool = False) -> None:
        self._realtime = realtime
        self._half = b""

    def read(self, data: bytes) -> list[str]:
        """The orders that stand at the begin of lines which end in these bytes; numbers and checksums are not looked at."""
        scanned = self._half + data
        end = scanned.rfind(b"\n") + 1
        self._half = scanned[end:][:LONGEST]
        if not any(sign in scanned for sign in SIGNS):
            return []
        orders = [found[1].decode() for line in scanned[:end].splitlines() if (found := ORDER.match(line))]
        return [order for order in orders if order[0] == "M" or self._realtime]

    def forget(self) -> None:
        """The board restarts."""
        self._half = b""
