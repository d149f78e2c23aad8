"""Marks: what a person marks checked against the model, and the faces that marks name, as tasks of the workbench."""

import numpy as np

from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.bench.marks import mark, named_faces, unmark
from machine.app.workbench.bench.values import Asked
from machine.app.workbench.work.processes import Tell
from mdp.zone import Zones


def mark_bench(tell: Tell, bench: Bench, asked: Asked) -> tuple[str, Zones]:
    """What `bench.marks.mark` makes of a command. Raises PlanError."""
    return mark(bench, asked)


def unmark_bench(tell: Tell, bench: Bench, asked: Asked) -> tuple[str, Zones]:
    """The same of `bench.marks.unmark`."""
    return unmark(bench, asked)


def mark_faces(tell: Tell, bench: Bench) -> bytes:
    """(m,) of each face of the model in which kinds of zones that are no boxes it is: a bit each, in their order."""
    return bytes(np.packbits(named_faces(bench), axis=0, bitorder="little")[0])
