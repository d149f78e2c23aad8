"""Keys pressed while a print runs, and the commands that they stand for."""

import os
import re
import select
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from math import inf
from time import monotonic
from types import MappingProxyType
from typing import Any

from machine.link.pending_commands import FEED_PERCENT, FLOW_PERCENT, Command, Control
from machine.link.print_state import PrintState, PrintStatus
from machine.notices import say

STEP_PERCENT = 10.0
STEP_MM = 0.01
LOOK_S = 0.05
HINT_S = 10.0  # a question expires after this time
ALONE_S = 2.0  # time for a second interrupt if no keys can be pressed
SURE = "cancel this print? c or y: heaters off and end; any other key: continue"
CANCELLING = "cancel this print? c or y: the server ends it; any other key: continue"
LEAVING = "the print continues without this program. c or Ctrl-C: cancel it, l: leave it printing; any other key: keep following"
MORE = "q does not quit: a print left alone stops feeding. c cancels it (Ctrl-C too), e twice stops the machine at once (M112)"
STOP = "emergency stop: e once more within a second (M112, the machine halts)"
STOP_S = 1.0  # the second press of the emergency stop comes within it: a single one may be a slip
SEQUENCE = re.compile(rb"\x1b(\[[0-9;]*[A-Za-z~]|O[A-Z])")  # arrow and function keys, whose letters are not keys
BEGUN = re.compile(rb"\x1b(\[[0-9;]*|O)?$")  # a slow line may split a sequence
SAME = {"=": "+", "_": "-", "?": "q"}


class Keyboard:
    """Turns keys into commands; `hint` temporarily replaces the list of keys on the screen.

    server: name of the print server, which continues without this program: the user may leave it printing, and Ctrl-C asks first.
    """

    def __init__(self, control: Control, server: str = "", now_s: Callable[[], float] = monotonic) -> None:
        self._control, self._server, self._now_s = control, server, now_s
        self._hint, self._hint_until_s = "", 0.0
        self._sure = self._leaving = False  # open questions
        self._left = self._cancelled = False
        self._stop_until_s = -inf  # a second e until then is the emergency stop
        self._deadline_s: float | None = None  # deadline of the question that Ctrl-C asked
        self._state, self._feed, self._flow = PrintState.PRINTING, 100.0, 100.0
        self._reported = (100.0, 100.0)

    @property
    def hint(self) -> str:
        """The current question, explanation or command; "" if there is none, or it has expired."""
        return self._hint if self._now_s() < self._hint_until_s else ""

    def follow(self, status: PrintStatus) -> None:
        """Update the state, on which the meaning of some keys depends."""
        self._state = status.state
        percents = (status.feed_percent, status.flow_percent)
        if percents != self._reported:  # the program may set them, too
            self._reported, (self._feed, self._flow) = percents, percents

    def press(self, key: str) -> None:
        """Execute a key's command; unknown keys have none, but any key answers the question of Ctrl-C."""
        self._deadline_s = None
        key = SAME.get(key, key).lower()
        sure, self._sure = self._sure and bool(self.hint), False
        self._tell("")
        if key == "e":
            self._stop()
        elif sure:
            self._answer(key)
        elif act := _ACTS.get(key):
            act(self)

    def interrupt(self) -> None:
        """Handle an interrupt in the main thread while a server prints: the first asks, the second cancels, the third raises
        KeyboardInterrupt."""
        if self._cancelled:
            raise KeyboardInterrupt
        if self._deadline_s is not None:
            self._cancel_now()
            return
        asked = is_terminal() and can_type()
        self._deadline_s = self._now_s() + (HINT_S if asked else ALONE_S)
        if asked:
            self._explain()
        else:
            say(f"the print continues at {self._server}: interrupt again within {ALONE_S:g} s to cancel it")

    def left(self) -> bool:
        """Whether the user has left the server printing, by l or by a Ctrl-C without an answer."""
        return self._left or (self._deadline_s is not None and self._now_s() > self._deadline_s)

    def _answer(self, key: str) -> None:
        """Handle a key as the answer to the open question."""
        leaving, self._leaving = self._leaving, False
        if leaving and key == "l":
            self._left = True
        elif key == "c" or (key == "y" and not leaving):
            self._cancel_now()

    def _stop(self) -> None:
        """The emergency stop at the second of two presses; a key that is held down repeats itself."""
        if self._now_s() <= self._stop_until_s:
            self._tell("emergency stop")
            self._control.ask(Command.EMERGENCY_STOP)
        else:
            self._stop_until_s = self._now_s() + STOP_S
            self._tell(STOP)

    def _cancel(self) -> None:
        self._sure, self._leaving = True, False
        self._tell(CANCELLING if self._server else SURE)

    def _cancel_now(self) -> None:
        self._deadline_s, self._cancelled = None, True
        self._tell("cancelling")
        self._control.ask(Command.CANCEL)

    def _explain(self) -> None:
        self._sure = self._leaving = bool(self._server)
        self._tell(LEAVING if self._server else MORE)

    def _tell(self, hint: str) -> None:
        self._hint, self._hint_until_s = hint, self._now_s() + HINT_S

    def _faster(self, step: float) -> None:
        self._feed = min(max(self._feed + step, FEED_PERCENT[0]), FEED_PERCENT[1])
        self._control.ask(Command.FEED, self._feed)

    def _more(self, step: float) -> None:
        self._flow = min(max(self._flow + step, FLOW_PERCENT[0]), FLOW_PERCENT[1])
        self._control.ask(Command.FLOW, self._flow)


_ACTS: dict[str, Callable[[Keyboard], None]] = {
    "p": lambda board: board._control.ask(Command.PAUSE),
    "r": lambda board: board._control.ask(Command.RESUME),
    " ": lambda board: board._control.ask(Command.RESUME if board._state.is_away else Command.PAUSE),
    "c": lambda board: board._cancel(),
    "q": lambda board: board._explain(),
    "+": lambda board: board._faster(STEP_PERCENT),
    "-": lambda board: board._faster(-STEP_PERCENT),
    "u": lambda board: board._control.ask(Command.BABYSTEP, STEP_MM),
    "d": lambda board: board._control.ask(Command.BABYSTEP, -STEP_MM),
    "]": lambda board: board._more(STEP_PERCENT),
    "[": lambda board: board._more(-STEP_PERCENT),
}


@contextmanager
def typing(press: Callable[[str], None], named: Mapping[bytes, bytes] = MappingProxyType({})) -> Iterator[None]:
    """Call press() with each key from a thread while the block runs; restores the terminal at the end.

    named: escape sequence -> key, for arrow and function keys; others are ignored. Ctrl-C still interrupts; Ctrl-Z is disabled,
    because a suspended sender leaves a hot nozzle on the print.
    """
    console = _windows_console()
    with _terminal_keys(press, named) if console is None else _windows_keys(press, console):
        yield


@contextmanager
def _terminal_keys(press: Callable[[str], None], named: Mapping[bytes, bytes]) -> Iterator[None]:
    import termios
    import tty

    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    tty.setcbreak(terminal, termios.TCSANOW)
    settings = termios.tcgetattr(terminal)
    settings[6][termios.VSUSP] = b"\x00"
    termios.tcsetattr(terminal, termios.TCSANOW, settings)
    end, wake = os.pipe()
    thread = threading.Thread(target=_read_keys, args=(terminal, end, press, named), name="keys", daemon=True)
    thread.start()
    try:
        yield
    finally:
        os.write(wake, b"x")
        thread.join()
        os.close(end)
        os.close(wake)
        with suppress(termios.error, OSError):  # the terminal has gone
            termios.tcsetattr(terminal, termios.TCSAFLUSH, before)


def _read_keys(terminal: int, end: int, press: Callable[[str], None], named: Mapping[bytes, bytes]) -> None:
    """Read keys until `end` becomes readable, or the terminal has gone."""
    begun = b""
    while end not in select.select([terminal, end], [], [])[0]:
        try:
            typed = os.read(terminal, 64)
        except OSError:
            return
        if not typed:
            return
        typed = SEQUENCE.sub(lambda sequence: named.get(sequence[0], b""), begun + typed)
        half = BEGUN.search(typed)
        begun = half[0] if half else b""
        for key in typed.removesuffix(begun).decode("ascii", "ignore"):
            press(key)


@contextmanager
def _windows_keys(press: Callable[[str], None], console: Any) -> Iterator[None]:
    """Call press() with each key of the Windows console, whose mode needs no change. console: the module msvcrt."""
    over = threading.Event()

    def read_keys() -> None:
        while not over.wait(LOOK_S):
            while console.kbhit():
                key = console.getwch()
                if key in ("\x00", "\xe0"):  # an arrow or a function key: the next character identifies it
                    console.getwch()
                else:
                    press(key)

    thread = threading.Thread(target=read_keys, name="keys", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def is_terminal() -> bool:
    """Whether stderr is a terminal whose lines can be rewritten."""
    return sys.stderr.isatty() and os.environ.get("TERM", "") not in ("", "dumb")


def can_type() -> bool:
    """Whether keys can be read: stdin is a terminal, and this process is in its foreground."""
    try:
        if not sys.stdin.isatty():
            return False
        if _windows_console() is not None:
            return True
        import termios  # noqa: F401 - not on Windows

        return os.tcgetpgrp(sys.stdin.fileno()) == os.getpgrp()
    except (ImportError, OSError, ValueError):
        return False


def _windows_console() -> Any:
    try:
        import msvcrt
    except ImportError:
        return None
    return msvcrt
