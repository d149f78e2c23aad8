"""Memory: what has been used goes back to the system, arrays when they are gone and the rest where a stage ends."""

import ctypes
import gc
from contextlib import suppress

TRIM_THRESHOLD, MMAP_THRESHOLD, LARGE_BYTES = -1, -3, 1 << 20  # of mallopt in glibc's malloc.h


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
