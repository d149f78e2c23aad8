"""Pool of processes that run many calls in parallel, on this machine or on the workers of a dask scheduler.

Each call runs in its own process, so a call that crashes or takes too long affects no other. A lost dask worker loses no work:
the scheduler passes its calls to other workers, and gives up a call after several workers were lost while they ran it.
"""

import logging
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from mdp.kernels.workers import CallError, KilledError, Worker
from profiles.errors import UserError

REACHED_WITHIN_S = 10.0  # long enough for a running scheduler on a slow network
POLL_S = 0.1  # longest delay before Ctrl-C takes effect
IDLE_S = 60.0  # after that an idle process is stopped to free its memory
CLOSED_WITHIN_S = 1.0  # a scheduler that has stopped does not answer the close request either

Key = TypeVar("Key")


@dataclass(frozen=True)
class Workers:
    """Where calls run. scheduler: address of a running dask scheduler, None for this machine; count: processes on this machine;
    retries: how often a call is repeated after its process was killed; limit_s: timeout of a call; folders: folders that every
    worker must be able to see.
    """

    scheduler: str | None
    count: int
    retries: int
    limit_s: float | None = None
    folders: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Pool:
    """Processes that run calls. submit: returns the future of a task with its arguments, as in concurrent.futures and dask; calls
    with lower numbers start first; is_there: whether more results can arrive; lost: error message when they cannot.
    """

    submit: Callable[[Callable[..., Any], tuple[Any, ...], int], Any]
    is_there: Callable[[], bool]
    lost: str

    def completed(
        self, task: Callable[..., Any], calls: Mapping[Key, tuple[Any, ...]], on_wait: Callable[[], None]
    ) -> Iterator[tuple[Key, Any]]:
        """Yields the key and the result of every call as it completes; calls start in the given order. The result is a CallError
        where a call finally failed.

        on_wait: called several times a second. Raises UserError when the connection to the scheduler is lost.
        """
        done: SimpleQueue[Any] = SimpleQueue()
        futures: dict[Any, Key] = {}
        for number, (key, arguments) in enumerate(calls.items()):
            future = self.submit(task, arguments, number)
            futures[future] = key
            future.add_done_callback(done.put)
        while futures:
            on_wait()
            try:
                future = done.get(timeout=POLL_S)
            except Empty:
                if not self.is_there():
                    raise UserError(self.lost) from None
                continue
            yield futures.pop(future), self._outcome(future)

    def _outcome(self, future: Any) -> Any:
        """The result of a call, or the CallError with which it failed."""
        if future.cancelled():
            raise UserError(self.lost)
        try:
            return future.result()
        except CallError as error:
            return error
        except Exception as error:  # noqa: BLE001 - any exception with which a cluster reports a failure
            if not self.is_there():
                raise UserError(self.lost) from None
            return CallError(f"its workers were lost ({type(error).__name__})")


class Isolation:
    """One worker process on one core for each calling thread, reused by the thread's next call; all of them end together."""

    def __init__(self) -> None:
        self._of_threads: dict[int, Worker] = {}
        self._ended = False

    def call(self, task: Callable[..., Any], arguments: tuple[Any, ...], retries: int = 0, limit_s: float | None = None) -> Any:
        """The task's return value. task: a module-level function; retries: how often a call is repeated after its process was
        killed; limit_s: timeout of the call, s.

        Raises CallError, also for exceptions of the task.
        """
        attempts = 0
        while not self._ended:
            try:
                return self._own().call(task, *arguments, limit_s=limit_s)
            except KilledError as error:
                attempts += 1
                if attempts > retries:
                    raise KilledError(f"{error}, {attempts} times" if retries else str(error)) from None
        raise KilledError("it was ended with all others")

    def end(self) -> None:
        """Kill all processes, whatever they are doing."""
        self._ended = True
        for worker in list(self._of_threads.values()):  # a thread that adds a worker meanwhile checks `_ended` afterwards
            worker.end()

    def _own(self) -> Worker:
        worker = self._of_threads.get(threading.get_ident())
        if worker is None or not worker.ready:
            if worker is not None:
                worker.end()
            worker = self._of_threads[threading.get_ident()] = Worker(one_core=True, idle_s=IDLE_S)
            if self._ended:
                worker.end()
        return worker


@contextmanager
def connected(workers: Workers) -> Iterator[Pool]:
    """Open the pool on which calls run; local processes are ended on exit, also after an exception.

    Raises UserError when the scheduler cannot be reached, or its workers cannot run the calls.
    """
    if workers.scheduler is not None:
        with _on_cluster(workers, workers.scheduler) as pool:
            yield pool
        return
    isolation, executor = Isolation(), ThreadPoolExecutor(workers.count, thread_name_prefix="batch")

    def submit(task: Callable[..., Any], arguments: tuple[Any, ...], number: int) -> Any:
        return executor.submit(isolation.call, task, arguments, workers.retries, workers.limit_s)

    try:
        yield Pool(submit, lambda: True, "the work was stopped")
    finally:
        isolation.end()
        executor.shutdown(cancel_futures=True)


_on_worker = Isolation()  # shared by all threads of a dask worker process


def call_on_worker(*call: Any) -> Any:
    """Run a call inside a dask worker and return its result."""
    return _on_worker.call(*call)


@contextmanager
def _on_cluster(workers: Workers, address: str) -> Iterator[Pool]:
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise UserError("a scheduler needs dask, which is not installed: pip install 'tiltprint[batch]'") from None
    for name in ("distributed", "tornado", "asyncio", *logging.root.manager.loggerDict):
        if name.startswith(("distributed", "tornado", "asyncio")):  # failures are reported by our own messages
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        client = Client(address, timeout=REACHED_WITHIN_S)
    except (OSError, TimeoutError, ValueError) as error:
        raise UserError(f"scheduler {address} cannot be reached ({error})") from None

    def submit(task: Callable[..., Any], arguments: tuple[Any, ...], number: int) -> Any:
        call = (task, arguments, workers.retries, workers.limit_s)
        return client.submit(call_on_worker, *call, pure=False, priority=-number)

    lost = f"scheduler {address} is gone; started again, the work continues where it stopped"
    try:
        for worker, missing in client.run(folders_missing, workers.folders, on_error="return").items():
            if missing:
                raise UserError(f"worker {worker} of scheduler {address} cannot work: {_in_words(missing)}")
        yield Pool(submit, lambda: bool(client.status == "running"), lost)
    finally:
        with suppress(Exception):  # a scheduler that does not answer needs no goodbye
            client.close(timeout=CLOSED_WITHIN_S)


def folders_missing(folders: tuple[Path, ...]) -> list[str]:
    """The folders that do not exist on this machine."""
    return [str(folder) for folder in folders if not folder.is_dir()]


def _in_words(missing: Any) -> str:
    if isinstance(missing, ModuleNotFoundError):
        return f"tiltprint is not installed there ({missing})"
    return f"it does not see {', '.join(missing)}" if isinstance(missing, list) else str(missing)
