"""Measure what the first run compiles: processor seconds of each kernel with its parts, and of each phase of numba.

Run: NUMBA_CACHE_DIR=$(mktemp -d) python tools/bench_kernels.py [BUNDLE ...] [--most 30]      (without a name: all bundles)

A kernel's own time is without that of the parts compiled meanwhile; whole: with them. Phases of LLVM: `functions` optimises each
function by itself, `module` all of a library after its callees were linked in, `code` makes machine code.
"""

import argparse
import gc
from collections import defaultdict
from collections.abc import Callable
from time import perf_counter, process_time
from typing import Any

from numba.core import codegen, event

from machine.pipeline.precompile import BUNDLES, NO_COLLECTION

PHASES = {
    "_optimize_functions": "LLVM functions",
    "_optimize_final_module": "LLVM module",
    "_finalize_final_module": "LLVM code",
}


class Compilations(event.Listener):
    """Seconds of each compiled function, those of the functions it has compiled taken off."""

    def __init__(self) -> None:
        self.own: dict[str, float] = defaultdict(float)
        self.whole: dict[str, float] = defaultdict(float)
        self.times: dict[str, int] = defaultdict(int)
        self._open: list[list[float]] = []

    def on_start(self, event: Any) -> None:
        """A compilation begins, perhaps inside of another."""
        self._open.append([process_time(), 0.0])

    def on_end(self, event: Any) -> None:
        """The newest one has ended."""
        began_s, inner_s = self._open.pop()
        seconds = process_time() - began_s
        function = event.data["dispatcher"].py_func
        name = f"{function.__module__}.{function.__name__}"
        self.own[name] += seconds - inner_s
        self.times[name] += 1
        if self._open:
            self._open[-1][1] += seconds
        else:
            self.whole[name] += seconds


class Passes(event.Listener):
    """Seconds of each pass of numba, those of passes inside taken off."""

    def __init__(self) -> None:
        self.own: dict[str, float] = defaultdict(float)
        self._open: list[list[float]] = []

    def on_start(self, event: Any) -> None:
        """A pass begins."""
        self._open.append([process_time(), 0.0])

    def on_end(self, event: Any) -> None:
        """The newest one has ended."""
        self.add(event.data["name"].partition(" [")[0], *self._open.pop())

    def add(self, name: str, began_s: float, inner_s: float) -> None:
        """Book a phase that ends now."""
        seconds = process_time() - began_s
        self.own[name] += seconds - inner_s
        if self._open:
            self._open[-1][1] += seconds

    def timed(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        """The call, booked as a phase of its own."""

        def timed(*arguments: Any) -> Any:
            self._open.append([process_time(), 0.0])
            try:
                return call(*arguments)
            finally:
                self.add(name, *self._open.pop())

        return timed


def main() -> None:
    """Print two tables, longest first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bundles", nargs="*", metavar="BUNDLE", help=", ".join(BUNDLES))
    parser.add_argument("--most", type=int, default=30)
    asked = parser.parse_args()
    compilations, passes = Compilations(), Passes()
    event.register("numba:compile", compilations)
    event.register("numba:run_pass", passes)
    for method, name in PHASES.items():
        setattr(codegen.CPUCodeLibrary, method, passes.timed(name, getattr(codegen.CPUCodeLibrary, method)))
    gc.freeze()
    gc.set_threshold(NO_COLLECTION)
    for bundle in asked.bundles or BUNDLES:
        wall_s, work_s = perf_counter(), process_time()
        BUNDLES[bundle]()
        print(f"{bundle:10s} {process_time() - work_s:6.1f} s of processor, {perf_counter() - wall_s:6.1f} s", flush=True)
    print(f"{sum(compilations.times.values())} functions, {sum(compilations.own.values()):.1f} s")
    for name, seconds in sorted(passes.own.items(), key=lambda item: -item[1])[: asked.most]:
        print(f"{seconds:7.2f} s  {name}")
    for name, seconds in sorted(compilations.own.items(), key=lambda item: -item[1])[: asked.most]:
        print(f"{seconds:7.2f} s  {compilations.whole.get(name, 0.0):7.2f} whole, {compilations.times[name]:2d} x  {name}")


if __name__ == "__main__":
    main()
