"""Marking: zones that a person draws, and the planes that they drive away."""

import asyncio
from collections.abc import Sequence

from machine.workbench.bench.bench import with_cuts, with_zones
from machine.workbench.bench.values import Asked
from machine.workbench.session.base import SessionBase
from machine.workbench.session.trials import PlaneTrials
from profiles.errors import PlanError


class Marking:
    """What takes the zones of a session's pages, one after the other."""

    def __init__(self, session: SessionBase, trials: PlaneTrials) -> None:
        self._session, self._trials = session, trials
        self._lock = asyncio.Lock()

    async def take(self, task: str, asked: Asked) -> None:
        """Do what a task, a function of `bench.marks`, makes of a command; planes that it forbids go, and the reason is told.
        Raises PlanError for what makes no sense, and where a plane that would go is locked."""
        async with self._lock:
            while not await self._taken(task, asked):
                pass  # something else came in between

    async def _taken(self, task: str, asked: Asked) -> bool:
        before = self._session.bench
        word, zones = await self._session.quick.run(task, before, asked)
        bench, gone = with_zones(before, zones), list[str]()
        while bench.cuts:
            trial = await self._trials.attempt(bench, bench.cuts)
            if not trial.refused:
                break
            part = bench.cuts[trial.refused_part - 2]
            if part in bench.locked:
                raise PlanError(f"the plane of part {trial.refused_part} is locked and would be in the way: {trial.refused}")
            gone.append(trial.refused)
            bench = with_cuts(bench, tuple(cut for cut in bench.cuts if cut is not part))
        if self._session.bench is not before:
            return False
        self._session.do(word, bench, _in_words(word, gone))
        return True


def _in_words(word: str, gone: Sequence[str]) -> str:
    if not gone:
        return ""
    return (
        f"{word}: {'a plane was' if len(gone) == 1 else f'{len(gone)} planes were'} taken away: {'; '.join(dict.fromkeys(gone))}"
    )
