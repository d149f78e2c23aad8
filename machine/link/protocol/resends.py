"""Resends: the lines that were asked for again, which one is repeated next, and when it is enough."""

from collections import deque

from machine.link.protocol.window import Window

ASKED_LIMIT = 10  # the same line asked for so often means that the cable is too noisy (OctoPrint's figure)
LOOK_BACK = 200  # lines
NOISE_LIMIT = 20  # of them asked for again: a tenth, at which a print has a blob on every layer


class Resends:
    """next_line: the first one still to be repeated; repeated: how many were, in all; alone: nothing but the `ok` that belongs to
    the Resend is on its way; words: what the printer has said of the line that it refused last.
    """

    def __init__(self) -> None:
        self.next_line = self.repeated = 0
        self.alone, self.words = False, ""
        self._asked = self._times = 0
        self._asked_lines: deque[int] = deque()

    @property
    def same_line(self) -> bool:
        """Whether of the last lines only the newest one was asked for: it is refused, others pass."""
        return len(set(self._asked_lines)) == 1

    def request(self, number: int) -> str:
        """Take note of a Resend; what is too much about it, "" when the line can be repeated."""
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
        """A line was acknowledged."""
        if number > self._asked:
            self._times = 0

    def repeat(self, window: Window, now_s: float) -> bytes:
        """The bytes of the next line, in flight again; none when all were repeated."""
        if self.next_line > window.sent:
            return b""
        framed = window.repeat(self.next_line, now_s)
        self.next_line += 1
        self.repeated += 1
        return framed
