"""Columns: support that goes straight down, and aside only where there is no ground below."""

from dataclasses import dataclass

from slicer.polygons import Polygons, sealed
from slicer.room import SMOOTH_MM, Room, leaning, solid

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
        stuck = self.area - room.reached[layer - 1]
        if stuck.is_empty():
            return self
        straight = self.area ^ room.reached[layer - 1]
        stuck = solid(stuck - room.ground[layer])
        if stuck.is_empty():
            return Columns(straight)
        aside = leaning(stuck, float(room.lean_mm[layer])) ^ room.reached[layer - 1]
        return Columns((straight + aside).simplify(SMOOTH_MM))
