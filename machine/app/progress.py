"""Progress: what long work tells on stderr; a line that is rewritten on a terminal, plain lines elsewhere."""

import os
import sys
from time import monotonic

PLAIN_EVERY_S = 5.0
PLAIN_AGAIN_S = 60.0  # what has not changed is said again: still alive
LIVE_EVERY_S = 0.1


def say(text: str) -> None:
    """One line on stderr."""
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


def is_terminal() -> bool:
    """Whether stderr is a terminal on which lines can be rewritten."""
    return sys.stderr.isatty() and os.environ.get("TERM", "") not in ("", "dumb")


class Ticker:
    """A status that changes often: `tick` shows it at a bearable rate, `close` ends it."""

    def __init__(self) -> None:
        self.live = is_terminal()
        self.shown_at = monotonic()
        self.shown = ""
        self.open = False

    def tick(self, text: str, at_once: bool = False) -> None:
        """Show the text when enough time has passed, or at once."""
        now = monotonic()
        if not at_once and now - self.shown_at < self._wait_s(text):
            return
        self.shown_at, self.shown = now, text
        if self.live:
            sys.stderr.write(f"\r\x1b[2K{text}")
            sys.stderr.flush()
            self.open = True
        else:
            say(text)

    def _wait_s(self, text: str) -> float:
        if self.live:
            return LIVE_EVERY_S
        return PLAIN_AGAIN_S if text == self.shown else PLAIN_EVERY_S

    def close(self) -> None:
        """End the rewritten line."""
        if self.open:
            sys.stderr.write("\r\x1b[2K")
            sys.stderr.flush()
            self.open = False
