"""The memory of large arrays is returned to the operating system."""

import ctypes

import pytest

from machine.pipeline.compilers import return_large_arrays, return_unused


def test_glibc_maps_arrays_of_a_megabyte_one_by_one_and_keeps_two_megabytes_of_heap(monkeypatch: pytest.MonkeyPatch) -> None:
    told = []
    library = type("Library", (), {"mallopt": staticmethod(lambda option, value: told.append((option, value)))})
    monkeypatch.setattr(ctypes, "CDLL", lambda name: library)
    return_large_arrays()
    assert told == [(-3, 1_048_576), (-1, 2_097_152)]


def test_a_system_without_glibc_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctypes, "CDLL", lambda name: object())
    return_large_arrays()
    return_unused()


def test_glibc_is_asked_to_return_all_unused_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    told = []
    monkeypatch.setattr(ctypes, "CDLL", lambda name: type("Library", (), {"malloc_trim": staticmethod(told.append)}))
    return_unused()
    assert told == [0]
