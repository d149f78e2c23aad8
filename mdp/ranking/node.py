"""Node: what remains of a model after some cuts, the unit of the search."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mdp.cost.cost import CostTerms, CutCost, SeamPlaces, TracedMesh, stair_weights
from mdp.cut import Solid, above, corners_above, cut
from mdp.directions.unit_vectors import frame_across
from mdp.mesh import Floats
from mdp.overhang import risky_upright
from mdp.plane import PLATFORM, Plane
from mdp.sweep.crossing import Rim, measure_rim
from mdp.sweep.limbs import limb_faces, limb_mesh, limb_vertices
from mdp.sweep.slivers import sliver_mm
from mdp.sweep.sweep import Remainder

UNCUT = CutCost(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Node:
    """What remains after some cuts, and how good that is.

    parent: the node before the last cut, None for the whole model; base: the plane of that cut, cut_cost: what it costs for ever.
    """

    solid: Solid
    terms: CostTerms
    places: SeamPlaces
    parent: "Node | None" = None
    base: Plane = PLATFORM
    cut_cost: CutCost = UNCUT

    @property
    def root(self) -> "Node":
        """The whole model."""
        node = self
        while node.parent is not None:
            node = node.parent
        return node

    @property
    def path(self) -> "list[Node]":
        """The nodes from the whole model to this one: the k-th of them has k cuts."""
        return [self] if self.parent is None else [*self.parent.path, self]

    @property
    def cuts(self) -> "list[Node]":
        """The nodes after each of the cuts."""
        return self.path[1:]

    @property
    def planes(self) -> list[Plane]:
        """The planes of the cuts in the order in which they are made."""
        return [node.base for node in self.cuts]

    @cached_property
    def part(self) -> Solid:
        """What the last cut took off. Most of what a search cuts off is never looked at, so it is made when it is asked for."""
        if self.parent is None:
            return self.solid
        whole = self.parent.solid
        return above(whole, self.base) if self.base.limbs_mm is None else cut(whole, self.base)[0]

    @cached_property
    def piece(self) -> TracedMesh:
        """The remaining solid, and which faces of the model its own are."""
        return self.places.piece(self.solid)

    @cached_property
    def remainder(self) -> Remainder:
        """The remaining solid for the sweep."""
        mesh, terms = self.piece.mesh, self.terms
        weights = self.seam_weights if terms.seam_mm > 0.0 else None
        risky = risky_upright(mesh, terms.angle_deg, terms.count_platform_faces)
        stairs = stair_weights(self.piece, terms.stair_weight)
        pieces = None if terms.need is None else terms.need.pieces(mesh, self.piece.sources)
        if pieces is not None:
            risky = risky & pieces.upright
        return Remainder(mesh, risky, weights, terms.feather, pieces, stairs, self.places.cylinders_of(self.piece))

    @cached_property
    def seam_weights(self) -> Floats:
        """(m,) how much a mm of rim counts on each face of what remains."""
        return self.places.weights(self.piece)

    @cached_property
    def seams(self) -> tuple[Rim, ...]:
        """The seams of the cuts."""
        before, base = self.parent, self.base
        if before is None:
            return ()
        weights = before.seam_weights
        if base.limbs_mm is not None:
            weights = np.where(limb_faces(before.remainder, base), weights, 0.0)
        return (*before.seams, measure_rim(before.remainder.mesh, weights, base, self.terms.feather))

    @cached_property
    def risky_mm2(self) -> float:
        """Area of what remains that needs support when it is printed straight up; where none is wanted it counts more."""
        return self.remainder.risky_mm2

    @cached_property
    def residual_mm2(self) -> float:
        """What the parts cut off so far cost for ever: a lower bound of the cost of every descendant."""
        return sum(node.cut_cost.residual_mm2 for node in self.cuts)

    @cached_property
    def lost_mm2(self) -> float:
        """What the cuts so far have made worse."""
        return sum(node.cut_cost.lost_mm2 for node in self.cuts)

    @property
    def saved_mm2(self) -> float:
        """How much less it costs when the search stops here than the whole model does."""
        return self.root.cost_mm2 - self.cost_mm2

    @cached_property
    def stairs_mm2(self) -> float:
        """What the stairs of what remains count when it is printed straight up."""
        return self.remainder.stairs_mm2

    @property
    def cost_mm2(self) -> float:
        """What it costs when the search stops here; the paper's J where seams cost nothing."""
        return self.risky_mm2 + self.stairs_mm2 + self.residual_mm2

    @cached_property
    def signature(self) -> tuple[float, ...]:
        """Equal for two orders of the same cuts."""
        return (round(self.solid.volume(), 3), round(self.risky_mm2 + self.stairs_mm2, 3), round(self.residual_mm2, 3))

    def corners_cut(self, plane: Plane) -> Floats:
        """(n, 3) the corners of what a plane would cut off: vertices, and where edges pass through it. Nothing is cut."""
        return corners_above(self.remainder.mesh if plane.limbs_mm is None else limb_mesh(self.remainder, plane), plane)

    def sliver_mm(self, plane: Plane) -> float:
        """Thickness of the thinnest sliver that cutting off the limbs of a plane would leave."""
        limb = limb_vertices(self.remainder, plane)
        return sliver_mm(self.remainder.facets, limb, plane, frame_across(plane.normal))

    def release(self) -> None:
        """Forget what is large and made again when it is asked for: a search keeps all its nodes and comes back to few."""
        for name in ("piece", "remainder", "seam_weights"):
            self.__dict__.pop(name, None)
