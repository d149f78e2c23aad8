"""Processes: tasks that hold the interpreter's lock, run in parallel by forked copies of this process.

Forking takes milliseconds and copies none of the data that tasks read; systems without fork run one task after the other. A copy
has none of our threads but the locks that they held, so no copy is made while threads run that are not known to be harmless: our
own threads are stopped beforehand, and with other threads present the tasks run here. As for threads of libraries: a task calls
no boolean of solids, which has threads of its own, and we hold the compiler's lock when a copy is made.
"""

import gc
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Thread
from typing import BinaryIO, TypeVar

from numba.core.compiler_lock import global_compiler_lock

from mdp.kernels import threads
from mdp.kernels.workers import frame, read_frames

LOOK_S = 0.2  # interval of checks for the parent
MOST_RUNS = 2048  # greatest number of tasks; a pipe of one page holds their numbers, and no system has smaller pages
NUMBER = 2  # bytes of a run's number in the pipe
AHEAD = 64  # runs of results that are received before they are needed
ROOM = 1 << 20  # bytes that a copy can answer before they are read, where the system allows it

Result = TypeVar("Result")

_forked = False  # whether copies are at work or this process is one


def parallel_map(
    work: Callable[[int], Result], count: int, fewest: int = 2, *, helps: bool = True, on_wait: Callable[[], None] | None = None
) -> Iterator[Result]:
    """work(0), work(1) .. work(count - 1), in this order; copies of this process work ahead while the caller uses the results.

    Results are pickled. The first exception of a task, in this order, is raised. Tasks start no further copies. fewest: the least
    number of tasks worth a copy. helps: whether this process runs tasks, too; during a long one, copies wait for it to receive
    results that no pipe can hold. on_wait: called periodically while results are awaited.
    """
    cores = min(threads.THREADS, count)
    if cores < 2 or count < fewest or _forked or not hasattr(os, "fork") or not threads.come_to_rest():
        yield from map(work, range(count))
        return
    size = -(-count // MOST_RUNS)
    runs = -(-count // size)

    def results(run: int) -> Iterator[Result]:
        return map(work, range(run * size, min((run + 1) * size, count)))

    with _numbers(runs) as numbers, _copies(cores - helps, results, numbers) as answers:
        known: dict[int, list[Result] | None] = {}  # None: a task raises an exception; its run is repeated when its turn comes
        for run in range(runs):
            while run not in known:
                _receive(answers, known, 0.0)
                if run not in known and not answers:  # killed from outside, or never started
                    known[run] = None
                elif run not in known and helps and (number := _next(numbers)) is not None:
                    known[number] = _tried(results, number)
                elif run not in known:
                    _receive(answers, known, LOOK_S)
                    if on_wait is not None:
                        on_wait()
            if len(known) < AHEAD:
                _receive(answers, known, 0.0)
            done = known.pop(run)
            yield from results(run) if done is None else done


@contextmanager
def _numbers(count: int) -> Iterator[int]:
    """A pipe with the numbers of the runs: the process that reads a number does that run."""
    numbers, end = os.pipe()
    os.write(end, b"".join(k.to_bytes(NUMBER, "big") for k in range(count)))
    os.close(end)
    try:
        yield numbers
    finally:
        os.close(numbers)


@contextmanager
def _copies(count: int, results: Callable[[int], Iterator[object]], numbers: int) -> Iterator[set[BinaryIO]]:
    """Working copies of this process, as the pipes by which they answer; all copies are ended on exit."""
    global _forked  # one flag for the process
    answers: list[BinaryIO] = []
    copies: list[int] = []
    import fcntl  # missing on systems without fork

    parent, _forked = os.getpid(), True
    try:
        for _ in range(count):
            try:
                answer, end = os.pipe()
            except OSError:  # too many open files: the existing copies do the work
                break
            answers.append(os.fdopen(answer, "rb", 0))  # unbuffered: select would not see what a buffer holds
            with suppress(AttributeError, OSError):  # systems without this call
                fcntl.fcntl(end, fcntl.F_SETPIPE_SZ, ROOM)
            try:
                with global_compiler_lock:  # held by another thread it would never be free in the copy
                    copy = os.fork()
            except OSError:  # no memory or no process number left
                os.close(end)
                break
            if copy == 0:
                _answer(results, numbers, end, parent)
            copies.append(copy)
            os.close(end)
        yield set(answers)
    finally:
        _forked = False
        for pipe in answers:
            pipe.close()
        for copy in copies:
            os.kill(copy, signal.SIGKILL)  # one that has answered, or whose answer is no longer needed
            os.waitpid(copy, 0)


def _answer(results: Callable[[int], Iterator[object]], numbers: int, end: int, parent: int) -> None:
    """Main function of a copy: answer run after run, then exit."""
    try:
        for ending in (signal.SIGINT, signal.SIGTERM):
            signal.signal(ending, signal.SIG_DFL)  # Ctrl-C reaches all processes; the parent reports it
        Thread(target=_end_with, args=(parent,), daemon=True).start()
        # no thread held the locks of these new streams
        sys.stdout, sys.stderr = (os.fdopen(stream, "w", 1, closefd=False) for stream in (1, 2))
        threads.use_threads(1)
        gc.freeze()  # a garbage collection would write to all memory, which would then be copied
        with open(end, "wb") as pipe:
            while (run := _next(numbers)) is not None:
                pipe.write(frame((run, _tried(results, run))))
                pipe.flush()
    finally:
        os._exit(0)


def _end_with(parent: int) -> None:
    """End this process as soon as its parent is gone, even if SIGKILL ended the parent."""
    while os.getppid() == parent:
        time.sleep(LOOK_S)
    os._exit(1)


def _next(numbers: int) -> int | None:
    """Take the next run from the pipe; None if there is none left."""
    number = os.read(numbers, NUMBER)
    return int.from_bytes(number, "big") if number else None


def _tried(results: Callable[[int], Iterator[Result]], run: int) -> list[Result] | None:
    with suppress(Exception):
        return list(results(run))
    return None


def _receive(answers: set[BinaryIO], known: dict[int, list[Result] | None], wait_s: float) -> None:
    """Receive the answers that have arrived; finished pipes are removed from `answers`."""
    for answer in select.select(list(answers), [], [], wait_s)[0]:
        done = next(read_frames(answer), None)
        if done is None:
            answers.discard(answer)
        else:
            known[done[0]] = done[1]
