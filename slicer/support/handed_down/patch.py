"""Patch: a place on a later part's base plane that wants support beneath it, and what of an earlier part's layers answers it."""

from collections.abc import Sequence
from dataclasses import dataclass

from slicer.geometry.polygons import Polygons, bounding_box, closing, offset, union
from slicer.interface.base_plane import BasePlane

DEEP_MM = 1.0  # support begins within this below a plane: as much as keeps a wall along a steep plane upright
NEAR_MM = 0.35  # what ends nearer to a plane carries what begins on it: a step of a slope and the space beside a disc
STEP_MM = 0.15  # steps of a slope are joined over this


@dataclass(frozen=True, eq=False)
class Patch:
    """Places on a base plane, in its part's frame, under which support has to end gap_mm below the plane."""

    places: Polygons
    gap_mm: float

    def under(self, plane: BasePlane, layer: int, deep_mm: float) -> Polygons:
        """What of a layer lies under the patch, from its gap to deep_mm below the plane."""
        return plane.shadow(self.places, layer) ^ plane.band(layer, -deep_mm, -self.gap_mm)

    def begins(self, plane: BasePlane, count: int) -> dict[int, Polygons]:
        """By layers, of the lowest `count`, the places at which support of the patch has to begin there."""
        deep_mm = self.gap_mm + DEEP_MM
        layers = plane.layers_near(self.places, deep_mm)
        begins = {layer: self.under(plane, layer, deep_mm) for layer in layers if layer < count}
        return {layer: area for layer, area in begins.items() if not area.is_empty()}


def keep_off(bodies: Sequence[Polygons], patches: Sequence[Patch], plane: BasePlane, gap_mm: float) -> list[Polygons]:
    """Support of the earlier part's layers that keeps gap_mm from the plane, under patches no more than their own gap."""
    wide = [Patch(offset(patch.places, gap_mm), patch.gap_mm) for patch in patches]
    clear = []
    for layer, body in enumerate(bodies):
        if not body.is_empty():
            near = plane.band(layer, -gap_mm, plane.far_mm) ^ bounding_box(body, 1.0)
            for patch in wide if not near.is_empty() else ():
                near = near - patch.under(plane, layer, gap_mm)
            body = body if near.is_empty() else body - near
        clear.append(body)
    return clear


def upper_side(areas: Sequence[Polygons], plane: BasePlane, window: Polygons, deep_mm: float) -> Polygons:
    """What of the areas of an earlier part's layers ends less than deep_mm below the plane, carried onto a window of it."""
    pieces = []
    for layer in plane.layers_near(window, deep_mm):
        if layer < len(areas) and not areas[layer].is_empty():
            near = areas[layer] ^ plane.band(layer, -deep_mm, 0.0)
            if not near.is_empty():
                pieces.append(plane.project(near, layer))
    return closing(offset(union(pieces), 0.5 * STEP_MM), STEP_MM) ^ window if pieces else Polygons()
