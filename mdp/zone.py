"""Zone: a box of the workpiece frame, or faces of a colour, where a person wants no cut at all, or no seam.

Which colour means what is the person's to say: a colour alone marks nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from mdp.formats.surface import Indices
from mdp.mesh import Floats, Mesh
from mdp.overhang import Mask
from mdp.plane import Plane
from mdp.repair.edges import connected_components
from profiles.frozen import Vector

ROUNDING_MM = 1e-6  # a plane may touch what it must not pass through
MOST_PRODUCTS = 4_000_000  # of directions and points at a time


@dataclass(frozen=True)
class Zone:
    """A box by its least and greatest x, y, z, mm."""

    min_mm: Vector
    max_mm: Vector

    def spans_mm(self, directions: Floats) -> Floats:
        """(k, 1, 2) least and greatest direction . p over the box for (k, 3) directions."""
        middle, half = 0.5 * np.add(self.min_mm, self.max_mm), 0.5 * np.subtract(self.max_mm, self.min_mm)
        centre, reach = directions @ middle, np.abs(directions) @ half
        return np.stack([centre - reach, centre + reach], axis=1)[:, None]

    def touches(self, mesh: Mesh) -> Mask:
        """(m,) which faces reach into the box: no axis of a box, a triangle or two edges parts them (Akenine-Moeller)."""
        middle, half = 0.5 * np.add(self.min_mm, self.max_mm), 0.5 * np.subtract(self.max_mm, self.min_mm)
        corners = mesh.vertices[mesh.faces] - middle
        edges = np.roll(corners, -1, axis=1) - corners
        axes = [np.broadcast_to(axis, mesh.normals.shape) for axis in np.eye(3)]
        axes += [mesh.normals, *(np.cross(axis, edges[:, k]) for axis, k in product(np.eye(3), range(3)))]
        inside = np.ones(len(mesh.faces), dtype=np.bool_)
        for axis in axes:
            heights, reach = np.einsum("fci,fi->fc", corners, axis), np.abs(axis) @ half
            inside &= (heights.min(axis=1) <= reach) & (heights.max(axis=1) >= -reach)
        return inside


@dataclass(frozen=True)
class Painted:
    """All faces that the model's file paints with a colour, 0xRRGGBB."""

    colour: int


@dataclass(frozen=True, eq=False)
class Patches:
    """Faces of a model by what hangs together: the vertices of each patch, one patch after the other, and where each begins."""

    points: Floats
    starts: Indices

    @classmethod
    def of(cls, mesh: Mesh, colour: int) -> "Patches":
        """The faces of a mesh that have a colour."""
        faces = mesh.faces[_has(mesh, colour)].astype(np.int64)
        label = connected_components(len(mesh.vertices), faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel())
        vertices = np.unique(faces)
        vertices = vertices[np.argsort(label[vertices], kind="stable")]
        return cls(mesh.vertices[vertices], np.unique(label[vertices], return_index=True)[1])

    def spans_mm(self, directions: Floats) -> Floats:
        """(k, n, 2) spans of direction . p between which a plane passes through a patch, for (k, 3) directions; those that
        overlap are one, and where that leaves a direction fewer than others it ends in empty ones."""
        step = max(1, MOST_PRODUCTS // max(len(self.points), 1))
        low, high = np.empty((2, len(directions), len(self.starts)))
        for first in range(0, len(directions), step):
            heights = directions[first : first + step] @ self.points.T
            low[first : first + step] = np.minimum.reduceat(heights, self.starts, axis=1)
            high[first : first + step] = np.maximum.reduceat(heights, self.starts, axis=1)
        return _united(low + ROUNDING_MM, np.maximum(high - ROUNDING_MM, low + ROUNDING_MM))


def _united(low: Floats, high: Floats) -> Floats:
    """(k, n, 2) unions of (k, s) spans by rows."""
    order = np.argsort(low, axis=1)
    low, high = np.take_along_axis(low, order, 1), np.take_along_axis(high, order, 1)
    reach = np.maximum.accumulate(high, axis=1)
    begins = np.ones(low.shape, dtype=np.bool_)
    begins[:, 1:] = low[:, 1:] >= reach[:, :-1]
    group = np.cumsum(begins, axis=1) - 1
    spans = np.full((len(low), int(group.max(initial=-1)) + 1, 2), np.inf)
    rows = np.broadcast_to(np.arange(len(low))[:, None], low.shape)
    spans[rows[begins], group[begins], 0] = low[begins]
    spans[rows, group, 1] = reach  # the last one of a group is its greatest
    return spans


def _has(mesh: Mesh, colour: int) -> Mask:
    return np.zeros(len(mesh.faces), dtype=np.bool_) if mesh.colours is None else mesh.colours == colour


@dataclass(frozen=True)
class Zones:
    """What a person keeps the search out of. keep: no plane passes through; no_seam: rims there weigh many times."""

    keep: tuple[Zone | Painted, ...] = ()
    no_seam: tuple[Zone | Painted, ...] = ()

    def on(self, mesh: Mesh) -> "ZonesOnModel":
        """The zones with the faces that a model has of their colours."""
        keep = tuple(Patches.of(mesh, zone.colour) if isinstance(zone, Painted) else zone for zone in self.keep)
        boxes = tuple(zone for zone in self.no_seam if isinstance(zone, Zone))
        colours = [zone.colour for zone in self.no_seam if isinstance(zone, Painted)]
        faces = np.any([_has(mesh, colour) for colour in colours], axis=0) if colours else None
        return ZonesOnModel(keep, boxes, faces)


@dataclass(frozen=True, eq=False)
class ZonesOnModel:
    """The zones of a search. no_seam_faces: (m,) which of the model's faces are painted so; None: no colour says so."""

    keep: tuple[Zone | Patches, ...] = ()
    no_seam: tuple[Zone, ...] = ()
    no_seam_faces: Mask | None = None

    @property
    def keep_seams_away(self) -> bool:
        """Whether seams are unwanted anywhere."""
        return bool(self.no_seam) or self.no_seam_faces is not None

    def crossed(self, plane: Plane) -> int | None:
        """Number, from 1, of the first zone to keep whole that a plane passes through."""
        for number, zone in enumerate(self.keep, start=1):
            low, high = zone.spans_mm(plane.normal[None])[0].T
            if ((low < plane.offset_mm) & (plane.offset_mm < high)).any():
                return number
        return None


NO_ZONES, NOWHERE = Zones(), ZonesOnModel()


def touched(mesh: Mesh, zones: Sequence[Zone]) -> Mask:
    """(m,) which faces reach into any of the zones."""
    faces = np.zeros(len(mesh.faces), dtype=np.bool_)
    for zone in zones:
        faces |= zone.touches(mesh)
    return faces


def spans_mm(directions: Floats, zones: Sequence[Zone | Patches]) -> Floats:
    """(k, n, 2) spans of direction . p between which a plane passes through a zone, for (k, 3) directions."""
    return np.concatenate([np.zeros((len(directions), 0, 2)), *(zone.spans_mm(directions) for zone in zones)], axis=1)
