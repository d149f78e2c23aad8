"""Ports: the serial ports of this computer and what answers at each."""

import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Event
from typing import Any

from machine.app.printer.compatibility import describe_answer
from machine.app.printer.running_simulators import running_simulators
from machine.app.terminal.progress import say
from machine.app.terminal.report import show
from machine.link.identification import QUICK_S, RATES, Answer, Kind, ask_at_any_rate
from machine.link.port import SerialDevice, check_baud, open_port, serial_devices
from profiles.errors import PortError

TIMEOUT_S = 4.0
AT_A_TIME = 16  # ports asked at once: each takes seconds when nothing answers


@dataclass(frozen=True)
class PortReport:
    """A port, and what answers there at which rate; trouble: why it could not be asked."""

    device: SerialDevice
    answer: Answer | None = None
    baud: int = 0
    trouble: str = ""


def ports(baud: int, as_json: bool, ask: bool) -> int:
    """List ports on stdout: those in /dev/serial/by-id first, running simulators of this user last. ask=False: none is opened.

    0 also when there is none.
    """
    check_baud(baud)
    devices = (*serial_devices(), *running_simulators())
    if not devices:
        say("no serial port was found: plug the printer in and switch it on")
    elif ask:
        say(f"asking {len(devices)} {'ports' if len(devices) > 1 else 'port'}: this takes up to {_longest_s():.0f} s")
    reports = _ask_all(devices, baud) if ask else [PortReport(device) for device in devices]
    text = json.dumps([port_json(each) for each in reports], indent=2) + "\n"
    show(text if as_json else "".join(describe(each) for each in reports))
    return 0


def _ask_all(devices: Sequence[SerialDevice], baud: int) -> list[PortReport]:
    over = Event()
    with ThreadPoolExecutor(AT_A_TIME) as pool:
        try:
            return list(pool.map(lambda device: ask_port(device, baud, over), devices))
        except KeyboardInterrupt:
            over.set()
            raise


def ask_port(device: SerialDevice, baud: int, over: Event | None = None) -> PortReport:
    """Open a port for this program alone and see what answers; a set `over` ends the asking."""
    try:
        with open_port(device.name, baud) as port:
            return PortReport(device, *ask_at_any_rate(port, baud, TIMEOUT_S, over))
    except PortError as error:
        return PortReport(device, trouble=str(error))


def describe(report: PortReport) -> str:
    """Two or three lines for a person."""
    device = report.device
    lines = [device.name]
    what = [device.path if device.path != device.name else "", device.description]
    what.append(f"serial number {device.serial_number}" if device.serial_number else "")
    lines.append(", ".join(word for word in what if word))
    lines.append(
        report.trouble.removeprefix(f"port {device.name} ")
        if report.answer is None
        else describe_answer(report.answer, report.baud)
    )
    return "\n    ".join(line for line in lines if line) + "\n"


def port_json(report: PortReport) -> dict[str, Any]:
    """The same for a program: every key always there, null where it is not known."""
    answer, device = report.answer, report.device
    printer = answer is not None and answer.kind in (Kind.PRINTER, Kind.BUSY, Kind.HALTED)
    return {
        "port": device.name,
        "path": device.path,
        "description": device.description,
        "serial_number": device.serial_number,
        "answer": None if answer is None else answer.kind.value,
        "baud": report.baud if printer else None,
        "firmware": answer.firmware if answer is not None and answer.kind is Kind.PRINTER else None,
        "axes": list(answer.letters) if answer is not None else [],
        "limits": {letter: list(limits) for letter, limits in answer.limits.items()} if answer is not None else {},
        "trouble": report.trouble or None,
    }


def _longest_s() -> float:
    return TIMEOUT_S + QUICK_S * len(RATES)
