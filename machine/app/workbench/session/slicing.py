"""Slicing: the slices that a session has or makes, and whether they are of what lies on the bench now."""

import asyncio
from dataclasses import dataclass

from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.session.desk import Desk
from machine.app.workbench.work.slices import Sliced
from profiles.errors import PlanError


@dataclass(frozen=True, eq=False)
class SlicingUnderWay:
    """The bench that is sliced, and how far it is."""

    bench: Bench
    text: str


class Slicing:
    """under_way: what is sliced now; done: the last slices, and the bench that they are of."""

    def __init__(self, desk: Desk) -> None:
        self.under_way: SlicingUnderWay | None = None
        self.done: tuple[Bench, Sliced] | None = None
        self._desk = desk
        self._task: asyncio.Task[None] | None = None
        desk.followers.append(self._follow)

    def shown(self) -> Sliced | None:
        """The slices of what lies on the bench now; None where they are of something else."""
        if self.done is None or self.done[0].printed != self._desk.bench.printed:
            return None
        return self.done[1]

    def needed(self) -> Sliced:
        """The same. Raises PlanError where there are none."""
        sliced = self.shown()
        if sliced is None and self.done is not None and self.done[0].model is self._desk.bench.model:
            raise PlanError("what is on the workbench has changed since it was sliced: slice it again")
        if sliced is None:
            raise PlanError("what is on the workbench is not sliced yet: slice it first")
        return sliced

    def begin(self) -> None:
        """Slice what lies on the bench, if nothing is being sliced. Raises PlanError without a model."""
        bench = self._desk.bench
        if bench.model is None:
            raise PlanError("there is no model on the workbench yet: choose a file first")
        if self.under_way is None:
            self.under_way = SlicingUnderWay(bench, "cutting the parts")
            self._task = self._desk.start(self._slice(bench))

    def stop(self) -> None:
        """End the slicing."""
        if self._task is not None:
            self._task.cancel()

    async def _slice(self, bench: Bench) -> None:
        def follow(text: str) -> None:
            self.under_way = SlicingUnderWay(bench, text)
            self._desk.tell()

        try:
            self.done = bench, await self._desk.long.run("slice_bench", bench, tell=follow)
        finally:
            self.under_way = None

    def _follow(self) -> None:
        if self.under_way is not None and self.under_way.bench.printed != self._desk.bench.printed:
            self.stop()
