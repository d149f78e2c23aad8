"""Paths: what the slicer hands over; one object per path, one array row per point, all in the part frame."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import pi

import numpy as np

from mdp.mesh import Floats

ON_PLATE_MM = 0.35  # so high above the plate a bead still sags onto it


class Kind(StrEnum):
    """What a path is for; the values are the names that G-code viewers know from PrusaSlicer."""

    OUTER_WALL = "External perimeter"
    INNER_WALL = "Perimeter"
    OVERHANG = "Overhang perimeter"
    GAP = "Gap fill"
    INFILL = "Internal infill"
    SKIN = "Solid infill"
    TOP_SKIN = "Top solid infill"
    BRIDGE = "Bridge infill"
    IRONING = "Ironing"
    SKIRT = "Skirt/Brim"
    SUPPORT = "Support material"
    SUPPORT_INTERFACE = "Support material interface"
    PURGE = "Custom"


def bead_area_mm2(width_mm: float, height_mm: float) -> float:
    """Cross-section of a bead: a rectangle with half-round sides, (w - h) h + pi h^2 / 4 (PrusaSlicer's model)."""
    return (width_mm - height_mm) * height_mm + pi * height_mm**2 / 4.0


@dataclass(frozen=True, eq=False)
class Path:
    """One continuous bead.

    points: (n, 2) mm, n >= 2; a closed path repeats its first point at the end. flow: factor on the bead's volume.
    approach: (k, 2) mm, points that the travel to the first point passes, k >= 0. retract: pull the filament back
    during that travel. fan: part fan 0..1 where it differs from the layer's. below_mm: how far below the layer's z the path
    begins and ends; it climbs evenly between. wiped: whether the tip may go over it again while the filament is pulled back.
    """

    kind: Kind
    points: Floats
    width_mm: float
    speed_mm_s: float
    flow: float
    approach: Floats
    retract: bool
    fan: float | None = None
    below_mm: tuple[float, float] = (0.0, 0.0)
    wiped: bool = True

    @property
    def z_mm(self) -> Floats:
        """(n,) heights of the points over the layer's z, none above it."""
        begin, end = self.below_mm
        if begin == end:
            return np.full(len(self.points), -begin)
        done = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.points, axis=0).T))])
        heights: Floats = -begin + (begin - end) * done / done[-1]
        return heights

    @property
    def length_mm(self) -> float:
        """Length of the bead."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())


@dataclass(frozen=True, eq=False)
class Layer:
    """Paths printed with the tip at z_mm above the base plane, in order; every bead is height_mm high.

    nozzle_add_c: how much hotter than the material asks this layer is printed, deg C.
    """

    z_mm: float
    height_mm: float
    paths: tuple[Path, ...]
    fan: float
    nozzle_add_c: float = 0.0

    def volume_mm3(self, path: Path) -> float:
        """Plastic that a path of this layer extrudes."""
        return path.length_mm * bead_area_mm2(path.width_mm, self.height_mm) * path.flow


@dataclass(frozen=True)
class Unsupported:
    """A hanging place that could be given no support: its area seen from above, the layer with most of it, and why."""

    mm2: float
    layer: int
    reason: str


@dataclass(frozen=True, eq=False)
class SlicedPart:
    """A part's layers from its base plane upward; index and pose are those of the Part.

    unsupported: the places of it that no support could be given, reported as findings, the largest first, their layers
    counted from 1. interface_mm3: plastic that there would not be if the model were not cut, by the index of the part whose
    base lies there. too_thin: how many layers below its last one hold something, but nothing that a line is narrow enough for;
    too_thin_mm: where the first of them lies above the base plane. pins: how many it fills.
    """

    index: int
    layers: tuple[Layer, ...]
    unsupported: tuple[Unsupported, ...] = ()
    interface_mm3: Mapping[int, float] = field(default_factory=dict)
    too_thin: int = 0
    too_thin_mm: float = 0.0
    pins: int = 0

    @property
    def unsupported_mm2(self) -> float:
        """Area of all places without support."""
        return sum(area.mm2 for area in self.unsupported)

    @property
    def volume_mm3(self) -> float:
        """All plastic of the part, skirt and support included."""
        return sum(layer.volume_mm3(path) for layer in self.layers for path in layer.paths)
