"""Node: the remainder of a model after some cuts, the unit of the search."""

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
    """The remainder of a model after some cuts, and its cost.

    parent: the node before the last cut, None for the whole model; base: the plane of the last cut; cut_cost: its final cost.
    """

    solid: Solid
    terms: CostTerms
    places: SeamPlaces
    parent: "Node | None" = None
    base: Plane = PLATFORM
    cut_cost: CutCost = UNCUT

    @property
    def root(self) -> "Node":
        """The node of the whole model."""
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
        """The nodes after each cut."""
        return self.path[1:]

    @property
    def planes(self) -> list[Plane]:
        """The planes of the cuts in the order of the cuts."""
        return [node.base for node in self.cuts]

    @cached_property
    def part(self) -> Solid:
        """The part that the last cut took off, computed on demand: a search never uses most of them."""
        if self.parent is None:
            return self.solid
        whole = self.parent.solid
        return above(whole, self.base) if self.base.limbs_mm is None else cut(whole, self.base)[0]

    @cached_property
    def piece(self) -> TracedMesh:
        """The remaining solid as a mesh, with the source face in the model of each of its faces."""
        return self.places.piece(self.solid)

    @cached_property
    def remainder(self) -> Remainder:
        """The remaining solid in the form that the sweep takes."""
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
        """(m,) weight of a mm of rim on each face of the remainder."""
        return self.places.weights(self.piece)

    @cached_property
    def seams(self) -> tuple[Rim, ...]:
        """The seams of all cuts."""
        before, base = self.parent, self.base
        if before is None:
            return ()
        weights = before.seam_weights
        if base.limbs_mm is not None:
            weights = np.where(limb_faces(before.remainder, base), weights, 0.0)
        return (*before.seams, measure_rim(before.remainder.mesh, weights, base, self.terms.feather))

    @cached_property
    def risky_mm2(self) -> float:
        """Area of the remainder that needs support when it is printed straight up, weighted where the user wants none."""
        return self.remainder.risky_mm2

    @cached_property
    def residual_mm2(self) -> float:
        """Final cost of the parts cut off so far, mm2: a lower bound of the cost of every descendant."""
        return sum(node.cut_cost.residual_mm2 for node in self.cuts)

    @cached_property
    def lost_mm2(self) -> float:
        """Cost that the cuts so far have added, mm2."""
        return sum(node.cut_cost.lost_mm2 for node in self.cuts)

    @property
    def saved_mm2(self) -> float:
        """How much less the decomposition that stops here costs than the whole model, mm2."""
        return self.root.cost_mm2 - self.cost_mm2

    @cached_property
    def stairs_mm2(self) -> float:
        """Cost of the remainder's stair-stepping when it is printed straight up, mm2."""
        return self.remainder.stairs_mm2

    @property
    def cost_mm2(self) -> float:
        """Cost if the search stops here, mm2; the paper's J if seams cost nothing."""
        return self.risky_mm2 + self.stairs_mm2 + self.residual_mm2

    @cached_property
    def signature(self) -> tuple[float, ...]:
        """Key that is equal for different orders of the same cuts."""
        return (round(self.solid.volume(), 3), round(self.risky_mm2 + self.stairs_mm2, 3), round(self.residual_mm2, 3))

    def corners_cut(self, plane: Plane) -> Floats:
        """(n, 3) corners of the part that a plane would cut off: vertices, and crossing points of edges, without cutting."""
        return corners_above(self.remainder.mesh if plane.limbs_mm is None else limb_mesh(self.remainder, plane), plane)

    def sliver_mm(self, plane: Plane) -> float:
        """Thickness of the thinnest sliver that a cut of a plane's limbs would leave, mm."""
        limb = limb_vertices(self.remainder, plane)
        return sliver_mm(self.remainder.facets, limb, plane, frame_across(plane.normal))

    def release(self) -> None:
        """Drop large cached values, which are recomputed on demand: a search keeps all its nodes but returns to few."""
        for name in ("piece", "remainder", "seam_weights"):
            self.__dict__.pop(name, None)
