"""Readers: one file a format with `read(path) -> list[Surface]`; READERS is the family.

The six that printers know are read by our own: trimesh reads some valid files of them as other solids (tools/RESULTS.md,
"Reading") and takes longer to import than these readers take for a model. What else it knows it reads.
"""

from collections.abc import Callable
from pathlib import Path

from mdp.formats import cad, glb, obj, off, ply, scene, stl, threemf
from mdp.formats.surface import Surface

READERS: dict[str, Callable[[Path], list[Surface]]] = {
    ".stl": stl.read,
    ".obj": obj.read,
    ".off": off.read,
    ".ply": ply.read,
    ".3mf": threemf.read,
    ".glb": glb.read,
    ".gltf": scene.read,
    ".dae": scene.read,
    **dict.fromkeys(cad.KINDS, cad.read),
}
