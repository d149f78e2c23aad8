"""Cluster: the searches of a collection as tasks of dask.distributed, on this machine's cores or on a scheduler's workers."""

import logging
import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from typing import Any, TypeVar

import dask
from distributed import CancelledError, Client, Future, LocalCluster, as_completed
from distributed.system import MEMORY_LIMIT

from profiles.errors import LearningError

REACHED_WITHIN_S = 10.0  # a scheduler that is there, also by a slow network
POLL_S = 0.1  # Ctrl-C is answered within that
CLOSED_WITHIN_S = 1.0  # a scheduler that is gone does not answer the goodbye either

Key = TypeVar("Key")


@dataclass(frozen=True)
class Workers:
    """Where searches run. scheduler: address of one that is there, None for this machine; count: processes on this machine."""

    scheduler: str | None
    count: int
    retries: int


@contextmanager
def connected(workers: Workers) -> Iterator[Client]:
    """A client of the scheduler or of processes of our own, which are gone at the end, whatever ends it.

    Raises LearningError when the scheduler cannot be reached.
    """
    for name in ("distributed", "tornado", "asyncio", *logging.root.manager.loggerDict):
        if name.startswith(("distributed", "tornado", "asyncio")):  # what goes wrong is told in our own words
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    settings = {
        "distributed.scheduler.allowed-failures": workers.retries,
        "distributed.scheduler.worker-saturation": 1.0,  # what waits on a worker that dies would be blamed, too
        "distributed.comm.timeouts.connect": REACHED_WITHIN_S,
    }
    with dask.config.set(settings):
        # Threads and processes that begin now never hear of Ctrl-C: we alone do, and end them. (Were the tracker to begin among
        # them, it would let them hear again.)
        resource_tracker.ensure_running()
        heard = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            client = _own(workers.count) if workers.scheduler is None else _joined(workers.scheduler)
        except BaseException:
            signal.pthread_sigmask(signal.SIG_SETMASK, heard)
            raise
        try:
            signal.pthread_sigmask(signal.SIG_SETMASK, heard)  # one that came meanwhile is raised here
            yield client
        except BaseException:
            _stop_at_once(client)
            raise
        finally:
            _leave(client)


def _own(count: int) -> Client:
    cluster = LocalCluster(
        n_workers=count,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",  # any free port: other clusters may be running here
        memory_limit=MEMORY_LIMIT // count,
        silence_logs=logging.CRITICAL,
    )
    return Client(cluster)


def _joined(address: str) -> Client:
    try:
        return Client(address, timeout=REACHED_WITHIN_S)
    except (OSError, TimeoutError, ValueError) as error:
        raise LearningError(f"scheduler {address}: cannot be reached ({error})") from None


def _stop_at_once(client: Client) -> None:
    """Kill processes of our own: a search that runs would be waited for."""
    nannies = [] if client.cluster is None else list(client.cluster.workers.values())
    for nanny in nannies:
        nanny.auto_restart = False
        if nanny.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(nanny.pid, signal.SIGKILL)


def _leave(client: Client) -> None:
    """Close a client, and the scheduler and workers that are our own."""
    for closing in (client, client.cluster):
        if closing is not None:
            with suppress(Exception):  # what does not answer any more need not be told
                closing.close(timeout=CLOSED_WITHIN_S)


def completed(
    client: Client, task: Callable[..., Any], calls: Mapping[Key, tuple[Any, ...]], retries: int, on_wait: Callable[[], None]
) -> Iterator[tuple[Key, Any]]:
    """The key and the result of every call as it is done, the first calls first; the exception where a call failed for good.

    on_wait: called some times a second. Raises LearningError when the scheduler is lost.
    """
    futures: dict[Future, Key] = {
        client.submit(task, *arguments, pure=False, retries=retries, priority=-number): key
        for number, (key, arguments) in enumerate(calls.items())
    }
    waiting = as_completed(list(futures))
    while futures:
        on_wait()
        for future in waiting.next_batch(block=False):
            if future.status in ("finished", "error"):
                yield futures.pop(future), _outcome(client, future)
                future.release()
        if client.status != "running" or any(future.status in ("cancelled", "lost") for future in list(futures)[:1]):
            raise _lost(client)
        time.sleep(POLL_S)


def _outcome(client: Client, future: Future) -> Any:
    """What a call returned or raised."""
    try:
        return future.result() if future.status == "finished" else future.exception()
    except (CancelledError, OSError):  # the connection broke between the end of the call and its result
        raise _lost(client) from None


def _lost(client: Client) -> LearningError:
    return LearningError(f"scheduler {_address(client)}: is gone; started again, the collection goes on where it stopped")


def _address(client: Client) -> str:
    scheduler = client.scheduler
    return "of this machine" if client.cluster is not None or scheduler is None else str(scheduler.address)
