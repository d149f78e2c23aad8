"""Trying: planes in a person's hand, tried as they move, and taken when they can be cut."""

import asyncio
from math import hypot
from typing import Any

from machine.app.workbench.bench.bench import Bench, with_cuts
from machine.app.workbench.bench.planes import Cuts, free_place, moved_to
from machine.app.workbench.session.desk import Desk
from mdp.plane import Plane
from mdp.search.neck import REACH_DEG, REACH_SHARE
from mdp.search.obstacle import Obstacle
from mdp.search.trial import Trial
from profiles.errors import PlanError


class Trying:
    """trial: of the planes that were tried last, and the bench that they were tried on. refused: where those that were refused
    last are in the way."""

    def __init__(self, desk: Desk) -> None:
        self.trial: tuple[Bench, Cuts, Trial] | None = None
        self.refused: Obstacle | None = None
        self._desk = desk
        self._one = asyncio.Lock()
        self._wanted: Cuts | None = None  # tried next, whatever else was wanted meanwhile
        self._known: tuple[object, ...] = ()  # what the numbered bench of the trials is made of
        self._known_number = 0
        desk.followers.append(self._follow)

    def move(self, cuts: Cuts) -> None:
        """Have planes tried, the newest ones as soon as the ones before are done."""
        waiting, self._wanted = self._wanted is not None, cuts
        if not waiting:
            self._desk.start(self._try_newest())

    async def take(self, word: str, cuts: Cuts, instead: str = "") -> None:
        """Take planes that can be cut. Raises PlanError with the reason for those that cannot be; instead: how that begins."""
        bench, self.refused = self._desk.bench, None
        trial = await self.attempt(bench, cuts)
        if trial.refused:
            self.refused = trial.obstacle
            raise PlanError(f"{instead}part {trial.refused_part} cannot be cut off: {trial.refused}")
        if self._desk.bench is bench:
            self.trial = bench, cuts, trial
            self._desk.do(word, with_cuts(bench, cuts))

    async def take_neck(self, number: Any) -> None:
        """Take the neck near the plane of the part of a number. Raises PlanError where there is none, or it cannot be cut."""
        bench = self._desk.bench
        free_place(bench, number)
        assert bench.model is not None
        low, high = bench.model.mesh.bounds_mm
        reach_mm = REACH_SHARE * hypot(*(high - low))
        with self._desk.waiting(f"looking for a neck near the plane of part {number}"):
            async with self._one:
                neck: Plane | None = (await self._run(bench, "near_neck", bench.cuts, number, reach_mm))[0]
        if neck is None:
            where = f"within {reach_mm:.0f} mm and {REACH_DEG:g} degrees no rim is shorter than all around it"
            raise PlanError(f"there is no neck near the plane of part {number}: {where}")
        if self._desk.bench is bench:
            instead = f"the neck near the plane of part {number} is no place for a cut: "
            await self.take("snap to the neck", moved_to(bench, number, neck), instead)

    async def attempt(self, bench: Bench, cuts: Cuts) -> Trial:
        """The figures of planes."""
        async with self._one:
            return await self._attempt(bench, cuts)

    async def _try_newest(self) -> None:
        async with self._one:
            cuts, self._wanted = self._wanted, None
            bench = self._desk.bench
            if cuts is not None and bench.model is not None:
                self.trial = bench, cuts, await self._attempt(bench, cuts)

    async def _attempt(self, bench: Bench, cuts: Cuts) -> Trial:
        trial: Trial = await self._run(bench, "try_cuts", cuts)
        return trial

    async def _run(self, bench: Bench, task: str, *given: Any) -> Any:
        """What a task says of a bench, which goes to the process once, not with every move of a hand."""
        made_of = (bench.model, bench.rotation, bench.profile, bench.zones)
        if any(one is not other for one, other in zip(made_of, self._known or (None,) * 4, strict=True)):
            self._known, self._known_number = made_of, self._known_number + 1
        answer = await self._desk.hand.run(task, self._known_number, None, *given)
        return answer if answer is not None else await self._desk.hand.run(task, self._known_number, bench, *given)

    def _follow(self) -> None:
        cuts = self._desk.bench.cuts
        if cuts is not None and (self.trial is None or self.trial[1] != cuts):
            self.move(cuts)
