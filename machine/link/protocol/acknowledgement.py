"""Acknowledgement: which line an `ok` answers. Most firmwares do not name it, and some of their oks belong to no line."""

from math import inf

from machine.link.protocol.events import Ok
from machine.link.protocol.window import FIRST_NUMBER_AGAIN, Window

UNKNOWN_COMMAND = "nknown command"  # echoed with the text of a line that was not understood, ahead of its ok


class Acknowledgement:
    """What has come so far that makes one `ok` differ from another."""

    def __init__(self) -> None:
        self._reports_temperature = False  # the answer to M105 begins with `ok T:`
        self._unknown_echoed = False
        self._resend_ok_until_s = -inf

    def hear_echo(self, text: str) -> None:
        """An echo has come."""
        if UNKNOWN_COMMAND in text:
            self._unknown_echoed = True

    def take_unknown(self) -> bool:
        """Whether the `ok` that has come belongs to a line that the printer did not understand."""
        unknown, self._unknown_echoed = self._unknown_echoed, False
        return unknown

    def expect_resend_ok(self, until_s: float) -> None:
        """A Resend or its error has come: the `ok` that follows acknowledges nothing."""
        self._resend_ok_until_s = until_s

    def belongs_to_resend(self, now_s: float) -> bool:
        """Whether this is the ok that belongs to a Resend; some firmwares omit it, so it is not waited for long."""
        until_s, self._resend_ok_until_s = self._resend_ok_until_s, -inf
        return now_s < until_s

    def answers_m110(self, ok: Ok, numbered: bool, unknown: bool, now_s: float) -> bool:
        """Whether the numbers begin anew as M110 has asked; unknown: the `ok` belongs to a line that was not understood."""
        if numbered:
            return ok.line == FIRST_NUMBER_AGAIN
        return not (unknown or ok.temperature or self.belongs_to_resend(now_s))

    def line(self, ok: Ok, window: Window, numbered: bool, now_s: float) -> int | None:
        """The number of the line that is answered, None for none; numbered: this printer's answers name their lines."""
        if ok.temperature is not None:
            self._reports_temperature = True
            return window.oldest_question()
        if numbered:
            return None if ok.line is None else window.line_number(ok.line)
        if self.belongs_to_resend(now_s) or not window.flight:
            return None
        oldest = window.flight[0]
        return None if oldest.asks_temperature and self._reports_temperature else oldest.number
