"""Identification: what answers at a port, by its replies to M115 and M114: a printer and its axes, or another device."""

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
from threading import Event as Flag

from machine.firmware import identify
from machine.firmware.firmware import BAUDS, LineRules
from machine.link.medium import SERIAL
from machine.link.pending_commands import CancelledError
from machine.link.port import Port
from machine.link.protocol.events import NAME, Event
from machine.link.protocol.events import Kind as EventKind
from machine.link.shutdown import Orders

TIMEOUT_S = 6.0  # a board that restarts when its port is opened spends 2 s in its boot loader and 2 s starting
QUICK_S = 1.5  # at another rate: it has started by then
ASK_S = 1.0  # between queries; those sent during the start are lost
POSITION_S = 1.0  # for a printer that names itself but reports no position
KEY = re.compile(r"\s+[A-Z_]+:")  # Marlin writes SOURCE_CODE_URL, RepRapFirmware ELECTRONICS after the name
VERSION = re.compile(r" FIRMWARE_VERSION: ?(\S+)")
GRBL_SAYS = re.compile(r"error:\s*\d+")  # its answer to M115; the errors of printers contain words


class Kind(Enum):
    """Kinds of answer."""

    PRINTER = "printer"
    BUSY = "busy printer"
    STARTING = "starting printer"
    HALTED = "halted printer"
    STRANGER = "no printer"
    GARBLED = "garbled"
    SILENT = "silent"

    @property
    def is_printer(self) -> bool:
        """Whether a printer answered, though perhaps not one that can print now."""
        return self in (Kind.PRINTER, Kind.BUSY, Kind.STARTING, Kind.HALTED)


@dataclass(frozen=True)
class Answer:
    """The answer of a device at a port."""

    kind: Kind
    words: str = ""  # the firmware's line, its error, what it is busy with, or the last line of another device
    letters: str = ""  # axes in M114 without the filament; "" for none
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)  # least and greatest value, if reported
    revival: str = LineRules.revival  # makes a halted printer print again

    @property
    def firmware(self) -> str:
        """Name and version of the firmware."""
        name = KEY.split(self.words.removeprefix(NAME).strip())[0]
        version = VERSION.search(self.words)
        return f"{name} {version[1]}" if version else name


def ask(port: Port, timeout_s: float = TIMEOUT_S, stop: Flag | None = None) -> Answer:
    """Query until a printer has named itself, for timeout_s at most, or until `stop` is set. Raises PortError."""
    inquiry = _Inquiry(port, stop or Flag())
    inquiry.listen("M115", timeout_s, lambda: inquiry.named)
    if inquiry.named:
        inquiry.listen("M114", POSITION_S, lambda: inquiry.placed or inquiry.starting)
    return inquiry.answer()


def ask_at_any_rate(port: Port, baud: int, timeout_s: float = TIMEOUT_S, stop: Flag | None = None) -> tuple[Answer, int]:
    """The answer and its baud rate: the given rate first, then the other usual ones if nothing readable comes.

    If no rate finds a printer, the answer is that at the given rate, and the port keeps that rate.
    """
    first = ask(port, timeout_s, stop)
    if first.kind not in (Kind.GARBLED, Kind.SILENT) or port.name.startswith("socket://"):
        return first, baud
    for rate in BAUDS:
        if rate != baud:
            port.set_baud(rate)
            answer = ask(port, QUICK_S, stop)
            if answer.kind.is_printer:
                return answer, rate
    port.set_baud(baud)
    return first, baud


class _Inquiry:
    """A query at a port, and the answers so far."""

    def __init__(self, port: Port, stop: Flag) -> None:
        self._stop = stop
        self._orders = Orders(port, SERIAL, self._check_stop)
        self._words = self._fault = self._letters = ""
        self._area: tuple[tuple[float, float], ...] = ()
        self._ok = self.named = self.placed = self.starting = False
        self._busy = ""  # its report of what it is doing

    def listen(self, question: str, timeout_s: float, until: Callable[[], bool]) -> None:
        """Repeat a query until the answer is complete or the time is over."""
        end_s = SERIAL.now_s() + timeout_s
        self._ok = False

        def is_whole(event: Event) -> bool:
            self._read(event)
            return until() or bool(self._fault)

        with suppress(CancelledError):
            while not (until() or self._fault) and (now_s := SERIAL.now_s()) < end_s:
                self._check_stop()
                self._orders.give((question,), is_whole, min(now_s + ASK_S, end_s))

    def _check_stop(self) -> None:
        if self._stop.is_set():
            raise CancelledError

    def answer(self) -> Answer:
        """The answer that the lines received amount to."""
        if self._fault:
            if GRBL_SAYS.fullmatch(self._fault):
                return Answer(Kind.STRANGER, self._fault)
            firmware = identify(self._words)
            revival = LineRules.revival if firmware is None else firmware.line.revival
            return Answer(Kind.HALTED, self._fault.removeprefix("!!").strip(), revival=revival)
        if self.starting:
            return Answer(Kind.STARTING, self._words)
        if self._words or self._ok or self._orders.insists:
            return Answer(Kind.PRINTER, self._words, self._letters, self._limits())
        if self._busy:
            return Answer(Kind.BUSY, self._busy)
        if self._orders.decoder.is_garbled:
            return Answer(Kind.GARBLED)
        words = self._orders.decoder.foreign
        return Answer(Kind.STRANGER, words) if words else Answer(Kind.SILENT)

    def _read(self, event: Event) -> None:
        if event.is_starting:
            self.starting = True
        elif event.kind is EventKind.FAULT:
            self._fault = event.text
        elif event.kind is EventKind.BUSY:
            self._busy = event.text.rpartition("busy:")[2].strip() or "busy"
        self._area = event.area or self._area
        self._words = event.identity or self._words
        if event.position is not None:
            self._letters, self.placed = "".join(letter for letter in event.position if letter != "E"), True
        if event.kind is EventKind.OK:
            self._ok, self.named = True, bool(self._words)

    def _limits(self) -> dict[str, tuple[float, float]]:
        """Limits by the letters of M114: Marlin's area calls the fourth and later axes I, J, K, whatever their letters are."""
        return {} if len(self._letters) < len(self._area) else dict(zip(self._letters, self._area, strict=False))
