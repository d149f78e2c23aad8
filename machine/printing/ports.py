"""Ports: the line to a printer, and the survey of all ports of this computer.

A running simulated printer keeps a locked file in the state folder with its path and a description. The lock matters: after a
simulator was killed, another terminal may get its path and must not be written to.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from math import inf
from pathlib import Path
from threading import Event
from time import monotonic, sleep
from typing import Any

from machine.firmware.firmware import BAUDS, LineRules
from machine.link.identification import QUICK_S, Answer, Kind, ask, ask_at_any_rate
from machine.link.port import Port, RefusedPortError, SerialDevice, open_port, serial_devices
from machine.notices import say
from machine.pipeline.requests import BAUD
from machine.printing.destination import AtPrinter, Simulated
from machine.simulator.contact import ProbedTable
from machine.simulator.simulator import SimulatedPrinter
from profiles.errors import FirmwareError, PortError, PrinterError, SilenceError
from profiles.files import lock
from profiles.folders import state_folder
from profiles.machine import Machine
from profiles.messages import advice, phrase, terminal_words

ECHO = ("M114", "M115")
STARTING_S, STARTING_AGAIN_S = 60.0, 5.0  # Klipper takes 5 to 20 s until its boards are connected
TIMEOUT_S = 4.0
LONGEST_S = TIMEOUT_S + QUICK_S * len(BAUDS)
AT_A_TIME = 16  # ports queried at once: each takes seconds when nothing answers


@contextmanager
def open_line(at: AtPrinter, machine: Machine, table: ProbedTable | None = None) -> Iterator[Port]:
    """Open an exclusive line to a printer, or to a new simulated one with this machine and probed table. Raises PortError."""
    if isinstance(at, Simulated):
        with SimulatedPrinter(machine, at.speed or inf, table=table) as printer, open_port(printer.path, BAUD) as wire:
            yield wire
        return
    with open_port(at.name, at.baud) as wire:
        yield wire


def rate_of(at: AtPrinter) -> int:
    """Baud rate of the line, bits per second."""
    return BAUD if isinstance(at, Simulated) else at.baud


def identify_printer(wire: Port, baud: int, halted: bool = False) -> Answer:
    """Identify the printer at a port, waiting for one that is still starting. Raises PrinterError when something else answers, or
    at another rate. halted: accept a halted printer that a command can revive."""
    answer, rate = ask_at_any_rate(wire, baud)
    end_s = monotonic() + STARTING_S
    while answer.kind is Kind.STARTING and monotonic() < end_s:
        say(f"{answer.firmware} at {wire.name} is still starting: waiting up to {end_s - monotonic():.0f} s more")
        sleep(STARTING_AGAIN_S)
        answer = ask(wire)
    if not (halted and answer.kind is Kind.HALTED and rate == baud and answer.revival != LineRules.revival):
        check_answer(answer, wire.name, baud, rate)
    return answer


def check_answer(answer: Answer, port: str, baud: int, rate: int) -> None:
    """Refuse an answer that is not from a printer or came at another rate. Raises PrinterError, PortError."""
    if answer.kind.is_printer and rate != baud:
        raise PortError(f"the printer at {port} does not speak at {baud} baud but at {rate}: {advice('baud', rate, 'use')}")
    if answer.kind is not Kind.PRINTER:
        error, refusal, _ = NO_PRINTERS[answer.kind]
        raise error(refusal.format(port=port, baud=baud, **_words(answer)))


def _words(answer: Answer) -> dict[str, str]:
    """Words for the sentences about an answer. While Marlin works it only reports that it is busy or waiting."""
    words = answer.words[:60]
    usual = answer.words.startswith(("processing", "paused for", "busy")) or not words
    work = "it heats, moves or waits for its user" if usual else words
    stranger = "it sends back what it receives" if answer.words in ECHO else f"it says {words!r}"
    return {"words": words, "work": work, "stranger": stranger, "firmware": answer.firmware, "revival": answer.revival}


# Answers that rule out printing: error class, its sentence, and the text in a list of ports.
NO_PRINTERS: Mapping[Kind, tuple[type[PrinterError], str, str]] = {
    Kind.BUSY: (
        PrinterError,
        "the printer at {port} is busy ({work}): wait until it is done, or restart it",
        "a printer that is busy ({work}), at {baud} baud",
    ),
    Kind.STARTING: (
        PrinterError,
        "the printer at {port} is still starting ({firmware}): if it does not become ready, look at Klipper's own log",
        "a printer that is still starting ({firmware}), at {baud} baud",
    ),
    Kind.HALTED: (
        FirmwareError,
        "the printer at {port} has stopped with an error of its own ({words}): {revival} before the next print",
        "a printer that has stopped with an error ({words}), at {baud} baud",
    ),
    Kind.STRANGER: (
        PrinterError,
        "the device at {port} is not a printer: {stranger} instead of answering M115",
        "a device answers but is not a printer: {stranger}",
    ),
    Kind.GARBLED: (
        PortError,
        "only garbled bytes come from {port} at {baud} baud, and no printer answers at the usual other rates: "
        f"the firmware's settings name {phrase('its baud rate', 'its rate for --baud')}",
        f"garbled bytes at {{baud}} baud, and nothing at the usual other rates: "
        f"{phrase('another baud rate', '--baud N tries another')}",
    ),
    Kind.SILENT: (
        SilenceError,
        "nothing answers at {port}: is the printer switched on, and is {baud} baud the firmware's rate? "
        "One that has halted says nothing until it is switched off and on",
        "nothing answers",
    ),
}


def describe_answer(answer: Answer, baud: int) -> str:
    """Description of an answer for the user."""
    if answer.kind is Kind.PRINTER:
        axes = f", axes {' '.join(answer.letters)}" if answer.letters else ""
        return f"{answer.firmware or 'a printer that does not name its firmware'}{axes}, at {baud} baud"
    return NO_PRINTERS[answer.kind][2].format(baud=baud, **_words(answer))


@dataclass(frozen=True)
class PortReport:
    """A port, the answer there and its rate. trouble: why it could not be queried; reason: that without the port's name."""

    device: SerialDevice
    answer: Answer | None = None
    baud: int = 0
    trouble: str = ""
    reason: str = ""


def known_ports() -> tuple[SerialDevice, ...]:
    """The serial ports, /dev/serial/by-id first, then this user's running simulators."""
    return (*serial_devices(), *running_simulators())


def ask_ports(devices: Sequence[SerialDevice], baud: int, over: Event, in_use: Iterable[str] = ()) -> list[PortReport]:
    """Query each port. over: ends the queries when set; in_use: ports at which this program is printing, which stay closed."""
    names = frozenset(in_use)

    def ask(device: SerialDevice) -> PortReport:
        if names & {device.name, device.path}:
            return _refused(device, RefusedPortError(device.name, "prints now"))
        return ask_port(device, baud, over)

    with ThreadPoolExecutor(AT_A_TIME) as pool:
        try:
            return list(pool.map(ask, devices))
        except BaseException:
            over.set()
            raise


def ask_port(device: SerialDevice, baud: int, over: Event | None = None) -> PortReport:
    """Open a port exclusively and query it; setting `over` ends the query."""
    try:
        with open_port(device.name, baud) as port:
            return PortReport(device, *ask_at_any_rate(port, baud, TIMEOUT_S, over))
    except PortError as error:
        return _refused(device, error)


def _refused(device: SerialDevice, error: PortError) -> PortReport:
    return PortReport(device, trouble=f"{error}", reason=error.reason if isinstance(error, RefusedPortError) else f"{error}")


def describe(report: PortReport) -> str:
    """Report of a port for the user, two or three lines."""
    device = report.device
    lines = [device.name]
    what = [device.path if device.path != device.name else "", device.description]
    what.append(f"serial number {device.serial_number}" if device.serial_number else "")
    lines.append(", ".join(word for word in what if word))
    lines.append(answer_words(report))
    return "\n    ".join(line for line in lines if line) + "\n"


def answer_words(report: PortReport) -> str:
    """The answer, or why the port could not be queried, without the port's name; "" if it was not queried."""
    if report.answer is None:
        return report.reason
    return describe_answer(report.answer, report.baud)


def port_json(report: PortReport) -> dict[str, Any]:
    """Report as JSON for other programs: every key is present, null where unknown."""
    answer, device = report.answer, report.device
    printer = answer is not None and answer.kind.is_printer
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
        "trouble": terminal_words(report.trouble) or None,
    }


@contextmanager
def announced(description: str, path: str) -> Iterator[Callable[[str], None]]:
    """List a simulated printer while it runs; yields a function to call when its path changes."""
    try:
        text = (_folder() / str(os.getpid())).open("w", encoding="utf-8")
    except OSError:  # disk full: it is not listed
        yield lambda now: None
        return
    lock(text.fileno())

    def tell(now: str) -> None:
        with suppress(OSError):
            text.seek(0)
            text.truncate()
            text.write(f"{now}\n{description}\n")
            text.flush()

    tell(path)
    try:
        yield tell
    finally:
        with suppress(OSError):
            Path(text.name).unlink(missing_ok=True)
        with suppress(OSError):
            text.close()


def running_simulators() -> tuple[SerialDevice, ...]:
    """The running simulators by path; files left by others are removed."""
    devices = []
    try:
        files = sorted(_folder().iterdir())
    except OSError:
        return ()
    for file in files:
        with suppress(OSError), file.open("r+", encoding="utf-8") as text:
            path, _, description = text.read().partition("\n")
            if path and lock(text.fileno()):  # an empty file belongs to a simulator that has not locked it yet
                file.unlink(missing_ok=True)
                continue
            if path:
                devices.append(SerialDevice(path, path, description.strip(), ""))
    return tuple(sorted(devices, key=lambda device: device.path))


def _folder() -> Path:
    folder = state_folder() / "simulators"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder
