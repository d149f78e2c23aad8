"""Plane trials: planes in a person's hand, tried as they move, and taken when they can be cut."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, inf

from machine.workbench.bench.bench import Bench, with_cuts
from machine.workbench.bench.planes import Cuts, check_unlocked, snap
from machine.workbench.bench.values import Asked
from machine.workbench.session.base import SessionBase, asking
from machine.workbench.session.readiness import Readiness
from mdp.plane import Plane
from mdp.search.neck import REACH_DEG, REACH_SHARE
from mdp.search.trial import Obstacle, Trial
from profiles.errors import PlanError

REST_S = 0.1  # how long a hand must rest before what it holds is tried more closely


@dataclass(frozen=True)
class Place:
    """Where a person wants a plane: what was asked, and the planes of a bench with it, each time with the number of its part, in
    the print orders that will do, the wanted one first. Where it says `near`, the nearest place where it can be cut will do."""

    asked: Asked
    orders: Callable[[Bench], list[tuple[Cuts, int]]]

    @property
    def near(self) -> bool:
        return self.asked.get("near") is True


@dataclass(frozen=True)
class Refused:
    """Planes that could not be cut: the page that wanted them, what is in the way where, and the command that puts the one that
    was moved at the nearest place; None: it was none that is put somewhere, or there is none."""

    page: str
    obstacle: Obstacle | None
    near: Asked | None = None


class PlaneTrials:
    """trial: of the planes that were tried last, and the bench that they were tried on. refused: those that were refused last."""

    def __init__(self, session: SessionBase, readiness: Readiness) -> None:
        self.trial: tuple[Bench, Cuts, Trial] | None = None
        self.refused: Refused | None = None
        self._session, self._readiness = session, readiness
        self._trying, self._edits = asyncio.Lock(), asyncio.Lock()
        self._wanted: Cuts | None = None  # tried next, whatever else was wanted meanwhile
        session.followers.append(self.settle)

    def move(self, cuts: Cuts) -> None:
        """Have planes tried, the newest ones as soon as the ones before are done."""
        waiting, self._wanted = self._wanted is not None, cuts
        if not waiting:
            self._session.start(self._try_newest())

    async def take(self, word: str, edit: Callable[[Bench], Cuts], instead: str = "", place: Place | None = None) -> None:
        """Take planes that can be cut; each of several edits begins with what the one before has left. edit: gives the planes of
        a bench after it; instead: how the reason begins; place: of the plane that is put somewhere. Raises PlanError for planes
        that cannot be cut."""
        async with self._edits:
            bench, self.refused = self._session.bench, None
            cuts = edit(bench)
            trial = await self.attempt(bench, cuts)
            if trial.refused and place is not None and place.near:
                cuts, trial = await self._nearest(bench, place.orders(bench)) or (cuts, trial)
            if trial.refused:
                self.settle()
                raise self._refusal(trial, instead, place)
            now = self._session.bench
            if now.shaped != bench.shaped:
                raise PlanError(f"{word}: what lies on the workbench has changed meanwhile, so it was not done")
            self.trial = now, cuts, trial
            self._session.do(word, with_cuts(now, cuts))

    async def after_edits(self, act: Callable[[], None]) -> None:
        """Do something to the planes that the edits asked for before leave."""
        async with self._edits:
            act()

    async def take_neck(self, asked: Asked) -> None:
        """Take the neck near the plane of a `part`. Raises PlanError where there is none, or it cannot be cut."""
        bench = self._session.bench
        number = check_unlocked(bench, asked)
        assert bench.model is not None
        reach_mm = REACH_SHARE * hypot(*bench.model.size_mm)
        with self._session.waiting(f"looking for a neck near the plane of part {number}"):
            async with self._trying:
                neck: Plane | None = await self._readiness.ask("near_neck", bench, bench.cuts, number, reach_mm)
        if neck is None:
            where = f"within {reach_mm:.0f} mm and {REACH_DEG:g} degrees no rim is shorter than all around it"
            raise PlanError(f"there is no neck near the plane of part {number}: {where}")
        if self._session.bench.shaped == bench.shaped:
            instead = f"the neck near the plane of part {number} is no place for a cut: "
            there = {"do": "move", "part": number, "normal": neck.normal.tolist(), "offset_mm": neck.offset_mm}
            place = Place(there, lambda now: [(snap(now, asked, neck), number)])
            await self.take("snap to the neck", lambda now: snap(now, asked, neck), instead, place)

    async def _nearest(self, bench: Bench, orders: list[tuple[Cuts, int]]) -> tuple[Cuts, Trial] | None:
        """The planes with the one that is put somewhere at the nearest place, and their trial; None: there is none."""
        with self._session.waiting("looking for the nearest place that can be cut"):
            async with self._trying:
                nearest: Cuts | None = await self._readiness.ask("nearest", bench, orders)
        return None if nearest is None else (nearest, await self.attempt(bench, nearest))

    def _refusal(self, trial: Trial, instead: str, place: Place | None) -> PlanError:
        """Why planes cannot be cut; what is known of that is kept."""
        why, near = f"{instead}part {trial.refused_part} cannot be cut off: {trial.refused}", None
        if place is not None and place.near:
            why += "; shifted along its normal it cannot be cut either"
        elif place is not None:
            near = {**place.asked, "near": True}
        self.refused = Refused(asking.get(), trial.obstacle, near)
        return PlanError(why)

    async def attempt(self, bench: Bench, cuts: Cuts, most_cuts: float = inf) -> Trial:
        """The figures of planes, every one of them looked at; most_cuts: see mdp.search.trial."""
        async with self._trying:
            trial: Trial = await self._readiness.ask("try_cuts", bench, cuts, most_cuts)
            return trial

    async def _try_newest(self) -> None:
        """Figures at once; where parts are not looked at yet, one after the other as soon as the hand rests."""
        async with self._trying:
            cuts, self._wanted = self._wanted, None
            bench = self._session.bench
            if cuts is None or bench.model is None:
                return
            self.trial = tried = bench, cuts, await self._readiness.ask("try_cuts", bench, cuts, 0)
        while tried[2].unchecked:
            self._session.notify()
            await asyncio.sleep(REST_S)
            if self._wanted is not None or self.trial is not tried or self._session.bench.sought != bench.sought:
                return
            trial = await self.attempt(bench, cuts, 1)
            if self.trial is not tried:
                return
            self.trial = tried = bench, cuts, trial

    def settle(self) -> None:
        """Have the planes on the bench tried anew where others were tried last: no hand holds those any more."""
        bench, tried = self._session.bench, self.trial
        if bench.cuts is not None and (tried is None or tried[1] != bench.cuts or tried[0].sought != bench.sought):
            self.move(bench.cuts)
