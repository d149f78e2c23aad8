"""Models: reading one, the ways in which it rests, and the faces that are marked on it, as tasks of the workbench."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from machine.app.pipeline import compilers
from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.bench.marks import named_faces
from machine.app.workbench.bench.model import Model
from machine.app.workbench.work.processes import Tell
from mdp.directions.orientation import in_words, side_in_words
from mdp.read import read_mesh
from mdp.search.laying import distinct_orientations
from profiles.errors import MeshError
from profiles.profile import Profile


@dataclass(frozen=True, eq=False)
class Resting:
    """An orientation in which a model rests: rows of its rotation, how to say it, and what it leaves hanging."""

    rotation: tuple[tuple[float, ...], ...]
    words: str
    overhang_mm2: float
    height_mm: float


def read_model(tell: Tell, path: Path, name: str, profile: Profile, mesh_file: Path) -> Model:
    """The model of a file, with the sentences of the command line; a file from the page has the name it had there."""
    try:
        mesh, notes = read_mesh(path, profile.process.scale, profile.process.rotate_deg)
    except MeshError as error:
        raise MeshError(str(error).replace(str(path), name)) from None
    return Model.stored(name, path, mesh, mesh_file, notes)


def rank_resting(tell: Tell, model: Model, profile: Profile) -> tuple[Resting, ...]:
    """The orientations in which a model rests, the most promising first."""
    compilers.wait_for(compilers.JUDGE)
    return tuple(
        Resting(
            tuple(tuple(float(value) for value in row) for row in orientation.rotation),
            side_in_words(orientation) or in_words(orientation),
            orientation.risky_mm2,
            orientation.height_mm,
        )
        for orientation in distinct_orientations(model.mesh(), profile)
    )


def mark_faces(tell: Tell, bench: Bench) -> bytes:
    """(m,) of each face of the model in which kinds of zones that are no boxes it is: a bit each, in their order."""
    return bytes(np.packbits(named_faces(bench), axis=0, bitorder="little")[0])
