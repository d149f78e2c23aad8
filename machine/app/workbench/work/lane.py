"""Lane: tasks one after the other in a process that stays warm for a while; stopping one ends the process, the next one starts
another."""

import asyncio
import pickle
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from machine.app.workbench.work.processes import Process, end_process, start_process
from machine.app.workbench.work.worker import DONE, LENGTH, TELLS, frame
from profiles.errors import UserError

REST_AFTER_S = 300.0  # without a task, after which the process goes: each holds some 200 MB
COMMAND = (sys.executable, "-m", "machine.app.workbench.work.worker")


class Lane:
    """One process for one task at a time. All methods from the event loop."""

    def __init__(self) -> None:
        self._process: Process | None = None
        self._free = asyncio.Lock()
        self._resting: asyncio.TimerHandle | None = None
        self._closed = False

    async def warm(self) -> None:
        """Start the process before it is needed."""
        async with self._held():
            pass

    async def run(self, task: str, *given: Any, tell: Callable[[Any], None] = lambda value: None) -> Any:
        """What a task gives. Raises UserError with its sentence; a task that is cancelled is stopped at once."""
        async with self._held() as process:
            try:
                return await self._ask(process, (task, given), tell)
            except (asyncio.IncompleteReadError, ConnectionError):
                self.stop()
                raise UserError("the process that did this work has ended before it was done: try it again") from None
            except asyncio.CancelledError:
                self.stop()
                raise

    def close(self) -> None:
        """End the process for good: whatever still waits for it is refused."""
        self._closed = True
        self.stop()
        if self._resting is not None:
            self._resting.cancel()

    def stop(self) -> None:
        """End the process and all that it has started."""
        process, self._process = self._process, None
        end_process(process)

    @asynccontextmanager
    async def _held(self) -> AsyncIterator[Process]:
        """The process for one task; when none has followed for a while, it goes."""
        async with self._free:
            if self._resting is not None:
                self._resting.cancel()
            try:
                yield await self._ready()
            finally:
                if not self._closed:
                    self._resting = asyncio.get_running_loop().call_later(REST_AFTER_S, self.stop)

    async def _ready(self) -> Process:
        if self._closed:
            raise UserError("this bench is closed: nothing is worked out for it any more")
        if self._process is None or self._process.returncode is not None:
            self._process = await start_process(COMMAND)
        return self._process

    async def _ask(self, process: Process, asked: Any, tell: Callable[[Any], None]) -> Any:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(frame(asked))
        await process.stdin.drain()
        while True:
            (length,) = LENGTH.unpack(await process.stdout.readexactly(LENGTH.size))
            kind, value = pickle.loads(await process.stdout.readexactly(length))
            if kind == TELLS:
                tell(value)
            elif kind == DONE:
                return value
            else:
                raise UserError(value)
