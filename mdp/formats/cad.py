"""CAD files, STEP and IGES: their boundary representation as triangles, by OpenCASCADE (cascadio, the extra `step`)."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mdp.formats import glb
from mdp.formats.surface import Surface
from profiles.errors import MeshError

KINDS = {".step": "step", ".stp": "step", ".iges": "iges", ".igs": "iges"}
MM = 1000.0  # OpenCASCADE writes glTF in metres, whatever the unit of its input
# So near the triangles are to the surface: a twentieth of a layer, and a circle in 36 corners at least.
DEFLECTION_MM, DEFLECTION_RAD = 0.01, 0.17


def read(path: Path) -> list[Surface]:
    """One surface for every solid or shell of a STEP or IGES file, in mm, z as in the file.

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
    return [Surface(MM * surface.vertices, surface.faces, surface.colours) for surface in glb.read_scene(path, scene)]


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
