"""Rows distributed to threads: each exactly once, for any number of threads; background tasks; arrays of one value."""

import numpy as np
import pytest
from numba import njit

from mdp.kernels import arrays, threads
from mdp.mesh import Floats, Ints


@pytest.mark.parametrize("cores", [1, 2, 3, 16])
@pytest.mark.parametrize("count", [0, 1, 4, 5, 63, 64, 65, 1000])
def test_every_row_is_given_out_once_with_all_arguments(cores: int, count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", cores)
    seen = np.zeros(count, np.int64)

    def mark(begin: int, end: int, rows: Ints, step: int) -> None:
        assert 0 <= begin <= end <= count
        rows[begin:end] += step

    threads.in_threads(mark, count, seen, 3)
    assert seen.tolist() == [3] * count


def test_an_error_in_a_thread_is_raised_by_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "THREADS", 4)

    def fail(begin: int, end: int) -> None:
        if begin >= 8:
            raise ValueError(f"row {begin}")

    with pytest.raises(ValueError, match="row 8"):
        threads.in_threads(fail, 16)


def test_work_begun_in_advance_is_done_when_requested() -> None:
    assert [threads.ahead(pow, 2, k).result() for k in range(5)] == [1, 2, 4, 8, 16]


@njit
def _all(size: int) -> tuple[Ints, Floats, Floats, Ints, Ints, Ints]:
    return (
        arrays.ints(size, -7),
        arrays.floats(size, np.inf),
        arrays.table(size, 2),
        arrays.int_table(2, size),
        arrays.longs(size, 2**40),
        arrays.flags(size),
    )


@pytest.mark.parametrize("size", [0, 1, 5])
def test_new_arrays_hold_one_value_and_are_of_their_kind(size: int) -> None:
    expected = [
        np.full(size, -7, np.int32),
        np.full(size, np.inf),
        np.zeros((size, 2)),
        np.zeros((2, size), np.int32),
        np.full(size, 2**40),
        np.zeros(size, bool),
    ]
    for array, wanted in zip(_all(size), expected, strict=True):
        assert array.dtype == wanted.dtype
        assert np.array_equal(array, wanted)


@njit
def _product(points: Floats, d: Floats) -> Floats:
    out = arrays.floats(points.shape[1], 0.0)
    arrays.dot(points[0], points[1], points[2], d, out)
    return out


def test_products_of_many_vectors_with_one() -> None:
    rng = np.random.default_rng(1)
    points, d = rng.normal(size=(3, 37)), rng.normal(size=3)
    assert _product(points, d) == pytest.approx(d @ points)
