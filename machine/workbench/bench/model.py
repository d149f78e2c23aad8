"""Model: a model as read, whose triangles are in a file, so that they pass through no pipe and use memory only while needed; and
its placement, which moves planes and zones along."""

import pickle
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from secrets import token_hex
from typing import Any

import numpy as np
from numpy.typing import NDArray

from machine.workbench.bench.values import vector_of
from mdp.mesh import Floats, Mesh
from mdp.read import ReadModel
from mdp.search.plan_file import MOST_MM, ZONE_KINDS, PlannedPart
from mdp.zone import NO_ZONES, AnyZone, Grown, MeshVolume, Modifier, Zone, Zones
from profiles.errors import PlanError
from profiles.frozen import Vector

POINT_DIGITS, BOX_DIGITS = 3, 9  # digits after the point of mm, for points of marks and sides of boxes
LEVEL = 1e-9  # tolerance of a cosine: after quarter turns a box is along the plate's axes again


@dataclass(frozen=True, eq=False)
class Model:
    """A model as read: its name, its own file, the file of its mesh in mm on z = 0, and a sentence for each repair.

    key: identifies this reading; a page requests its triangles by it. zones: boxes marked in its file; shapes_file: other marks,
    None: there are none. plate: of a slicer file, None: the first of `plates`, number -> name. has_settings: its file contains
    settings.
    """

    name: str
    path: Path
    mesh_file: Path
    faces: int
    size_mm: Vector
    volume_mm3: float
    notes: tuple[str, ...] = ()
    key: str = field(default_factory=lambda: token_hex(8))
    zones: Zones = NO_ZONES
    plate: int | None = None
    shapes_file: Path | None = None
    plates: Mapping[int, str] = field(default_factory=dict)
    has_settings: bool = False

    @classmethod
    def stored(
        cls, name: str, path: Path, read: ReadModel, mesh_file: Path, plate: int | None = None, has_settings: bool = False
    ) -> "Model":
        """Write the mesh, and marks other than boxes, to files; boxes stay in memory, because they move with the bench."""
        mesh, zones = read.mesh, read.zones
        with mesh_file.open("wb") as file:
            file.writelines(mesh_blocks(mesh))
        size_mm = vector_of(np.ptp(mesh.bounds_mm, axis=0))
        shapes_file = None
        if zones.shapes != NO_ZONES:
            shapes_file = mesh_file.with_suffix(".marks")
            shapes_file.write_bytes(pickle.dumps(zones.shapes))
        return cls(
            name,
            path,
            mesh_file,
            len(mesh.faces),
            size_mm,
            mesh.volume_mm3,
            read.notes,
            zones=zones.boxes,
            plate=plate,
            shapes_file=shapes_file,
            plates=read.plates,
            has_settings=has_settings,
        )

    def shapes(self) -> Zones:
        """Marks of its file other than boxes, on the model as read."""
        if self.shapes_file is None:
            return NO_ZONES
        shapes: Zones = pickle.loads(self.shapes_file.read_bytes())  # written by this program into its own folder
        return shapes

    def mesh(self) -> Mesh:
        """Read its triangles."""
        with self.mesh_file.open("rb") as file:
            points, count = np.fromfile(file, "<u4", 2)
            vertices = np.fromfile(file, "<f8", 3 * points).reshape(-1, 3)
            faces = np.fromfile(file, "<i4", 3 * count).reshape(-1, 3)
            colours = np.fromfile(file, "<i4", count)
        return Mesh(vertices, faces, colours if len(colours) else None)


def mesh_blocks(mesh: Mesh) -> Iterator[memoryview]:
    """A mesh in the format of its file and the page, little-endian: two counts as uint32, vertices (n, 3) float64 in mm, faces
    (m, 3) int32, and the face colours of the model's file, (m,) int32, if any."""
    blocks: list[NDArray[np.generic]] = [
        np.array([len(mesh.vertices), len(mesh.faces)], "<u4"),
        mesh.vertices.astype("<f8", copy=False),
        mesh.faces.astype("<i4", copy=False),
    ]
    if mesh.colours is not None:
        blocks.append(mesh.colours.astype("<i4", copy=False))
    return (block.data.cast("B") for block in blocks)


@dataclass(frozen=True, eq=False)
class Placing:
    """Transformation from a model as read to the build plate: rotation (3, 3), scale, shift in mm."""

    turn: Floats
    factor: float
    shift_mm: Floats

    @classmethod
    def of(cls, model: Model, turned: Floats | None, lift_mm: float, factor: float = 1.0) -> "Placing":
        """Place a model on the build plate or a pedestal. turned: None: as read; factor: scale that was applied when it was
        read."""
        lift = np.array([0.0, 0.0, lift_mm])
        if turned is None:
            return cls(np.eye(3), factor, lift)
        places = model.mesh().vertices @ turned.T
        low, high = places.min(axis=0), places.max(axis=0)
        return cls(turned, factor, lift - (0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2]))

    def after(self, before: "Placing") -> "Placing":
        """Transformation from the model's previous placement to this one."""
        turn, factor = _between(before.turn, self.turn), self.factor / before.factor
        return Placing(turn, factor, self.shift_mm - factor * turn @ before.shift_mm)


def _between(before: Floats, after: Floats) -> Floats:
    """Rotation between two turns that may be rounded; it is not rounded itself, so that errors do not accumulate."""
    if np.array_equal(before, after):
        return np.eye(3)
    left, _, right = np.linalg.svd(after @ before.T)
    turn: Floats = left @ right
    return turn


def moved_zones(zones: Zones, move: Placing) -> Zones:
    """Move zones with the model. Raises PlanError for a mesh, and for a box outside the limits of a plan."""
    kinds: dict[str, Any] = {
        kind: tuple(_moved(zone, move, f"{kind} {number}") for number, zone in enumerate(getattr(zones, kind), start=1))
        for kind in ZONE_KINDS
    }
    modifiers = tuple(_moved_modifier(own, move, f"modifier {number}") for number, own in enumerate(zones.modifiers, start=1))
    return Zones(**kinds, modifiers=modifiers)


def moved_part(part: PlannedPart, move: Placing) -> PlannedPart:
    """Move the plane of a part with the model, if it is fully given."""
    if part.normal is None or part.offset_mm is None:
        return part
    normal = move.turn @ np.array(part.normal)
    limbs_mm = tuple(vector_of(move.factor * move.turn @ np.array(point) + move.shift_mm) for point in part.limbs_mm)
    offset_mm = move.factor * part.offset_mm + float(normal @ move.shift_mm)
    return replace(part, normal=vector_of(normal), offset_mm=offset_mm, limbs_mm=limbs_mm)


def _moved(zone: AnyZone, move: Placing, label: str) -> AnyZone:
    if isinstance(zone, Zone):
        return _moved_box(zone, move, label)
    if isinstance(zone, Grown):
        point_mm = move.factor * move.turn @ np.array(zone.point_mm) + move.shift_mm
        return replace(zone, point_mm=vector_of(np.round(point_mm, POINT_DIGITS)))
    if isinstance(zone, MeshVolume):
        raise PlanError(_immovable(zone, label))
    return zone


def _moved_modifier(modifier: Modifier, move: Placing, label: str) -> Modifier:
    if isinstance(modifier.volume, Zone):
        return replace(modifier, volume=_moved_box(modifier.volume, move, label))
    raise PlanError(_immovable(modifier.volume, label))


def _immovable(volume: MeshVolume, label: str) -> str:
    return f"{label}: its mesh lies where {volume.file.name} has it and cannot be moved with the model"


def _moved_box(box: Zone, move: Placing, label: str) -> Zone:
    room = None if box.room is None else _moved_box(box.room, move, label)
    axes = box.along(move.turn).T  # the box's own axes as rows
    low, high = (move.factor * np.array(corner) + axes @ move.shift_mm for corner in (box.min_mm, box.max_mm))
    level = np.round(axes)
    if np.abs(axes - level).max() > LEVEL:
        x, y, z = (vector_of(row) for row in axes)
        return Zone(*_sides(low, high, label), (x, y, z), room)
    low, high = level.T @ low, level.T @ high
    return Zone(*_sides(np.minimum(low, high), np.maximum(low, high), label), room=room)


def _sides(low: Floats, high: Floats, label: str) -> tuple[Vector, Vector]:
    """Corners clipped to the limits of a plan. Raises PlanError if nothing of the box is left."""
    least, most = (vector_of(np.round(np.clip(corner, -MOST_MM, MOST_MM), BOX_DIGITS) + 0.0) for corner in (low, high))
    if not all(x < y for x, y in zip(least, most, strict=True)):
        corners = " and ".join(f"{key} [{', '.join(f'{x:g}' for x in at)}]" for key, at in (("min_mm", low), ("max_mm", high)))
        raise PlanError(
            f"{label}: its box would have {corners}: {-MOST_MM:g} to {MOST_MM:g} is allowed, and it must have a volume"
        )
    return least, most
