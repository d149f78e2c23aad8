"""Marking: zones that a person draws, and the planes that they drive away."""

import asyncio
from collections.abc import Sequence
from typing import Any

from machine.app.workbench.bench.bench import with_cuts, with_zones
from machine.app.workbench.session.desk import Desk
from machine.app.workbench.session.trying import Trying
from profiles.errors import PlanError


class Marking:
    """What takes the zones of a session's pages, one after the other."""

    def __init__(self, desk: Desk, trying: Trying) -> None:
        self._desk, self._trying = desk, trying
        self._one = asyncio.Lock()

    async def take(self, asked: dict[str, Any]) -> None:
        """Do a command of `bench.marks`; planes that it forbids go, and the reason is told. Raises PlanError for what makes no
        sense, and where a plane that would go is locked."""
        async with self._one:
            while not await self._taken(asked):
                pass  # something else came in between

    async def _taken(self, asked: dict[str, Any]) -> bool:
        before = self._desk.bench
        word, zones = await self._desk.quick.run("mark_bench", before, asked)
        bench, gone = with_zones(before, zones), list[str]()
        while bench.cuts:
            trial = await self._trying.attempt(bench, bench.cuts)
            if not trial.refused:
                break
            part = bench.cuts[trial.refused_part - 2]
            if part in bench.locked:
                raise PlanError(f"the plane of part {trial.refused_part} is locked and would be in the way: {trial.refused}")
            gone.append(trial.refused)
            bench = with_cuts(bench, tuple(each for each in bench.cuts if each is not part))
        if self._desk.bench is not before:
            return False
        self._desk.do(word, bench, _told(word, gone))
        return True


def _told(word: str, gone: Sequence[str]) -> str:
    if not gone:
        return ""
    return (
        f"{word}: {'a plane was' if len(gone) == 1 else f'{len(gone)} planes were'} taken away: {'; '.join(dict.fromkeys(gone))}"
    )
