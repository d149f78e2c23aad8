"""Pool: many calls worked off at a time, in processes of this machine or on the workers of a dask scheduler.

Either way a call runs in a process of its own, so that one that kills its process or takes too long harms no other. A dask worker
that is lost loses nothing: the scheduler hands what it had to others, and gives up what several were lost over.
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

REACHED_WITHIN_S = 10.0  # a scheduler that is there, also by a slow network
POLL_S = 0.1  # Ctrl-C is answered within that
IDLE_S = 60.0  # then a process gives its memory back
CLOSED_WITHIN_S = 1.0  # a scheduler that is gone does not answer the goodbye either

Key = TypeVar("Key")


@dataclass(frozen=True)
class Workers:
    """Where calls run. scheduler: address of one that is there, None for this machine; count: processes on this machine;
    retries: how often a call whose process was killed is tried again; limit_s: how long a call may take; folders: that workers
    must see."""

    scheduler: str | None
    count: int
    retries: int
    limit_s: float | None = None
    folders: tuple[Path, ...] = ()


@dataclass(frozen=True)
class Pool:
    """Processes that work calls off. submit: gives the future of a task with its arguments, as concurrent.futures and dask have
    it, lower numbers first; is_there: whether there will be more results; lost: why not, where there will be none."""

    submit: Callable[[Callable[..., Any], tuple[Any, ...], int], Any]
    is_there: Callable[[], bool]
    lost: str

    def completed(
        self, task: Callable[..., Any], calls: Mapping[Key, tuple[Any, ...]], on_wait: Callable[[], None]
    ) -> Iterator[tuple[Key, Any]]:
        """The key and the result of every call as it is done, the first calls first; a CallError where a call failed for good.

        on_wait: called some times a second. Raises UserError when the scheduler is lost.
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
        """What a call returned, or the CallError that it came to."""
        if future.cancelled():
            raise UserError(self.lost)
        try:
            return future.result()
        except CallError as error:
            return error
        except Exception as error:  # noqa: BLE001 - whatever a cluster says of what it could not do
            if not self.is_there():
                raise UserError(self.lost) from None
            return CallError(f"its workers were lost ({type(error).__name__})")


class Isolation:
    """For every thread that calls a process of its own on one core, which stays for the next call; all end together."""

    def __init__(self) -> None:
        self._of_threads: dict[int, Worker] = {}
        self._ended = False

    def call(self, task: Callable[..., Any], arguments: tuple[Any, ...], retries: int = 0, limit_s: float | None = None) -> Any:
        """What the task returns. task: of a module; retries: how often a call whose process was killed is tried again; limit_s:
        seconds after which a call is given up.

        Raises CallError for what the task raises, too.
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
        """Kill all processes, whatever they do."""
        self._ended = True
        for worker in list(self._of_threads.values()):  # who adds one meanwhile looks then whether all have ended
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
    """What works calls off; processes of our own are gone at the end, whatever ends it.

    Raises UserError when the scheduler cannot be reached, or where its workers cannot work.
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


_on_worker = Isolation()  # of all threads of a dask worker


def call_on_worker(*call: Any) -> Any:
    """In a dask worker: what a call returns."""
    return _on_worker.call(*call)


@contextmanager
def _on_cluster(workers: Workers, address: str) -> Iterator[Pool]:
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise UserError("a scheduler needs dask, which is not installed: pip install 'tiltprint[batch]'") from None
    for name in ("distributed", "tornado", "asyncio", *logging.root.manager.loggerDict):
        if name.startswith(("distributed", "tornado", "asyncio")):  # what goes wrong is told in our own words
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        client = Client(address, timeout=REACHED_WITHIN_S)
    except (OSError, TimeoutError, ValueError) as error:
        raise UserError(f"scheduler {address}: cannot be reached ({error})") from None

    def submit(task: Callable[..., Any], arguments: tuple[Any, ...], number: int) -> Any:
        call = (task, arguments, workers.retries, workers.limit_s)
        return client.submit(call_on_worker, *call, pure=False, priority=-number)

    lost = f"scheduler {address}: is gone; started again, the work goes on where it stopped"
    try:
        for worker, missing in client.run(folders_missing, workers.folders, on_error="return").items():
            if missing:
                raise UserError(f"worker {worker} of scheduler {address} cannot work: {_in_words(missing)}")
        yield Pool(submit, lambda: bool(client.status == "running"), lost)
    finally:
        with suppress(Exception):  # what does not answer any more need not be told
            client.close(timeout=CLOSED_WITHIN_S)


def folders_missing(folders: tuple[Path, ...]) -> list[str]:
    """The folders that this machine does not see."""
    return [str(folder) for folder in folders if not folder.is_dir()]


def _in_words(missing: Any) -> str:
    if isinstance(missing, ModuleNotFoundError):
        return f"tiltprint is not installed there ({missing})"
    return f"it does not see {', '.join(missing)}" if isinstance(missing, list) else str(missing)
