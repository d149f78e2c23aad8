"""Parts: all parts of a decomposition sliced, in processes side by side where that pays.

First the support of all parts is planned together, for what one part's support stands on may be printed with another. From
then on a part's paths depend on nothing but the plan and the profile, so the result is the same bit for bit either way.
Processes are forked, which takes milliseconds; a fresh interpreter would spend longer loading the kernels than slicing
usually takes (measured: tools/RESULTS.md), so systems without fork slice part after part.
"""

import gc
import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import active_children, get_all_start_methods, get_context
from multiprocessing.sharedctypes import RawArray
from typing import Any

from mdp.decomposition import Part
from mdp.kernels import threads
from mdp.kernels.processes import end_with
from profiles.profile import Profile
from slicer.interface.interlock import plan_pins
from slicer.overhangs import Overhang, find_overhangs
from slicer.paths import SlicedPart
from slicer.sectioning import section_part
from slicer.slice import slice_supported
from slicer.strokes.vase import check_vase
from slicer.support.handed_down import plan_supports
from slicer.support.support import Supports, own_supports

FEWEST_LAYERS = 250  # fewer are sliced sooner than processes are forked and their paths brought back
LOOK_S = 0.2  # between two looks at processes: progress moves five times a second

Planned = Sequence[tuple[Supports, Sequence[Overhang]]]


@dataclass(frozen=True, eq=False)
class SlicingProgress:
    """How far slicing is, part by part in print order: layers done, how many are expected, and the parts that are sliced."""

    layers: tuple[int, ...]
    expected: tuple[int, ...]
    ready: tuple[SlicedPart | None, ...]

    @property
    def begun(self) -> int:
        """How many parts are sliced or being sliced."""
        return sum(count > 0 for count in self.layers)

    @property
    def share(self) -> float:
        """What of all layers is done, 0 to 1, an estimate that never falls: a part that is ready may have fewer than expected."""
        pieces = zip(self.layers, self.expected, self.ready, strict=True)
        return sum(of if piece else min(count, of) for count, of, piece in pieces) / max(sum(self.expected), 1)


OnProgress = Callable[[SlicingProgress], None]


def slice_parts(
    parts: Sequence[Part], profile: Profile, on_progress: OnProgress | None = None, processes: int | None = None
) -> tuple[SlicedPart, ...]:
    """Every part sliced; on_progress: called now and then. processes: how many side by side; None: as many as pay here.

    Raises SliceError as slice_part does, for the first part in print order that has a reason.
    """
    check_vase(parts, profile)
    pins = plan_pins(parts, profile)
    sections = [section_part(part, profile, parts[:k], parts[k + 1 :], pins) for k, part in enumerate(parts)]
    overhangs = [find_overhangs(layers) for layers in sections]
    supports = plan_supports([own_supports(*pair) for pair in zip(sections, overhangs, strict=True)])
    planned = list(zip(supports, overhangs, strict=True))
    expected = [len(support.areas) for support in supports]
    if processes is None:
        processes = _process_count(len(parts), sum(expected))
    if processes < 2:
        return _slice_in_turn(planned, expected, on_progress)
    try:
        return _slice_side_by_side(planned, expected, on_progress, processes)
    except BrokenProcessPool:  # a process was killed from outside: this one does the work
        return _slice_in_turn(planned, expected, on_progress)


def _process_count(parts: int, layers: int) -> int:
    if parts < 2 or layers < FEWEST_LAYERS or "fork" not in get_all_start_methods():
        return 1
    return min(parts, threads.THREADS)


def _slice_in_turn(planned: Planned, expected: Sequence[int], on_progress: OnProgress | None) -> tuple[SlicedPart, ...]:
    sliced: list[SlicedPart] = []

    def show(layer: int, of: int) -> None:
        if on_progress is not None:
            left = len(planned) - len(sliced)
            layers = (*(len(piece.layers) for piece in sliced), layer, *[0] * left)[: len(planned)]
            on_progress(SlicingProgress(layers, tuple(expected), (*sliced, *[None] * left)))

    for supports, overhangs in planned:
        sliced.append(slice_supported(supports, overhangs, show))
    show(0, 0)
    return tuple(sliced)


_job: tuple[Planned, Any] | None = None  # what a forked process finds in its copy of the memory


def _inherit(planned: Planned, counts: Any, parent: int) -> None:
    global _job
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C reaches the whole group: end without a word, the parent speaks
    _job = planned, counts
    end_with(parent)


def _slice_forked(k: int) -> SlicedPart:
    """In a forked process: slice a part, counting its layers where the parent reads them."""
    assert _job is not None
    planned, counts = _job

    def on_layer(layer: int, of: int) -> None:
        counts[k] = layer

    return slice_supported(*planned[k], on_layer)


def _slice_side_by_side(
    planned: Planned, expected: Sequence[int], on_progress: OnProgress | None, processes: int
) -> tuple[SlicedPart, ...]:
    """The highest parts first, so that no long one is left for the end."""
    context = get_context("fork")
    counts: Any = RawArray("i", len(planned))
    gc.freeze()  # a search for garbage would write on all memory, of which each process would have its own then
    pool = ProcessPoolExecutor(processes, context, _inherit, (planned, counts, os.getpid()))
    try:
        order = sorted(range(len(planned)), key=lambda k: (-expected[k], k))
        futures = {k: pool.submit(_slice_forked, k) for k in order}
        waiting = set(futures.values())
        while waiting:
            waiting = wait(waiting, LOOK_S, FIRST_COMPLETED).not_done
            if on_progress is not None:
                ready = tuple(_result(futures[k]) for k in range(len(planned)))
                on_progress(SlicingProgress(tuple(counts), tuple(expected), ready))
        return tuple(futures[k].result() for k in range(len(planned)))
    except BaseException:
        for process in active_children():  # nobody waits for what they slice
            process.kill()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        gc.unfreeze()


def _result(future: "Future[SlicedPart]") -> SlicedPart | None:
    """What a process has sliced, if it has."""
    return future.result() if future.done() and not future.cancelled() and future.exception() is None else None
