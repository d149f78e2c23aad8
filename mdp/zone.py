"""Zones: boxes of the workpiece frame or faces of a surface that the user marks for no cut, no seam, no support or support, and
modifiers: volumes with other settings.

Faces are named by a colour of the model's file, by a point and an angle up to which the region around it grows, or by their
numbers. The meaning of a colour is the user's choice: a colour alone marks nothing.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import product
from math import cos, radians
from pathlib import Path
from typing import Any

import numpy as np

from mdp.head import corners
from mdp.mesh import Floats, Indices, Ints, Mesh
from mdp.overhang import Mask
from mdp.plane import Plane
from mdp.topology.components import connected_components, vertex_components
from mdp.topology.edges import edges_of
from profiles.errors import PlanError
from profiles.frozen import Vector

FARTHEST_MM = 1.0  # greatest distance of a point from the surface that it marks
MOST_GROWN_DEG = 180.0  # greatest angle between two normals
ROUNDING_COSINE = 1e-6  # an angle of 0 selects the faces of a flat region
ROUNDING_MM = 1e-6  # a plane may touch a zone that it must not pass through
# resolution for comparing points; shifted, since coordinates lie on whole and half micrometres
GRID_MM, GRID_SHIFT = 1e-4, 0.3141
FACE_NUMBERS = re.compile(r"\d{1,9}(-\d{1,9})?( \d{1,9}(-\d{1,9})?)*")
MOST_PRODUCTS = 4_000_000  # pairs of a direction and a point that are processed at a time


@dataclass(frozen=True)
class Zone:
    """A box by its least and greatest x, y, z, mm. axes: rows of the rotation to these coordinates, None for those of the frame.
    room: a box around the zone's model, to which the zone is limited; None if there are no other models.
    """

    min_mm: Vector
    max_mm: Vector
    axes: tuple[Vector, Vector, Vector] | None = None
    room: "Zone | None" = None

    def along(self, places: Floats) -> Floats:
        """(..., 3) points or directions of the frame in the box's own coordinates."""
        return places if self.axes is None else places @ np.array(self.axes).T

    @property
    def corners(self) -> Floats:
        """(8, 3) corners of the box."""
        own = corners(self.min_mm, self.max_mm)
        return own if self.axes is None else own @ np.array(self.axes)

    def transform(self, rotation: Floats, shift_mm: Floats) -> "Zone":
        """The box after moving every point p to rotation @ p + shift_mm."""
        axes = self.axes
        if not np.array_equal(rotation, np.eye(3)):
            x, y, z = ((np.eye(3) if axes is None else np.array(axes)) @ rotation.T).tolist()
            axes = (x[0], x[1], x[2]), (y[0], y[1], y[2]), (z[0], z[1], z[2])
        shift = shift_mm if axes is None else np.array(axes) @ shift_mm
        low, high = (np.add(corner, shift).tolist() for corner in (self.min_mm, self.max_mm))
        room = None if self.room is None else self.room.transform(rotation, shift_mm)
        return Zone((low[0], low[1], low[2]), (high[0], high[1], high[2]), axes, room)

    def spans_mm(self, directions: Floats) -> Floats:
        """(k, 1, 2) least and greatest direction . p over the box for (k, 3) directions."""
        middle, half = 0.5 * np.add(self.min_mm, self.max_mm), 0.5 * np.subtract(self.max_mm, self.min_mm)
        own = self.along(directions)
        centre, reach = own @ middle, np.abs(own) @ half
        return np.stack([centre - reach, centre + reach], axis=1)[:, None]

    def faces(self, mesh: Mesh) -> Mask:
        """(m,) faces that extend into the box: no axis of the box, normal of the triangle or product of edges separates them
        (Akenine-Moeller).
        """
        middle, half = 0.5 * np.add(self.min_mm, self.max_mm), 0.5 * np.subtract(self.max_mm, self.min_mm)
        places, normals = self.along(mesh.vertices)[mesh.faces] - middle, self.along(mesh.normals)
        edges = np.roll(places, -1, axis=1) - places
        axes = [np.broadcast_to(axis, normals.shape) for axis in np.eye(3)]
        axes += [normals, *(np.cross(axis, edges[:, k]) for axis, k in product(np.eye(3), range(3)))]
        inside = np.ones(len(mesh.faces), dtype=np.bool_)
        for axis in axes:
            heights, reach = np.einsum("fci,fi->fc", places, axis), np.abs(axis) @ half
            inside &= (heights.min(axis=1) <= reach) & (heights.max(axis=1) >= -reach)
        return inside if self.room is None else inside & self.room.faces(mesh)


@dataclass(frozen=True)
class Painted:
    """All faces that the model's file paints with a colour, 0xRRGGBB."""

    colour: int

    def transform(self, rotation: Floats, shift_mm: Floats) -> "Painted":
        """The zone itself: painted faces stay the same wherever the model is."""
        return self

    def faces(self, mesh: Mesh) -> Mask:
        """(m,) faces of a mesh with the colour."""
        return np.zeros(len(mesh.faces), dtype=np.bool_) if mesh.colours is None else mesh.colours == self.colour


@dataclass(frozen=True, eq=False)
class KeptFaces:
    """Connected patches of a model's faces: their vertices, patch by patch, and the start of each patch."""

    points: Floats
    starts: Indices

    @classmethod
    def of(cls, mesh: Mesh, chosen: Mask) -> "KeptFaces":
        """The patches of the chosen (m,) faces of a mesh."""
        faces = mesh.faces[chosen]
        label = vertex_components(len(mesh.vertices), faces)
        vertices = np.unique(faces)
        vertices = vertices[np.argsort(label[vertices], kind="stable")]
        return cls(mesh.vertices[vertices], np.unique(label[vertices], return_index=True)[1])

    def spans_mm(self, directions: Floats) -> Floats:
        """(k, n, 2) spans of direction . p in which a plane passes through a patch, for (k, 3) directions; overlapping spans are
        merged, and unused entries at the end are empty.
        """
        step = max(1, MOST_PRODUCTS // max(len(self.points), 1))
        low, high = np.empty((2, len(directions), len(self.starts)))
        for first in range(0, len(directions), step):
            heights = directions[first : first + step] @ self.points.T
            low[first : first + step] = np.minimum.reduceat(heights, self.starts, axis=1)
            high[first : first + step] = np.maximum.reduceat(heights, self.starts, axis=1)
        return _united(low + ROUNDING_MM, np.maximum(high - ROUNDING_MM, low + ROUNDING_MM))


def _united(low: Floats, high: Floats) -> Floats:
    """(k, n, 2) row-wise unions of (k, s) spans."""
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


@dataclass(frozen=True)
class Grown:
    """The faces connected with the one at a point of the workpiece frame whose normals deviate from its normal by at most
    angle_deg.
    """

    point_mm: Vector
    angle_deg: float

    def transform(self, rotation: Floats, shift_mm: Floats) -> "Grown":
        """The zone after moving its point p to rotation @ p + shift_mm."""
        x, y, z = (rotation @ np.array(self.point_mm) + shift_mm).tolist()
        return replace(self, point_mm=(x, y, z))

    def faces(self, mesh: Mesh) -> Mask:
        """(m,) faces of a mesh in the zone; faces without area count if they connect others."""
        face = mesh.nearest_face(np.array(self.point_mm))[0]
        alike = mesh.normals @ mesh.normals[face] >= cos(radians(self.angle_deg)) - ROUNDING_COSINE
        alike |= mesh.areas_mm2 == 0.0
        pairs = edges_of(mesh.faces.astype(np.int64)).twins // 3
        pairs = pairs[alike[pairs].all(axis=1)]
        label = connected_components(len(mesh.faces), pairs[:, 0], pairs[:, 1])
        together: Mask = np.equal(label, label[face])
        return together

    def away_mm(self, mesh: Mesh) -> float:
        """Distance of the point from the surface, mm."""
        return mesh.nearest_face(np.array(self.point_mm))[1]


@dataclass(frozen=True)
class Brushed:
    """Faces of the model by their numbers from 0, as a brush marks them: numbers and ranges, for example "0-11 15 20-24"."""

    numbers: str

    def __post_init__(self) -> None:
        """Raises ValueError for text that is not a list of face numbers."""
        if not FACE_NUMBERS.fullmatch(self.numbers) or any(last < first for first, last in self.ranges):
            raise ValueError('numbers and ranges of faces are expected, as "0-11 15 20-24"')

    @classmethod
    def of(cls, chosen: Mask) -> "Brushed":
        """The chosen (m,) faces, at least one."""
        ends = np.flatnonzero(np.diff(chosen, prepend=False, append=False)).reshape(-1, 2).tolist()
        return cls(" ".join(f"{first}" if end == first + 1 else f"{first}-{end - 1}" for first, end in ends))

    @property
    def ranges(self) -> Iterator[tuple[int, int]]:
        """First and last number of every range."""
        for text in self.numbers.split():
            first, _, last = text.partition("-")
            yield int(first), int(last or first)

    def transform(self, rotation: Floats, shift_mm: Floats) -> "Brushed":
        """The zone itself: the faces keep their numbers wherever the model is."""
        return self

    def faces(self, mesh: Mesh) -> Mask:
        """(m,) faces of a mesh in the zone; numbers beyond its last face are ignored."""
        chosen = np.zeros(len(mesh.faces), dtype=np.bool_)
        for first, last in self.ranges:
            chosen[first : last + 1] = True
        return chosen

    def check_on(self, mesh: Mesh, where: str = "") -> None:
        """Raises PlanError if the mesh lacks one of the faces. where: what the sentence begins with."""
        last, count = max(last for _, last in self.ranges), len(mesh.faces)
        if last >= count:
            raise PlanError(f"{where}faces has {last}, but the model's {count} faces are numbered from 0 to {count - 1}")


@dataclass(frozen=True, eq=False)
class Triangles:
    """Faces of a model given by the positions of their corners, (k, 3, 3)."""

    corners: Floats

    def transform(self, rotation: Floats, shift_mm: Floats) -> "Triangles":
        """The zone after moving every corner p to rotation @ p + shift_mm."""
        return Triangles(self.corners @ rotation.T + shift_mm)

    def faces(self, mesh: Mesh) -> Mask:
        """(m,) faces of a mesh in the zone, matched by their centres to a tenth of a micrometre."""
        middles = [corners.mean(axis=1) for corners in (self.corners, mesh.vertices[mesh.faces])]
        cells = [np.floor(places / GRID_MM + GRID_SHIFT).astype(np.int64) for places in middles]
        _, cell = np.unique(np.concatenate(cells), axis=0, return_inverse=True)
        count = len(self.corners)
        found: Mask = np.isin(cell.ravel()[count:], cell.ravel()[:count])
        return found


@dataclass(frozen=True)
class MeshVolume:
    """A closed mesh in the workpiece frame, and the file from which it was read. room: as in Zone."""

    file: Path
    mesh: Mesh = field(compare=False, repr=False)
    room: Zone | None = None

    def transform(self, rotation: Floats, shift_mm: Floats) -> "MeshVolume":
        """The volume after moving every point p to rotation @ p + shift_mm."""
        room = None if self.room is None else self.room.transform(rotation, shift_mm)
        return replace(self, mesh=self.mesh.transform(rotation, shift_mm), room=room)

    @property
    def box(self) -> Zone:
        """The bounding box."""
        (x0, y0, z0), (x1, y1, z1) = self.mesh.bounds_mm.tolist()
        return Zone((x0, y0, z0), (x1, y1, z1), room=self.room)

    def faces(self, mesh: Mesh) -> Mask:
        """(m,) faces of a mesh that extend into the bounding box."""
        return self.box.faces(mesh)


Volume = Zone | MeshVolume


def in_room(volume: Volume, room: Zone) -> Volume:
    """A volume limited to a box around its model as well, for a plate with several models."""
    return replace(volume, room=replace(room, room=volume.room))


AnyZone = Zone | MeshVolume | Painted | Grown | Brushed | Triangles


@dataclass(frozen=True)
class Modifier:
    """A volume with other values of process settings, by their keys."""

    volume: Volume
    process: dict[str, Any]

    def transform(self, rotation: Floats, shift_mm: Floats) -> "Modifier":
        """The modifier after moving every point p to rotation @ p + shift_mm."""
        return replace(self, volume=self.volume.transform(rotation, shift_mm))


@dataclass(frozen=True)
class Zones:
    """The zones that a user marks on a model.

    keep: no plane passes through; no_seam: rims there have a large weight, and z-seams avoid them; no_support: overhangs there
    get no support and have a large weight; support: all overhangs there get support; modifiers: volumes with other settings,
    where later ones override earlier ones.
    """

    keep: tuple[AnyZone, ...] = ()
    no_seam: tuple[AnyZone, ...] = ()
    no_support: tuple[AnyZone, ...] = ()
    support: tuple[AnyZone, ...] = ()
    modifiers: tuple[Modifier, ...] = ()

    def on(self, mesh: Mesh) -> "ZonesOnModel":
        """The zones resolved to the faces of a model."""
        keep = tuple(zone if isinstance(zone, Zone) else KeptFaces.of(mesh, zone.faces(mesh)) for zone in self.keep)
        no_seam, no_support, support = (Marked.of(mesh, zones) for zones in (self.no_seam, self.no_support, self.support))
        return ZonesOnModel(keep, no_seam, no_support, support, self.modifiers)

    def transform(self, rotation: Floats, shift_mm: Floats) -> "Zones":
        """The zones after moving every point p to rotation @ p + shift_mm."""
        return self._each(lambda zones: tuple(zone.transform(rotation, shift_mm) for zone in zones))

    def _each(self, change: Callable[[tuple[Any, ...]], tuple[Any, ...]]) -> "Zones":
        """The zones with every kind, modifiers included, changed by a function."""
        return Zones(*(change(getattr(self, kind.name)) for kind in fields(self)))

    @property
    def count(self) -> int:
        """The number of zones."""
        return sum(len(getattr(self, entry.name)) for entry in fields(self))

    @property
    def boxes(self) -> "Zones":
        """The zones that are boxes."""
        return self._each(lambda zones: tuple(filter(_is_box, zones)))

    @property
    def shapes(self) -> "Zones":
        """The zones that are not boxes."""
        return self._each(lambda zones: tuple(zone for zone in zones if not _is_box(zone)))

    def beside(self, others: "Zones") -> "Zones":
        """These zones and others; where modifiers of both overlap, the others override."""
        return Zones(*(getattr(self, entry.name) + getattr(others, entry.name) for entry in fields(self)))


def _is_box(zone: "AnyZone | Modifier") -> bool:
    return isinstance(zone.volume if isinstance(zone, Modifier) else zone, Zone)


@dataclass(frozen=True, eq=False)
class Marked:
    """The marks of one kind: volumes of the workpiece frame, and (m,) faces of a mesh; None if no faces are marked."""

    volumes: tuple[Volume, ...] = ()
    faces: Mask | None = None

    @classmethod
    def of(cls, mesh: Mesh, zones: Sequence[AnyZone]) -> "Marked":
        """The marks of some zones on a mesh."""
        named = [zone.faces(mesh) for zone in zones if not isinstance(zone, Volume)]
        volumes = tuple(zone for zone in zones if isinstance(zone, Volume))
        return cls(volumes, np.any(named, axis=0) if named else None)

    @property
    def anywhere(self) -> bool:
        """Whether anything is marked."""
        return bool(self.volumes) or self.faces is not None

    def among(self, sources: Ints) -> "Marked":
        """The marks on a piece of the mesh. sources: (k,) source face in the mesh of each of the piece's faces, negative if it
        has none.
        """
        if self.faces is None:
            return self
        known = (sources >= 0) & (sources < len(self.faces))
        return replace(self, faces=known & self.faces[np.where(known, sources, 0)])

    def transform(self, rotation: Floats, shift_mm: Floats) -> "Marked":
        """The marks after moving every vertex v of the mesh to rotation @ v + shift_mm."""
        return replace(self, volumes=tuple(volume.transform(rotation, shift_mm) for volume in self.volumes))

    def within(self, room: Zone) -> "Marked":
        """The marks limited to a box around the mesh."""
        return replace(self, volumes=tuple(in_room(volume, room) for volume in self.volumes))

    @classmethod
    def together(cls, marks: Sequence[tuple["Marked", int]]) -> "Marked":
        """The marks of several meshes that become one, each given with its number of faces."""
        volumes = tuple(volume for mark, _ in marks for volume in mark.volumes)
        if all(mark.faces is None for mark, _ in marks):
            return cls(volumes)
        faces = [np.zeros(count, dtype=np.bool_) if mark.faces is None else mark.faces for mark, count in marks]
        return cls(volumes, np.concatenate(faces))

    def touched(self, mesh: Mesh) -> Mask:
        """(m,) faces of the mesh that are marked or extend into a marked volume."""
        faces = touched(mesh, self.volumes)
        return faces if self.faces is None else faces | self.faces


@dataclass(frozen=True, eq=False)
class ZonesOnModel:
    """The zones of a search, resolved to faces of the model."""

    keep: tuple[Zone | KeptFaces, ...] = ()
    no_seam: Marked = Marked()
    no_support: Marked = Marked()
    support: Marked = Marked()
    modifiers: tuple[Modifier, ...] = ()

    @property
    def by_face(self) -> bool:
        """Whether the source face of each face of a part matters."""
        return self.no_seam.faces is not None or self.no_support.anywhere or self.support.faces is not None

    def crossed(self, plane: Plane) -> int | None:
        """Number, from 1, of the first [[keep]] zone that a plane passes through; None if there is none."""
        for number, zone in enumerate(self.keep, start=1):
            low, high = zone.spans_mm(plane.normal[None])[0].T
            if ((low < plane.offset_mm) & (plane.offset_mm < high)).any():
                return number
        return None


NO_ZONES, NOWHERE, UNMARKED = Zones(), ZonesOnModel(), Marked()


def touched(mesh: Mesh, zones: Sequence[Volume]) -> Mask:
    """(m,) faces that extend into any of the zones."""
    faces = np.zeros(len(mesh.faces), dtype=np.bool_)
    for zone in zones:
        faces |= zone.faces(mesh)
    return faces


def spans_mm(directions: Floats, zones: Sequence[Zone | KeptFaces]) -> Floats:
    """(k, n, 2) spans of direction . p in which a plane passes through a zone, for (k, 3) directions."""
    return np.concatenate([np.zeros((len(directions), 0, 2)), *(zone.spans_mm(directions) for zone in zones)], axis=1)
