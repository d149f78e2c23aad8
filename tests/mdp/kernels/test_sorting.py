"""Sorting inside kernels agrees with numpy's."""

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray

from mdp.kernels import sorting

NUMBERS = st.lists(st.integers(0, 9), max_size=60)


@njit
def counting_sort(keys: NDArray[np.int64], bins: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    return sorting.counting_sort(keys, bins)


@njit
def sort_into_bins(low: NDArray[np.int64], high: NDArray[np.int64], bins: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    return sorting.sort_into_bins(low, high, bins)


@njit
def argsort(keys: NDArray[np.float64]) -> NDArray[np.int64]:
    return sorting.argsort(keys)


@njit
def sort(values: NDArray[np.float64], begin: int, end: int) -> None:
    sorting.sort(values, begin, end)


@njit
def rank(values: NDArray[np.float64], x: float, equal: bool) -> int:
    return sorting.rank(values, x, equal)


@settings(deadline=None)
@given(NUMBERS)
def test_a_counting_sort_is_stable_and_knows_where_each_bin_begins(numbers: list[int]) -> None:
    keys = np.array(numbers, np.int64)
    first, items = counting_sort(keys, 10)
    assert items.tolist() == np.argsort(keys, kind="stable").tolist()
    assert first.tolist() == np.searchsorted(np.sort(keys), np.arange(11)).tolist()


def test_an_item_is_in_exactly_the_bins_that_it_touches() -> None:
    first, items = sort_into_bins(np.array([0, 1, 2]), np.array([1, 0, 3]), 4)
    assert [items[a:b].tolist() for a, b in pairwise(first)] == [[0], [0], [2], [2]]


@settings(deadline=None)
@given(NUMBERS)
def test_comparison_sorts_order_as_numpy_does(numbers: list[int]) -> None:
    keys = np.array(numbers, np.float64)
    assert argsort(keys).tolist() == np.argsort(keys, kind="stable").tolist()
    part = keys.copy()
    sort(part, 1, len(part))
    assert part.tolist() == [*keys[:1], *np.sort(keys[1:])]


@settings(deadline=None)
@given(NUMBERS, st.integers(-1, 10))
def test_a_rank_counts_smaller_values_with_or_without_equal_ones(numbers: list[int], x: int) -> None:
    rising = np.sort(np.array(numbers, np.float64))
    assert rank(rising, float(x), False) == (rising < x).sum()
    assert rank(rising, float(x), True) == (rising <= x).sum()
