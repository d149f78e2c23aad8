"""Sorting: binary search, comparison sorts and counting sorts inside kernels."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdp.kernels.arrays import longs
from mdp.kernels.kernel import helper, no_nrt


@helper
def counting_sort(keys: NDArray[Any], bins: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Counting sort of items by keys 0 <= key < bins: bin b holds items[first[b] : first[b + 1]] in ascending order.

    keys: (n,) integers; first: (bins + 1,); items: (n,).
    """
    return sort_into_bins(keys, keys, bins)


@helper
def sort_into_bins(low: NDArray[Any], high: NDArray[Any], bins: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Counting sort of items into all bins low[k] .. high[k] inclusive that item k touches; none if high < low.

    Bin b holds items[first[b] : first[b + 1]], in ascending order; first: (bins + 1,).
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
    """The number of sorted values below x, with or without those equal to it (binary search)."""
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
    """Sort values[begin:end] in place, ascending (Shell 1959)."""
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
    """(n,) indices that sort the keys in ascending order, stable (bottom-up merge sort)."""
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
