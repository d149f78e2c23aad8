"""Memory: what large arrays have taken goes back to the system when they are gone."""

import ctypes
from contextlib import suppress

MMAP_THRESHOLD, LARGE_BYTES = -3, 1 << 20  # of mallopt in glibc's malloc.h


def return_large_arrays() -> None:
    """Have glibc take arrays of a megabyte and more from the system one by one.

    By itself it puts those below 32 MB into its heap, whose gaps a dry run of 700,000 lines leaves 190 MB too large. Where there
    is no glibc nothing happens.
    """
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).mallopt(MMAP_THRESHOLD, LARGE_BYTES)
