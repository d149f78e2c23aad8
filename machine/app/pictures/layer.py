"""Layer picture: which layer is asked for with --layer PART:LAYER, and its SVG."""

import re
from collections.abc import Sequence

from profiles.errors import OutputError
from slicer.drawing import layer_svg
from slicer.paths import SlicedPart

FIRST = (1, 1)


def parse_layer(layer: str | None, has_file: bool) -> tuple[int, int]:
    """Part and layer, both counted from 1, of a --layer option; the first layer of all when it is absent.

    Raises OutputError for a text that is not PART:LAYER, and when there is no picture to draw it in.
    """
    if layer is None:
        return FIRST
    if not has_file:
        raise OutputError(f"--layer {layer} says which layer to draw: --svg FILE must say where to")
    match = re.fullmatch(r"(\d{1,9}):(\d{1,9})", layer)
    if match is None:
        raise OutputError(f"--layer {layer}: PART:LAYER is expected, both counted from 1, such as 2:15")
    return int(match[1]), int(match[2])


def draw_layer(sliced: Sequence[SlicedPart], part: int, layer: int) -> bytes:
    """The SVG file of a layer; raises OutputError or SliceError when there is no such part or layer."""
    for piece in sliced:
        if piece.index == part:
            return layer_svg(piece, layer).encode()
    raise OutputError(f"--layer {part}:{layer}: there is no part {part}, the parts are 1 to {max(p.index for p in sliced)}")
