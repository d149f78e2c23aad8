"""Mesh file formats: one file each with `read(path) -> list[Surface]`; READERS is the family."""

from collections.abc import Callable
from pathlib import Path

from mdp.formats import glb, obj, off, ply, stl, threemf
from mdp.surface import Surface

READERS: dict[str, Callable[[Path], list[Surface]]] = {
    ".stl": stl.read,
    ".obj": obj.read,
    ".off": off.read,
    ".ply": ply.read,
    ".3mf": threemf.read,
    ".glb": glb.read,
}
