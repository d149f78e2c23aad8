"""Console: a person, or a pipe, talks to a printer line by line: what is typed is sent, what it says is shown."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from math import inf
from pathlib import Path
from types import FrameType

from machine.app.interrupts import interrupting
from machine.app.match import printer_on
from machine.app.output import check_writable
from machine.app.ports_command import in_words
from machine.app.printing import SIMULATED, check_speed
from machine.app.progress import say
from machine.app.session import LeftError, Session, StopError
from machine.app.state_folder import state_folder
from machine.app.traffic import TappedWire, TrafficLog, new_log
from machine.dialects import DIALECTS
from machine.link.events import (
    Action,
    Banner,
    Busy,
    Echo,
    Event,
    FirmwareFault,
    LineError,
    Ok,
    Resend,
    Start,
    Temperature,
    read_event,
)
from machine.link.port import open_port
from machine.link.simulator import SimulatedPrinter
from profiles.errors import LocalProtocolError, PrinterError
from profiles.machine import Machine

PROMPT = "> "
HISTORY = 1000  # lines
AT_ONCE_S = 0.5
WAKE_S = 0.1
HELP = """What you type is sent, one line after the other is answered. Besides:
  /help     this
  /reports  show or hide temperature reports
  /stop     emergency stop (M112) at once, even while a command is under way
  /quit     leave; Ctrl-D and Ctrl-C do too
"""
DIM, RED, YELLOW, CYAN = "2", "31", "33", "36"
COLOURS: dict[type[Event], str] = {
    Ok: DIM,
    Busy: DIM,
    Temperature: CYAN,
    Echo: YELLOW,
    Action: YELLOW,
    Start: YELLOW,
    Banner: YELLOW,
    LineError: RED,
    Resend: RED,
    FirmwareFault: RED,
}


def console(
    machine: Machine, port: str, baud: int, sim_speed: float, reports: bool, leave_heaters: bool, log: Path | None
) -> int:
    """Talk to a printer until the person leaves (0; 130 after Ctrl-C) or the pipe ends (1 when a command was not known)."""
    check_speed(sim_speed)
    if log is not None:
        check_writable(log)
    title = f"console at {port}"
    with ExitStack() as stack:
        path = stack.enter_context(SimulatedPrinter(machine, sim_speed or inf)).path if port == SIMULATED else port
        kept = stack.enter_context(new_log("console", title) if log is None else TrafficLog(log, title))
        wire = stack.enter_context(open_port(path, baud))
        if kept.trouble:
            say(f"the traffic is not logged: {kept.file}: {kept.trouble}")
        stack.enter_context(interrupting())
        shown = Shown(reports)

        def tell(direction: str, data: bytes) -> None:
            kept.note(direction, data)
            if direction == "<":
                shown.hear(data)

        say(in_words(printer_on(wire, baud), baud) + ("; /help tells what can be typed" if sys.stdin.isatty() else ""))
        session = Session(TappedWire(wire, tell), DIALECTS[machine.dialect].longest_line)
        return _Console(session, shown, leave_heaters).run()


class _WokenError(Exception):
    """The other thread has an error to tell."""


class _Console:
    """One console from the greeting to a safe end."""

    def __init__(self, session: Session, shown: Shown, leave_heaters: bool) -> None:
        self._session, self._shown, self._leave_heaters = session, shown, leave_heaters
        self._waiting: deque[str] = deque()
        self._done = threading.Event()
        self._left = threading.Event()
        self._reader = threading.get_ident()
        self._error: Exception | None = None

    def run(self) -> int:
        """The exit code; raises PrinterError."""
        typed, code = sys.stdin.isatty(), 0
        try:
            self._session.greet()
            self._shown.quiet = False
            (self._typed if typed else self._piped)()
        except KeyboardInterrupt:
            code = 130
        except StopError:
            raise self._session.stop() from None
        except PrinterError as error:
            raise type(error)(f"{error}{self._given_up()}") from None
        try:
            self._leave(ask=typed and not code)
        except KeyboardInterrupt:
            say("left at once: heaters may still be on, look at the printer")
            raise
        if self._session.unknown and not typed:
            raise PrinterError(f"the printer did not know {', '.join(repr(line) for line in self._session.unknown[:5])}")
        return code

    def _piped(self) -> None:
        """Every line of a pipe, one after the other."""
        for line in sys.stdin:
            if self._meant_for_us(line.strip()):
                return
            if not line.startswith("/"):
                self._session.command(line)

    def _typed(self) -> None:
        """What a person types; a thread of its own keeps listening meanwhile."""
        worker = threading.Thread(target=self._serve, name="console", daemon=True)
        before = signal.signal(signal.SIGUSR1, self._wake)
        worker.start()
        try:
            with _history():
                self._read_on()
        finally:
            self._part_from(worker)
            signal.signal(signal.SIGUSR1, before)
            if self._waiting:
                say(f"not sent any more: {', '.join(self._waiting)}")
        if self._error is not None:
            raise self._error

    def _part_from(self, worker: threading.Thread) -> None:
        """Let the other thread end whatever interrupts: two must not talk at the same time."""
        while worker.is_alive():
            with suppress(KeyboardInterrupt):
                self._left.set()
                self._session.order(LeftError)
                worker.join()

    def _read_on(self) -> None:
        while self._error is None:
            try:
                line = self._asked()
            except EOFError:
                self._shown.write("")
                return
            except _WokenError:
                return
            if self._meant_for_us(line):
                return
            if line and not line.startswith("/"):
                self._hand_over(line)

    def _asked(self) -> str:
        try:
            self._shown.typing = True
            return input(PROMPT).strip()
        finally:
            self._shown.typing = False

    def _wake(self, _number: int, _frame: FrameType | None) -> None:
        """Leave input() for an error of the other thread; between two lines that error is seen without it."""
        if self._shown.typing:
            self._shown.typing = False
            raise _WokenError

    def _hand_over(self, line: str) -> None:
        """Let the thread send a line; what is answered at once comes before the next prompt, what takes longer above it."""
        self._done.clear()
        self._waiting.append(line)
        self._done.wait(AT_ONCE_S)

    def _serve(self) -> None:
        try:
            while True:
                if not self._waiting:
                    self._session.listen()
                    continue
                try:
                    self._session.command(self._waiting.popleft())
                except LocalProtocolError as error:
                    self._shown.write(str(error))
                self._done.set()
        except LeftError:
            return
        except (PrinterError, StopError) as error:
            self._error = error
            self._done.set()
            while not self._left.wait(WAKE_S):  # input() waits for a key; a signal just before it begins to is lost
                signal.pthread_kill(self._reader, signal.SIGUSR1)

    def _meant_for_us(self, line: str) -> bool:
        """Do what a line with a slash means; True when it means to leave."""
        word = line.lower()
        if word == "/stop" or word.split(" ")[0].split("*")[0] == "m112":
            raise StopError
        if word == "/reports":
            self._shown.reports = not self._shown.reports
            self._shown.write(f"temperature reports are {'shown' if self._shown.reports else 'hidden'}")
        elif word == "/help":
            self._shown.write(HELP.rstrip())
        elif word.startswith("/") and word != "/quit":
            self._shown.write(f"{line} is not known: /help, /reports, /stop and /quit are")
        return word == "/quit"

    def _leave(self, ask: bool) -> None:
        """Tell which heaters are on, and switch them off unless told otherwise."""
        self._shown.quiet = True
        try:
            heated = self._session.heated()
            if not heated:
                return
            if self._leave_heaters or (ask and not _agreed(f"{heated}: switch off? [Y/n] ")):
                say(f"left on: {heated}")
                return
            off = self._session.switch_off()
        except PrinterError as error:
            raise type(error)(f"{error}{self._given_up()}") from None
        if not off:
            raise PrinterError(f"the printer did not confirm that its heaters are off ({heated}): look at it")
        say(f"switched off: {heated}")

    def _given_up(self) -> str:
        """After an error: heaters off where that is wanted; what became of it, in words."""
        self._shown.quiet = True
        if self._leave_heaters or not self._session.talk.greeted:
            return ""
        return "" if self._session.give_up() else "; its heaters may still be on, look at the printer"


def _agreed(question: str) -> bool:
    """Anything but a plain no agrees."""
    try:
        return not input(question).strip().lower().startswith("n")
    except (EOFError, KeyboardInterrupt):
        return True


@contextmanager
def _history() -> Iterator[None]:
    """Lines typed in earlier consoles, by the arrow keys; kept for later ones."""
    try:
        import readline
    except ImportError:
        yield
        return
    file = state_folder() / "console_history"
    with suppress(OSError):
        readline.read_history_file(file)
    try:
        yield
    finally:
        readline.set_history_length(HISTORY)
        with suppress(OSError):
            readline.write_history_file(file)


class Shown:
    """Prints what the printer says, line by line; on a terminal in colours, and around the line that is being typed."""

    def __init__(self, reports: bool) -> None:
        self.reports = reports
        self.typing = False
        self.quiet = True
        self._half = b""
        self._colours = sys.stdout.isatty() and "NO_COLOR" not in os.environ

    def hear(self, data: bytes) -> None:
        """Take what was received."""
        *lines, self._half = (self._half + data.replace(b"\r", b"\n")).split(b"\n")
        self._half = self._half[-4096:]
        for line in lines:
            if line.strip() and not self.quiet:
                self._show(line)

    def _show(self, line: bytes) -> None:
        event = read_event(line)
        if isinstance(event, Temperature) and not self.reports:
            return
        text = "".join(c if c.isprintable() else "?" for c in line.decode("ascii", "replace"))
        colour = COLOURS.get(type(event))
        self.write(f"\x1b[{colour}m{text}\x1b[0m" if colour and self._colours else text)

    def write(self, text: str) -> None:
        """One line, the line that is being typed kept below it."""
        if self.typing:
            import readline

            text = f"\r\x1b[K{text}\n{PROMPT}{readline.get_line_buffer()}"
        else:
            text = f"{text}\n"
        sys.stdout.write(text)
        sys.stdout.flush()
