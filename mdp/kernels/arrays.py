"""Arrays: new arrays inside kernels, each kind compiled once, and products of many vectors with one vector."""

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.kernel import helper, no_nrt

Floats = NDArray[np.float64]


@helper
def ints(size: int, value: int) -> NDArray[np.int32]:
    """(size,) int32 array filled with one value."""
    array = np.empty(size, np.int32)
    for k in range(size):
        array[k] = value
    return array


@helper
def floats(size: int, value: float) -> Floats:
    """(size,) float64 array filled with one value."""
    array = np.empty(size, np.float64)
    for k in range(size):
        array[k] = value
    return array


@helper
def table(rows: int, columns: int) -> Floats:
    """(rows, columns) zeros."""
    array = np.empty((rows, columns), np.float64)
    for row in range(rows):
        for column in range(columns):
            array[row, column] = 0.0
    return array


@helper
def int_table(rows: int, columns: int) -> NDArray[np.int32]:
    """(rows, columns) int32 zeros."""
    array = np.empty((rows, columns), np.int32)
    for row in range(rows):
        for column in range(columns):
            array[row, column] = 0
    return array


@helper
def longs(size: int, value: int) -> NDArray[np.int64]:
    """(size,) int64 array filled with one value."""
    array = np.empty(size, np.int64)
    for k in range(size):
        array[k] = value
    return array


@helper
def flags(size: int) -> NDArray[np.bool_]:
    """(size,) False."""
    array = np.empty(size, np.bool_)
    for k in range(size):
        array[k] = False
    return array


@no_nrt
def dot(x: Floats, y: Floats, z: Floats, d: Floats, out: Floats) -> None:
    """Dot products of (n,) vectors, given by their coordinates, with one vector, written into `out`."""
    d0, d1, d2 = d[0], d[1], d[2]
    for k in range(len(out)):
        out[k] = x[k] * d0 + y[k] * d1 + z[k] * d2
