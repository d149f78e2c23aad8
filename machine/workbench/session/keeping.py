"""Keeping: autosave: what lies on a bench is written to the state folder a moment after every change."""

import asyncio
import os
import sys
import weakref
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from machine.crash import bug_in_words
from machine.workbench.bench.bench import Bench
from machine.workbench.session.base import Derived, SessionBase
from machine.workbench.work.folders import new_folder, write_work
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
        self._kept: weakref.ref[Bench] | None = None
        self._write_under_way: asyncio.Task[None] | None = None
        self._path: Path | None = None  # of the model that is kept
        self._opening = False
        self._trouble = ""
        self._reported: tuple[str, Path | None] = "", None  # trouble, and the model that it was reported for
        self._saved = Derived(session, self._unsaved, self._save, start=asyncio.create_task)  # the end of a session waits for it

    @property
    def behind(self) -> bool:
        """Whether a change has not been written, or tried to be, yet."""
        kept = None if self._kept is None else self._kept()
        return self._session.bench is not kept and self._session.bench.model is not None

    def _unsaved(self, bench: Bench) -> weakref.ref[Bench] | None:
        return weakref.ref(bench) if self.behind and not self._opening and not self._session.closed else None

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
            await self._written()
            self._release()
            self._folder, self._lock, lock = folder, lock, None
            self._path = None if self._session.bench.model is None else self._session.bench.model.path
        finally:
            if lock is not None:
                os.close(lock)
            self._opening = False
            self._saved.follow()

    async def finish(self) -> str:
        """Wait for the write under way, and write what is newer; why the last change is not kept, "" where it is.

        The session has ended, so that nothing changes any more. Work that was still being opened stays as it was kept.
        """
        was_opening = self._opening
        self._saved.stop()
        await self._written()
        if not was_opening and self._session.bench.model is not None and (self.behind or self._trouble):  # tried once more
            await self._write_newest()
        self._release()
        return self._trouble

    def _release(self) -> None:
        """What is kept so far stays as it is, for whoever opens it."""
        if self._lock is not None:
            os.close(self._lock)
        self._folder, self._lock = None, None

    async def _save(self, bench: Bench) -> None:
        await asyncio.sleep(AFTER_S)
        await self._written()
        if self.behind and not self._opening:
            await self._write_newest()

    async def _written(self) -> None:
        """Return when no write is under way."""
        if self._write_under_way is not None:
            await asyncio.wait((self._write_under_way,))

    async def _write_newest(self) -> None:
        async def write(bench: Bench) -> None:
            self._trouble = await asyncio.to_thread(self._write, bench)
            self._kept = weakref.ref(bench)
            reported, self._reported = self._reported, (self._trouble, self._path)
            if self._trouble and reported != self._reported:  # once a model, not with every change
                self._session.add_problem(f"this work cannot be kept for after a crash: {self._trouble}; Save > Project keeps it")
                self._session.notify()

        self._write_under_way = asyncio.create_task(write(self._session.bench))  # it outlives who waits for it
        await self._written()

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
            return f"{error}"
        except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench goes on
            return bug_in_words(error, sys.argv)
        return ""
