"""Node: what remains of a model after some cuts, the unit of the search."""

from dataclasses import dataclass
from functools import cached_property

import manifold3d as m3

from mdp.cut import above, mesh_of
from mdp.overhang import risky_upright
from mdp.plane import Plane
from mdp.sweep import Remainder


@dataclass(frozen=True, eq=False)
class Cut:
    """A part cut off: its base plane, the solid it is cut off, and the area that stays risky on it."""

    base: Plane
    whole: m3.Manifold
    residual_mm2: float

    @cached_property
    def solid(self) -> m3.Manifold:
        """The part. Most of what a search cuts off is never looked at, so it is made when it is asked for."""
        return above(self.whole, self.base)


@dataclass(frozen=True, eq=False)
class Node:
    """What remains after some cuts, and how good that is; parent: the node before the last cut, None for the whole model."""

    solid: m3.Manifold
    cuts: tuple[Cut, ...]
    angle_deg: float
    count_platform_faces: bool
    parent: "Node | None" = None

    @cached_property
    def remainder(self) -> Remainder:
        """The remaining solid for the sweep."""
        mesh = mesh_of(self.solid)
        return Remainder(mesh, risky_upright(mesh, self.angle_deg, self.count_platform_faces))

    @cached_property
    def risky_mm2(self) -> float:
        """Risky area of what remains when it is printed straight up."""
        return float(self.remainder.mesh.areas_mm2[self.remainder.risky].sum())

    @cached_property
    def residual_mm2(self) -> float:
        """Area left risky on the parts cut off so far: a lower bound of the cost of every descendant."""
        return sum(c.residual_mm2 for c in self.cuts)

    @property
    def cost_mm2(self) -> float:
        """J of the paper when the search stops here."""
        return self.risky_mm2 + self.residual_mm2

    @cached_property
    def signature(self) -> tuple[float, ...]:
        """Equal for two orders of the same cuts."""
        return (round(self.solid.volume(), 3), round(self.risky_mm2, 3), round(self.residual_mm2, 3))
