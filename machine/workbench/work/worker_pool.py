"""Worker pool: a bounded number of processes for the long tasks of all benches, one task at a time each.

A task is a function of this room whose first argument `tell()` reports progress; values are pickled. A process stays warm for a
while after its task, with its cache for the bench. A task cannot be interrupted, so a cancelled one is stopped by ending its
process.
"""

import asyncio
import sys
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Iterator
from contextlib import aclosing, asynccontextmanager, suppress
from importlib import import_module
from threading import Thread
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from machine.crash import bug_in_words
from mdp.kernels.workers import CallError, KilledError, Tell, Worker, tell
from profiles.errors import CutError, UserError

CLOSED = "this bench is closed: nothing is computed for it any longer"
REST_AFTER_S = 300.0  # idle time after which a process ends: each holds some 200 MB
Value = TypeVar("Value")
TASKS = "cutting", "models", "plate", "slices"  # modules of this room with tasks


async def heard(values: Iterator[Value]) -> AsyncGenerator[Value, None]:
    """Yield the values of a blocking iterator in an event loop, and raise its error. A daemon thread waits for it, which blocks
    neither the loop's nor the program's end; a caller that leaves early must end the process."""
    loop, coming = asyncio.get_running_loop(), asyncio.Queue[tuple[Value] | Exception | None]()

    def hear() -> None:
        with suppress(RuntimeError):  # the loop is closed
            try:
                for value in values:
                    loop.call_soon_threadsafe(coming.put_nowait, (value,))
            except Exception as error:  # noqa: BLE001 - raised again in the loop
                loop.call_soon_threadsafe(coming.put_nowait, error)
            else:
                loop.call_soon_threadsafe(coming.put_nowait, None)

    Thread(target=hear, name="heard", daemon=True).start()
    while (came := await coming.get()) is not None:
        if isinstance(came, Exception):
            raise came
        yield came[0]


class WorkerPool:
    """At most `most` processes; used from one event loop."""

    def __init__(self, most: int) -> None:
        self.most = most
        self._places = asyncio.Semaphore(most)
        self._busy: list[Worker] = []
        self._idle: list[Worker] = []  # longest idle first
        self._had_by: WeakKeyDictionary[Worker, TaskQueue] = WeakKeyDictionary()  # the last user of each

    @property
    def full(self) -> bool:
        """Whether a further task must wait."""
        return self._places.locked()

    @property
    def may_start(self) -> bool:
        return len(self._busy) + sum(worker.ready for worker in self._idle) < self.most

    @asynccontextmanager
    async def worker(self, tasks: "TaskQueue") -> AsyncIterator[Worker]:
        """A process for one of these tasks, in the order of requests. An error in the block ends it."""
        async with self._places:
            if tasks.closed:
                raise UserError(CLOSED)
            worker = self._take(tasks)
            self._busy.append(worker)
            try:
                yield worker
            except BaseException:
                worker.end()
                raise
            else:
                self._idle.append(worker)
            finally:
                self._busy.remove(worker)

    def end(self, tasks: "TaskQueue | None" = None) -> None:
        """End the processes that work for these tasks, or may cache their data; None: all."""
        for worker in (*self._busy, *self._idle):
            if tasks is None or self._had_by[worker] is tasks:
                worker.end()

    def _take(self, tasks: "TaskQueue") -> Worker:
        """The process that these tasks used last, else a new one, else the one that has been idle longest."""
        for worker in [worker for worker in self._idle if not worker.ready]:
            self._idle.remove(worker)
            worker.end()
        own = [worker for worker in self._idle if self._had_by[worker] is tasks]
        if own or not self.may_start:
            worker = (own or self._idle)[0]
            self._idle.remove(worker)
        else:
            worker = Worker(idle_s=REST_AFTER_S)
        self._had_by[worker] = tasks
        return worker


class WorkerPools:
    """The pools of one run of the program. quick: interactive tasks; long: searches and slices; hand: dragged planes and turned
    models, whose processes cache the preparation of the bench."""

    def __init__(self) -> None:
        self.quick, self.long, self.hand = WorkerPool(3), WorkerPool(2), WorkerPool(3)

    def end(self) -> None:
        for pool in (self.quick, self.long, self.hand):
            pool.end()


class TaskQueue:
    """The tasks of one session in a pool, executed one after the other."""

    def __init__(self, pool: WorkerPool) -> None:
        self.pool = pool
        self._lock = asyncio.Lock()
        self.closed = False

    async def warm(self) -> None:
        """Start a process ahead of use, if another one may be started."""
        async with self._lock:
            if self.pool.may_start:
                with suppress(CallError):  # the next caller gets the error
                    await self._ask(load)

    async def run(self, task: Callable[..., Value], *given: Any, tell: Tell = lambda value: None) -> Value:
        """Run a task and return its result. Raises UserError with its message, CutError as it is; a cancelled task is stopped at
        once."""
        try:
            async with self._lock:
                value, trouble = await self._ask(do, task, *given, tell=tell)
        except KilledError:
            raise UserError("the process that did this work has ended before it was done: try it again") from None
        if trouble is not None:
            raise trouble
        result: Value = value
        return result

    def close(self) -> None:
        """End the processes that work for it or cache its data; waiting tasks are refused."""
        self.closed = True
        self.pool.end(self)

    async def _ask(self, task: Callable[..., Any], *given: Any, tell: Tell = lambda value: None) -> Any:
        async with self.pool.worker(self) as worker, aclosing(heard(worker.ask(task, *given))) as answers:
            async for done, value in answers:
                if not done:
                    tell(value)
            return value


def load() -> None:
    """In a worker: import all modules with tasks."""
    for name in TASKS:
        import_module(f"machine.workbench.work.{name}")


def do(task: Callable[..., Value], *given: Any) -> tuple[Value | None, UserError | None]:
    """In a worker: run a task; returns its result and the error because of which there is none; a bug gets a log file."""
    try:
        return task(tell, *given), None
    except CutError as error:  # sessions continue without what cannot be cut
        return None, error
    except UserError as error:
        return None, UserError(f"{error}")
    except Exception as error:  # noqa: BLE001 - a bug becomes a sentence, and the workbench continues
        return None, UserError(bug_in_words(error, sys.argv))
