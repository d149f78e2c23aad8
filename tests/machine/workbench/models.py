"""Models on a bench, with their meshes in files that exist while the tests run."""

import tempfile
from itertools import count
from pathlib import Path
from typing import Any

from machine.workbench.bench.bench import Bench, History
from machine.workbench.bench.changes import CHANGES, EDITS, Cuts
from machine.workbench.bench.model import Model
from machine.workbench.bench.values import read_command
from machine.workbench.session.commands import COMMANDS
from mdp.mesh import Mesh
from mdp.read import ReadModel
from tests.shapes import tee

_folder = tempfile.TemporaryDirectory()
_numbers = count()


def model(name: str = "tee.stl", mesh: Mesh | None = None) -> Model:
    """A model of this name, a tee unless another mesh is given."""
    return Model.stored(name, Path(name), ReadModel(mesh or tee()), Path(_folder.name) / str(next(_numbers)))


def changed(history: History, name: str, **asked: Any) -> History:
    """The history after a page's command."""
    return history.do(CHANGES[name][1], changed_bench(history.now.bench, name, **asked))


def changed_bench(bench: Bench, name: str, **asked: Any) -> Bench:
    """The bench after a page's command."""
    _, arguments = read_command({"do": name, **asked}, COMMANDS)
    return CHANGES[name][0](bench, **dict(arguments))


def edited_cuts(bench: Bench, name: str, **asked: Any) -> Cuts:
    """The cuts after a page's edit."""
    _, arguments = read_command({"do": name, **asked}, COMMANDS)
    return EDITS[name](bench, **dict(arguments)).cuts
