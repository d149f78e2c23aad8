"""Parts: all parts of a decomposition sliced, side by side where that pays.

First the support of all parts is planned together, for what one part's support stands on may be printed with another. From
then on a part's paths depend on nothing but the plan and the profile, so the result is the same bit for bit however many
processes slice. Where one part is most of the print, its layers are worked out side by side instead.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from mmap import mmap

import numpy as np

from mdp.decomposition import Part
from mdp.kernels.processes import parallel_map
from profiles.errors import SliceError
from profiles.profile import Profile
from slicer.interface.interlock import plan_pins
from slicer.overhangs import find_overhangs
from slicer.paths import SlicedPart
from slicer.sectioning import section_part
from slicer.slice import slice_supported
from slicer.strokes.vase import check_vase
from slicer.support.handed_down import plan_supports
from slicer.support.support import own_supports

FEWEST_LAYERS = 250  # fewer are sliced sooner than processes are forked and their paths brought back
LARGEST_SHARE = 0.6  # of all layers: where a part has more of them, the other parts end long before it


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


def slice_parts(
    parts: Sequence[Part], profile: Profile, on_progress: Callable[[SlicingProgress], None] | None = None
) -> tuple[SlicedPart, ...]:
    """Every part sliced; on_progress: called now and then.

    Raises SliceError as slice_part does, for the first part in print order that has a reason.
    """
    if not parts:
        return ()
    check_vase(parts, profile)
    pins = plan_pins(parts, profile)
    sections = [section_part(part, profile, parts[:k], parts[k + 1 :], pins) for k, part in enumerate(parts)]
    overhangs = [find_overhangs(layers) for layers in sections]
    supports = plan_supports([own_supports(*pair) for pair in zip(sections, overhangs, strict=True)])
    expected = [len(support.areas) for support in supports]
    layers = np.frombuffer(mmap(-1, 4 * len(parts)), np.int32)  # those that are done: other processes write them, too
    ready: list[SlicedPart | None] = [None] * len(parts)
    errors: dict[int, SliceError] = {}
    here = os.getpid()

    def show() -> None:
        if on_progress is not None and os.getpid() == here:
            on_progress(SlicingProgress(tuple(layers.tolist()), tuple(expected), tuple(ready)))

    def sliced(k: int) -> SlicedPart | SliceError:
        def on_layer(layer: int, of: int) -> None:
            layers[k] = layer
            show()

        try:
            return slice_supported(supports[k], overhangs[k], on_layer)
        except SliceError as error:
            return error

    by_layers = max(expected) > LARGEST_SHARE * sum(expected) or sum(expected) < FEWEST_LAYERS
    largest_first = sorted(range(len(parts)), key=lambda k: (-expected[k], k))  # so that no large one is left for the end
    results = (
        map(sliced, largest_first)
        if by_layers
        else parallel_map(lambda place: sliced(largest_first[place]), len(parts), helps=False, on_wait=show)
    )
    for k, result in zip(largest_first, results, strict=True):
        if isinstance(result, SliceError):
            errors[k] = result
        else:
            ready[k] = result
            layers[k] = len(result.layers)
            show()
    if errors:
        raise errors[min(errors)]
    return tuple(piece for piece in ready if piece is not None)
