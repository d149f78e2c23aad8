"""Models: reading one, the ways in which it rests, and the faces that are marked on it, as tasks of the workbench."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from machine.pipeline import compilers
from machine.pipeline.embedded_profile import has_settings
from machine.workbench.bench.bench import Bench
from machine.workbench.bench.marks import named_faces
from machine.workbench.bench.model import Model
from mdp.directions.orientation import in_words, resting_facets, side_in_words
from mdp.kernels.workers import Tell
from mdp.read import SizeError
from mdp.read import read_model as read_model_file
from mdp.search.orient import distinct_orientations
from profiles.errors import MeshError
from profiles.profile import Profile

FACET_DIGITS = 4  # of the mm of a facet's corners


@dataclass(frozen=True, eq=False)
class Resting:
    """An orientation in which a model rests: rows of its rotation, how to say it, and what it leaves hanging."""

    rotation: tuple[tuple[float, ...], ...]
    words: str
    overhang_mm2: float
    height_mm: float


@dataclass(frozen=True)
class Unscaled:
    """A model of a size that no printer makes: see mdp.read.SizeError."""

    sentence: str
    question: str
    units: dict[str, float]


def read_model(
    tell: Tell, path: Path, name: str, profile: Profile, mesh_file: Path, plate: int | None = None
) -> Model | Unscaled:
    """The model of a file, with the sentences of the command line; a file from the page has the name it had there."""
    try:
        read = read_model_file(path, profile.process.scale, profile.process.rotate_deg, plate)
    except SizeError as error:
        sentence, question = (text.replace(str(path), name) for text in (str(error), error.question))
        return Unscaled(sentence, question, error.units)
    except MeshError as error:
        raise MeshError(str(error).replace(str(path), name)) from None
    return Model.stored(name, path, read, mesh_file, plate, has_settings(path))


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
        for orientation in distinct_orientations(model.mesh(), profile, for_person=True)
    )


def rest_facets(tell: Tell, model: Model) -> bytes:
    """The facets of a model's hull that it rests on, as JSON in its own frame: `normal`, `corners` (nine numbers a triangle)."""
    facets = [
        {"normal": normal.tolist(), "corners": np.round(corners, FACET_DIGITS).ravel().tolist()}
        for normal, corners in resting_facets(model.mesh())
    ]
    return json.dumps(facets).encode()


def mark_faces(tell: Tell, bench: Bench) -> bytes:
    """(m,) of each face of the model in which kinds of zones that are no boxes it is: a bit each, in their order."""
    return bytes(np.packbits(named_faces(bench), axis=0, bitorder="little")[0])
