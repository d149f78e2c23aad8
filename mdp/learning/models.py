"""Models: the training solids of a folder, simplified if they are too fine, in several orientations."""

from itertools import pairwise
from math import cos, radians
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from mdp.cut import simplify
from mdp.directions.orientation import resting_orientations, set_on_plate
from mdp.formats.readers import READERS
from mdp.formats.surface import check_surface
from mdp.mesh import Floats, Mesh
from mdp.overhang import UP
from mdp.read import read_mesh
from mdp.repair.repair import repair
from profiles.errors import MeshError, UserError

ARRAYS = ".npz"
MOST_MOVED = 0.002  # deviation of a simplified surface, as a share of the diagonal
FINEST_MOVED = MOST_MOVED / 2**8  # first tolerance, doubled up to MOST_MOVED: at most nine simplifications
SIDES_APART_DEG = 20.0  # least angle between the directions of two different sides


def model_files(folder: Path, only: str = "", every: int = 1) -> list[Path]:
    """The models of a folder sorted by name: npz files and mesh files whose name contains `only`, and of these every nth
    (`every`).

    Raises UserError for a folder without models, and for two models with the same name.
    """
    if not folder.is_dir():
        raise UserError(f"folder {folder} does not exist; a folder of models is expected")
    kinds = (ARRAYS, *READERS)
    files = sorted(file for file in folder.iterdir() if file.suffix.lower() in kinds and only in file.stem)[::every]
    if not files:
        words = f" with {only!r} in its name" if only else ""
        raise UserError(f"folder {folder} holds no model{words}; {', '.join(kinds)} are read")
    for file, next_file in pairwise(files):
        if name_of(file) == name_of(next_file):
            raise UserError(f"folder {folder}: {file.name} and {next_file.name} would have the same records; rename one")
    return files


def name_of(file: Path) -> str:
    """The model's name with dots replaced, since dots separate the fields of record names."""
    return file.stem.replace(".", "_")


def read_model(path: Path) -> Mesh:
    """The repaired solid of an npz file (vertices (n, 3) in mm and faces (m, 3)) or of a mesh file, centred on the build plate;
    raises MeshError for an invalid one.
    """
    if path.suffix.lower() != ARRAYS:
        return read_mesh(path)[0]
    try:
        with np.load(path) as arrays:
            solid, _ = repair([check_surface(path, arrays["vertices"], arrays["faces"])])
    except (KeyError, ValueError, BadZipFile) as error:
        raise MeshError(f"{path} holds no vertices and faces ({error})") from None
    except OSError as error:
        raise MeshError(f"{path} cannot be read ({error})") from None
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    return Mesh(solid.vertices - np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]), solid.faces.astype(np.int32))


def coarser(mesh: Mesh, most_faces: int) -> Mesh:
    """The mesh with at most `most_faces` faces, or as many as remain when its surface moves by MOST_MOVED of its diagonal."""
    if len(mesh.faces) <= most_faces:
        return mesh
    diagonal_mm = float(np.linalg.norm(mesh.bounds_mm[1] - mesh.bounds_mm[0]))
    share, simpler = FINEST_MOVED, mesh
    while len(simpler.faces) > most_faces and share <= MOST_MOVED:
        simpler = simplify(mesh, share * diagonal_mm)
        share *= 2.0
    return set_on_plate(simpler, np.eye(3))


def oriented(mesh: Mesh, number: int, angle_deg: float) -> Mesh | None:
    """The mesh in one of its resting poses; None if it has fewer.

    number: 0 for the present pose, 1 and up for the other sides in the order of `other_sides`.
    """
    if number == 0:
        return mesh
    sides = other_sides(mesh, angle_deg)
    return set_on_plate(mesh, sides[number - 1]) if number <= len(sides) else None


def other_sides(mesh: Mesh, angle_deg: float) -> list[Floats]:
    """Rotations (3, 3) onto the other sides on which a mesh rests and has risky faces, the most different first."""
    left = [orientation.rotation for orientation in resting_orientations(mesh, angle_deg) if orientation.risky_mm2 > 0.0]
    directions, sides = [UP], list[Floats]()
    while left:
        nearest = [max(float(direction @ rotation[2]) for direction in directions) for rotation in left]
        farthest = int(np.argmin(np.round(nearest, 6)))
        if nearest[farthest] > cos(radians(SIDES_APART_DEG)):
            break
        sides.append(left.pop(farthest))
        directions.append(sides[-1][2])
    return sides
