"""CAD files (STEP and IGES): their boundary representation triangulated by OpenCASCADE (mdp.formats.cad_library).

STEP names its parts and its solids. An IGES file may have a solid (type 186), but most have separate trimmed faces (type 144)
without common edges, each with corners of its own along its border: they get a gap, within which the repair sews them together.
"""

import math
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

from mdp.formats import glb
from mdp.formats.cad_library import DEFLECTION_MM, to_glb
from mdp.formats.surface import Surface
from profiles.errors import MeshError

KINDS = {".step": "step", ".stp": "step", ".iges": "iges", ".igs": "iges"}
MM = {"step": 1000.0, "iges": 1.0}  # cascadio delivers STEP in metres and IGES in mm, whatever the file's unit
# Numbers with an exponent of three or four digits; the columns of an IGES file that end in D0000305 hold none.
LARGE = re.compile(rb"[(,\s]([-+]?\d+\.\d*[ED]\+?\d{3,4})(?=[\s,;)])")
LAST_LINE = re.compile(rb"T[ 0]*1\s*$", re.MULTILINE)  # the terminate section of an IGES file
MOST_NAMED = 8  # parts named in a sentence


def read(path: Path) -> list[Surface]:
    """One surface for every solid or shell of a STEP or IGES file, in mm, z as in the file, with the name of its part; free edges
    and points are left out with a note.

    Raises MeshError for a damaged file, and if cascadio is not installed.
    """
    kind, content = KINDS[path.suffix.lower()], path.read_bytes()
    _check_numbers(path, content)
    scene = to_glb(path, content, kind)
    if not scene:
        raise MeshError(f"{path} is not a valid {kind.upper()} file")
    if kind == "iges" and not LAST_LINE.search(content[-1000:]):
        raise MeshError(f"{path} is cut short: its last section (T, terminate) is missing")
    gap = 2.0 * DEFLECTION_MM if kind == "iges" else 0.0
    surfaces = [replace(surface, vertices=MM[kind] * surface.vertices, gap=gap) for surface in glb.read_scene(path, scene)]
    notes = (*_assembly(surfaces), *_lost(glb.parts_without_faces(scene)), *surfaces[0].notes)
    return [replace(surfaces[0], notes=notes), *surfaces[1:]]


def _check_numbers(path: Path, content: bytes) -> None:
    """Raises MeshError for a number beyond the range of a float: the library drops its entity, or never ends."""
    for number in LARGE.findall(content):
        if math.isinf(float(number.replace(b"D", b"E"))):
            raise MeshError(f"{path} is damaged: it holds the number {number.decode()[:40]}, which is not finite")


def _assembly(surfaces: list[Surface]) -> tuple[str, ...]:
    """A note on the parts that a file names, if there are several."""
    names = [surface.name for surface in surfaces if surface.name]
    if len(names) < 2:
        return ()
    return (f"is an assembly of {len(names)} parts, printed as one model: {_counted(names)}",)


def _lost(names: list[str]) -> tuple[str, ...]:
    """A note on the parts that arrive without a surface."""
    if not names:
        return ()
    return (f"leaves out {_counted(names)}: {'it has' if len(names) == 1 else 'they have'} no surface that can be read",)


def _counted(names: list[str]) -> str:
    """Names with their counts."""
    counts = Counter(names)
    shown = [f"{count} x {name}" if count > 1 else name for name, count in counts.most_common(MOST_NAMED)]
    return ", ".join(shown) + (f" and {len(counts) - MOST_NAMED} more" if len(counts) > MOST_NAMED else "")
