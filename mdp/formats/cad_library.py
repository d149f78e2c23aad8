"""CAD library: OpenCASCADE (cascadio, the extra `step`) in a separate process, since some damaged files crash it.

The process belongs to this process's session, so whatever ends the session ends it too: the library holds Python's lock while it
works, so the process could not notice that its caller is gone.
"""

import signal
from importlib.util import find_spec
from pathlib import Path

from mdp.kernels.workers import ONE_CORE, Interpreter, frame, read_frames, redirect_stdio
from profiles.errors import MeshError

CODE = "from mdp.formats.cad_library import answer; answer()"
# Greatest distance of a triangle from the surface: a twentieth of a layer, and at least 36 corners in a circle.
DEFLECTION_MM, DEFLECTION_RAD = 0.01, 0.17
SIGKILL = getattr(signal, "SIGKILL", 0)  # Linux sends it to a process that exhausts the memory; Windows has no such signal
DAMAGED = "is damaged: the CAD library (OpenCASCADE) cannot read it"
KILLED = "the CAD library (OpenCASCADE) was killed while it read it: there may be too little memory"


def to_glb(path: Path, content: bytes, kind: str) -> bytes:
    """The content of a file ("step" or "iges") converted to GLB; empty if the library finds no such file in it.

    Raises MeshError if the library is missing or ends without an answer.
    """
    if find_spec("cascadio") is None:
        raise MeshError(f"{path}: reading CAD files needs cascadio: pip install 'tiltprint[step]'")
    library = Interpreter(CODE, ONE_CORE, leads=False)
    try:
        library.say((content, kind))
        scene, trouble = next(library.hear(), (b"", None))
    finally:
        library.end()
    if trouble is None:
        trouble = KILLED if SIGKILL and library.process.returncode == -SIGKILL else DAMAGED
    if trouble:
        raise MeshError(f"{path}: {trouble}")
    return bytes(scene)


def answer() -> None:
    """Entry point of the library's process: read a file and answer with (scene, error message)."""
    requests, answers = redirect_stdio()
    content, kind = next(read_frames(requests))
    answers.write(frame(_loaded(content, kind)))
    answers.flush()


def _loaded(content: bytes, kind: str) -> tuple[bytes, str]:
    try:
        import cascadio
    except ImportError as error:  # the package is installed, but a library that it needs is missing
        return b"", f"cascadio, which reads CAD files, does not start here ({error})"
    tolerances = {"tol_linear": DEFLECTION_MM, "tol_angular": DEFLECTION_RAD}
    return cascadio.load(content, kind, use_parallel=False, **tolerances), ""
