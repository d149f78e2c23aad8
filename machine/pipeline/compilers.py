"""Compilers: processes that compile the kernels which the first run needs, one a core, while the command goes on.

The command says early what it will need, in the order of need, and waits for a bundle where it needs it. Where a process
cannot be had or fails, the work compiles by itself what is missing. Below: what a command does so that its own process, and with
it those that are forked from it, stay small.
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
TRIM_THRESHOLD, MMAP_THRESHOLD, LARGE_BYTES = -1, -3, 1 << 20  # of mallopt in glibc's malloc.h
COMPILE = "machine.pipeline.precompile:compile_bundle"


class Compilers:
    """The processes of this command. Threads: one a process reads what it answers; `changed` guards what they share."""

    def __init__(self) -> None:
        self._waiting: deque[str] = deque()
        self._done: set[str] = set()
        self._asked: set[str] = set()
        self._kernels = 0
        self._working = 0
        self._announced = False
        self._changed = Condition()

    def begin(self, bundles: Sequence[str]) -> None:
        """Have the bundles compiled that are not cached yet, the first ones first."""
        new = [bundle for bundle in bundles if bundle not in self._asked and not trouble() and not is_cached(bundle)]
        with self._changed:
            self._asked.update(new)
            self._waiting.extend(new)
            start = min(len(self._waiting), THREADS - self._working)
            self._working += start
        for _ in range(start):
            harmless(Thread(target=self._work, daemon=True)).start()

    def wait_for(self, bundles: Sequence[str], report: Report | None = None) -> None:
        """Return when the bundles are compiled, or cannot be in a process of their own; report: where progress is shown."""
        self.begin(bundles)
        if self._ready(bundles):
            return
        if not self._announced:
            self._announced = True
            say(phrase("compiling", "compiling the kernels (only the first run that needs them does)"))
        with nullcontext(report) if report is not None else reporting() as show:
            while not self._ready(bundles):
                show(phrase("compiled", f"compiling the kernels: {self._kernels} done", self._kernels))
                with self._changed:
                    self._changed.wait(LOOK_S)

    def _ready(self, bundles: Sequence[str]) -> bool:
        return not self._working or all(bundle not in self._asked or bundle in self._done for bundle in bundles)

    def _work(self) -> None:
        """In a thread: hand bundles to a process of our own until there are none."""
        try:
            self._hand_over()
        except (CallError, OSError):  # no process can be had, or it has ended
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
    """What slicing, the dry run and the pictures of a file need."""
    return (*PROGRAM, *(PICTURES if profile.machine.thumbnails_px else ()))


COMPILERS = Compilers()
begin, wait_for = COMPILERS.begin, COMPILERS.wait_for


def return_large_arrays() -> None:
    """Have glibc take arrays of a megabyte and more from the system one by one.

    By itself it puts those below 32 MB into its heap, whose gaps a dry run of 700,000 lines leaves 190 MB too large. Where there
    is no glibc nothing happens. Two free megabytes stay at the end of the heap: else small arrays are mapped again and again.
    """
    with suppress(AttributeError, OSError, TypeError):
        libc = ctypes.CDLL(None)
        libc.mallopt(MMAP_THRESHOLD, LARGE_BYTES)
        libc.mallopt(TRIM_THRESHOLD, 2 * LARGE_BYTES)


def keep_modules() -> None:
    """Exclude all that is loaded so far from garbage collection: scanning it takes 70 ms a time and frees nothing."""
    if gc.get_freeze_count() == 0:
        gc.freeze()


def return_unused() -> None:
    """Have glibc give back what lies unused in its heap: after a search 90 MB, which every forked process would have, too."""
    gc.collect()
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
