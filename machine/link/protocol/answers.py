"""Meaning of a printer's answers: the line that an `ok` acknowledges, the lines to resend, and the unanswered questions.

Most firmwares do not name the line of an `ok`, and some oks belong to no line. A question is a numbered M105 that shows what has
arrived when an answer is missing; each has a new number, for Marlin silently drops a repeat of its last line.
"""

from collections import deque
from dataclasses import dataclass
from math import inf

from machine.link.protocol.events import Event
from machine.link.protocol.window import FIRST_NUMBER_AGAIN, Window

UNKNOWN_COMMAND = "nknown command"  # echoed with the text of an unknown command, before its ok
ASKED_LIMIT = 10  # as many resends of a line mean that the cable is too noisy (OctoPrint's figure)
LOOK_BACK = 200  # lines
NOISE_LIMIT = 20  # resends in the last LOOK_BACK lines: a tenth, at which a print has a blob on every layer
QUESTION = "M105"
QUESTIONS_MOST = 4  # unanswered in a row before the printer counts as gone
IDLE_REPORTS = 2  # a printer that reports twice in a row that it is idle has lost the line in flight


class Acknowledgement:
    """Finds the line that an `ok` acknowledges, from what came before it."""

    def __init__(self) -> None:
        self._reports_temperature = False  # the answer to M105 begins with `ok T:`
        self._unknown_echoed = False
        self._resend_ok_until_s = -inf

    def hear_echo(self, text: str) -> None:
        """Note an echo."""
        if UNKNOWN_COMMAND in text:
            self._unknown_echoed = True

    def take_unknown(self) -> bool:
        """Whether the `ok` that has come belongs to an unknown command."""
        unknown, self._unknown_echoed = self._unknown_echoed, False
        return unknown

    def expect_resend_ok(self, until_s: float) -> None:
        """Note a Resend or its error: the `ok` that follows acknowledges nothing."""
        self._resend_ok_until_s = until_s

    def belongs_to_resend(self, now_s: float) -> bool:
        """Whether this `ok` belongs to a Resend; some firmwares omit it, so that it is expected for a short time only."""
        until_s, self._resend_ok_until_s = self._resend_ok_until_s, -inf
        return now_s < until_s

    def answers_m110(self, ok: Event, numbered: bool, unknown: bool, now_s: float) -> bool:
        """Whether an `ok` confirms M110's new numbers; unknown: it belongs to an unknown command."""
        if numbered:
            return ok.line == FIRST_NUMBER_AGAIN
        return not (unknown or ok.temperature or self.belongs_to_resend(now_s))

    def line(self, ok: Event, window: Window, numbered: bool, now_s: float) -> int | None:
        """Number of the line that an `ok` answers, None for none; numbered: this printer's answers name their lines."""
        if ok.temperature is not None:
            self._reports_temperature = True
            return window.oldest_question()
        if numbered:
            return None if ok.line is None else window.line_number(ok.line)
        if self.belongs_to_resend(now_s) or not window.flight:
            return None
        oldest = window.flight[0]
        return None if oldest.asks_temperature and self._reports_temperature else oldest.number


class Resends:
    """Lines that the printer requests again. next_line: the first one to be repeated; repeated: repeats in all; alone: only the
    `ok` that belongs to the Resend is under way; words: the printer's message about the line that it refused last."""

    def __init__(self) -> None:
        self.next_line = self.repeated = 0
        self.alone, self.words = False, ""
        self._asked = self._times = 0
        self._asked_lines: deque[int] = deque()

    @property
    def same_line(self) -> bool:
        """Whether recently only the newest line was requested: it is refused while others pass."""
        return len(set(self._asked_lines)) == 1

    def request(self, number: int) -> str:
        """Note a Resend; returns what is excessive about it, "" when the line can be repeated."""
        self._times = self._times + 1 if number == self._asked else 1
        self._asked = number
        if self._times > ASKED_LIMIT:
            return f"this line {ASKED_LIMIT} times"
        self._asked_lines.append(number)
        while self._asked_lines[0] < number - LOOK_BACK:
            self._asked_lines.popleft()
        if len(self._asked_lines) > NOISE_LIMIT:
            return f"{NOISE_LIMIT} of the last {LOOK_BACK} lines"
        self.next_line = number
        return ""

    def acknowledge(self, number: int) -> None:
        """Note an acknowledged line."""
        if number > self._asked:
            self._times = 0

    def repeat(self, window: Window, now_s: float) -> bytes:
        """Bytes of the next line to repeat, in flight again; empty when all were repeated."""
        if self.next_line > window.sent:
            return b""
        framed = window.repeat(self.next_line, now_s)
        self.next_line += 1
        self.repeated += 1
        return framed


@dataclass
class Questions:
    """Unanswered questions."""

    unanswered: int = 0  # in a row
    first: int = 0  # line number of the first
    implausible: int = 0  # the line requested although it cannot be meant, 0: none
    _idle_reports: int = 0

    def ask(self) -> bool:
        """Count a question; False when the printer must be given up."""
        self.unanswered += 1
        return self.unanswered <= QUESTIONS_MOST

    def hear_idle(self, in_flight: bool) -> bool:
        """Note that the printer reports itself idle; whether that calls for a question."""
        self._idle_reports += 1
        if self._idle_reports < IDLE_REPORTS or not in_flight:
            return False
        self._idle_reports = 0
        return True

    def acknowledge(self) -> None:
        """Note an answer to a line or a question."""
        self.unanswered = self._idle_reports = 0

    def end(self) -> None:
        """Note that it is known which lines have arrived."""
        self.unanswered = self.first = self.implausible = 0
