"""CAD files, STEP and IGES: their boundary representation as triangles, by OpenCASCADE (cascadio, the extra `step`).

STEP names its parts and its solids. An IGES file may have a solid (type 186), but most have a heap of trimmed faces (type 144)
that tell of no common edge, each with corners of its own along it: they get a gap within which they are sewn when they are
repaired.
"""

import os
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from mdp.formats import glb
from mdp.formats.surface import Surface
from profiles.errors import MeshError

KINDS = {".step": "step", ".stp": "step", ".iges": "iges", ".igs": "iges"}
MM = {"step": 1000.0, "iges": 1.0}  # cascadio delivers STEP in metres and IGES in mm, whatever unit the file has
# So near the triangles are to the surface: a twentieth of a layer, and a circle in 36 corners at least.
DEFLECTION_MM, DEFLECTION_RAD = 0.01, 0.17
MOST_NAMED = 8  # parts that a sentence names


def read(path: Path) -> list[Surface]:
    """One surface for every solid or shell of a STEP or IGES file, in mm, z as in the file, with the name of its part; free edges
    and points are left out with a note.

    Raises MeshError for a damaged file and where cascadio is not installed.
    """
    try:
        import cascadio
    except ImportError:
        raise MeshError(f"{path}: reading CAD files needs cascadio: pip install 'tiltprint[step]'") from None
    kind, content = KINDS[path.suffix.lower()], path.read_bytes()
    with _silence():
        scene = cascadio.load(content, kind, tol_linear=DEFLECTION_MM, tol_angular=DEFLECTION_RAD, use_parallel=False)
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


@contextmanager
def _silence() -> Iterator[None]:
    """What a compiled library says on standard output and error goes nowhere: results go there."""
    duplicates = [os.dup(descriptor) for descriptor in (1, 2)]
    try:
        with open(os.devnull, "wb") as nowhere:
            for descriptor in (1, 2):
                os.dup2(nowhere.fileno(), descriptor)
        yield
    finally:
        for descriptor, own in zip((1, 2), duplicates, strict=True):
            os.dup2(own, descriptor)
            os.close(own)
