"""Stretches: the straight moves between turns of the table."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from machine.parsed import MoveKind, ParsedProgram
from mdp.pose import Pose


@dataclass(frozen=True, eq=False)
class Stretch:
    """Consecutive rows of straight moves at one pose."""

    rows: NDArray[np.int64]
    pose: Pose


def stretches(program: ParsedProgram) -> list[Stretch]:
    """The straight moves between turns of the table."""
    turned = np.any(np.diff(program.end[:, 3:], axis=0, prepend=program.start[:1, 3:]) != 0, axis=1)
    found = []
    for rows in np.split(np.arange(len(turned)), np.flatnonzero(turned)):
        straight = rows[program.kind[rows] != MoveKind.ROTATE]
        if len(straight):
            found.append(Stretch(straight, Pose(*(float(v) for v in program.end[straight[0], 3:]))))
    return found
