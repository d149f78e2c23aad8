"""Columns: support that goes straight down, and aside only where there is no ground below."""

from dataclasses import dataclass

from slicer.polygons import Polygons, sealed
from slicer.room import SLIVER_MM, SMOOTH_MM, Room, carried

JOIN_MM = 0.8  # columns with less than twice this between them are one: sturdier, and not more plastic than two outlines


@dataclass(frozen=True, eq=False)
class Columns:
    """The places of a layer's support."""

    area: Polygons

    def joined(self, contact: Polygons, reached: Polygons, top_mm: float) -> "Columns":
        """With what begins in this layer."""
        return self if contact.is_empty() else Columns(sealed(self.area + contact, JOIN_MM).simplify(SMOOTH_MM) ^ reached)

    def lowered(self, room: Room, layer: int) -> "Columns":
        """What carries a layer's support in the layer below."""
        if (self.area - room.reached[layer - 1]).is_empty():
            return self
        lower = carried(self.area, room.reached[layer - 1], room.ground[layer], float(room.lean_mm[layer]))
        return Columns(lower.simplify(SLIVER_MM))
