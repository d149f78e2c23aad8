"""Arrays: new arrays inside kernels, each kind compiled once."""

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.kernel import part


@part
def ints(size: int, value: int) -> NDArray[np.int32]:
    """(size,) whole numbers, all of one value."""
    array = np.empty(size, np.int32)
    for k in range(size):
        array[k] = value
    return array


@part
def floats(size: int, value: float) -> NDArray[np.float64]:
    """(size,) numbers, all of one value."""
    array = np.empty(size, np.float64)
    for k in range(size):
        array[k] = value
    return array


@part
def table(rows: int, columns: int) -> NDArray[np.float64]:
    """(rows, columns) zeros."""
    array = np.empty((rows, columns), np.float64)
    for row in range(rows):
        for column in range(columns):
            array[row, column] = 0.0
    return array


@part
def int_table(rows: int, columns: int) -> NDArray[np.int32]:
    """(rows, columns) whole numbers, zeros."""
    array = np.empty((rows, columns), np.int32)
    for row in range(rows):
        for column in range(columns):
            array[row, column] = 0
    return array


@part
def longs(size: int, value: int) -> NDArray[np.int64]:
    """(size,) whole numbers of 64 bits, all of one value."""
    array = np.empty(size, np.int64)
    for k in range(size):
        array[k] = value
    return array


@part
def flags(size: int) -> NDArray[np.bool_]:
    """(size,) False."""
    array = np.empty(size, np.bool_)
    for k in range(size):
        array[k] = False
    return array
