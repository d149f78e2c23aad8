"""Model: a model as it is read. Its triangles are in a file, so that they go through no pipe and lie in no memory for longer than
they are worked with."""

import pickle
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from secrets import token_hex

import numpy as np
from numpy.typing import NDArray

from machine.workbench.bench.values import vector_of
from mdp.mesh import Mesh
from mdp.read import ReadModel
from mdp.zone import NO_ZONES, Zones
from profiles.frozen import Vector


@dataclass(frozen=True, eq=False)
class Model:
    """A model as it is read: its name, its own file, the file of its mesh in mm on z = 0, and a sentence for every repair.

    key: what tells it from every other reading; a page asks for its triangles by it. zones: the boxes that its file marks;
    shapes_file: with what else it marks, None: nothing. plate: of a slicer file, None: the first of `plates`, which are their
    names by their numbers. has_settings: its file keeps some.
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
        """One whose mesh is written to a file first, and marks that are no boxes to another; boxes move with the bench."""
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
        """What its file marks that is no box, on the model as it is read."""
        if self.shapes_file is None:
            return NO_ZONES
        shapes: Zones = pickle.loads(self.shapes_file.read_bytes())  # written by this program into its own folder
        return shapes

    def mesh(self) -> Mesh:
        """Its triangles, read anew."""
        with self.mesh_file.open("rb") as file:
            points, count = np.fromfile(file, "<u4", 2)
            vertices = np.fromfile(file, "<f8", 3 * points).reshape(-1, 3)
            faces = np.fromfile(file, "<i4", 3 * count).reshape(-1, 3)
            colours = np.fromfile(file, "<i4", count)
        return Mesh(vertices, faces, colours if len(colours) else None)


def mesh_blocks(mesh: Mesh) -> Iterator[memoryview]:
    """A mesh as its file and the page have it: two counts as uint32, vertices (n, 3) float64 in mm, faces (m, 3) int32, and what
    the model's file paints each face with, (m,) int32, if anything; all little-endian."""
    blocks: list[NDArray[np.generic]] = [
        np.array([len(mesh.vertices), len(mesh.faces)], "<u4"),
        mesh.vertices.astype("<f8", copy=False),
        mesh.faces.astype("<i4", copy=False),
    ]
    if mesh.colours is not None:
        blocks.append(mesh.colours.astype("<i4", copy=False))
    return (block.data.cast("B") for block in blocks)
