"""Paths: the slicer's output, a table per layer with one row per stroke, in the part frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from math import isnan, pi
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mdp.mesh import Floats, Indices
from mdp.overhang import Mask
from slicer.geometry.polyline import along_mm, length_mm, lengths_mm

ON_PLATE_MM = 0.35  # height above the plate up to which a bead still sags onto it


class Kind(StrEnum):
    """The purpose of a path; the values are PrusaSlicer's names, which G-code viewers know."""

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


SKINS = (Kind.SKIN, Kind.TOP_SKIN, Kind.BRIDGE)
KINDS = tuple(Kind)
NUMBER = {kind: number for number, kind in enumerate(KINDS)}
Width = TypeVar("Width", float, Floats)


def bead_area_mm2(width_mm: Width, height_mm: float) -> Width:
    """Cross-section of a bead: a rectangle with half-round sides, (w - h) h + pi h^2 / 4 (PrusaSlicer's model)."""
    return (width_mm - height_mm) * height_mm + pi * height_mm**2 / 4.0


@dataclass(frozen=True, eq=False)
class Path:
    """One continuous bead, a row of a Layer.

    points: (n, 2) mm, n >= 2; a closed path repeats its first point. flow: factor on the bead's volume. approach: (k, 2) mm via
    points of the travel to the first point. retract: pull the filament back during that travel. fan: part fan 0..1 if it differs
    from the layer's. below_mm: depth below the layer's z at which the path begins and ends; it climbs evenly between. wiped:
    whether a wipe may pass over it again.
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
    def length_mm(self) -> float:
        """Length of the bead, mm."""
        return length_mm(self.points)


@dataclass(frozen=True, eq=False)
class Layer:
    """Strokes printed with the tip at z_mm above the base plane, in order, one row each; every bead is height_mm high.

    fan: of strokes without their own fan speed; nozzle_add_c: increase over the material's nozzle temperature, deg C. points: (n,
    2) mm; starts: (k + 1,) start of each stroke's points. Columns, (k,) each but for below_mm (k, 2): kind: index in KINDS;
    own_fan: NaN for the layer's; the others as in Path. approach: (m, 2), approach_starts: (k + 1,).
    """

    z_mm: float
    height_mm: float
    fan: float
    nozzle_add_c: float
    points: Floats
    starts: Indices
    kind: NDArray[np.int8]
    width_mm: Floats
    speed_mm_s: Floats
    flow: Floats
    own_fan: Floats
    retract: Mask
    wiped: Mask
    below_mm: Floats
    approach: Floats
    approach_starts: Indices

    @classmethod
    def of(cls, z_mm: float, height_mm: float, paths: Sequence[Path], fan: float, nozzle_add_c: float = 0.0) -> "Layer":
        """The table of a sequence of paths."""
        return cls(
            z_mm=z_mm,
            height_mm=height_mm,
            fan=fan,
            nozzle_add_c=nozzle_add_c,
            points=np.concatenate([np.zeros((0, 2)), *(path.points for path in paths)]),
            starts=np.cumsum([0, *(len(path.points) for path in paths)]),
            kind=np.array([NUMBER[path.kind] for path in paths], dtype=np.int8),
            width_mm=np.array([path.width_mm for path in paths]),
            speed_mm_s=np.array([path.speed_mm_s for path in paths]),
            flow=np.array([path.flow for path in paths]),
            own_fan=np.array([np.nan if path.fan is None else path.fan for path in paths]),
            retract=np.array([path.retract for path in paths], dtype=np.bool_),
            wiped=np.array([path.wiped for path in paths], dtype=np.bool_),
            below_mm=np.array([path.below_mm for path in paths]).reshape(-1, 2),
            approach=np.concatenate([np.zeros((0, 2)), *(path.approach.reshape(-1, 2) for path in paths)]),
            approach_starts=np.cumsum([0, *(len(path.approach) for path in paths)]),
        )

    def __len__(self) -> int:
        return len(self.kind)

    @property
    def paths(self) -> tuple[Path, ...]:
        """The rows as Path objects."""
        points, approaches = np.split(self.points, self.starts[1:-1]), np.split(self.approach, self.approach_starts[1:-1])
        numbers = (self.kind, self.width_mm, self.speed_mm_s, self.flow, self.own_fan, self.below_mm, self.retract, self.wiped)
        rows = zip(*(column.tolist() for column in numbers), points, approaches, strict=True) if len(self) else ()
        return tuple(
            Path(KINDS[kind], way, width, speed, flow, passed, pulls, None if isnan(fan) else fan, (begin, end), wiped)
            for kind, width, speed, flow, fan, (begin, end), pulls, wiped, way, passed in rows
        )

    @property
    def points_mm(self) -> Floats:
        """(n, 3) points in the part frame; a stroke climbs evenly from one below_mm to the other."""
        placed = np.empty((len(self.points), 3))
        placed[:, :2], placed[:, 2] = self.points, self.z_mm
        for k in np.flatnonzero(self.below_mm.any(axis=1)).tolist():
            a, b = self.starts[k], self.starts[k + 1]
            done = along_mm(self.points[a:b])
            begin, end = self.below_mm[k]
            placed[a:b, 2] += -begin + (begin - end) * done / max(float(done[-1]), 1e-12)
        return placed

    @property
    def volumes_mm3(self) -> Floats:
        """(k,) volume of plastic of each stroke, mm3."""
        return lengths_mm(self.points, self.starts) * bead_area_mm2(self.width_mm, self.height_mm) * self.flow

    def is_of(self, *kinds: Kind) -> Mask:
        """(k,) whether each stroke is of one of some kinds."""
        return is_of(self.kind, kinds)


def is_of(kind: NDArray[np.int8], kinds: Sequence[Kind]) -> Mask:
    """(k,) whether each of the strokes, given by numbers of kinds, is of one of some kinds."""
    marks = np.zeros(len(KINDS), np.bool_)
    marks[[NUMBER[one] for one in kinds]] = True
    return marks[kind]


@dataclass(frozen=True)
class Unsupported:
    """An overhanging area that support cannot reach: its projected area, the layer with most of it, and the reason."""

    mm2: float
    layer: int
    reason: str


@dataclass(frozen=True, eq=False)
class SlicedPart:
    """A part's layers from its base plane upward; index and pose are those of the Part.

    unsupported: areas without support, reported as findings, largest first, their layers counted from 1. interface_mm3: plastic
    that the uncut model would not have, by the index of the part whose base lies there. too_thin: number of layers below its last
    one that are too thin for any line, for a vase those above its last one; too_thin_mm: height of the first of them above the
    base plane, where a vase ends. pins: number of pins that it fills.
    """

    index: int
    layers: tuple[Layer, ...]
    unsupported: tuple[Unsupported, ...] = ()
    interface_mm3: Mapping[int, float] = field(default_factory=dict)
    too_thin: int = 0
    too_thin_mm: float = 0.0
    pins: int = 0

    @property
    def points_mm(self) -> Floats:
        """(n, 3) points of all strokes in the part frame."""
        return np.concatenate([layer.points_mm for layer in self.layers])

    def moved(self, x_mm: float, y_mm: float) -> "SlicedPart":
        """The part with its layers shifted in its frame."""
        by_mm = np.array([x_mm, y_mm])
        if not by_mm.any():
            return self
        layers = [replace(layer, points=layer.points + by_mm, approach=layer.approach + by_mm) for layer in self.layers]
        return replace(self, layers=tuple(layers))

    @property
    def unsupported_mm2(self) -> float:
        """Total area without support, mm2."""
        return sum(area.mm2 for area in self.unsupported)

    @property
    def volume_mm3(self) -> float:
        """Total plastic of the part, including skirt and support, mm3."""
        return float(sum(layer.volumes_mm3.sum() for layer in self.layers))
