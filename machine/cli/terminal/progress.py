"""Progress: what long work reports on stderr: a live line of rich's on a terminal, plain lines elsewhere."""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Protocol

from machine.cli.terminal.plain import plain_line, put
from mdp.kernels.threads import harmless

PLAIN_EVERY_S = 5.0
PLAIN_AGAIN_S = 60.0  # what has not changed is said again: still alive


class Report(Protocol):
    """Shows what work is under way, and the share of it that is done where that is known."""

    def __call__(self, text: str, share: float | None = None) -> None: ...


def say(text: str, *, forced: bool = False) -> None:
    """One line on stderr. forced: it is what --force goes past."""
    put(f"{plain_line(text)}\n", sys.stderr, forced)


def say_lines(text: str) -> None:
    """Several lines on stderr."""
    put(f"{text}\n", sys.stderr)


def is_terminal() -> bool:
    """Whether stderr is a terminal on which lines can be rewritten."""
    return sys.stderr.isatty() and os.environ.get("TERM", "") not in ("", "dumb")


@contextmanager
def reporting() -> Iterator[Report]:
    """What shows the progress of the work inside; the terminal is as before afterwards."""
    if not is_terminal():
        lines = PlainLines()
        yield lambda text, share=None: lines.show(text)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), BarColumn(20), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        for thread in threading.enumerate():
            if type(thread).__module__.startswith("rich."):  # it draws the bar, on a stream that a copy of this process reopens
                harmless(thread)
        task = progress.add_task("", total=None)

        def show(text: str, share: float | None = None) -> None:
            progress.update(task, description=plain_line(text), total=None if share is None else 1.0, completed=share or 0.0)

        yield show


class PlainLines:
    """A status that changes often, as lines at a bearable rate."""

    def __init__(self) -> None:
        self._shown, self._shown_at_s = "", monotonic()

    def show(self, text: str, at_once: bool = False) -> None:
        """Say the text when enough time has passed since the one before, or at once."""
        now_s = monotonic()
        wait_s = PLAIN_AGAIN_S if text == self._shown else PLAIN_EVERY_S
        if at_once or now_s - self._shown_at_s >= wait_s:
            self._shown, self._shown_at_s = text, now_s
            say(text)
