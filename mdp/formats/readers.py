"""Readers: one file a format with `read(path) -> list[Surface]`; READERS is the family.

Not trimesh's: it reads some valid files as other solids (tools/RESULTS.md, "Reading") and takes longer to import than these
readers take for a model.
"""

from collections.abc import Callable
from pathlib import Path

from mdp.formats import glb, obj, off, ply, stl, threemf
from mdp.formats.surface import Surface

READERS: dict[str, Callable[[Path], list[Surface]]] = {
    ".stl": stl.read,
    ".obj": obj.read,
    ".off": off.read,
    ".ply": ply.read,
    ".3mf": threemf.read,
    ".glb": glb.read,
}
