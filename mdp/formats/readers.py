"""Readers: one file a format with `read(path) -> list[Surface]`; READERS is the family, each of which is loaded when it reads.

The six that printers know are read by our own: trimesh reads some valid files of them as other solids (tools/RESULTS.md,
"Reading") and takes longer to import than these readers take for a model. What else it knows it reads.
"""

from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mdp.formats.surface import Surface

Reader = Callable[[Path], "list[Surface]"]


def _read(module: str, path: Path) -> "list[Surface]":
    surfaces: list[Surface] = import_module(f"mdp.formats.{module}").read(path)
    return surfaces


READERS: dict[str, Reader] = {
    suffix: partial(_read, module)
    for suffix, module in {
        ".stl": "stl",
        ".obj": "obj",
        ".off": "off",
        ".ply": "ply",
        ".3mf": "threemf",
        ".glb": "glb",
        ".gltf": "scene",
        ".dae": "scene",
        **dict.fromkeys((".step", ".stp", ".iges", ".igs"), "cad"),
    }.items()
}
