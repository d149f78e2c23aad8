"""Pricing: times and plastic of a front worked out anew, a row at a time, where a setting that no search reads has changed."""

from contextlib import suppress

from machine.workbench.bench.bench import Bench, rows_to_price, with_prices
from machine.workbench.session.base import SessionBase
from profiles.errors import UserError


class Pricing:
    """Work in the background; slices and searches go between two rows."""

    def __init__(self, session: SessionBase) -> None:
        self._session = session
        self._at_work = False
        session.followers.append(self._follow)

    def _follow(self) -> None:
        if not self._session.bench.priced and not self._at_work:
            self._at_work = True
            self._session.start(self._price_all())

    async def _price_all(self) -> None:
        """Until nothing on the bench is without a price, whatever is changed meanwhile."""
        try:
            while not self._session.bench.priced:
                await self._price(self._session.bench)
        finally:
            self._at_work = False

    async def _price(self, bench: Bench) -> None:
        prices = {}
        for row in rows_to_price(bench):
            with suppress(UserError):  # then it has none
                prices[row] = await self._session.long.run("price_row", bench, row)
            if self._session.bench is not bench:
                return
        self._session.become(self._session.history.amended(with_prices(bench, prices)))
