"""Threads: the rows of a kernel on all cores, and the nodes of a search evaluated while others are cut.

Threads of our own wait for each other without spinning, Ctrl-C reaches the one that asks, and kernels that are not parallel
themselves compile in half the time. What is worked out does not depend on their number.
"""

import os
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
LEAST_ROWS, SHARES = 4, 8  # rows a call, and calls for every core: handing a call over costs as much as a row

Result = TypeVar("Result")

HARMLESS = "harmless"  # the attribute of such threads
POOLS = "ahead", "sweep"  # what their threads are called

_pools: dict[tuple[str, int], ThreadPoolExecutor] = {}


def use_threads(count: int) -> None:
    """Use that number of threads from now on, for a process that is one of many on its machine."""
    global THREADS  # one number for the process, as the cores are
    THREADS = count


def _pool(name: str) -> ThreadPoolExecutor:
    return _pools.setdefault((name, THREADS), ThreadPoolExecutor(THREADS, thread_name_prefix=name))


def in_threads(kernel: Callable[..., None], count: int, *arguments: Any) -> None:
    """Run a kernel over `count` rows, some at a time on every core; each row is written by one call alone."""
    rows = max(LEAST_ROWS, count // (SHARES * THREADS))
    spans = [(row, min(row + rows, count)) for row in range(0, count, rows)]
    threads = min(THREADS, len(spans))
    if threads < 2:
        kernel(0, count, *arguments)
        return
    for done in [_pool("sweep").submit(kernel, begin, end, *arguments) for begin, end in spans]:
        done.result()


def ahead(work: Callable[..., Result], *arguments: Any) -> Future[Result]:
    """Work that begins now, beside the caller's own; it may run kernels in threads, and no such work may wait for another."""
    return _pool("ahead").submit(work, *arguments)


def harmless(thread: threading.Thread) -> threading.Thread:
    """Note that a copy of this process may be made while a thread runs: it imports nothing and holds no lock that a copy needs.
    Most such threads wait for what comes through a pipe and hand it over."""
    setattr(thread, HARMLESS, True)  # on the thread itself: a set could grow during iteration
    return thread


def come_to_rest() -> bool:
    """Whether a copy of this process can be made here: by the main thread, where all others are harmless. Those of our own pools
    do what they have to do and are gone then; others begin with the next work."""
    main = threading.main_thread()
    others = [thread for thread in threading.enumerate() if thread is not main and not hasattr(thread, HARMLESS)]
    if threading.current_thread() is not main or any(thread.name.rpartition("_")[0] not in POOLS for thread in others):
        return False
    while _pools:
        _pools.pop(min(_pools)).shutdown()  # those for work ahead first, which shares out rows
    return True
