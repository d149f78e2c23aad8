"""Surface: triangles as read from a file, with indices and coordinates checked and no other guarantees."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from mdp.mesh import NO_COLOUR, Floats, Indices
from profiles.errors import MeshError

# Limits of what a file may place by reference: a small file whose references double at every level would exceed any memory.
MOST_PLACED = 20_000  # objects, components and nodes
MOST_PLACED_MESHES = 2_000  # greatest number of placed meshes, which are united where they touch
MOST_PLACED_FACES = 20_000_000  # as many as the largest STL file holds (mdp.read.MOST_BYTES)


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles as read from a file. vertices: (n, 3) float64 in the file's coordinates; faces: (m, 3) int64, wound as in the
    file, possibly open or intersecting; colours: (m,) colour of each face, NO_COLOUR if unpainted, None if there are no colours
    or they are unknown; name: of the part that this surface is or begins, "" if unnamed; gap: greatest distance between the edges
    of adjoining faces; notes: sentences on what the reader has left out.
    """

    vertices: Floats
    faces: Indices
    colours: Indices | None = None
    name: str = ""
    gap: float = 0.0
    notes: tuple[str, ...] = ()


def text_lines(path: Path, continued: str = "") -> list[str]:
    """The lines of a text file with any line endings; a line that ends with `continued` continues in the next. Bytes map to
    themselves: 0x85, a line end for str.splitlines, may be an ellipsis or half a letter in a comment.
    """
    text = path.read_text("latin-1")
    return (text.replace(f"{continued}\n", " ") if continued else text).split("\n")


def check_surface(path: Path, vertices: Any, faces: Any, colours: Indices | None = None) -> Surface:
    """A surface with finite coordinates and indices in range.

    Raises MeshError if there are no faces, if a coordinate is not finite, or if an index is out of range.
    """
    with np.errstate(invalid="ignore"):  # a signalling NaN of the file is reported below
        positions = np.ascontiguousarray(vertices, dtype=np.float64).reshape(-1, 3)
    surface = Surface(positions, np.ascontiguousarray(faces, dtype=np.int64).reshape(-1, 3), colours)
    if not len(surface.faces):
        raise MeshError(f"{path} holds no faces")
    check_vertices(path, positions)
    inside = np.atleast_1d(((surface.faces >= 0) & (surface.faces < len(positions))).all(axis=1))
    if not inside.all():
        worst = int(np.flatnonzero(~inside)[0])
        raise MeshError(
            f"{path}: face {worst + 1} of {len(inside)} names vertex {surface.faces[worst].tolist()} (counted from 0), "
            f"but there are {len(positions)} vertices"
        )
    return surface


def check_vertices(path: Path, vertices: Floats) -> None:
    """Raises MeshError if a coordinate of (n, 3) vertices is not a finite number."""
    finite = np.atleast_1d(np.isfinite(vertices).all(axis=1))
    if not finite.all():
        worst = int(np.flatnonzero(~finite)[0])
        raise MeshError(f"{path}: vertex {worst + 1} of {len(finite)} has a coordinate that is not a finite number")


def parse_floats(path: Path, rows: Iterable[Iterable[str | bytes]], what: str) -> Floats:
    """The words of all rows as flat float64; raises MeshError if one is not a number."""
    try:
        return np.fromiter(map(float, chain.from_iterable(rows)), np.float64)
    except ValueError as error:
        raise MeshError(f"{path}: {what} holds something that is not a number ({error})") from None


def parse_integers(path: Path, rows: Iterable[Iterable[str | bytes]], what: str) -> Indices:
    """The words of all rows as flat int64; raises MeshError if one is not a whole number."""
    try:
        return np.fromiter(map(int, chain.from_iterable(rows)), np.int64)
    except (ValueError, OverflowError) as error:
        raise MeshError(f"{path}: {what} holds something that is not a whole number ({str(error)[:80]})") from None


def concatenate(pieces: list[Surface]) -> Surface:
    """Several surfaces as one, each with its own vertices."""
    if len(pieces) == 1:
        return pieces[0]
    shifts = np.cumsum([0] + [len(piece.vertices) for piece in pieces[:-1]])
    faces = [piece.faces + shift for piece, shift in zip(pieces, shifts, strict=True)]
    colours = None
    if any(piece.colours is not None for piece in pieces):
        colours = np.concatenate(
            [np.full(len(piece.faces), NO_COLOUR) if piece.colours is None else piece.colours for piece in pieces]
        )
    return Surface(np.concatenate([piece.vertices for piece in pieces]), np.concatenate(faces), colours)


def check_placed(path: Path, placed: int) -> None:
    """Raises MeshError if a file places too many objects by reference."""
    if placed > MOST_PLACED:
        raise MeshError(f"{path}: places more than {MOST_PLACED} objects by reference")


def check_meshes(path: Path, meshes: int, faces: int) -> None:
    """Raises MeshError if a file places too many meshes or faces by reference."""
    if meshes > MOST_PLACED_MESHES or faces > MOST_PLACED_FACES:
        raise MeshError(f"{path}: places more than {MOST_PLACED_MESHES} meshes or {MOST_PLACED_FACES} faces by reference")
