"""Keeping: autosave: what lies on a bench is written to the state folder a moment after every change."""

import asyncio
import os
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from machine.crash import bug_in_words
from machine.workbench.bench.bench import Bench
from machine.workbench.session.base import SessionBase
from machine.workbench.work.kept_work import new_folder, write_work
from profiles.errors import PlanError, UserError, reason
from profiles.files import lock_folder

AFTER_S = 1.0  # so that a hand that drags writes once
OPEN_ELSEWHERE = "this work is not kept any more, or another page has opened it"


class Keeping:
    """Saves one session, from its event loop. Only one write goes on at a time, in a thread, and it always runs to its end."""

    def __init__(self, session: SessionBase) -> None:
        self._session = session
        self._folder: Path | None = None
        self._lock: int | None = None
        self._kept: Bench | None = None
        self._later: asyncio.TimerHandle | None = None
        self._write_under_way: asyncio.Task[None] | None = None
        self._writing = asyncio.Lock()
        self._path: Path | None = None  # of the model that is kept
        self._opening = False
        self._trouble = ""
        self._reported: tuple[str, Path | None] = "", None  # trouble, and the model that it was reported for
        session.followers.append(self._follow)

    @property
    def behind(self) -> bool:
        """Whether a change has not been written, or tried to be, yet."""
        return self._session.bench is not self._kept and self._session.bench.model is not None

    @asynccontextmanager
    async def opening(self, folder: Path) -> AsyncIterator[None]:
        """While kept work is put on the bench, nothing is written; then it is kept on in the folder that it comes from. Raises
        PlanError when another bench writes there."""
        lock = lock_folder(folder)
        if lock is None:
            raise PlanError(OPEN_ELSEWHERE)
        self._opening = True
        try:
            yield
            async with self._writing:
                self._release()
                self._folder, self._lock, lock = folder, lock, None
                self._path = None if self._session.bench.model is None else self._session.bench.model.path
        finally:
            if lock is not None:
                os.close(lock)
            self._opening = False
            self._follow()

    async def finish(self) -> str:
        """Wait for the write under way, and write what is newer; why the last change is not kept, "" where it is.

        The session has ended, so that nothing changes any more. Work that was still being opened stays as it was kept.
        """
        was_opening = self._opening
        if self._later is not None:
            self._later.cancel()
        async with self._writing:
            if self._trouble:  # tried once more
                self._kept = None
            if not was_opening:
                await self._write_newest()
        self._release()
        return self._trouble

    def _release(self) -> None:
        """What is kept so far stays as it is, for whoever opens it."""
        if self._lock is not None:
            os.close(self._lock)
        self._folder, self._lock = None, None

    def _follow(self) -> None:
        if self.behind and self._later is None and not self._opening and not self._session.closed:
            self._later = asyncio.get_running_loop().call_later(AFTER_S, self._begin)

    def _begin(self) -> None:
        self._later = None
        self._write_under_way = asyncio.create_task(self._keep())  # not a task of the session, which cancels those at its end

    async def _keep(self) -> None:
        async with self._writing:
            if not self._opening:
                await self._write_newest()
            reported, self._reported = self._reported, (self._trouble, self._path)
            if self._trouble and reported != self._reported:  # once a model, not with every change
                self._session.add_problem(f"this work cannot be kept for after a crash: {self._trouble}; Save > Project keeps it")
                self._session.notify()

    async def _write_newest(self) -> None:
        bench = self._session.bench
        if self.behind:
            self._trouble = await asyncio.to_thread(self._write, bench)
            self._kept = bench

    def _write(self, bench: Bench) -> str:
        """Why it could not be written, "" where it is."""
        try:
            if bench.model is not None and bench.model.path != self._path:  # of another model: the last one's stays
                self._release()
                self._path = bench.model.path
            if self._folder is None:
                self._folder = new_folder()
                self._lock = lock_folder(self._folder)
            write_work(self._folder, bench)
        except OSError as error:
            return reason(error)
        except UserError as error:
            return str(error)
        except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench goes on
            return bug_in_words(error, sys.argv)
        return ""
