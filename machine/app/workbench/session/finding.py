"""Finding: the search for parts that a session has under way, and what it takes of one that is stopped."""

import asyncio
from dataclasses import dataclass, replace

from machine.app.workbench.bench.bench import Bench, locked_plan, plan_of_bench, with_front
from machine.app.workbench.session.desk import Desk
from machine.app.workbench.work.cutting import Searched
from profiles.errors import PlanError


@dataclass(frozen=True, eq=False)
class Search:
    """A search under way: the bench that it began with, and how far it is."""

    bench: Bench
    searched: Searched


class Finding:
    """search: the one under way; notes: of the last one."""

    def __init__(self, desk: Desk) -> None:
        self.search: Search | None = None
        self.notes: tuple[str, ...] = ()
        self._desk = desk
        self._task: asyncio.Task[None] | None = None
        self._pricing: asyncio.Task[None] | None = None  # of the best of a search that was stopped
        desk.followers.append(self._follow)

    def begin(self) -> None:
        """Search for the parts of what lies on the bench, if no search is under way. Raises PlanError without a model."""
        bench = self._desk.bench
        if bench.model is None:
            raise PlanError("there is no model on the workbench yet: choose a file first")
        if self.search is None:
            if self._pricing is not None:
                self._pricing.cancel()
            self.search = Search(bench, Searched("beginning"))
            self._task = self._desk.start(self._find(bench))

    def stop(self) -> None:
        """End the search; the best that it has met so far is taken, and what its parts take to print told when that is known."""
        search, self.search = self.search, None
        if search is None or self._task is None:
            return
        self._task.cancel()
        self._desk.start(self._desk.long.warm())
        best = search.searched.best
        if best is not None and best.planes:
            self._desk.do("stop the search", with_front(self._desk.bench, [replace(best, chosen=True)]))
            self._pricing = self._desk.start(self._price(self._desk.bench))

    async def _find(self, bench: Bench) -> None:
        def follow(searched: Searched) -> None:
            if self.search is not None and self.search.bench is bench:
                self.search = Search(bench, searched)
                self._desk.tell()

        try:
            rows, self.notes = await self._desk.long.run("find_parts", bench, tell=follow)
            self._desk.do("find parts", with_front(self._desk.bench, rows))
        finally:
            if self.search is not None and self.search.bench is bench:
                self.search = None

    async def _price(self, taken: Bench) -> None:
        rows = await self._desk.long.run("measure_plan", taken, plan_of_bench(taken, "the search"))
        self._desk.amend(taken, replace(taken, rows=tuple(rows)))

    def _follow(self) -> None:
        """A search ends whose model is not there any more or lies otherwise, or whose settings, marks or locked planes are others
        now."""
        search, bench = self.search, self._desk.bench
        if search is not None and _other(search.bench, bench):
            self.search = None
            if self._task is not None:
                self._task.cancel()
                self._desk.start(self._desk.long.warm())


def _other(begun: Bench, now: Bench) -> bool:
    """Whether a search that has begun with a bench is not one for that of now."""
    return begun.sought != now.sought or locked_plan(begun).parts != locked_plan(now).parts
