"""The ports and console commands: list what answers at each port, and talk to a printer line by line."""

from __future__ import annotations

import os
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import TYPE_CHECKING

from machine.cli.terminal.interrupts import calling, interrupting
from machine.cli.terminal.requests import ConsoleRequest
from machine.firmware import dialect_of
from machine.firmware.firmware import check_baud
from machine.link.protocol.events import Kind, read_event
from machine.notices import say, show
from machine.pipeline.output import check_writable, write_json
from machine.pipeline.requests import STDOUT
from machine.printing.command_session import CommandSession, LeftError, StopError
from machine.printing.destination import parse_printer
from machine.printing.ports import (
    LONGEST_S,
    PortReport,
    ask_ports,
    describe,
    describe_answer,
    identify_printer,
    known_ports,
    open_line,
    port_json,
    rate_of,
)
from machine.printing.serial_log import TappedWire, new_log
from profiles.errors import LocalProtocolError, PrinterError
from profiles.folders import state_folder
from profiles.machine import Machine

if TYPE_CHECKING:
    from prompt_toolkit import PromptSession
    from prompt_toolkit.application import Application

PROMPT = "> "
AT_ONCE_S = 0.5
HELP = """Each line that you type is sent and answered. Further commands:
  /help     this
  /reports  show or hide temperature reports
  /stop     emergency stop (M112) at once, even while a command is under way
  /quit     leave; Ctrl-D and Ctrl-C do too
"""
DIM, RED, YELLOW, CYAN = "2", "31", "33", "36"
COLOURS: dict[Kind, str] = {
    **dict.fromkeys((Kind.OK, Kind.BUSY), DIM),
    Kind.TEMPERATURE: CYAN,
    **dict.fromkeys((Kind.ECHO, Kind.ACTION, Kind.START, Kind.BANNER), YELLOW),
    **dict.fromkeys((Kind.LINE_ERROR, Kind.RESEND, Kind.FAULT), RED),
}


def console(request: ConsoleRequest, machine: Machine) -> int:
    """Talk to a printer. Returns 0 when the user leaves, 130 after Ctrl-C, 1 if a piped command was not known."""
    at = parse_printer(request.port, request.baud, request.sim_speed)
    if request.log is not None:
        check_writable(request.log)
    rate = rate_of(at)
    with ExitStack() as stack:
        log = stack.enter_context(new_log("console", f"console at {at.name}", request.log))
        wire = stack.enter_context(open_line(at, machine))
        log.say_trouble()
        stack.enter_context(interrupting())
        shown = Shown(request.reports)

        def tell(direction: str, data: bytes) -> None:
            log.note(direction, data)
            if direction == "<":
                shown.hear(data)

        hint = "; /help lists the commands" if sys.stdin.isatty() else ""
        say(describe_answer(identify_printer(wire, rate, halted=True), rate) + hint)
        session = CommandSession(TappedWire(wire, tell), dialect_of(machine).longest_line)
        return _Console(session, shown, request.leave_heaters).run()


class _Console:
    """A console session, from the greeting until the heaters are safe."""

    def __init__(self, session: CommandSession, shown: Shown, leave_heaters: bool) -> None:
        self._session, self._shown, self._leave_heaters = session, shown, leave_heaters
        self._waiting: deque[str] = deque()
        self._done = threading.Event()
        self._error: BaseException | None = None
        self._interrupted = False

    def run(self) -> int:
        """Return the exit code. Raises PrinterError and any other error after the heaters have been switched off."""
        typed, code, session = sys.stdin.isatty(), 0, self._session
        heated, unknown = "", list[str]()
        with session:
            try:
                session.greet()
                self._shown.quiet = False
                (self._typed if typed else self._piped)()
            except KeyboardInterrupt:
                code = 130
            except PrinterError:
                if not session.restarts:
                    raise
            finally:
                self._shown.quiet = True
            if session.restarts:
                session.keep_heat = True  # the restart switches the heaters off, and the firmware answers nothing meanwhile
                say("the printer restarts, its heaters are off: the next console or print waits until it is ready")
                return code
            if session.exchange.greeted:
                unknown = session.unknown[:]
                heated = session.heated()
                session.keep_heat = self._leave_heaters or (typed and not code and bool(heated) and not _agreed(heated))
        if heated:
            say(f"{'left on' if session.keep_heat else 'switched off'}: {heated}")
        if unknown and not typed:
            raise PrinterError(f"the printer did not know {', '.join(repr(line) for line in unknown[:5])}")
        return code

    def _piped(self) -> None:
        """Send the lines of a pipe one after the other."""
        for line in sys.stdin:
            if self._meant_for_us(line.strip()):
                return
            if not line.startswith("/"):
                self._session.command(line)

    def _typed(self) -> None:
        """Read lines at a prompt while a thread talks to the printer."""
        prompt = _prompt_session()
        worker = threading.Thread(target=self._serve, args=(prompt.app,), name="console", daemon=True)
        worker.start()
        try:
            self._read_on(prompt)
        finally:
            self._part_from(worker)
            if self._waiting:
                say(f"not sent: {', '.join(self._waiting)}")
        if self._error is not None:
            raise self._error

    def _part_from(self, worker: threading.Thread) -> None:
        """Wait until the thread has ended, through all interrupts: only one thread may talk to the printer."""
        while worker.is_alive():
            with suppress(KeyboardInterrupt):
                self._session.order(LeftError)
                worker.join()

    def _read_on(self, prompt: PromptSession[str]) -> None:
        while self._error is None:
            try:
                line = self._read_line(prompt)
            except EOFError:
                if not sys.stdin.isatty():  # a closed terminal can reach its end of file before the signal comes
                    raise KeyboardInterrupt from None
                return
            if self._meant_for_us(line):
                return
            if line and not line.startswith("/"):
                self._hand_over(line)

    def _read_line(self, prompt: PromptSession[str]) -> str:
        """Read a line at the prompt. Raises EOFError, and KeyboardInterrupt once the prompt has restored the terminal."""
        with calling(lambda: self._interrupt(prompt.app)), self._shown.above(prompt.app):
            line = prompt.prompt(PROMPT, pre_run=lambda: self._begin_prompt(prompt.app)).strip()
        if self._interrupted:
            raise KeyboardInterrupt
        return line

    def _interrupt(self, app: Application[str]) -> None:
        self._interrupted = True
        if app.loop is None:  # the prompt has not begun, or is over
            raise KeyboardInterrupt
        self._call_prompt(app)

    def _call_prompt(self, app: Application[str]) -> None:
        """Make the prompt check whether it must end."""
        loop = app.loop
        if loop is not None:
            with suppress(RuntimeError):  # the prompt and its loop have just ended
                loop.call_soon_threadsafe(self._end_prompt, app)

    def _begin_prompt(self, app: Application[str]) -> None:
        self._shown.write_above()
        self._end_prompt(app)

    def _end_prompt(self, app: Application[str]) -> None:
        """End the prompt after an interrupt or an error of the other thread, including one from before the prompt began."""
        if (self._interrupted or self._error is not None) and app.is_running and not app.is_done:
            app.exit(exception=KeyboardInterrupt if self._interrupted else EOFError)

    def _hand_over(self, line: str) -> None:
        """Let the thread send a line, and wait briefly, so that a quick answer appears before the next prompt."""
        self._done.clear()
        self._waiting.append(line)
        self._done.wait(AT_ONCE_S)

    def _serve(self, app: Application[str]) -> None:
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
        except BaseException as error:  # noqa: BLE001 - a bug, too, ends the console: run() raises it once the heaters are off
            self._error = error
            self._done.set()
            self._call_prompt(app)

    def _meant_for_us(self, line: str) -> bool:
        """Execute a line that is addressed to the console; returns True if it ends the console."""
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


def _agreed(heated: str) -> bool:
    """Ask whether to switch the heaters off; anything but an answer that begins with n means yes."""
    try:
        return not input(f"{heated}: switch off? [Y/n] ").strip().lower().startswith("n")
    except (EOFError, KeyboardInterrupt):
        return True


def _prompt_session() -> PromptSession[str]:
    """A prompt with a history that is shared by all consoles."""
    from prompt_toolkit import PromptSession
    from prompt_toolkit.history import FileHistory
    from prompt_toolkit.output.defaults import create_output

    output = create_output()
    setattr(output, "enable_cpr", False)  # noqa: B010 - only menus need the cursor's position, which not all terminals report
    return PromptSession(history=FileHistory(str(state_folder() / "console_lines")), output=output)


class Shown:
    """Prints the printer's output line by line: in colour at a terminal, and above the line that the user is typing."""

    def __init__(self, reports: bool) -> None:
        self.reports = reports
        self.quiet = True
        self._half = b""
        self._busy = 0  # consecutive busy messages
        self._lock = threading.Lock()
        self._lines: list[str] = []  # waiting to be written above the prompt
        self._app: Application[str] | None = None  # the active prompt
        self._colours = sys.stdout.isatty() and "NO_COLOR" not in os.environ

    def hear(self, data: bytes) -> None:
        """Add received bytes."""
        *lines, self._half = (self._half + data.replace(b"\r", b"\n")).split(b"\n")
        self._half = self._half[-4096:]
        for line in lines:
            if line.strip() and not self.quiet:
                self._show(line)

    def _show(self, line: bytes) -> None:
        event = read_event(line)
        if event.kind is Kind.TEMPERATURE and not self.reports:
            return
        if event.kind is Kind.BUSY:
            self._busy += 1
            if self._busy > 1:
                return
        elif self._busy:
            if self._busy > 1:
                self.write(f"(busy {self._busy - 1} more times)")
            self._busy = 0
        text = "".join(c if c.isprintable() else "?" for c in line.decode("ascii", "replace"))
        colour = COLOURS.get(event.kind)
        self.write(f"\x1b[{colour}m{text}\x1b[0m" if colour and self._colours else text)

    def write(self, text: str) -> None:
        """Print one line, above the prompt if there is one. Thread-safe."""
        with self._lock:
            self._lines.append(text)
            if self._app is None:
                self._print_lines()
            elif len(self._lines) > 1:
                return  # lines that wait are written together
            elif (loop := self._app.loop) is not None:  # without a loop the prompt is about to begin, and writes them first
                with suppress(RuntimeError):  # the prompt has just ended: above() writes them
                    loop.call_soon_threadsafe(self.write_above)

    @contextmanager
    def above(self, app: Application[str]) -> Iterator[None]:
        """Write lines above this prompt and from its thread, so that they never interrupt its cursor movements."""
        try:
            with self._lock:
                self._app = app
            yield
        finally:
            with self._lock:
                self._app = None
                self._print_lines()

    def write_above(self) -> None:
        """Write the waiting lines; must be called by the prompt's thread."""
        from prompt_toolkit.application import run_in_terminal

        def print_lines() -> None:
            with self._lock:
                self._print_lines()

        if self._lines:
            run_in_terminal(print_lines)

    def _print_lines(self) -> None:
        sys.stdout.write("".join(f"{line}\n" for line in self._lines))
        sys.stdout.flush()
        self._lines.clear()


def ports(baud: int, as_json: bool, ask: bool) -> int:
    """List ports on stdout: those of /dev/serial/by-id first, this user's simulators last; 0 even if there are none.

    ask: open each port and identify what answers.
    """
    check_baud(baud)
    devices = known_ports()
    if not devices:
        say("no serial port was found: plug the printer in and switch it on")
    elif ask:
        say(f"querying {len(devices)} {'ports' if len(devices) > 1 else 'port'}: this takes up to {LONGEST_S:.0f} s")
    reports = ask_ports(devices, baud, threading.Event()) if ask else [PortReport(device) for device in devices]
    if as_json:
        write_json(STDOUT, [port_json(report) for report in reports])
    else:
        show("".join(describe(report) for report in reports))
    return 0
