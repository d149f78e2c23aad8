"""Finding: the search for parts that a session has under way, and what it takes of one that is stopped."""

import asyncio
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from machine.workbench.bench.bench import Bench, locked_plan, plan_of_bench, with_front, with_rotation
from machine.workbench.session.base import WAITING, SessionBase
from machine.workbench.work.cutting import Found, Searched, SearchWay
from profiles.errors import PlanError
from profiles.frozen import Vector

BY_DEFAULT = SearchWay()


@dataclass(frozen=True, eq=False)
class Search:
    """A search under way: its number, the bench that it began with, and how far it is."""

    number: int
    bench: Bench
    searched: Searched


def search_way(asked: dict[str, Any]) -> SearchWay:
    """How a page wants parts sought. Raises PlanError."""
    orient, ranker = asked.get("orient", BY_DEFAULT.orient), asked.get("ranker", BY_DEFAULT.ranker)
    if not isinstance(orient, bool) or not isinstance(ranker, str):
        raise PlanError(f"orient is {orient!r} and ranker {ranker!r}: true or false and a name are allowed")
    return SearchWay(orient, ranker.strip() or BY_DEFAULT.ranker)


class Finding:
    """search: the one under way; notes: of the last one; laid: how it found the model turned, and how it has turned it."""

    def __init__(self, session: SessionBase) -> None:
        self.search: Search | None = None
        self.notes: tuple[str, ...] = ()
        self.laid: tuple[tuple[Vector, ...], tuple[Vector, ...]] | None = None
        self._session = session
        self._count = 0
        self._task: asyncio.Task[None] | None = None
        self._pricing: asyncio.Task[None] | None = None  # of the best of a search that was stopped
        session.followers.append(self._follow)

    def begin(self, way: SearchWay = BY_DEFAULT) -> None:
        """Search for the parts of the model on the bench, if no search is under way."""
        bench = self._session.bench
        if self.search is None:
            if self._pricing is not None:
                self._pricing.cancel()
            self._count += 1
            begins = WAITING if self._session.long.pool.full else "beginning"
            self.search = Search(self._count, bench, Searched(begins))
            self._task = self._session.start(self._find(self.search, way))

    def stop(self) -> str:
        """End the search; the best that it has met so far is taken, and what its parts take to print told when that is known.
        What became of it, as a sentence; "" where there was none."""
        search, self.search = self.search, None
        if search is None or self._task is None:
            return ""
        self._task.cancel()
        self._session.start(self._session.long.warm())
        best = search.searched.best
        if best is None or not best.planes:
            return "The search was stopped before it had cut anything: all is as it was."
        self._session.do("stop the search", with_front(self._session.bench, [replace(best, chosen=True)]))
        self._pricing = self._session.start(self._price(self._session.bench))
        return f"The search was stopped, and the best so far is taken: {best.parts} parts."

    async def _find(self, begun: Search, way: SearchWay) -> None:
        def follow(searched: Searched) -> None:
            if self._is_under_way(begun):
                self.search = replace(begun, searched=searched)
                self._session.notify()

        try:
            outcome: Found = await self._session.long.run("find_parts", begun.bench, way, tell=follow)
            self.notes = outcome.notes
            now = self._session.bench
            laid = now if outcome.turn is None else with_rotation(now, (outcome.turn @ np.array(now.rotation)).tolist())
            self.laid = None if laid is now else (now.rotation, laid.rotation)
            self._session.do("find parts", with_front(laid, outcome.front))
        finally:
            if self._is_under_way(begun):
                self.search = None

    def _is_under_way(self, begun: Search) -> bool:
        """Whether a search is still the one: another one may have begun with the same bench as soon as it was stopped."""
        return self.search is not None and self.search.number == begun.number

    async def _price(self, taken: Bench) -> None:
        rows = await self._session.long.run("measure_plan", taken, plan_of_bench(taken, "the search"))
        self._session.amend(taken, replace(taken, rows=tuple(rows)))

    def _follow(self) -> None:
        """A search ends whose model is not there any more or lies otherwise, or whose settings, marks or locked planes are others
        now."""
        search, bench = self.search, self._session.bench
        if search is not None and _differs(search.bench, bench):
            self.search = None
            if self._task is not None:
                self._task.cancel()
                self._session.start(self._session.long.warm())


def _differs(begun: Bench, now: Bench) -> bool:
    """Whether a search that has begun with a bench is not one for that of now."""
    return begun.sought != now.sought or locked_plan(begun).parts != locked_plan(now).parts
