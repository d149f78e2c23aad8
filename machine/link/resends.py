"""Resends: the lines that were asked for again, and when it is enough."""

from collections import deque

ASKED_LIMIT = 10  # the same line asked for so often means that the cable is too noisy (OctoPrint's figure)
LOOK_BACK = 200  # lines
NOISE_LIMIT = 20  # of them asked for again: a tenth, at which a print has a blob on every layer


class Resends:
    """Counts of one conversation."""

    def __init__(self) -> None:
        self._wanted = self._times = 0
        self._rounds: deque[int] = deque()

    def ask(self, number: int) -> str:
        """Take note of a wish for a line; what is too much about it, "" when it can be granted."""
        self._times = self._times + 1 if number == self._wanted else 1
        self._wanted = number
        if self._times > ASKED_LIMIT:
            return f"this line {ASKED_LIMIT} times"
        self._rounds.append(number)
        while self._rounds[0] < number - LOOK_BACK:
            self._rounds.popleft()
        return f"{NOISE_LIMIT} of the last {LOOK_BACK} lines" if len(self._rounds) > NOISE_LIMIT else ""

    def passed(self, number: int) -> None:
        """A line was acknowledged."""
        if number > self._wanted:
            self._times = 0
