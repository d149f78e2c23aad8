"""Comparing: what the sliced print costs beside the same model in one piece."""

import asyncio

from machine.program import Alternative
from machine.workbench.bench.bench import Bench
from machine.workbench.session.base import WAITING, SessionBase
from machine.workbench.session.slicing import Slicing


class Comparing:
    """text: how far the comparison under way is, "" where there is none."""

    def __init__(self, session: SessionBase, slicing: Slicing) -> None:
        self.text = ""
        self._done: tuple[Bench, tuple[Alternative, ...]] | None = None
        self._session, self._slicing = session, slicing
        self._task: asyncio.Task[None] | None = None

    def rows(self) -> tuple[Alternative, ...]:
        """The last slices, then their model in one piece; none where these slices have not been compared."""
        slices = self._slicing.latest()
        if slices is None or self._done is None or self._done[0].printed != slices.bench.printed:
            return ()
        return slices.sliced.cost, *self._done[1]

    def begin(self) -> None:
        """Compare what is sliced, if that is not done yet."""
        if not self.text and not self.rows():
            self.text = WAITING if self._session.long.pool.full else "comparing"
            self._task = self._session.start(self._compare(self._session.bench))

    def stop(self) -> str:
        """End the comparison. What became of it, as a sentence; "" where nothing was compared."""
        if not self.text or self._task is None:
            return ""
        self._task.cancel()
        return "The comparison was stopped: nothing of it is kept."

    async def _compare(self, bench: Bench) -> None:
        def follow(text: str) -> None:
            self.text = text
            self._session.notify()

        try:
            self._done = bench, await self._session.long.run("compare_bench", bench, tell=follow)
        finally:
            self.text = ""
