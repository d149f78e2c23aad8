"""Models on a bench, their meshes in files as long as the tests run."""

import tempfile
from itertools import count
from pathlib import Path

from machine.app.workbench.bench.model import Model
from mdp.mesh import Mesh
from tests.shapes import tee

_folder = tempfile.TemporaryDirectory()
_numbers = count()


def model(name: str = "tee.stl", mesh: Mesh | None = None) -> Model:
    """A model of this name, a tee unless another mesh is given."""
    return Model.stored(name, Path(name), mesh or tee(), Path(_folder.name) / str(next(_numbers)))
