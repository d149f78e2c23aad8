"""Patch: a place on a part's base plane that wants support beneath it, and what of an earlier part's layers answers it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mdp.mesh import Floats
from slicer.demand.facing import Facing
from slicer.geometry.polygons import Polygons, bounding_box, closing, contours, offset, union
from slicer.heights import Heights

DEEP_MM = 1.0  # support begins within this below a plane: as much as keeps a wall along a steep plane upright
NEAR_MM = 0.35  # what ends nearer to a plane carries what begins on it: a step of a slope and the space beside a disc
STEP_MM = 0.15  # steps of a slope are joined over this


@dataclass(frozen=True, eq=False)
class Patch:
    """Places on a base plane, in its part's frame, under which support has to end gap_mm below the plane."""

    places: Polygons
    gap_mm: float


def begins_under(patch: Patch, facing: Facing, heights: Heights, count: int, far_mm: float) -> dict[int, Polygons]:
    """By layers of the earlier part, of the lowest `count`, the places at which support of a patch has to begin there."""
    begins = {}
    for layer in _layers_near(patch.places, facing, heights, patch.gap_mm + DEEP_MM)[:count]:
        if layer < count:
            z_mm = facing.nearest_z_mm(float(heights.bottom_mm[layer]), float(heights.tip_mm[layer]))
            place = _under(patch, facing, z_mm, patch.gap_mm + DEEP_MM, far_mm)
            if not place.is_empty():
                begins[layer] = place
    return begins


def keep_off(
    bodies: Sequence[Polygons], patches: Sequence[Patch], facing: Facing, heights: Heights, gap_mm: float, far_mm: float
) -> list[Polygons]:
    """Support of the earlier part's layers that keeps gap_mm from the plane, under patches no more than their own gap."""
    kept = []
    for layer, body in enumerate(bodies):
        if not body.is_empty():
            z_mm = facing.nearest_z_mm(float(heights.bottom_mm[layer]), float(heights.tip_mm[layer]))
            near = facing.band(z_mm, -gap_mm, far_mm, far_mm) ^ bounding_box(body, 1.0)
            for patch in patches if not near.is_empty() else ():
                wide = Patch(offset(patch.places, gap_mm), patch.gap_mm)
                near = near - _under(wide, facing, z_mm, gap_mm, far_mm)
            body = body if near.is_empty() else body - near
        kept.append(body)
    return kept


def upper_side(
    areas: Sequence[Polygons], facing: Facing, heights: Heights, window: Polygons, low_mm: float, high_mm: float, far_mm: float
) -> Polygons:
    """What of the areas of an earlier part's layers ends low_mm to high_mm above the plane (below it: negative), on the
    plane, inside a window of it."""
    pieces = []
    for layer in _layers_near(window, facing, heights, -low_mm):
        if layer < len(areas) and not areas[layer].is_empty():
            z_mm = facing.nearest_z_mm(float(heights.bottom_mm[layer]), float(heights.tip_mm[layer]))
            near = areas[layer] ^ facing.band(z_mm, low_mm, high_mm, far_mm)
            if not near.is_empty():
                pieces.append(facing.project(near, z_mm))
    return closing(offset(union(pieces), 0.5 * STEP_MM), STEP_MM) ^ window if pieces else Polygons()


def _under(patch: Patch, facing: Facing, z_mm: float, deep_mm: float, far_mm: float) -> Polygons:
    """What of a height lies under a patch, from its gap to deep_mm below the plane."""
    return facing.shadow(patch.places, z_mm) ^ facing.band(z_mm, -deep_mm, -patch.gap_mm, far_mm)


def _layers_near(places: Polygons, facing: Facing, heights: Heights, deep_mm: float) -> list[int]:
    """The layers of the earlier part that come within deep_mm below places on the plane."""
    if places.is_empty():
        return []
    on_plane: Floats = facing.points_mm(np.concatenate(contours(places)))[:, 2]
    deeper = on_plane - deep_mm * facing.cosine
    low, high = min(on_plane.min(), deeper.min()), max(on_plane.max(), deeper.max())
    first = int(np.searchsorted(heights.tip_mm, low))
    return list(range(first, int(np.searchsorted(heights.bottom_mm, high))))
