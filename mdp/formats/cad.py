"""CAD files, STEP and IGES: their boundary representation as triangles, by OpenCASCADE (mdp.formats.cad_library).

STEP names its parts and its solids. An IGES file may have a solid (type 186), but most have a heap of trimmed faces (type 144)
that tell of no common edge, each with corners of its own along it: they get a gap within which they are sewn when they are
repaired.
"""

from collections import Counter
from dataclasses import replace
from pathlib import Path

from mdp.formats import glb
from mdp.formats.cad_library import DEFLECTION_MM, to_glb
from mdp.formats.surface import Surface
from profiles.errors import MeshError

KINDS = {".step": "step", ".stp": "step", ".iges": "iges", ".igs": "iges"}
MM = {"step": 1000.0, "iges": 1.0}  # cascadio delivers STEP in metres and IGES in mm, whatever unit the file has
MOST_NAMED = 8  # parts that a sentence names


def read(path: Path) -> list[Surface]:
    """One surface for every solid or shell of a STEP or IGES file, in mm, z as in the file, with the name of its part; free edges
    and points are left out with a note.

    Raises MeshError for a damaged file and where cascadio is not installed.
    """
    kind, content = KINDS[path.suffix.lower()], path.read_bytes()
    scene = to_glb(path, content, kind)
    if not scene:
        raise MeshError(f"{path}: is no {kind.upper()} file, or damaged")
    gap = 2.0 * DEFLECTION_MM if kind == "iges" else 0.0
    surfaces = [replace(surface, vertices=MM[kind] * surface.vertices, gap=gap) for surface in glb.read_scene(path, scene)]
    return [replace(surfaces[0], notes=(*_assembly(surfaces), *surfaces[0].notes)), *surfaces[1:]]


def _assembly(surfaces: list[Surface]) -> tuple[str, ...]:
    """A sentence about the parts that a file names where they are several."""
    names = [surface.name for surface in surfaces if surface.name]
    if len(names) < 2:
        return ()
    counts = Counter(names)
    shown = [f"{count} x {name}" if count > 1 else name for name, count in counts.most_common(MOST_NAMED)]
    more = f" and {len(counts) - MOST_NAMED} more" if len(counts) > MOST_NAMED else ""
    return (f"is an assembly of {len(names)} parts, printed as one model: {', '.join(shown)}{more}",)
