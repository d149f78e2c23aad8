"""Scenes: formats beyond our own readers, glTF with its buffers outside and COLLADA, by trimesh."""

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mdp.formats.surface import Surface, check_meshes, check_surface
from mdp.mesh import Floats
from profiles.errors import MeshError

if TYPE_CHECKING:
    from trimesh import Trimesh

Z_UP_OF_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
UNIT = re.compile(rb'<unit\b[^>]*\bmeter\s*=\s*"([^"]+)"')
MM = 1000.0


def read(path: Path) -> list[Surface]:
    """One surface for every mesh that the scene of a .gltf or .dae file places.

    Coordinates of glTF are taken as mm with z up, as those of GLB are (mdp.formats.glb). COLLADA tells its unit and its upward
    axis; where its unit is the metre, which it is where nothing is told, its numbers are taken as mm, and one of another size
    is refused by name (mdp.read). Raises MeshError.
    """
    import trimesh

    try:
        scene = trimesh.load_scene(path, process=False)
        nodes = [scene.graph[name] for name in sorted(scene.graph.nodes_geometry)]
    except ImportError as error:
        raise MeshError(f"{path}: reading {path.suffix} files needs {error.name}: pip install 'tiltprint[dae]'") from None
    except Exception as error:  # noqa: BLE001 - trimesh names no errors of its own: whatever it meets, the file is not what it says
        raise MeshError(f"{path}: cannot be read as {path.suffix} ({type(error).__name__}: {str(error)[:200]})") from None
    placed = [(matrix, mesh) for matrix, name in nodes if isinstance(mesh := scene.geometry[name], trimesh.Trimesh)]
    if not placed:
        raise MeshError(f"{path}: its scene places no mesh")
    check_meshes(path, len(placed), sum(len(mesh.faces) for _, mesh in placed))
    turn = _to_mm_with_z_up(path.read_bytes()) if path.suffix.lower() == ".dae" else np.eye(3)
    return [_surface(path, mesh, matrix, turn) for matrix, mesh in placed]


def _surface(path: Path, mesh: "Trimesh", matrix: Floats, turn: Floats) -> Surface:
    """A mesh where its node places it, (4, 4), and then turned."""
    vertices = (np.asarray(mesh.vertices, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]) @ turn.T
    return check_surface(path, vertices, mesh.faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0.0 else mesh.faces)


def _to_mm_with_z_up(document: bytes) -> Floats:
    """(3, 3) that takes the coordinates of a COLLADA document to mm with z up (its <asset>: <unit>, <up_axis>)."""
    unit = UNIT.search(document)
    try:
        metres = float(unit[1]) if unit else 1.0
    except ValueError:
        metres = 1.0
    scale = 1.0 if metres == 1.0 else MM * metres
    return scale * (Z_UP_OF_Y_UP if b"<up_axis>Y_UP" in document else np.eye(3))
