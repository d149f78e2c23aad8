r"""Tree: support as branches; what begins near each other grows down as one branch.

A branch is kept as the places of its middle; printed are discs about all of them. First, from the ground up, it is found where
such places may be (`reachable`): beside the part, and within the lean of a reachable place in the layer below, or on something.
Then, from the top down, each layer's branches are made from those above, never out of what is reachable, so none ends in the air.

    _____________________________________
    | hangs               |             |   add_contact: what hangs is cut along squares of CELL_MM, each begins a branch
    `------+------+-------+-----.  part |
     \    / \    / \    /       |       |   lower: a wide branch shrinks to its middle, in every layer by the lean,
      \  /   \  /   \  /        |       |
       \ \   / /     ||         |       |   then it is a trunk, round: nearest ones go to meet each other, half way each,
        \ \_/ /      ||    .----'       |   where the height that is left is enough,
         \   /        \\   |            |   and get thicker downward;
          | |         ||   |            |   what comes in its way a branch passes as it is or thinner, moves aside from
         /   \        ||   |            |   within the lean, or ends on where the part may be stood on (`placeable`)
    ____/_____\______/__\__|____________|____

The rule for every step: each place of a branch has a place of one below it within the lean, or it stands. What of the tree is as
wide as a bead and does stand is sifted afterwards (support.stand); what hangs and is not held is counted (missed).
"""

from dataclasses import dataclass
from itertools import product
from math import floor

from slicer.geometry.polygons import Polygons, closing, islands, union
from slicer.support.branch import Branch, Growth, branch_of, lower_branches
from slicer.support.reachable import LEAST_MM2, SLIVER_MM, SMOOTH_MM, ReachableAreas, carrying_area

CELL_MM = 10.0  # wider contacts get a branch for every square of this size: its middle is down after half of that
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


@dataclass(frozen=True, eq=False)
class Tree:
    """The branches of a layer; those that are no trunks yet take up what begins in their square."""

    growth: Growth
    branches: tuple[Branch, ...] = ()

    @property
    def area(self) -> Polygons:
        """The places of all branches."""
        return union([branch.area for branch in self.branches])

    def add_contact(self, contact: Polygons, reachable: Polygons, top_mm: float) -> "Tree":
        """With what begins in this layer."""
        if contact.is_empty():
            return self
        branches = list(self.branches)
        young = {_cell(b.x, b.y): k for k, b in enumerate(branches) if not b.full}
        for cell, piece in _pieces(contact):
            k = young.get(cell)
            area = piece if k is None else branches[k].area + piece
            area = closing(area, JOIN_MM).simplify(SMOOTH_MM) ^ reachable
            if area.area() <= LEAST_MM2:
                continue
            if k is None:
                branches.append(branch_of(area, top_mm))
            else:
                branches[k] = branch_of(area, branches[k].top_mm)
        return Tree(self.growth, tuple(branches))

    def lower(self, areas: ReachableAreas, layer: int) -> "Tree":
        """What carries a layer's support in the layer below."""
        return Tree(self.growth, tuple(lower_branches(self.branches, areas, layer, self.growth))) if self.branches else self


def _cell(x: float, y: float) -> tuple[int, int]:
    return floor(x / CELL_MM), floor(y / CELL_MM)


def _pieces(area: Polygons) -> list[tuple[tuple[int, int], Polygons]]:
    """An area cut along a fixed lattice, with the lattice's numbers."""
    pieces: dict[tuple[int, int], list[Polygons]] = {}
    square = Polygons.square((CELL_MM, CELL_MM))
    for island in islands(area):
        x0, y0, x1, y1 = island.bounds()
        (i0, j0), (i1, j1) = _cell(x0, y0), _cell(x1, y1)
        for i, j in product(range(i0, i1 + 1), range(j0, j1 + 1)):
            whole = (i0, j0) == (i1, j1)
            piece = island if whole else island ^ square.translate((i * CELL_MM, j * CELL_MM))
            if piece.area() > LEAST_MM2:
                pieces.setdefault((i, j), []).append(piece)
    return [(cell, Polygons.compose(several)) for cell, several in sorted(pieces.items())]
