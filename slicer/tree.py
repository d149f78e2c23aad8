"""Tree: support as branches; what begins near each other grows down as one branch."""

from dataclasses import dataclass
from math import floor

from slicer.branch import Branch, Growth, branch_of, lowered
from slicer.columns import JOIN_MM
from slicer.polygons import Polygons, sealed, united
from slicer.room import LEAST_MM2, SMOOTH_MM, Room

CELL_MM = 10.0  # wider contacts get a branch for every square of this size: its middle is down after half of that


@dataclass(frozen=True, eq=False)
class Tree:
    """The branches of a layer; young: those that still take up what begins in their square, by the square's numbers."""

    growth: Growth
    branches: tuple[Branch, ...] = ()
    young: tuple[tuple[tuple[int, int], Branch], ...] = ()

    @property
    def area(self) -> Polygons:
        """The places of all branches."""
        return united([branch.area for branch in (*self.branches, *(branch for _, branch in self.young))])

    def joined(self, contact: Polygons, reached: Polygons, top_mm: float) -> "Tree":
        """With what begins in this layer."""
        if contact.is_empty():
            return self
        young = dict(self.young)
        for cell, piece in _cells(contact):
            old = young.get(cell)
            area = piece if old is None else old.area + piece
            area = sealed(area, JOIN_MM).simplify(SMOOTH_MM) ^ reached
            if area.area() > LEAST_MM2:
                young[cell] = branch_of(area, top_mm if old is None else old.top_mm)
        return Tree(self.growth, self.branches, tuple(young.items()))

    def lowered(self, room: Room, layer: int) -> "Tree":
        """What carries a layer's support in the layer below."""
        z = float(room.top_mm[layer - 1])
        grown_up = tuple(b for _, b in self.young if b.radius <= self.growth.radius_mm(b, z))
        young = tuple((cell, b) for cell, b in self.young if b.radius > self.growth.radius_mm(b, z))
        old = lowered([*self.branches, *grown_up], room, layer, self.growth)
        still = [(cell, lower) for cell, b in young for lower in lowered([b], room, layer, self.growth)]
        latest = dict(still)
        rest = [b for cell, b in still if latest[cell] is not b]
        return Tree(self.growth, (*old, *rest), tuple(latest.items()))


def _cells(area: Polygons) -> list[tuple[tuple[int, int], Polygons]]:
    """An area cut along a fixed lattice."""
    x0, y0, x1, y1 = (floor(bound / CELL_MM) for bound in area.bounds())
    cells = []
    for i in range(x0, x1 + 1):
        for j in range(y0, y1 + 1):
            square = Polygons.square((CELL_MM, CELL_MM)).translate((i * CELL_MM, j * CELL_MM))
            piece = area if (x0, y0) == (x1, y1) else area ^ square
            if piece.area() > LEAST_MM2:
                cells.append(((i, j), piece))
    return cells
