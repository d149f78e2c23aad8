"""Compilers: processes, one per core, that compile the kernels of a first run while the command continues.

A command names its bundles of kernels early, in the order of need, and waits for each when it needs it. If a process cannot be
started or fails, the command compiles by itself. The last functions keep its own process, and those forked from it, small.
"""

import ctypes
import gc
from collections import deque
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from threading import Condition, Thread

from machine.notices import Report, reporting, say
from mdp.kernels.cache import is_cached, keep, trouble
from mdp.kernels.threads import THREADS, harmless
from mdp.kernels.workers import CallError, Worker
from profiles.messages import phrase
from profiles.profile import Profile

JUDGE, SEARCH, PROGRAM, DRY_RUN, PICTURES = (
    ("judge",),
    ("sweep", "search", "slice"),
    ("slice", "dry-run"),
    ("dry-run",),
    ("draw",),
)
LOOK_S = 0.2
TRIM_THRESHOLD, MMAP_THRESHOLD, LARGE_BYTES = -1, -3, 1 << 20  # options of mallopt in glibc's malloc.h
COMPILE = "machine.pipeline.precompile:compile_bundle"


class Compilers:
    """The compiling processes of a command. One thread per process reads its answers; `changed` guards the shared state."""

    def __init__(self) -> None:
        self._waiting: deque[str] = deque()
        self._done: set[str] = set()
        self._asked: set[str] = set()
        self._kernels = 0
        self._working = 0
        self._announced = False
        self._changed = Condition()

    def begin(self, bundles: Sequence[str]) -> None:
        """Start compiling the bundles that are not cached, in order."""
        new = [bundle for bundle in bundles if bundle not in self._asked and not trouble() and not is_cached(bundle)]
        with self._changed:
            self._asked.update(new)
            self._waiting.extend(new)
            start = min(len(self._waiting), THREADS - self._working)
            self._working += start
        for _ in range(start):
            harmless(Thread(target=self._work, daemon=True)).start()

    def wait_for(self, bundles: Sequence[str], report: Report | None = None) -> None:
        """Return when the bundles are compiled, or cannot be in a separate process. report: shows progress."""
        self.begin(bundles)
        if self._ready(bundles):
            return
        if not self._announced:
            self._announced = True
            say(phrase("compiling", "compiling the kernels, once, for the first run that needs them"))
        with nullcontext(report) if report is not None else reporting() as show:
            while not self._ready(bundles):
                show(phrase("compiled", f"compiling the kernels: {self._kernels} done", self._kernels))
                with self._changed:
                    self._changed.wait(LOOK_S)

    def _ready(self, bundles: Sequence[str]) -> bool:
        return not self._working or all(bundle not in self._asked or bundle in self._done for bundle in bundles)

    def _work(self) -> None:
        """In a thread: pass bundles to a process until none are left."""
        try:
            self._hand_over()
        except (CallError, OSError):  # no process could be started, or it has ended
            pass
        finally:
            with self._changed:
                self._working -= 1
                self._changed.notify_all()

    def _hand_over(self) -> None:
        worker = Worker(one_core=True)
        try:
            while (bundle := self._next()) is not None:
                for done, _ in worker.ask(COMPILE, bundle):
                    with self._changed:
                        if done:
                            keep(bundle)
                            self._done.add(bundle)
                        else:
                            self._kernels += 1
                        self._changed.notify_all()
        finally:
            worker.end()

    def _next(self) -> str | None:
        with self._changed:
            return self._waiting.popleft() if self._waiting else None


def bundles_to_build(profile: Profile) -> tuple[str, ...]:
    """Bundles for slicing, dry run and pictures of a file."""
    return (*PROGRAM, *(PICTURES if profile.machine.thumbnails_px else ()))


COMPILERS = Compilers()
begin, wait_for = COMPILERS.begin, COMPILERS.wait_for


def return_large_arrays() -> None:
    """Make glibc map arrays of a megabyte or more one by one; does nothing without glibc.

    By default arrays below 32 MB are in its heap, whose gaps waste 190 MB after a dry run of 700,000 lines. Two free megabytes
    stay at the heap's end: otherwise small arrays are mapped again and again.
    """
    with suppress(AttributeError, OSError, TypeError):
        libc = ctypes.CDLL(None)
        libc.mallopt(MMAP_THRESHOLD, LARGE_BYTES)
        libc.mallopt(TRIM_THRESHOLD, 2 * LARGE_BYTES)


def keep_modules() -> None:
    """Exclude everything loaded so far from garbage collection: a scan takes 70 ms and frees nothing."""
    if gc.get_freeze_count() == 0:
        gc.freeze()


def return_unused() -> None:
    """Make glibc return unused memory of its heap: 90 MB after a search, which every forked process would inherit."""
    gc.collect()
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
