"""Models on a bench, their meshes in files as long as the tests run."""

import tempfile
from itertools import count
from pathlib import Path
from typing import Any

from machine.workbench.bench.bench import History
from machine.workbench.bench.changes import Change
from machine.workbench.bench.model import Model
from mdp.mesh import Mesh
from mdp.read import ReadModel
from tests.shapes import tee

_folder = tempfile.TemporaryDirectory()
_numbers = count()


def model(name: str = "tee.stl", mesh: Mesh | None = None) -> Model:
    """A model of this name, a tee unless another mesh is given."""
    return Model.stored(name, Path(name), ReadModel(mesh or tee()), Path(_folder.name) / str(next(_numbers)))


def changed(history: History, change: type[Change], **asked: Any) -> History:
    """The history after what a page asks to be changed."""
    return history.do(change.word, change.of(asked).change(history.now.bench))
