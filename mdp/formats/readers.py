"""Readers: one per file format, in READERS; a reader's module is imported when it is first used.

Each module has `read(path) -> list[Surface]`; the 3MF module, for files saved by slicers, has `read_build(path, plate) -> Build`.
The six common formats have our own readers: trimesh reads some valid files as different solids (tools/RESULTS.md), and
importing it takes longer than these readers take for a model. trimesh reads the remaining formats.
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
    """A file's content as one object, or the objects on a plate of a slicer file."""
    if module == "threemf":
        from mdp.formats.threemf import read_build

        return read_build(path, plate)
    if plate is not None:
        raise MeshError(f"{path} has no plates: {option('plate', plate)} goes with a file of Bambu Studio or OrcaSlicer (.3mf)")
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
