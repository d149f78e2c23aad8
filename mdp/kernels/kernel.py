"""Kernel decorators: how a kernel and its helpers are compiled; numba's defaults cost seconds in the first run.

A kernel is called from Python and cached on disk. Helpers are called by kernels only, so they need no entry point for Python and
no cache on disk. numba compiles every allocation again, and every function again for each literal argument: so arrays come from
mdp.kernels.arrays, flags from variables. Its sorts, searches and row assignments compile library code, which takes a second or
more for the first of each: so numbers are moved one by one and sorted by mdp.kernels.sorting. More than six arguments are grouped
in a NamedTuple.
"""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

from numba import njit
from numba.core import event

from mdp.kernels.cache import KernelCache

P = ParamSpec("P")
R = TypeVar("R")


def helper(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that only kernels call. With entry points for Python and C all bundles would take 130 core-s instead of
    115.
    """
    return cast(Callable[P, R], njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)(function))


def no_nrt(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a helper that neither creates nor returns arrays and calls only functions of its kind.

    numba's runtime (NRT) then does not count references to the arrays it works on, which would lock all cores each time. This
    saves 6 % of an export and 3 of the 115 core-s.
    """
    return cast(Callable[P, R], njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)(function))


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile and cache a function for calls from Python; it runs without Python's lock. Omitting the C entry point saves 3 of
    115 core-s.
    """
    compiled: Any = njit(error_model="numpy", nogil=True, no_cfunc_wrapper=True)(function)
    compiled._cache = KernelCache(function)
    return cast(Callable[P, R], compiled)


def on_compiled(call: Callable[[], None]) -> None:
    """Have a function called whenever a kernel and its helpers have been compiled, but not when they come from the cache."""
    event.register("numba:compile", _Compilations(call))


class _Compilations(event.Listener):
    """Listener to numba's compilations; those of helpers are nested in that of their kernel."""

    def __init__(self, call: Callable[[], None]) -> None:
        self._call, self._depth = call, 0

    def on_start(self, event: Any) -> None:
        self._depth += 1

    def on_end(self, event: Any) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._call()
