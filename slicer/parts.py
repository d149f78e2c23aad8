"""Parts: all parts of a decomposition sliced, in processes side by side where that pays.

A part's paths depend on nothing but the parts and the profile, so the result is the same bit for bit either way. Processes
are forked, which takes milliseconds; a fresh interpreter would spend longer loading the kernels than slicing usually takes
(measured: tools/RESULTS.md), so systems without fork slice part after part.
"""

import os
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_all_start_methods, get_context
from multiprocessing.sharedctypes import RawArray
from typing import Any

from mdp.decomposition import Part
from profiles.profile import Profile
from slicer.paths import SlicedPart
from slicer.slice import slice_part

FEWEST_LAYERS = 250  # fewer are sliced sooner than processes are forked and their paths brought back
LOOK_S = 0.2

Tell = Callable[[int, int, int, int], None]  # parts begun, parts, layers done, layers of all parts (an estimate)


def slice_parts(
    parts: Sequence[Part], profile: Profile, tell: Tell | None = None, processes: int | None = None
) -> tuple[SlicedPart, ...]:
    """Every part sliced; tell hears of the progress. processes: how many side by side; None: as many as pay here.

    Raises SliceError as slice_part does, for the first part in print order that has a reason.
    """
    expected = [_layers(part, profile) for part in parts]
    if processes is None:
        processes = _worthwhile(len(parts), sum(expected))
    if processes < 2:
        return _in_turn(parts, profile, expected, tell)
    try:
        return _side_by_side(parts, profile, expected, tell, processes)
    except BrokenProcessPool:  # a process was killed from outside: this one does the work
        return _in_turn(parts, profile, expected, tell)


def _layers(part: Part, profile: Profile) -> int:
    """How many layers a part will have, about: what takes time."""
    return max(1, round(float(part.in_part_frame().bounds_mm[1, 2]) / profile.process.layer_height_mm))


def _worthwhile(parts: int, layers: int) -> int:
    if parts < 2 or layers < FEWEST_LAYERS or "fork" not in get_all_start_methods():
        return 1
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(parts, cores)


def _in_turn(parts: Sequence[Part], profile: Profile, expected: Sequence[int], tell: Tell | None) -> tuple[SlicedPart, ...]:
    sliced: list[SlicedPart] = []
    done = 0
    for k, part in enumerate(parts):

        def show(layer: int, of: int, before: int = done, begun: int = k + 1) -> None:
            if tell is not None:
                tell(begun, len(parts), before + layer, sum(expected))

        sliced.append(slice_part(part, profile, parts[:k], parts[k + 1 :], show))
        done += len(sliced[-1].layers)
    return tuple(sliced)


_job: tuple[Sequence[Part], Profile, Any] | None = None  # what a forked process finds in its copy of the memory


def _inherit(parts: Sequence[Part], profile: Profile, counts: Any) -> None:
    global _job
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C reaches the whole group: end without a word, the parent speaks
    _job = parts, profile, counts


def _one(k: int) -> SlicedPart:
    """In a forked process: slice a part, counting its layers where the parent reads them."""
    assert _job is not None
    parts, profile, counts = _job

    def show(layer: int, of: int) -> None:
        counts[k] = layer

    return slice_part(parts[k], profile, parts[:k], parts[k + 1 :], show)


def _side_by_side(
    parts: Sequence[Part], profile: Profile, expected: Sequence[int], tell: Tell | None, processes: int
) -> tuple[SlicedPart, ...]:
    """The highest parts first, so that no long one is left for the end."""
    context = get_context("fork")
    counts: Any = RawArray("i", len(parts))
    pool = ProcessPoolExecutor(processes, context, _inherit, (parts, profile, counts))
    try:
        order = sorted(range(len(parts)), key=lambda k: (-expected[k], k))
        futures = {k: pool.submit(_one, k) for k in order}
        waiting = set(futures.values())
        while waiting:
            waiting = wait(waiting, LOOK_S, FIRST_COMPLETED).not_done
            if tell is not None:
                tell(sum(count > 0 for count in counts), len(parts), sum(counts), sum(expected))
        return tuple(futures[k].result() for k in range(len(parts)))
    finally:
        pool.shutdown(cancel_futures=True)
