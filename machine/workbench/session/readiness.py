"""Readiness: what planes on a bench need, worked out in a process of its own as soon as there is a model."""

import asyncio
from itertools import count
from typing import Any

from machine.workbench.bench.bench import Bench
from machine.workbench.session.base import SessionBase
from mdp.read import MANY_FACES
from profiles.effect import effect_of_change
from profiles.frozen import Effect
from profiles.profile import Profile

CHANGING_S = 0.2  # of a bench, until it is made ready as it is
_numbers = count(1)  # of the benches of all sessions, whose processes may be the same


class Readiness:
    """preparing: how many benches are made ready now; very large models wait for the first plane. A process knows by its number
    what it has worked out already."""

    def __init__(self, session: SessionBase) -> None:
        self.preparing = 0
        self._session = session
        self._made_of: tuple[object, ...] = (None, None, None)  # the bench of the last number
        self._profile: Profile | None = None
        self._number = self._wanted = 0
        self._model = ""  # key of that of the bench that was made ready last
        self._task: asyncio.Task[None] | None = None
        session.followers.append(self._follow)

    def load(self) -> None:
        """Load what all planes need, while the first model is read."""
        if not self._number:
            self._session.start(self._session.hand.run("load_kernels"))

    async def wait(self) -> None:
        """Return when nothing is made ready any more: what a person waits for less comes then."""
        while self._task is not None and not self._task.done():
            await asyncio.wait((self._task,))

    async def ask(self, task: str, bench: Bench, *given: Any) -> Any:
        """What a task of work.trials says of a bench."""
        return await self._session.hand.run(task, self._number_of(bench), bench, *given)

    def _number_of(self, bench: Bench) -> int:
        made_of = (bench.model and bench.model.key, bench.rotation, bench.zones)
        if any(new is not old for new, old in zip(made_of, self._made_of, strict=True)) or not self._serves(bench.profile):
            self._made_of, self._profile, self._number = made_of, bench.profile, next(_numbers)
        return self._number

    def _serves(self, profile: Profile) -> bool:
        """Whether what was made ready serves another profile: planes read of it what a search does."""
        if profile is self._profile:
            return True
        serves = self._profile is not None and effect_of_change(self._profile, profile) < Effect.REACH
        if serves:
            self._profile = profile
        return serves

    def _follow(self) -> None:
        bench = self._session.bench
        if bench.model is None or bench.model.faces > MANY_FACES or self._number_of(bench) == self._wanted:
            return
        wait_s = CHANGING_S if bench.model.key == self._model else 0.0
        self._wanted, self._model = self._number_of(bench), bench.model.key
        self._task = self._session.start(self._prepare(bench, self._wanted, wait_s))

    async def _prepare(self, bench: Bench, number: int, wait_s: float) -> None:
        """Make a bench ready, unless it changes while it is waited for that."""
        await asyncio.sleep(wait_s)
        if self._wanted != number:
            return
        self.preparing += 1
        self._session.notify()
        try:
            await self._session.hand.run("make_ready", number, bench)
        finally:
            self.preparing -= 1
