"""Server keys: keys and Ctrl-C while a server on the network prints, which goes on when this program ends."""

from collections.abc import Callable
from time import monotonic

from machine.cli.terminal.keys import HINT_S, Keyboard, can_type
from machine.cli.terminal.progress import is_terminal
from machine.link.pending_commands import Command, Control
from machine.notices import say

ALONE_S = 2.0  # where nobody can press a key, a second interrupt is waited for so long
LEAVING = "the print goes on without this program. c or Ctrl-C: cancel it, l: leave it printing; any other key: go on following"
CANCELLING = "cancel this print? c or y: the server ends it; any other key: go on"


class ServerKeyboard(Keyboard):
    """The keys of a print, and interrupt() for Ctrl-C: the first one asks, the second one cancels, a third one ends at once.

    gone() tells whether the person has left: by l, or by an interrupt whose question nobody answered.
    """

    def __init__(self, control: Control, where: str, now_s: Callable[[], float] = monotonic) -> None:
        super().__init__(control, now_s)
        self._where = where
        self._leaving, self._left, self._cancelled = False, False, False
        self._deadline_s: float | None = None

    def interrupt(self) -> None:
        """Take a Ctrl-C or a request to end, in the main thread. Raises KeyboardInterrupt at the third."""
        if self._cancelled:
            raise KeyboardInterrupt
        if self._deadline_s is not None:
            self._cancel_now()
            return
        asked = is_terminal() and can_type()
        self._deadline_s = self._now_s() + (HINT_S if asked else ALONE_S)
        if asked:
            self._ask_leaving()
        else:
            say(f"the print goes on at {self._where}: interrupt again within {ALONE_S:g} s to cancel it")

    def gone(self) -> bool:
        """Whether the person has left while the print goes on."""
        return self._left or (self._deadline_s is not None and self._now_s() > self._deadline_s)

    def _ask_leaving(self) -> None:
        self._sure = self._leaving = True
        self._tell(LEAVING)

    def _explain(self) -> None:
        self._ask_leaving()

    def _cancel(self) -> None:
        self._sure = True
        self._tell(CANCELLING)

    def press(self, key: str) -> None:
        """Any key answers an interrupt's question."""
        self._deadline_s = None
        super().press(key)

    def _answer(self, key: str) -> None:
        leaving, self._leaving = self._leaving, False
        if leaving and key == "l":
            self._left = True
        elif key in ("c", "y") and not (leaving and key == "y"):
            self._cancel_now()

    def _cancel_now(self) -> None:
        self._deadline_s, self._cancelled = None, True
        self._tell("cancelling")
        self._control.ask(Command.CANCEL)
