"""Kernel: how a kernel and its helpers are compiled: numba's own ways cost seconds of the first run.

A kernel is called from Python and cached on disk. Helpers are called by kernels only, so they need no entry from Python and no
place on disk of their own. numba compiles an allocation again at every place and every function again for every literal
argument: arrays come from mdp.kernels.arrays, flags from variables. Its sorts, searches and assignments of whole rows bring
their own Python along, a second or more for the first of each: numbers are moved one by one and sorted by mdp.kernels.sorting.
Arguments that would be more than six go together in a NamedTuple.
"""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

from numba import njit
from numba.core import event

from mdp.kernels.cache import KernelCache

P = ParamSpec("P")
R = TypeVar("R")


def helper(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that kernels alone call. With entries from Python and C all bundles would take 130 core-s, not 115."""
    return cast(Callable[P, R], njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)(function))


def no_nrt(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a helper that makes no array, gives none back and calls only its like.

    numba's runtime (NRT) does not count who holds the arrays it works on, which would take a lock on all cores each time. It
    saves 6 % of an export and 3 of the 115 core-s.
    """
    return cast(Callable[P, R], njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)(function))


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function for calls from Python, outside Python's lock, and cache it; no entry from C saves 3 of 115 core-s."""
    compiled: Any = njit(error_model="numpy", nogil=True, no_cfunc_wrapper=True)(function)
    compiled._cache = KernelCache(function)
    return cast(Callable[P, R], compiled)


def on_compiled(call: Callable[[], None]) -> None:
    """Have a function called whenever a kernel has been compiled, with its helpers; those that are cached do not count."""
    event.register("numba:compile", _Compilations(call))


class _Compilations(event.Listener):
    """Compilations as numba tells them, those of helpers inside that of their kernel."""

    def __init__(self, call: Callable[[], None]) -> None:
        self._call, self._depth = call, 0

    def on_start(self, event: Any) -> None:
        self._depth += 1

    def on_end(self, event: Any) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._call()
