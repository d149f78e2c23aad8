"""Progress of a batch: a bar on a terminal, an occasional line elsewhere."""

import sys
import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

EVERY_S = 20.0  # between lines of a log: 1,800 lines in ten hours


class BatchProgress:
    """Shows the progress of calls on one line, updated when a call ends and several times a second. things: plural noun of the
    calls.
    """

    def __init__(self, total: int, things: str) -> None:
        self._total, self._things = total, things
        self._done, self._failed, self._last = 0, 0, "starting"
        self._began = self._said = time.monotonic()
        self._live = sys.stderr.isatty()
        columns = (
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.description}", markup=False),
        )
        self._bar = Progress(*columns, console=Console(file=sys.stderr), disable=not self._live)
        self._task = self._bar.add_task(self._last, total=total)

    def __enter__(self) -> "BatchProgress":
        self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._bar.stop()

    def show(self, text: str, failed: bool) -> None:
        """Report that a call has ended. text: its name and its result."""
        self._done += 1
        self._failed += int(failed)
        self._last = text
        self._bar.update(self._task, advance=1, description=text)

    def tick(self) -> None:
        """Print the state unless it was printed within the last EVERY_S seconds."""
        now = time.monotonic()
        if self._live or now - self._said < EVERY_S:
            return
        self._said = now
        minutes = (now - self._began) / 60.0
        failed = f", {self._failed} without a result" if self._failed else ""
        sys.stderr.write(f"{self._done} of {self._total} {self._things} after {minutes:.1f} min{failed}; last {self._last}\n")
        sys.stderr.flush()
