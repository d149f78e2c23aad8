"""Readers: what a file of a format prints, as its build; READERS is the family, each of which is loaded when it reads.

One module a format has `read(path) -> list[Surface]`, the one of 3MF, which slicers save, `read_build(path, plate) -> Build`.

The six that printers know are read by our own: trimesh reads some valid files of them as other solids (tools/RESULTS.md,
"Which files are read?") and takes longer to import than these readers take for a model. What else it knows it reads.
"""

from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from profiles.errors import MeshError
from profiles.messages import option

if TYPE_CHECKING:
    from mdp.formats.slicer_file import Build

Reader = Callable[[Path, int | None], "Build"]


def _read(module: str, path: Path, plate: int | None) -> "Build":
    """One object of a file that no slicer has saved, or what a plate of a slicer file prints."""
    if module == "threemf":
        from mdp.formats.threemf import read_build

        return read_build(path, plate)
    if plate is not None:
        raise MeshError(f"{path}: has no plates: {option('plate', plate)} goes with a file of Bambu Studio or OrcaSlicer (.3mf)")
    from mdp.formats.slicer_file import Build, BuildObject, Role

    return Build([BuildObject([(surface, Role()) for surface in import_module(f"mdp.formats.{module}").read(path)])])


READERS: dict[str, Reader] = {
    suffix: partial(_read, module)
    for suffix, module in {
        ".stl": "stl",
        ".obj": "polygons",
        ".off": "polygons",
        ".ply": "ply",
        ".3mf": "threemf",
        ".glb": "glb",
        ".gltf": "scene",
        ".dae": "scene",
        **dict.fromkeys((".step", ".stp", ".iges", ".igs"), "cad"),
    }.items()
}
