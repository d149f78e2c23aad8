"""Mesh: a closed, oriented triangle mesh in mm with its measures and face colours (integers 0xRRGGBB)."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from profiles.errors import MeshError

if TYPE_CHECKING:
    from trimesh import Trimesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Indices = NDArray[np.int64]
NO_COLOUR = -1  # colours are 0xRRGGBB
WRITTEN_COLOUR = re.compile(r"#([0-9a-fA-F]{6})(?:[0-9a-fA-F]{2})?")


def dot(vectors: Floats, direction: Floats) -> Floats:
    """(n,) dot products of (n, 3) vectors with one direction.

    Written out so that the result is the same on every machine; numpy's library for products also waits for its threads by
    spinning, which on two busy cores costs more than the products.
    """
    x, y, z = (float(value) for value in direction)
    products: Floats = vectors[:, 0] * x
    products += vectors[:, 1] * y
    products += vectors[:, 2] * z
    return products


def crosses_of(vertices: Floats, faces: Ints | Indices) -> Floats:
    """(m, 3) normals of the faces, with twice their area as length."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def areas_of(vertices: Floats, faces: Ints | Indices) -> Floats:
    """(m,) areas of the faces."""
    areas: Floats = 0.5 * np.linalg.norm(crosses_of(vertices, faces), axis=1)
    return areas


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed, consistently outward-oriented triangle mesh.

    vertices: (n, 3) float64, mm; faces: (m, 3) int32, counter-clockwise seen from outside; colours: (m,) colour of each face in
    the model's file, NO_COLOUR if unpainted; None if the file has no colours. The arrays are read-only.
    """

    vertices: Floats
    faces: Ints
    colours: Ints | None = None

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=np.float64, order="C")
        faces = np.array(self.faces, dtype=np.int32, order="C")
        vertices.setflags(write=False)
        faces.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)
        if self.colours is not None:
            colours = np.array(self.colours, dtype=np.int32)
            colours.setflags(write=False)
            object.__setattr__(self, "colours", colours)

    @cached_property
    def _crosses(self) -> Floats:
        return crosses_of(self.vertices, self.faces)

    @cached_property
    def areas_mm2(self) -> Floats:
        """(m,) areas of the faces."""
        areas: Floats = 0.5 * np.linalg.norm(self._crosses, axis=1)
        return areas

    @cached_property
    def normals(self) -> Floats:
        """(m, 3) unit outward normals; zero for a face without area."""
        lengths = 2.0 * self.areas_mm2
        return self._crosses / np.where(lengths > 0, lengths, 1.0)[:, None]

    @cached_property
    def volume_mm3(self) -> float:
        """Volume by the divergence theorem, about the box centre for accuracy."""
        middle = 0.5 * (self.bounds_mm[0] + self.bounds_mm[1])
        corner = self.vertices[self.faces[:, 0]] - middle
        return float(np.einsum("ij,ij->", corner, self._crosses) / 6.0)

    @cached_property
    def bounds_mm(self) -> Floats:
        """(2, 3) least and greatest coordinates."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def transform(self, rotation: Any, shift_mm: Any = (0.0, 0.0, 0.0)) -> "Mesh":
        """The mesh with every vertex v at rotation @ v + shift_mm; rotation is (3, 3)."""
        vertices = self.vertices @ np.asarray(rotation, dtype=np.float64).T + np.asarray(shift_mm, dtype=np.float64)
        return Mesh(vertices, self.faces, self.colours)

    def nearest_face(self, point: Floats) -> tuple[int, float]:
        """The nearest face with an area to a point (3,), the first of several, and its distance, mm."""
        corners = self.vertices[self.faces] - point
        edges = np.roll(corners, -1, axis=1) - corners
        lengths = np.einsum("fki,fki->fk", edges, edges)
        share = np.clip(-np.einsum("fki,fki->fk", corners, edges) / np.where(lengths > 0.0, lengths, 1.0), 0.0, 1.0)
        least = np.linalg.norm(corners + share[..., None] * edges, axis=2).min(axis=1)
        sides = np.einsum("fki,fki->fk", np.cross(corners, edges), self.normals[:, None])  # side of the point's projection
        height = np.abs(np.einsum("fi,fi->f", corners[:, 0], self.normals))
        distance = np.where((sides >= 0.0).all(axis=1), height, least)
        distance[self.areas_mm2 == 0.0] = np.inf
        face = int(np.argmin(distance))
        return face, float(distance[face])

    def distance_mm(self, point: Floats) -> float:
        """Distance of a point (3,) from the surface; 0 at a vertex."""
        at_vertex = (self.vertices == point).all(axis=1).any()
        return 0.0 if at_vertex else self.nearest_face(point)[1]

    def to_trimesh(self) -> "Trimesh":
        """The mesh as a trimesh.Trimesh, for other programs; vertices and faces stay as they are."""
        from trimesh import Trimesh

        return Trimesh(self.vertices, self.faces, process=False)

    @classmethod
    def from_trimesh(cls, mesh: "Trimesh") -> "Mesh":
        """A mesh from a closed trimesh.Trimesh in mm, neither repaired nor moved; mdp.read does both with a file.

        Raises MeshError for a trimesh that is open, inconsistently wound or inside out.
        """
        if not (mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0.0):
            raise MeshError("the trimesh is not a solid: a closed, consistently wound mesh with outward normals is expected")
        return cls(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def parse_colour(text: str) -> int | None:
    """The colour of #RRGGBB or #RRGGBBAA, whose alpha is ignored; None for anything else."""
    match = WRITTEN_COLOUR.fullmatch(text.strip())
    return None if match is None else int(match[1], 16)


def colour_text(colour: int) -> str:
    """A colour as #rrggbb."""
    return f"#{colour:06x}"


def together(meshes: Sequence[Mesh]) -> Mesh:
    """Several meshes as one mesh, their vertices and faces one after the other."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + begin for mesh, begin in zip(meshes, first, strict=False)]
    colours = None
    if any(mesh.colours is not None for mesh in meshes):
        bare = [np.full(len(mesh.faces), NO_COLOUR) if mesh.colours is None else mesh.colours for mesh in meshes]
        colours = np.concatenate(bare)
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces), colours)
