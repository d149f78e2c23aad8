"""Streaming a program to a printer: greeting, lines as fast as the window allows, a barrier at the end, a safe way out."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from threading import Event as Flag
from time import monotonic

from machine.link.events import Echo, Event, Identity, Ok, Temperature
from machine.link.framing import LINE_LIMIT, command_of
from machine.link.port import Port, open_port
from machine.link.progress import Place, Progress
from machine.link.protocol import Protocol, Timing
from machine.link.shutdown import SETTLE_S, heaters_off
from machine.link.states import State
from profiles.errors import FirmwareError, PortError, PrinterError, SilenceError

PROGRESS_S = 0.2  # a person reads no faster
ASK_S = 5.0  # between temperature questions to a printer that does not report by itself
REPORT_S = 2  # between reports of one that does
WARNINGS = 20  # kept of the printer's own words that show a program it does not understand
WARNS = ("nknown command", "cold extrusion", "too long extrusion")
# After an error the printer may be deaf: the orders are given, the proof is not awaited for long. A halted or restarted
# firmware has switched its heaters off by itself.
PATIENCE_S: dict[type[PrinterError], float] = {FirmwareError: 1.0, SilenceError: 5.0}


@dataclass(frozen=True)
class Outcome:
    """How a print ended. heaters_off, after a cancel: whether the printer's own report proves it; None when
    the program ran to its own end, or when nothing of it had been sent.
    """

    cancelled: bool
    sent: int
    acknowledged: int
    repeated: int
    elapsed_s: float
    firmware: str
    warnings: tuple[str, ...]
    heaters_off: bool | None = None


class _StoppedError(Exception):
    """The caller's stop flag was seen."""


def print_lines(
    lines: Iterable[str],
    port: str,
    baud: int = 115200,
    on_progress: Callable[[Progress], None] | None = None,
    stop: Flag | None = None,
    total_s: float | None = None,
    total: int | None = None,
    timing: Timing | None = None,
    limit: int = LINE_LIMIT,
) -> Outcome:
    """Print a program: send every line's command, wait until the last one is done.

    A sequence is checked wholly before the port is opened, any other iterable line by line as it is reached; it is consumed
    lazily. A plain string is taken as its lines. total_s is the expected duration, total the number of commands where
    `lines` does not tell; limit: characters of a line, number and checksum included, that the firmware keeps.

    A set `stop` flag ends the print: feeding stops, moves are stopped, heaters and fan go off, nothing homes or turns; the
    Outcome says cancelled. KeyboardInterrupt does the same and is raised again. Raises LocalProtocolError for a line that
    cannot be sent, PortError, FirmwareError, RemoteProtocolError or SilenceError; the heaters are switched off first and
    the message says whether the printer confirmed it.
    """
    if isinstance(lines, str):
        lines = lines.splitlines()
    if isinstance(lines, Sequence):
        total = sum(1 for place, line in enumerate(lines, 1) if command_of(line, place, limit))
    with open_port(port, baud) as wire:
        talk = _Talk(wire, timing or Timing(), on_progress, stop, total, total_s, limit)
        try:
            talk.greet()
            talk.feed(lines)
            talk.finish()
        except _StoppedError:
            return replace(talk.outcome(cancelled=True), heaters_off=heaters_off(wire) if talk.greeted else None)
        except PrinterError as error:
            if not talk.greeted:
                raise
            raise type(error)(f"{error}; {_left(wire, error)}") from None
        except BaseException:
            if talk.greeted:
                heaters_off(wire)
            raise
        return talk.outcome(cancelled=False)


def _left(wire: Port, error: PrinterError) -> str:
    """Heaters off before an error goes its way; words on whether the printer proved it."""
    try:
        proven = not isinstance(error, PortError) and heaters_off(wire, PATIENCE_S.get(type(error), SETTLE_S))
    except PortError:
        proven = False
    return "the printer reports its heaters off" if proven else "its heaters may still be on, look at the printer"


class _Talk:
    """One print under way."""

    def __init__(
        self,
        wire: Port,
        timing: Timing,
        on_progress: Callable[[Progress], None] | None,
        stop: Flag | None,
        total: int | None,
        total_s: float | None,
        limit: int = LINE_LIMIT,
    ) -> None:
        self._limit = limit
        self._wire, self._on_progress, self._stop = wire, on_progress, stop
        self._total, self._total_s = total, total_s
        self._began_s = monotonic()
        self._protocol = Protocol(timing, self._began_s, limit)
        self._place, self._temperature = Place(), Temperature()
        self.greeted = False
        self._jobs = 0
        self._firmware = "unknown"
        self._warnings: list[str] = []
        self._shown_s = self._asked_s = self._began_s

    def greet(self) -> None:
        """Agree on line numbers and learn the printer's habits."""
        while self._protocol.state in (State.DRAIN, State.SYNC, State.HELLO):
            self._pump()
        self.greeted = True
        if self._protocol.capabilities.get("AUTOREPORT_TEMP"):
            self._send(f"M155 S{REPORT_S}")

    def feed(self, lines: Iterable[str]) -> None:
        """Send every command of the program."""
        for command in self._commands(lines):
            self._send(command)
            self._jobs += 1

    def finish(self) -> None:
        """The barrier: the print is done when a question asked after M400 is answered."""
        if self._protocol.capabilities.get("AUTOREPORT_TEMP"):
            self._send("M155 S0")
        self._send("M400")
        self._send("M105")
        while self._protocol.window.acknowledged < self._protocol.window.sent or self._protocol.state is not State.OPEN:
            self._pump()
        self._show(monotonic())

    def outcome(self, cancelled: bool) -> Outcome:
        """The end as it stands."""
        return Outcome(
            cancelled=cancelled,
            sent=self._jobs,
            acknowledged=self._acknowledged(),
            repeated=self._protocol.repeated,
            elapsed_s=monotonic() - self._began_s,
            firmware=self._firmware,
            warnings=tuple(self._warnings),
        )

    def _commands(self, lines: Iterable[str]) -> Iterator[str]:
        for place, line in enumerate(lines, 1):
            command = command_of(line, place, self._limit)
            if command:
                if command.startswith("M73"):
                    self._place.told(command, monotonic() - self._began_s)
                yield command
            elif line.startswith(";"):
                self._place.comment(line)

    def _send(self, command: str) -> None:
        room = self._protocol.room
        while not room(command):
            self._pump()
        self._protocol.send(command, monotonic())

    def _pump(self) -> None:
        """One turn: write, read, let time pass, tell the progress."""
        protocol = self._protocol
        if out := protocol.take():
            self._wire.write(out)
        data = self._wire.read()
        now_s = monotonic()
        if data:
            for event in protocol.receive(data, now_s):
                self._note(event)
        protocol.tick(now_s)
        if protocol.fault is not None:
            raise protocol.fault
        if self._stop is not None and self._stop.is_set():
            raise _StoppedError
        if now_s - self._shown_s >= PROGRESS_S:
            self._show(now_s)
        if now_s - self._asked_s >= ASK_S:
            self._ask(now_s)

    def _ask(self, now_s: float) -> None:
        if not self._protocol.capabilities.get("AUTOREPORT_TEMP") and self._protocol.room("M105"):
            self._asked_s = now_s
            self._protocol.send("M105", now_s)

    def _note(self, event: Event) -> None:
        if isinstance(event, Ok):
            if event.temperature is not None:
                self._temperature = event.temperature
        elif isinstance(event, Temperature):
            self._temperature = event
        elif isinstance(event, Identity):
            self._firmware = event.text.removeprefix("FIRMWARE_NAME:").strip()
        elif isinstance(event, Echo) and len(self._warnings) < WARNINGS and any(word in event.text for word in WARNS):
            self._warnings.append(event.text)

    def _acknowledged(self) -> int:
        return max(0, self._jobs - (self._protocol.window.sent - self._protocol.window.acknowledged))

    def _show(self, now_s: float) -> None:
        self._shown_s = now_s
        if self._on_progress is None:
            return
        elapsed_s, done, place = now_s - self._began_s, self._acknowledged(), self._place
        self._on_progress(
            Progress(
                sent=self._jobs,
                acknowledged=done,
                total=self._total,
                elapsed_s=elapsed_s,
                left_s=place.left_s(elapsed_s, self._total_s),
                share=place.share(done, self._total),
                temperature=self._temperature,
                part=place.part,
                parts=place.parts,
                layer=place.layer,
            )
        )
