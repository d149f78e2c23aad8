"""Columns: support that goes straight down, and aside only where there is no ground below."""

from dataclasses import dataclass

from slicer.geometry.polygons import Polygons, closing
from slicer.support.reachable import SLIVER_MM, SMOOTH_MM, ReachableAreas, carrying_area

JOIN_MM = 0.8  # columns with less than twice this between them are one: sturdier, and not more plastic than two outlines


@dataclass(frozen=True, eq=False)
class Columns:
    """The places of a layer's support."""

    area: Polygons

    def add_contact(self, contact: Polygons, reachable: Polygons, top_mm: float) -> "Columns":
        """With what begins in this layer."""
        return self if contact.is_empty() else Columns(closing(self.area + contact, JOIN_MM).simplify(SMOOTH_MM) ^ reachable)

    def lower(self, areas: ReachableAreas, layer: int) -> "Columns":
        """What carries a layer's support in the layer below."""
        if (self.area - areas.reachable[layer - 1]).is_empty():
            return self
        lower = carrying_area(self.area, areas.reachable[layer - 1], areas.placeable[layer], float(areas.lean_mm[layer]))
        return Columns(lower.simplify(SLIVER_MM))
