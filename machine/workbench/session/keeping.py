"""Autosave: writes a bench to the state folder shortly after every change."""

import asyncio
import os
import sys
import weakref
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

from machine.crash import bug_in_words
from machine.workbench.bench.bench import Bench
from machine.workbench.session.base import SessionBase
from machine.workbench.work.folders import new_folder, write_work
from profiles.errors import PlanError, UserError, reason
from profiles.files import lock_folder

AFTER_S = 1.0  # so that dragging causes one write
Plate = tuple[Path, int | None]  # a model's file, and its plate in that
OPEN_ELSEWHERE = "this work is no longer kept, or another page has opened it"


class Keeping:
    """Saves one session, from its event loop. Writes run one at a time in a thread, and are never cancelled."""

    def __init__(self, session: SessionBase) -> None:
        self._session = session
        self._folder: Path | None = None
        self._lock: int | None = None
        self._kept: weakref.ref[Bench] | None = None
        self._saving: asyncio.Task[None] | None = None
        self._writing, self._ended = asyncio.Lock(), asyncio.Event()
        self._work: frozenset[Plate] = frozenset()  # files and plates of the saved models, which identify their work
        self.released = 0  # how often work of this session became earlier work, or was opened again
        self._opening = False
        self._trouble = ""
        self._reported: tuple[str, object] = "", None  # error, and the work for which it was reported
        session.followers.append(self._follow)

    @property
    def behind(self) -> bool:
        """Whether there is a change that no write has attempted to save; an empty bench leaves its folder."""
        kept = None if self._kept is None else self._kept()
        return self._session.bench is not kept and (self._session.bench.model is not None or self._folder is not None)

    def _follow(self) -> None:
        """Schedule a write after a change."""
        if self._saving is None and self.behind and not self._opening and not self._session.closed:
            self._saving = asyncio.create_task(self._save())

    async def _save(self) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self._ended.wait(), AFTER_S)
        if self.behind and not self._opening:
            await self._write_newest()
        self._saving = None
        self._follow()

    @asynccontextmanager
    async def opening(self, folder: Path) -> AsyncIterator[None]:
        """Suspend writes while saved work is opened, then continue saving in its folder. Raises PlanError if another bench writes
        there."""
        lock = lock_folder(folder)
        if lock is None:
            raise PlanError(OPEN_ELSEWHERE)
        self._opening = True
        try:
            yield
            async with self._writing:
                self._release()
            self._folder, self._lock, lock = folder, lock, None
            self._work = _identity(self._session.bench)
        finally:
            if lock is not None:
                os.close(lock)
            self._opening = False
            self._follow()

    async def finish(self) -> str:
        """Finish the running write, and save newer changes; returns why the last change is not saved, or "".

        The session has ended, so nothing changes. If work was just being opened, its saved state stays.
        """
        was_opening = self._opening
        self._ended.set()
        if self._saving is not None:
            await self._saving
        if not was_opening and self._session.bench.model is not None and (self.behind or self._trouble):  # retry once
            await self._write_newest()
        self._release()
        return self._trouble

    async def put_away(self) -> str:
        """Keep the bench as earlier work; later changes are kept elsewhere. Returns a sentence about that, "" if the bench has no
        work worth keeping, or it could not be kept."""
        bench = self._session.bench
        if not bench.worked_on or bench.model is None:
            return ""
        if self.behind:
            await self._write_newest()
        if self._trouble:
            return ""
        async with self._writing:
            self._release()
            self._work = frozenset()
        cut = f", cut into {bench.parts} parts," if bench.parts > 1 else ""
        return f"{bench.model.name}{cut} is kept under Earlier work (Undo brings it back)"

    def _release(self) -> None:
        """Release the folder, so that its work can be opened elsewhere."""
        self.released += 1
        if self._lock is not None:
            os.close(self._lock)
        self._folder, self._lock = None, None

    async def _write_newest(self) -> None:
        async with self._writing:
            bench, released = self._session.bench, self.released
            self._trouble = await asyncio.to_thread(self._write, bench)
            self._kept = weakref.ref(bench)
        reported, self._reported = self._reported, (self._trouble, self._work)
        told = bool(self._trouble) and reported != self._reported  # once per model, not at every change
        if told:
            self._session.add_problem(f"this work cannot be kept for after a crash: {self._trouble}; Save > Project keeps it")
        if told or released != self.released:
            self._session.notify()

    def _write(self, bench: Bench) -> str:
        """Write a bench; returns why that failed, or ""."""
        try:
            models = _identity(bench)
            if models.isdisjoint(self._work):  # other models, or none: the save of the previous ones stays
                self._release()
            self._work = models
            if bench.model is None:
                return ""
            if self._folder is None:
                self._folder = new_folder()
                self._lock = lock_folder(self._folder)
            write_work(self._folder, bench)
        except OSError as error:
            return reason(error)
        except UserError as error:
            return f"{error}"
        except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench continues
            return bug_in_words(error, sys.argv)
        return ""


def _identity(bench: Bench) -> frozenset[Plate]:
    """The file and the plate of each of the bench's models."""
    return frozenset((each.model.path, each.model.plate) for each in bench.plate if each.model is not None)
