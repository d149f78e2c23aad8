"""Processes: work side by side, each piece in a copy of this process, where it holds the interpreter's lock most of the time.

A copy is forked, which takes milliseconds; systems without fork do one piece after the other. A copy has none of our threads nor
those of a library: what runs in it starts none, and calls no boolean of solids, which has its own.
"""

import os
import pickle
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from threading import Thread
from typing import TypeVar

from mdp.kernels import threads

LOOK_S = 0.2  # between two looks at the parent
MOST_PIECES = 4096  # whose numbers every system's pipe holds
NUMBER = 2  # bytes of one

Result = TypeVar("Result")


def side_by_side(pieces: Sequence[Callable[[], Result]]) -> list[Result]:
    """What the pieces of work give, in their order: something small that can be pickled. The first one's error is raised."""
    copies = min(threads.THREADS, len(pieces)) - 1
    if copies < 1 or len(pieces) > MOST_PIECES or not hasattr(os, "fork"):
        return [piece() for piece in pieces]
    with _numbers(len(pieces)) as numbers, _copies(copies, pieces, numbers) as answers:
        known = _work(pieces, numbers)
        for answer in answers:  # one whose process could not be had is at its end
            with suppress(EOFError, pickle.UnpicklingError), open(answer, "rb", closefd=False) as pipe:  # killed from outside
                known |= pickle.load(pipe)
    return [known[k] if k in known else piece() for k, piece in enumerate(pieces)]


def end_with(parent: int) -> None:
    """From now on end this process as soon as its parent is gone, whatever ended that: SIGKILL leaves it no time to say so."""
    Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(LOOK_S)
    os._exit(1)


@contextmanager
def _numbers(count: int) -> Iterator[int]:
    """A pipe with the numbers of the pieces: who reads one does that piece."""
    numbers, end = os.pipe()
    os.write(end, b"".join(k.to_bytes(NUMBER, "big") for k in range(count)))
    os.close(end)
    try:
        yield numbers
    finally:
        os.close(numbers)


@contextmanager
def _copies(count: int, pieces: Sequence[Callable[[], Result]], numbers: int) -> Iterator[list[int]]:
    """Copies of this process at work, and the pipes by which they answer; none of them is left."""
    answers: list[int] = []
    copies: list[int] = []
    parent = os.getpid()
    try:
        for _ in range(count):
            answer, end = os.pipe()
            answers.append(answer)
            try:
                copy = os.fork()
            except OSError:  # no memory or no number for another process: those that are there do the work
                os.close(end)
                break
            if copy == 0:
                _answer(pieces, numbers, end, parent)
            copies.append(copy)
            os.close(end)
        yield answers
    finally:
        for answer in answers:
            os.close(answer)
        for copy in copies:
            os.kill(copy, signal.SIGKILL)  # one that has answered, or that nobody waits for
            os.waitpid(copy, 0)


def _answer(pieces: Sequence[Callable[[], Result]], numbers: int, end: int, parent: int) -> None:
    """All that a copy does."""
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)  # Ctrl-C reaches all: the parent speaks
        end_with(parent)
        threads.use_threads(1)
        with open(end, "wb") as pipe:
            pickle.dump(_work(pieces, numbers), pipe)
    finally:
        os._exit(0)


def _work(pieces: Sequence[Callable[[], Result]], numbers: int) -> dict[int, Result]:
    """Do pieces until none is left; those that raise an error are left out."""
    known: dict[int, Result] = {}
    while number := os.read(numbers, NUMBER):
        k = int.from_bytes(number, "big")
        with suppress(Exception):
            known[k] = pieces[k]()
    return known
