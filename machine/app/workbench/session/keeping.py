"""Keeping: what lies on a bench is kept in the state folder a moment after every change."""

import asyncio
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.session.base import SessionBase
from machine.app.workbench.work.kept_work import new_folder, write_work
from machine.app.workbench.work.received import lock_folder
from profiles.errors import UserError, reason

AFTER_S = 1.0  # so that a hand that drags writes once


class Keeping:
    """Of one session, from its event loop."""

    def __init__(self, session: SessionBase) -> None:
        self._session = session
        self._folder: Path | None = None
        self._lock: int | None = None
        self._kept: Bench | None = None
        self._later: asyncio.TimerHandle | None = None
        self._writing = asyncio.Lock()
        self._path: Path | None = None  # of the model that is kept
        self._opening = False
        self._trouble = ""
        session.followers.append(self._follow)
        session.endings.append(self._end)

    @property
    def behind(self) -> bool:
        """Whether a change has not been written, or tried to be, yet."""
        return self._session.bench is not self._kept and self._session.bench.model is not None

    @contextmanager
    def opening(self, folder: Path) -> Iterator[None]:
        """While kept work is put on the bench, nothing is written; then it is kept on in the folder that it comes from."""
        self._opening = True
        try:
            yield
            self._release()
            self._folder, self._lock = folder, lock_folder(folder)
            self._path = None if self._session.bench.model is None else self._session.bench.model.path
        finally:
            self._opening = False
            self._follow()

    def _release(self) -> None:
        """What is kept so far stays as it is, for whoever opens it."""
        if self._lock is not None:
            os.close(self._lock)
        self._folder, self._lock = None, None

    def _follow(self) -> None:
        if self.behind and self._later is None and not self._opening:
            self._later = asyncio.get_running_loop().call_later(AFTER_S, self._begin)

    def _begin(self) -> None:
        self._later = None
        self._session.start(self._keep())

    async def _keep(self) -> None:
        async with self._writing:
            bench = self._session.bench
            if not self.behind or self._opening or bench.model is None:
                return
            trouble = await asyncio.to_thread(self._write, bench)
        self._kept = bench
        if trouble and trouble != self._trouble:  # told once, not with every change
            self._session.add_problem(f"this work cannot be kept for after a crash: {trouble}; Save keeps its plan")
            self._session.notify()
        self._trouble = trouble

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
        return ""

    def _end(self) -> None:
        """The session ends: what has changed a moment ago is kept, too."""
        if self._later is not None:
            self._later.cancel()
            if self.behind:
                self._write(self._session.bench)
        self._release()
