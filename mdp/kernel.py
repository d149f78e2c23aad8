"""Kernel: how a kernel's parts are compiled, with the arrays they need: numba's own ways cost seconds of the first run.

Parts are called by kernels only, so they need no entry from Python and no place in the cache of their own. numba compiles an
allocation again at every place and every function again for every literal argument: arrays come from here, flags from variables.
"""

import numpy as np
from numba import njit

part = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
# No flag allows the compiler to change a result, so all processors and numbers of threads give the same numbers.
vector_part = njit(error_model="numpy", fastmath={"nnan", "ninf", "nsz"}, no_cpython_wrapper=True, no_cfunc_wrapper=True)
inlined = njit(error_model="numpy", inline="always", no_cpython_wrapper=True, no_cfunc_wrapper=True)


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
