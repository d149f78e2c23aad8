"""Ports: the serial ports of this computer and what answers at each."""

import json
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Event
from typing import Any

from machine.app.match import ECHO
from machine.app.progress import say
from machine.app.report import show
from machine.link.answer import QUICK_S, RATES, Answer, Kind, ask_at_any_rate
from machine.link.port import SerialDevice, check_baud, open_port, serial_devices
from profiles.errors import PortError

PATIENCE_S = 4.0
AT_A_TIME = 16  # ports asked at once: each takes seconds when nothing answers


@dataclass(frozen=True)
class Found:
    """A port, and what answers there at which rate; trouble: why it could not be asked."""

    device: SerialDevice
    answer: Answer | None = None
    baud: int = 0
    trouble: str = ""


def ports(baud: int, as_json: bool, ask: bool) -> int:
    """List ports on stdout; those found in /dev/serial/by-id first. ask=False: none is opened. 0 also when there is none."""
    check_baud(baud)
    devices = serial_devices()
    if not devices:
        say("no serial port was found: plug the printer in and switch it on")
    elif ask:
        say(f"asking {len(devices)} {'ports' if len(devices) > 1 else 'port'}: this takes up to {_longest_s():.0f} s")
    found = _all_asked(devices, baud) if ask else [Found(device) for device in devices]
    show(json.dumps([plain(each) for each in found], indent=2) + "\n" if as_json else "".join(told(each) for each in found))
    return 0


def _all_asked(devices: Sequence[SerialDevice], baud: int) -> list[Found]:
    over = Event()
    with ThreadPoolExecutor(AT_A_TIME) as pool:
        try:
            return list(pool.map(lambda device: asked(device, baud, over), devices))
        except KeyboardInterrupt:
            over.set()
            raise


def asked(device: SerialDevice, baud: int, over: Event | None = None) -> Found:
    """Open a port for this program alone and see what answers; a set `over` ends the asking."""
    try:
        with open_port(device.name, baud) as port:
            return Found(device, *ask_at_any_rate(port, baud, PATIENCE_S, over))
    except PortError as error:
        return Found(device, trouble=str(error))


def told(found: Found) -> str:
    """Two or three lines for a person."""
    device = found.device
    lines = [device.name]
    what = [device.path if device.path != device.name else "", device.description]
    what.append(f"serial number {device.serial_number}" if device.serial_number else "")
    lines.append(", ".join(word for word in what if word))
    lines.append(
        found.trouble.removeprefix(f"port {device.name} ") if found.answer is None else in_words(found.answer, found.baud)
    )
    return "\n    ".join(line for line in lines if line) + "\n"


def in_words(answer: Answer, baud: int) -> str:
    """What answers, for a person."""
    if answer.kind is Kind.PRINTER:
        axes = f", axes {' '.join(answer.letters)}" if answer.letters else ""
        return f"{answer.firmware or 'a printer that does not name its firmware'}{axes}, at {baud} baud"
    if answer.kind is Kind.STRANGER:
        what = "it sends back what it is told" if answer.words in ECHO else f"it says {answer.words[:60]!r}"
        return f"something answers but is no printer: {what}"
    return {
        Kind.BUSY: f"a printer that is busy (it heats, moves or waits for a person), at {baud} baud",
        Kind.HALTED: f"a printer that has stopped with an error ({answer.words[:60]}), at {baud} baud",
        Kind.RUBBISH: f"rubbish at {baud} baud, and nothing at the usual other rates: --baud N tries another",
        Kind.SILENT: "nothing answers",
    }[answer.kind]


def plain(found: Found) -> dict[str, Any]:
    """The same for a program: every key always there, null where it is not known."""
    answer, device = found.answer, found.device
    printer = answer is not None and answer.kind in (Kind.PRINTER, Kind.BUSY, Kind.HALTED)
    return {
        "port": device.name,
        "path": device.path,
        "description": device.description,
        "serial_number": device.serial_number,
        "answer": None if answer is None else answer.kind.value,
        "baud": found.baud if printer else None,
        "firmware": answer.firmware if answer is not None and answer.kind is Kind.PRINTER else None,
        "axes": list(answer.letters) if answer is not None else [],
        "limits": {letter: list(limits) for letter, limits in answer.limits.items()} if answer is not None else {},
        "trouble": found.trouble or None,
    }


def _longest_s() -> float:
    return PATIENCE_S + QUICK_S * len(RATES)
