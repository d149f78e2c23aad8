"""Finding: the search for parts that a session has under way, what it takes of one that is stopped, and the prices of a front."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from machine.workbench.bench.bench import Bench, locked_plan, rows_to_price, with_front, with_prices, with_rotation
from machine.workbench.session.base import WAITING, Derived, SessionBase
from machine.workbench.work.cutting import Found, Searched, SearchWay
from mdp.decomposition import FrontRow
from profiles.errors import UserError
from profiles.frozen import Vector


class Finding(Derived[Found]):
    """A search ends whose model is gone or lies otherwise, or whose settings, marks or locked planes are others now.

    notes: of the last one; laid: how it found the model turned, and how it has turned it."""

    def __init__(self, session: SessionBase) -> None:
        self.notes: tuple[str, ...] = ()
        self.laid: tuple[tuple[Vector, ...], tuple[Vector, ...]] | None = None
        self._way = SearchWay()
        super().__init__(
            session,
            lambda bench: None if bench.model is None else (bench.sought, locked_plan(bench).parts),
            lambda bench: session.long.run("find_parts", bench, self._way, tell=self.teller()),
            by_itself=False,
            interrupts=True,
            accept=self._accept_found,
        )

    def search(self, way: SearchWay) -> None:
        """Search for the parts of the model on the bench, if no search is under way."""
        if self.progress is None:
            self._way = way
            self.begin(Searched(WAITING if self._session.long.pool.full else "beginning"))

    def interrupted(self) -> None:
        """Have another process ready for the next one."""
        self._session.start(self._session.long.warm())

    def take_best(self, bench: Bench, searched: Searched | None) -> str:
        """Take the best that a search of a bench had met when it was stopped; its prices are told when they are known. What
        became of it, as a sentence. searched: None, it had not begun."""
        best, now = None if searched is None else searched.best, self._session.bench
        if best is None or not best.planes or self._key_of(now) != self._key_of(bench):
            return "The search was stopped before it had cut anything: all is as it was."
        taken = with_front(now, [replace(best, chosen=True)])
        self._session.do("stop the search", replace(taken, priced=best.time_s is not None))
        return f"The search was stopped, and the best so far is taken: {best.parts} parts."

    def _accept_found(self, found: Found) -> None:
        self.notes, now = found.notes, self._session.bench
        laid = now if found.turn is None else with_rotation(now, (found.turn @ np.array(now.rotation)).tolist())
        self.laid = None if laid is now else (now.rotation, laid.rotation)
        self._session.do("find parts", with_front(laid, found.front))


def prices_of(session: SessionBase) -> Derived[dict[int, FrontRow]]:
    """Times and plastic of the front worked out a row at a time, where a setting has changed that no search reads; slices and
    searches go between two rows."""

    async def price(bench: Bench) -> dict[int, FrontRow]:
        prices: dict[int, FrontRow] = {}
        for row in rows_to_price(bench):
            if not prices_now.stale:
                with suppress(UserError):  # then it has none
                    prices[row] = await session.long.run("price_row", bench, row)
        return prices

    def accept(prices: dict[int, FrontRow]) -> None:
        session.become(session.history.amended(with_prices(session.bench, prices)))

    prices_now = Derived(
        session, lambda bench: None if bench.priced else (bench.sought, bench.rows, bench.locked), price, accept=accept
    )
    return prices_now
