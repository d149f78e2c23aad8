"""Trying: planes in a person's hand, tried as they move, and taken when they can be cut."""

import asyncio

from machine.app.workbench.bench.bench import Bench, with_cuts
from machine.app.workbench.bench.planes import Cuts
from machine.app.workbench.session.desk import Desk
from mdp.search.trial import Trial
from profiles.errors import PlanError


class Trying:
    """trial: of the planes that were tried last, and the bench that they were tried on."""

    def __init__(self, desk: Desk) -> None:
        self.trial: tuple[Bench, Cuts, Trial] | None = None
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

    async def take(self, word: str, cuts: Cuts) -> None:
        """Take planes that can be cut. Raises PlanError with the reason for those that cannot be."""
        bench = self._desk.bench
        trial = await self.attempt(bench, cuts)
        if trial.refused:
            raise PlanError(f"part {trial.refused_part} cannot be cut off: {trial.refused}")
        if self._desk.bench is bench:
            self.trial = bench, cuts, trial
            self._desk.do(word, with_cuts(bench, cuts))

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
        """The bench goes to the process once, not with every move of a hand."""
        made_of = (bench.model, bench.rotation, bench.profile, bench.zones)
        if any(one is not other for one, other in zip(made_of, self._known or (None,) * 4, strict=True)):
            self._known, self._known_number = made_of, self._known_number + 1
        trial: Trial | None = await self._desk.hand.run("try_cuts", self._known_number, None, cuts)
        if trial is None:
            trial = await self._desk.hand.run("try_cuts", self._known_number, bench, cuts)
        assert trial is not None
        return trial

    def _follow(self) -> None:
        cuts = self._desk.bench.cuts
        if cuts is not None and (self.trial is None or self.trial[1] != cuts):
            self.move(cuts)
