"""Progress: what long work reports on stderr: a live line of rich's on a terminal, plain lines elsewhere."""

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from machine.notices import FrontEnd, Report, as_notices, plain_line, to_streams
from mdp.kernels.threads import harmless


def is_terminal() -> bool:
    """Whether stderr is a terminal on which lines can be rewritten."""
    return sys.stderr.isatty() and os.environ.get("TERM", "") not in ("", "dumb")


@contextmanager
def progress() -> Iterator[Report]:
    """What shows the progress of the work inside; the terminal is as before afterwards."""
    if not is_terminal():
        with as_notices() as report:
            yield report
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


TERMINAL = FrontEnd(to_streams, progress)
