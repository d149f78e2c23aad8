"""Marks: what a person marks checked against the model, and the faces that marks name, as tasks of the workbench."""

from typing import Any

import numpy as np

from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.bench.marks import marked, named_faces
from machine.app.workbench.work.processes import Tell
from mdp.zone import Zones


def mark_bench(tell: Tell, bench: Bench, asked: dict[str, Any]) -> tuple[str, Zones]:
    """What `bench.marks.marked` makes of a command. Raises PlanError."""
    return marked(bench, asked)


def mark_faces(tell: Tell, bench: Bench) -> bytes:
    """(m,) of each face of the model in which kinds of zones that are no boxes it is: a bit each, in their order."""
    return bytes(np.packbits(named_faces(bench), axis=0, bitorder="little")[0])
