"""Ports: the serial ports of this computer and what answers at each."""

import json
from threading import Event

from machine.firmware.firmware import check_baud
from machine.notices import say, show
from machine.printing.ports import LONGEST_S, PortReport, ask_ports, describe, known_ports, port_json


def ports(baud: int, as_json: bool, ask: bool) -> int:
    """List ports on stdout: those in /dev/serial/by-id first, running simulators of this user last. ask=False: none is opened.

    0 also when there is none.
    """
    check_baud(baud)
    devices = known_ports()
    if not devices:
        say("no serial port was found: plug the printer in and switch it on")
    elif ask:
        say(f"asking {len(devices)} {'ports' if len(devices) > 1 else 'port'}: this takes up to {LONGEST_S:.0f} s")
    reports = ask_ports(devices, baud, Event()) if ask else [PortReport(device) for device in devices]
    text = json.dumps([port_json(report) for report in reports], indent=2) + "\n"
    show(text if as_json else "".join(describe(report) for report in reports))
    return 0
