"""Workbench: the sessions of one run of the program by number, each with its own bench and its own pages."""

import asyncio
from collections.abc import Callable

from machine.workbench.bench.bench import History, Step, emptied
from machine.workbench.session.session import OpenBench, Session
from machine.workbench.work.worker_pool import WorkerPools
from profiles.errors import PlanError

MOST_SESSIONS = 20


class Workbench:
    """sessions: by number, from 1 on; a number is not given again. Each is told what the others are, as soon as that changes.
    pools: of the processes that they share."""

    def __init__(self, make: Callable[[WorkerPools], Session]) -> None:
        self.sessions: dict[int, Session] = {}
        self.pools = WorkerPools()
        self._make = make
        self._closing: dict[int, asyncio.Task[str]] = {}
        self._last = 0

    def open(self, like: Session | None = None) -> int:
        """The number of a new session with an empty bench, its machine and settings those of another. Raises PlanError where
        there are too many."""
        if len(self.sessions) >= MOST_SESSIONS:
            raise PlanError(f"{MOST_SESSIONS} benches are open, which is the most: close one first")
        self._last += 1
        self.sessions[self._last] = session = self._make(self.pools)
        if like is not None:
            session.history = History(Step("", emptied(like.bench)))
        session.listeners.append(self._list_again)
        session.warm()
        self._list_again()
        return self._last

    async def close(self, number: int) -> str:
        """End a session and its work; a sentence where its last change could not be kept, else "". To cancel the waiting does not
        cancel the keeping."""
        self._begin_to_close(number)
        return await asyncio.shield(self._closing[number]) if number in self._closing else ""

    async def close_all(self) -> list[str]:
        """End all of them, and all processes; a sentence for each whose last change could not be kept."""
        for number in list(self.sessions):
            self._begin_to_close(number)
        await asyncio.sleep(0)  # all of them have ended their work
        self.pools.end()
        return [trouble for trouble in await asyncio.gather(*self._closing.values()) if trouble]

    def _begin_to_close(self, number: int) -> None:
        session = self.sessions.pop(number, None)
        if session is not None:
            self._closing[number] = closing = asyncio.create_task(session.close())
            closing.add_done_callback(lambda _: self._closing.pop(number))
            self._list_again()

    def _list_again(self) -> None:
        benches = tuple(_described(number, session) for number, session in self.sessions.items())
        for session in self.sessions.values():
            if session.benches != benches:
                session.benches = benches
                session.notify()


def _described(number: int, session: Session) -> OpenBench:
    bench = session.bench
    work = session.busy or ("finding parts" if session.finding.search else "slicing" if session.slicing.under_way else "")
    return OpenBench(number, "" if bench.model is None else bench.model.name, bench.parts, work)
