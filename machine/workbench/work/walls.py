"""Walls: what is seen of a sliced part from outside, as the page draws it while the other parts are still being sliced."""

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats
from slicer.paths import Kind, Layer, SlicedPart

SEEN = (Kind.OUTER_WALL, Kind.OVERHANG, Kind.TOP_SKIN, Kind.BRIDGE, Kind.GAP, Kind.SUPPORT)
BEHIND = (*SEEN, Kind.INNER_WALL)  # on shallow slopes inner walls are free, too; drawn where all are few enough
MOST_PIECES = 60_000  # per part: with more, only every second layer is drawn, or every third, that many times as high


def walls(part: Part, sliced: SlicedPart, most: int = MOST_PIECES) -> bytes:
    """The straight pieces of its outer paths: 3 float32, the direction of printing, then 7 a piece: where it begins and ends, mm
    in the workpiece frame, in the middle of its height, and its height; all little-endian."""
    kinds = BEHIND if _count(sliced, BEHIND) < most else SEEN
    step = 1 + _count(sliced, kinds) // most
    own = [
        layer for layer in sliced.layers if layer.z_mm > 0.5 * layer.height_mm
    ]  # not the raft: the model stands on the plate there
    rows = [_pieces(layer, kinds, step) for layer in own[step - 1 :: step]]
    flat = np.concatenate([np.zeros((0, 7)), *rows])
    back = part.rotation
    for ends in (slice(0, 3), slice(3, 6)):
        flat[:, ends] = (flat[:, ends] + (0.0, 0.0, part.base.offset_mm)) @ back
    return np.asarray(part.direction, "<f4").tobytes() + flat.astype("<f4").tobytes()


def _count(sliced: SlicedPart, kinds: tuple[Kind, ...]) -> int:
    return sum(int((np.diff(layer.starts) - 1)[layer.is_of(*kinds)].sum()) for layer in sliced.layers)


def _pieces(layer: Layer, kinds: tuple[Kind, ...], step: int) -> Floats:
    """(n, 7) in the part frame: two ends and the height, which is that of `step` layers."""
    high = layer.height_mm * step
    points = layer.points_mm - (0.0, 0.0, high / 2.0)
    begins = np.repeat(layer.is_of(*kinds), np.diff(layer.starts))
    begins[layer.starts[1:] - 1] = False  # nothing leads from a stroke's last point to the next stroke
    at = np.flatnonzero(begins)
    return np.column_stack([points[at], points[at + 1], np.full(len(at), high)])
