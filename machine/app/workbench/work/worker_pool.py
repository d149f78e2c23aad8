"""Worker pool: processes that do the long work of all benches, a bounded number of them, each for one task at a time.

A process stays warm for a while after its task, with what it has worked out for the bench. A task cannot be interrupted, so one
that is cancelled is stopped at once by ending its process.
"""

import asyncio
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

from machine.app.workbench.work.processes import Process, end_process, start_process
from machine.app.workbench.work.worker import DONE, TELLS, frame, read_frame
from profiles.errors import UserError

REST_AFTER_S = 300.0  # without a task, after which a process goes: each holds some 200 MB
COMMAND = (sys.executable, "-m", "machine.app.workbench.work.worker")


@dataclass(eq=False)
class Worker:
    """A process, the tasks that it was taken for last, None when it is ended, and what will end it when it has rested."""

    process: Process
    tasks: "TaskQueue | None"
    end: asyncio.TimerHandle | None = None


class WorkerPool:
    """At most so many processes. All from the event loop."""

    def __init__(self, most: int) -> None:
        self.most = most
        self._places = asyncio.Semaphore(most)
        self._starting = 0
        self._busy: list[Worker] = []
        self._idle: list[Worker] = []  # the one that has rested longest first

    @property
    def full(self) -> bool:
        """Whether a further task has to wait for another one's end."""
        return self._places.locked()

    async def warm(self, tasks: "TaskQueue") -> None:
        """Start a process for these tasks before it is needed, if there may be one more."""
        if self._may_start:
            async with self.worker(tasks):
                pass

    @asynccontextmanager
    async def worker(self, tasks: "TaskQueue") -> AsyncIterator[Process]:
        """A process for one of these tasks, in the order in which they are asked for. Whoever leaves with an error ends it."""
        async with self._places:
            tasks.check_open()
            worker = await self._take(tasks)
            self._busy.append(worker)
            try:
                tasks.check_open()
                yield worker.process
            except BaseException:
                end_process(worker.process)
                raise
            else:
                if worker.tasks is not None:
                    worker.end = asyncio.get_running_loop().call_later(REST_AFTER_S, self._end, worker)
                    self._idle.append(worker)
            finally:
                self._busy.remove(worker)

    def end(self, tasks: "TaskQueue | None" = None) -> None:
        """End the processes that work for these tasks, or may hold what was worked out for them; None: all."""
        for worker in (*self._busy, *self._idle):
            if tasks is None or worker.tasks is tasks:
                self._end(worker)

    @property
    def _may_start(self) -> bool:
        return len(self._idle) + len(self._busy) + self._starting < self.most

    async def _take(self, tasks: "TaskQueue") -> Worker:
        """The process that these tasks had last, else a new one, else the one that has rested longest."""
        self._idle = [worker for worker in self._idle if worker.process.returncode is None]
        own = [worker for worker in self._idle if worker.tasks is tasks]
        if not own and self._may_start:
            self._starting += 1
            try:
                return Worker(await start_process(COMMAND), tasks)
            finally:
                self._starting -= 1
        worker = (own or self._idle)[0]
        self._idle.remove(worker)
        if worker.end is not None:
            worker.end.cancel()
        worker.tasks = tasks
        return worker

    def _end(self, worker: Worker) -> None:
        worker.tasks = None
        end_process(worker.process)
        if worker in self._idle:
            self._idle.remove(worker)


class WorkerPools:
    """Those of one run of the program. quick: for what a person waits for; long: for searches and slices; hand: for planes in
    hand and a model that is turned; its processes keep what they have worked out for planes on the bench."""

    def __init__(self) -> None:
        self.quick, self.long, self.hand = WorkerPool(3), WorkerPool(2), WorkerPool(3)

    def end(self) -> None:
        """End all processes."""
        for pool in (self.quick, self.long, self.hand):
            pool.end()


class TaskQueue:
    """The tasks of one session in a pool, one after the other."""

    def __init__(self, pool: WorkerPool) -> None:
        self.pool = pool
        self._lock = asyncio.Lock()
        self._closed = False

    async def warm(self) -> None:
        """Start a process before it is needed."""
        async with self._lock:
            await self.pool.warm(self)

    async def run(self, task: str, *given: Any, tell: Callable[[Any], None] = lambda value: None) -> Any:
        """What a task gives. Raises UserError with its sentence; a task that is cancelled is stopped at once."""
        try:
            async with self._lock, self.pool.worker(self) as process:
                kind, value = await _answer(process, (task, given), tell)
        except (asyncio.IncompleteReadError, ConnectionError):
            raise UserError("the process that did this work has ended before it was done: try it again") from None
        if kind != DONE:
            raise UserError(value)
        return value

    def check_open(self) -> None:
        """Raises UserError when its session is closed."""
        if self._closed:
            raise UserError("this bench is closed: nothing is worked out for it any more")

    def close(self) -> None:
        """End the processes that work for it or hold anything of it; whatever still waits for one is refused."""
        self._closed = True
        self.pool.end(self)


async def _answer(process: Process, asked: Any, tell: Callable[[Any], None]) -> tuple[str, Any]:
    """The last word of a process to what it is asked; what it tells meanwhile is passed on."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(frame(asked))
    await process.stdin.drain()
    while True:
        kind, value = await read_frame(process.stdout)
        if kind != TELLS:
            return kind, value
        tell(value)
