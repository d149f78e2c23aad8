"""Scenes read by trimesh: glTF with external buffers, and COLLADA."""

import json
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

import numpy as np

from mdp.formats.glb import check_extensions
from mdp.formats.surface import Surface, check_meshes, check_surface
from mdp.mesh import Floats
from profiles.errors import MeshError

if TYPE_CHECKING:
    from trimesh import Trimesh

# Right, inwards and up for each COLLADA <up_axis>, as rows; Y_UP is the default (COLLADA 1.4.1, 5-8).
Z_UP_OF = {
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "Z_UP": np.eye(3),
}
COLLADA = "pycollada"  # trimesh does not name it when it is missing
MM = 1000.0  # per metre, the unit of COLLADA's <unit>


def read(path: Path) -> list[Surface]:
    """One surface for every mesh in the scene of a .gltf or .dae file.

    glTF coordinates are taken as mm with z up, like those of GLB files (mdp.formats.glb). COLLADA states its unit and up axis; if
    its unit is the metre, which is the default, its numbers are taken as mm, and mdp.read refuses a model of implausible size.
    Raises MeshError.
    """
    import trimesh

    try:
        scene = trimesh.load_scene(path, process=False)
        nodes = [scene.graph[name] for name in sorted(scene.graph.nodes_geometry)]
    except ImportError as error:
        raise MeshError(
            f"{path}: reading {path.suffix} files needs {error.name or COLLADA}: pip install 'tiltprint[dae]'"
        ) from None
    except Exception as error:  # noqa: BLE001 - trimesh has no exception types of its own: any exception means an unreadable file
        raise MeshError(f"{path} cannot be read as {path.suffix} ({type(error).__name__}: {str(error)[:200]})") from None
    if path.suffix.lower() == ".gltf":
        check_extensions(path, json.loads(path.read_bytes()))
    placed = [(matrix, mesh) for matrix, name in nodes if isinstance(mesh := scene.geometry[name], trimesh.Trimesh)]
    if not placed:
        raise MeshError(f"{path}: its scene places no mesh")
    check_meshes(path, len(placed), sum(len(mesh.faces) for _, mesh in placed))
    turn = _to_mm_with_z_up(path) if path.suffix.lower() == ".dae" else np.eye(3)
    return [_surface(path, mesh, matrix, turn) for matrix, mesh in placed]


def _surface(path: Path, mesh: "Trimesh", matrix: Floats, turn: Floats) -> Surface:
    """A mesh transformed by its node's matrix (4, 4), and then turned."""
    vertices = (np.asarray(mesh.vertices, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]) @ turn.T
    return check_surface(path, vertices, mesh.faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0.0 else mesh.faces)


def _to_mm_with_z_up(path: Path) -> Floats:
    """(3, 3) matrix from the coordinates of a COLLADA document to mm with z up, from its <asset>: <unit>, <up_axis>."""
    asset = ElementTree.parse(path).find("{*}asset")
    unit = None if asset is None else asset.find("{*}unit")
    axis = "Y_UP" if asset is None else asset.findtext("{*}up_axis", "Y_UP").strip()
    meter = "1" if unit is None else unit.get("meter", "1")
    try:
        metres = float(meter)
    except ValueError:
        metres = np.nan
    if not 0.0 < metres < np.inf:
        raise MeshError(f"{path}: its <unit> is {meter[:40]!r} m, it must be a number above 0")
    if axis not in Z_UP_OF:
        raise MeshError(f"{path}: its <up_axis> is {axis[:40]!r}, it must be one of {', '.join(Z_UP_OF)}")
    return (1.0 if metres == 1.0 else MM * metres) * Z_UP_OF[axis]
