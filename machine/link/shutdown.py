"""Leaving a printer safely in mid-print: moves stopped, heaters and fan off, and a look whether the heaters really are."""

from time import monotonic

from machine.link.events import Ok, Temperature, read_event
from machine.link.port import Port

# The newline ends a half line. The lines carry no numbers, so they are understood whatever was lost before: M108 ends a wait
# for heat and M410 a move where the firmware reads them out of turn. Nothing homes or turns the table: the head may be
# inside the part.
ORDERS = b"\nM108\nM410\nM104 S0\nM140 S0\nM107\nM105\n"
AGAIN_S = 2.0  # noise may eat an order; without the proof they are given again this often
OLD_WORDS_S = 1.0  # a report from before the orders proves nothing; a printer that never falls silent is not waited for
SETTLE_S = 20.0  # lines that the printer had already taken are run first


def heaters_off(port: Port, patience_s: float = SETTLE_S) -> bool:
    """Stop the printer and switch the heaters off; True when its own report shows targets of 0.

    Raises PortError when the port is gone.
    """
    port.discard()
    began_s = monotonic()
    while port.read() and monotonic() - began_s < OLD_WORDS_S:
        pass
    next_s, heard = began_s, b""
    while (now_s := monotonic()) - began_s < patience_s:
        if now_s >= next_s:
            port.write(ORDERS)
            next_s = now_s + AGAIN_S
        *lines, heard = (heard + port.read()).split(b"\n")
        if any(_cold(line) for line in lines):
            return True
        heard = heard[-4096:]
    return False


def _cold(line: bytes) -> bool:
    event = read_event(line)
    report = event.temperature if isinstance(event, Ok) else event
    return isinstance(report, Temperature) and report.nozzle_target_c == 0 and report.bed_target_c in (0, None)
