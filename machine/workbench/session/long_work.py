"""Long tasks: the search for parts, the prices of a front, the slices, and the comparison with the model in one piece."""

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from machine.program import Alternative
from machine.workbench.bench.bench import Bench, locked_plan, rows_to_price, with_front, with_prices, with_rotation
from machine.workbench.session.base import WAITING, Derived, SessionBase
from machine.workbench.work.cutting import Found, Searched, find_parts, price_cuts, price_row
from machine.workbench.work.plate import naming_model
from machine.workbench.work.slices import Sliced, SlicesSoFar, compare_bench, slice_bench
from mdp.decomposition import FrontRow
from mdp.ranking.ranker import CLASSIC
from mdp.search.plan_file import planned_parts
from profiles.errors import PlanError, UserError
from profiles.frozen import Vector

REST_S = 0.3  # pause in changes of a bench after which it is priced; an interrupted pricing costs a process
ENDED = "slicing was stopped, for the model on the workbench has changed: slice it again"
REPLACED = "your planes were replaced: Undo brings them back"


class Finding(Derived[tuple[Found, ...]]):
    """Search for the parts of the bench's model, then of each other model on the plate that is not cut; cancelled when one of
    these, its orientation, settings, marks or locked planes change.

    laid: the rotations before and after it."""

    def __init__(self, session: SessionBase) -> None:
        self.laid: tuple[tuple[Vector, ...], tuple[Vector, ...]] | None = None
        self._how = True, CLASSIC
        super().__init__(
            session,
            lambda bench: None if bench.model is None else (bench.sought, locked_plan(bench).parts, _uncut(bench)),
            self._find,
            by_itself=False,
            interrupts=True,
            accept=self._accept_found,
        )

    def search(self, orient: bool = True, ranker: str = CLASSIC) -> None:
        """Search for the parts of the model on the bench, unless a search is running."""
        if self.progress is None:
            self._how = orient, ranker
            self.begin(Searched(WAITING if self._session.long.pool.full else "beginning"))

    async def _find(self, bench: Bench) -> tuple[Found, ...]:
        tell, found = self.teller(), list[Found]()
        best: FrontRow | None = None

        def follow_other(name: str, searched: Searched) -> None:
            tell(Searched(f"{name}: {searched.text}", best))

        found.append(await self._session.long.run(find_parts, bench, *self._how, tell=tell))
        if found[0].turn is None:
            best = next(row for row in found[0].front if row.chosen)
        for other in bench.beside:
            if other.cuts is None and other.model is not None:
                follow = partial(follow_other, other.model.name)
                with naming_model(other):
                    found.append(await self._session.long.run(find_parts, other, *self._how, tell=follow))
        return tuple(found)

    def interrupted(self) -> None:
        """Start a process for the next search."""
        self._session.start(self._session.long.warm())

    def take_best(self, bench: Bench, searched: Searched | None) -> str:
        """Apply the best result of a stopped search, whose prices may follow later; returns a sentence. searched: None: it had
        not begun."""
        best, now = None if searched is None else searched.best, self._session.bench
        if best is None or not best.planes or self._key_of(now) != self._key_of(bench):
            return "The search was stopped before it had cut anything: all is as it was."
        taken = with_front(now, [replace(best, chosen=True)])
        self._session.do("stop the search", replace(taken, priced=best.time_s is not None))
        used = f"The search was stopped; the best so far is used: {best.parts} parts"
        return f"{used}; {REPLACED}." if _replaces_planes(now, taken) else f"{used}."

    def _accept_found(self, found: tuple[Found, ...]) -> None:
        now, (own, *further) = self._session.bench, found
        of_others = iter(further)
        others = tuple(_with_found(other, next(of_others)) if other.cuts is None else other for other in now.beside)
        after = replace(_with_found(now, own), beside=others)
        self.laid = None if after.rotation == now.rotation else (now.rotation, after.rotation)
        self._session.do("find parts", after, REPLACED if _replaces_planes(now, after) else "")


def _uncut(bench: Bench) -> tuple[object, ...]:
    """Everything that determines the parts found for the other models, which are not cut yet."""
    return tuple(other.sought for other in bench.beside if other.cuts is None)


def _with_found(bench: Bench, found: Found) -> Bench:
    laid = bench if found.turn is None else with_rotation(bench, (found.turn @ np.array(bench.rotation)).tolist())
    return with_front(laid, found.front, found.notes)


def _replaces_planes(now: Bench, after: Bench) -> bool:
    """Whether a search has replaced planes that it did not find itself."""
    if any(planned_parts(row) == now.cuts for row in now.rows):
        return False
    return any(cut not in (after.cuts or ()) for cut in now.cuts or () if cut not in now.locked)


def prices_of(session: SessionBase) -> Derived[dict[int, FrontRow]]:
    """Times and filament of the front, computed row by row after the change of a setting that no search reads; slices and
    searches may run between two rows."""

    async def price(bench: Bench) -> dict[int, FrontRow]:
        prices: dict[int, FrontRow] = {}
        await asyncio.sleep(REST_S)
        for row in rows_to_price(bench):
            with suppress(UserError):  # the row then has no price
                prices[row] = await session.long.run(price_row, bench, row)
        return prices

    def accept(prices: dict[int, FrontRow]) -> None:
        now = replace(session.history.now, bench=with_prices(session.bench, prices))
        session.become(replace(session.history, now=now))

    def decides(bench: Bench) -> tuple[object, ...] | None:
        return None if bench.priced else (bench.sought, bench.rows, bench.locked)

    return Derived(session, decides, price, interrupts=True, accept=accept)


def price_by_hand(session: SessionBase) -> Derived[FrontRow | None]:
    """The row of planes that the user has changed since they were found, or that no search has priced; None if they cannot be
    cut."""

    def decides(bench: Bench) -> tuple[object, ...] | None:
        found = next((row for row in bench.rows if planned_parts(row) == bench.cuts), None)
        has_price = found is not None and (found.time_s is not None or not bench.priced)
        return None if bench.cuts is None or has_price or not bench.rows else (bench.sought, bench.cuts, bench.locked)

    async def price(bench: Bench) -> FrontRow | None:
        await asyncio.sleep(REST_S)
        with suppress(UserError):
            return await session.long.run(price_cuts, bench)
        return None

    return Derived(session, decides, price, interrupts=True)


@dataclass(frozen=True, eq=False)
class Slices:
    """Finished slices: their bench, their number, and the visible walls of each part."""

    bench: Bench
    number: int
    sliced: Sliced
    walls: Mapping[int, bytes]


class Slicing(Derived[Slices]):
    """The slices. progress: SlicesSoFar with all finished parts, for the slices with this number; done: the last slices."""

    def __init__(self, session: SessionBase) -> None:
        super().__init__(session, lambda bench: bench.printed, self._slice, by_itself=False, interrupts=True)

    def latest(self) -> Slices | None:
        """The last slices of a model on the plate, even if it has been turned, cut or set differently since."""
        models = {each.model for each in self._session.bench.plate}
        return self.done if self.done is not None and any(each.model in models for each in self.done.bench.plate) else None

    @property
    def out_of_date(self) -> bool:
        """Whether the last slices differ from the current bench."""
        return self.done is not None and self.done.bench.printed != self._session.bench.printed

    def lacking(self) -> str:
        """Sentence on why there are no slices of the current bench; "" if there are."""
        if self.latest() is None:
            return "what is on the workbench is not sliced yet: slice it first"
        return "what is on the workbench has changed since it was sliced: slice it again" if self.out_of_date else ""

    def needed(self) -> Slices:
        """The slices of the current bench. Raises PlanError if there are none."""
        if sentence := self.lacking():
            raise PlanError(sentence)
        assert self.done is not None
        return self.done

    def walls_of(self, number: int, part: int) -> bytes | None:
        """Visible walls of a part in the slices with a number; None if they do not exist, or not yet."""
        if self.progress is not None and self.number == number:
            drawn: bytes | None = self.progress.walls.get(part)
            return drawn
        return self.done.walls.get(part) if self.done is not None and self.done.number == number else None

    def slice(self) -> None:
        """Slice the model on the bench, unless slicing is running."""
        self.begin(SlicesSoFar(WAITING if self._session.long.pool.full else "cutting the parts"))

    def interrupted(self) -> None:
        """Notify the pages."""
        self._session.add_note(ENDED)

    async def _slice(self, bench: Bench) -> Slices:
        walls: dict[int, bytes] = {}
        number, tell = self.number, self.teller()

        def follow(so_far: SlicesSoFar) -> None:
            walls.update(so_far.walls)
            tell(replace(so_far, walls=walls))

        page, gcode = self._session.new_file(), self._session.new_file()
        sliced = await self._session.long.run(slice_bench, bench, page, gcode, tell=follow)
        if self.done is not None:
            self.done.sliced.page.unlink(missing_ok=True)
            self.done.sliced.gcode.unlink(missing_ok=True)
        return Slices(bench, number, sliced, walls)


class Comparing(Derived[tuple[Alternative, ...]]):
    """Comparison of the slices with their model in one piece; progress: in words."""

    def __init__(self, session: SessionBase, slicing: Slicing) -> None:
        self._slicing = slicing
        super().__init__(
            session,
            lambda bench: None if (slices := slicing.latest()) is None else slices.bench.printed,
            self._compare,
            by_itself=False,
            interrupts=True,
        )

    async def _compare(self, bench: Bench) -> tuple[Alternative, ...]:
        return await self._session.long.run(compare_bench, bench, tell=self.teller())

    def rows(self) -> tuple[Alternative, ...]:
        """The last slices, then their model in one piece; () if these slices have not been compared."""
        slices, others = self._slicing.latest(), self.result
        return () if slices is None or others is None else (slices.sliced.cost, *others)

    def compare(self) -> None:
        """Compare the slices, unless that has been done; ends a comparison of earlier slices."""
        if self.stale:
            self.stop()
        if not self.rows():
            self.begin(WAITING if self._session.long.pool.full else "comparing")
