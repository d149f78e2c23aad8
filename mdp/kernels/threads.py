"""Threads: the rows of a kernel on all cores, and the nodes of a search evaluated while others are cut.

Threads of our own wait for each other without spinning, Ctrl-C reaches the one that asks, and kernels that are not parallel
themselves compile in half the time. What is worked out does not depend on their number.
"""

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from typing import Any, TypeVar

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
LEAST_ROWS, SHARES = 4, 8  # rows a call, and calls for every core: handing a call over costs as much as a row

Result = TypeVar("Result")


def use_threads(count: int) -> None:
    """Use so many threads from now on, for a process that is one of many on its machine."""
    global THREADS  # one number for the process, as the cores are
    THREADS = count


@cache
def _pool(name: str, threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix=name)


def in_threads(kernel: Callable[..., None], count: int, *arguments: Any) -> None:
    """Run a kernel over `count` rows, some at a time on every core; each row is written by one call alone."""
    rows = max(LEAST_ROWS, count // (SHARES * THREADS))
    spans = [(row, min(row + rows, count)) for row in range(0, count, rows)]
    threads = min(THREADS, len(spans))
    if threads < 2:
        kernel(0, count, *arguments)
        return
    for done in [_pool("sweep", THREADS).submit(kernel, begin, end, *arguments) for begin, end in spans]:
        done.result()


def ahead(work: Callable[..., Result], *arguments: Any) -> Future[Result]:
    """Work that begins now, beside the caller's own; it may run kernels in threads, and no such work may wait for another."""
    return _pool("ahead", THREADS).submit(work, *arguments)
