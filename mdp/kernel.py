"""Kernel: how a kernel's parts are compiled, with the arrays they need: numba's own ways cost seconds of the first run.

A kernel is called from Python and kept on disk. Parts are called by kernels only, so they need no entry from Python and no place
on disk of their own. numba compiles an allocation again at every place and every function again for every literal argument:
arrays come from here, flags from variables. Its sorts, searches and assignments of whole rows bring their own Python along: a
second or more for the first of each, so numbers are moved one by one.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numba import config, njit

from mdp.store import folder

KERNEL = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
part = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
# No flag allows the compiler to change a result, so all processors and numbers of threads give the same numbers.
vector_part = njit(error_model="numpy", fastmath={"nnan", "ninf", "nsz"}, no_cpython_wrapper=True, no_cfunc_wrapper=True)
inlined = njit(error_model="numpy", inline="always", no_cpython_wrapper=True, no_cfunc_wrapper=True)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a function for calls from Python and keep it, in a folder below the one that NUMBA_CACHE_DIR names or our own."""
    given = config.CACHE_DIR
    config.CACHE_DIR = str(folder(Path(function.__code__.co_filename)))
    try:
        return njit(**KERNEL)(function)
    finally:
        config.CACHE_DIR = given


@part
def ints(size, value):  # type: ignore[no-untyped-def]
    """(size,) whole numbers, all of one value."""
    array = np.empty(size, np.int32)
    for k in range(size):
        array[k] = value
    return array


@part
def floats(size, value):  # type: ignore[no-untyped-def]
    """(size,) numbers, all of one value."""
    array = np.empty(size, np.float64)
    for k in range(size):
        array[k] = value
    return array


@part
def table(rows, columns):  # type: ignore[no-untyped-def]
    """(rows, columns) zeros."""
    array = np.empty((rows, columns), np.float64)
    for row in range(rows):
        for column in range(columns):
            array[row, column] = 0.0
    return array


@part
def int_table(rows, columns):  # type: ignore[no-untyped-def]
    """(rows, columns) whole numbers, zeros."""
    array = np.empty((rows, columns), np.int32)
    for row in range(rows):
        for column in range(columns):
            array[row, column] = 0
    return array


@part
def longs(size, value):  # type: ignore[no-untyped-def]
    """(size,) whole numbers of 64 bits, all of one value."""
    array = np.empty(size, np.int64)
    for k in range(size):
        array[k] = value
    return array


@part
def flags(size):  # type: ignore[no-untyped-def]
    """(size,) False."""
    array = np.empty(size, np.bool_)
    for k in range(size):
        array[k] = False
    return array


@part
def rank(values, x, equal):  # type: ignore[no-untyped-def]
    """How many of the rising values lie below x, those equal to it counted or not."""
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if values[middle] < x or (equal and values[middle] == x):
            low = middle + 1
        else:
            high = middle
    return low


@part
def sort(values, begin, end):  # type: ignore[no-untyped-def]
    """Bring values[begin:end] into rising order, in place (Shell 1959)."""
    gap = (end - begin) // 2
    while gap > 0:
        for k in range(begin + gap, end):
            value, at = values[k], k
            while at >= begin + gap and values[at - gap] > value:
                values[at] = values[at - gap]
                at -= gap
            values[at] = value
        gap = 1 if gap == 2 else gap * 5 // 11


@part
def rising(keys):  # type: ignore[no-untyped-def]
    """(n,) numbers of the keys in rising order, equal keys as they come (runs merged from the bottom up)."""
    order, spare = longs(len(keys), 0), longs(len(keys), 0)
    for k in range(len(keys)):
        order[k] = k
    width = 1
    while width < len(keys):
        for begin in range(0, len(keys), 2 * width):
            middle, end = min(begin + width, len(keys)), min(begin + 2 * width, len(keys))
            left, right = begin, middle
            for k in range(begin, end):
                if right >= end or (left < middle and keys[order[left]] <= keys[order[right]]):
                    spare[k] = order[left]
                    left += 1
                else:
                    spare[k] = order[right]
                    right += 1
        order, spare = spare, order
        width *= 2
    return order
