"""Sorting: binary search, comparison sorts and counting sorts inside kernels."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import longs
from mdp.kernels.kernel import helper, no_nrt


@helper
def counting_sort(keys: NDArray[Any], bins: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Items sorted by their keys 0 <= key < bins: bin b holds items[first[b] : first[b + 1]], in rising order.

    keys: (n,) whole numbers; first: (bins + 1,); items: (n,).
    """
    return sort_into_bins(keys, keys, bins)


@helper
def sort_into_bins(low: NDArray[Any], high: NDArray[Any], bins: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Items sorted into all bins low[k] .. high[k] that item k touches, both included, none where high < low (counting sort).

    Bin b holds items[first[b] : first[b + 1]], in rising order; first: (bins + 1,).
    """
    first, next_free = longs(bins + 1, 0), longs(bins + 1, 0)
    for k in range(len(low)):
        for b in range(low[k], high[k] + 1):
            first[b + 1] += 1
    for b in range(bins):
        first[b + 1] += first[b]
        next_free[b + 1] = first[b + 1]
    items = longs(first[bins], 0)
    for k in range(len(low)):
        for b in range(low[k], high[k] + 1):
            items[next_free[b]] = k
            next_free[b] += 1
    return first, items


@no_nrt
def rank(values: NDArray[Any], x: float, equal: bool) -> int:
    """How many of the rising values lie below x, those equal to it counted or not (binary search)."""
    low, high = 0, len(values)
    while low < high:
        middle = (low + high) // 2
        if values[middle] < x or (equal and values[middle] == x):
            low = middle + 1
        else:
            high = middle
    return low


@no_nrt
def sort(values: NDArray[Any], begin: int, end: int) -> None:
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


@helper
def argsort(keys: NDArray[Any]) -> NDArray[np.int64]:
    """(n,) numbers of the keys in rising order, equal keys as they come (merge sort from the bottom up)."""
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
