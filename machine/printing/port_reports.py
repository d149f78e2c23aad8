"""Port reports: what answers at each serial port of this computer, and at simulated printers that run."""

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Event
from typing import Any

from machine.firmware.firmware import BAUDS
from machine.link.identification import QUICK_S, Answer, Kind, ask_at_any_rate
from machine.link.port import RefusedPortError, SerialDevice, open_port, serial_devices
from machine.printing.compatibility import describe_answer
from machine.printing.running_simulators import running_simulators
from profiles.errors import PortError

TIMEOUT_S = 4.0
LONGEST_S = TIMEOUT_S + QUICK_S * len(BAUDS)
AT_A_TIME = 16  # ports asked at once: each takes seconds when nothing answers


@dataclass(frozen=True)
class PortReport:
    """A port, and what answers there at which rate; trouble: why it could not be asked, reason: the same behind its name."""

    device: SerialDevice
    answer: Answer | None = None
    baud: int = 0
    trouble: str = ""
    reason: str = ""


def known_ports() -> tuple[SerialDevice, ...]:
    """Those in /dev/serial/by-id first, running simulators of this user last."""
    return (*serial_devices(), *running_simulators())


def ask_ports(devices: Sequence[SerialDevice], baud: int, over: Event, in_use: Iterable[str] = ()) -> list[PortReport]:
    """What answers at each; a set `over` ends the asking. in_use: those at which this program prints are not opened."""
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
    """Open a port for this program alone and see what answers; a set `over` ends the asking."""
    try:
        with open_port(device.name, baud) as port:
            return PortReport(device, *ask_at_any_rate(port, baud, TIMEOUT_S, over))
    except PortError as error:
        return _refused(device, error)


def _refused(device: SerialDevice, error: PortError) -> PortReport:
    return PortReport(device, trouble=str(error), reason=error.reason if isinstance(error, RefusedPortError) else str(error))


def describe(report: PortReport) -> str:
    """Two or three lines for a person."""
    device = report.device
    lines = [device.name]
    what = [device.path if device.path != device.name else "", device.description]
    what.append(f"serial number {device.serial_number}" if device.serial_number else "")
    lines.append(", ".join(word for word in what if word))
    lines.append(answer_words(report))
    return "\n    ".join(line for line in lines if line) + "\n"


def answer_words(report: PortReport) -> str:
    """What answers, or why the port could not be asked, for a person who sees the port's name; "" where it was not asked."""
    if report.answer is None:
        return report.reason
    return describe_answer(report.answer, report.baud)


def port_json(report: PortReport) -> dict[str, Any]:
    """The same for a program: every key always there, null where it is not known."""
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
        "trouble": report.trouble or None,
    }
