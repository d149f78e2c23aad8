"""Threads: a kernel's rows on all cores, and search nodes evaluated while others are cut.

Our threads wait for each other without spinning, Ctrl-C reaches the calling thread, and kernels that are not parallel themselves
compile in half the time. Results do not depend on the number of threads.
"""

import os
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
LEAST_ROWS, SHARES = 4, 8  # rows per call, and calls per core: handing over a call costs as much as a row

Result = TypeVar("Result")

HARMLESS = "harmless"  # attribute that marks such threads
POOLS = "ahead", "sweep"  # name prefixes of our pools' threads

_pools: dict[tuple[str, int], ThreadPoolExecutor] = {}


def use_threads(count: int) -> None:
    """Set the number of threads, for a process that is one of many on its machine."""
    global THREADS  # one number for the process, as for the cores
    THREADS = count


def _pool(name: str) -> ThreadPoolExecutor:
    return _pools.setdefault((name, THREADS), ThreadPoolExecutor(THREADS, thread_name_prefix=name))


def in_threads(kernel: Callable[..., None], count: int, *arguments: Any) -> None:
    """Run a kernel over `count` rows in spans on all cores; each row is written by one call alone."""
    rows = max(LEAST_ROWS, count // (SHARES * THREADS))
    spans = [(row, min(row + rows, count)) for row in range(0, count, rows)]
    threads = min(THREADS, len(spans))
    if threads < 2:
        kernel(0, count, *arguments)
        return
    for done in [_pool("sweep").submit(kernel, begin, end, *arguments) for begin, end in spans]:
        done.result()


def ahead(work: Callable[..., Result], *arguments: Any) -> Future[Result]:
    """Start a task in a background thread. It may run kernels in threads, but must not wait for another such task."""
    return _pool("ahead").submit(work, *arguments)


def harmless(thread: threading.Thread) -> threading.Thread:
    """Mark a thread during which this process may be forked: it imports nothing and holds no lock that a copy needs. Most such
    threads wait for messages from a pipe and pass them on.
    """
    setattr(thread, HARMLESS, True)  # on the thread itself: a set could grow during iteration
    return thread


def come_to_rest() -> bool:
    """Whether this process can be forked here: by the main thread, if all others are harmless. Our pools finish their tasks and
    are shut down; the next task starts new ones.
    """
    main = threading.main_thread()
    others = [thread for thread in threading.enumerate() if thread is not main and not hasattr(thread, HARMLESS)]
    if threading.current_thread() is not main or any(thread.name.rpartition("_")[0] not in POOLS for thread in others):
        return False
    while _pools:
        _pools.pop(min(_pools)).shutdown()  # those for tasks ahead first, since these use the other pools
    return True
