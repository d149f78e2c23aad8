"""Progress: how far a collection is, as a bar on a terminal and as a line now and then elsewhere."""

import sys
import time
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from mdp.learning.collection.index import Row

EVERY_S = 20.0  # where lines stay, in a log: ten hours of searches are 1,800 of them


class Progress:
    """Told of every search that ends, and some times a second that others go on."""

    def __init__(self, total: int) -> None:
        self._total, self._done, self._failed, self._last = total, 0, 0, "starting"
        self._began = self._said = time.monotonic()
        self._live = sys.stderr.isatty()
        columns = (
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.description}"),
        )
        self._bar = Bar(*columns, console=Console(file=sys.stderr), disable=not self._live)
        self._task = self._bar.add_task(self._last, total=total)

    def __enter__(self) -> "Progress":
        self._bar.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._bar.stop()

    def show(self, row: Row) -> None:
        """A search has ended."""
        self._done += 1
        self._failed += int(row.excluded.startswith("failed"))
        result = row.excluded or f"J {row.outcome:.4f}, {row.lists} lists, {row.seconds:.0f} s"
        self._last = f"{row.search.file.removesuffix('.npz')}: {result}"
        self._bar.update(self._task, advance=1, description=self._last)

    def tick(self) -> None:
        """Say where it stands, where that was not said for a while."""
        now = time.monotonic()
        if self._live or now - self._said < EVERY_S:
            return
        self._said = now
        minutes = (now - self._began) / 60.0
        failed = f", {self._failed} failed" if self._failed else ""
        sys.stderr.write(f"{self._done} of {self._total} searches after {minutes:.1f} min{failed}; last {self._last}\n")
        sys.stderr.flush()
