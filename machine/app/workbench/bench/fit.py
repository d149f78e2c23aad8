"""Fit: how large the model stands on the platform, and whether the machine reaches all of it."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.bench.marks import standing_mesh
from machine.planning.fit import check_parts
from mdp.mesh import Mesh
from mdp.search.parts import one_piece
from profiles.errors import MoveError
from profiles.profile import Profile


@dataclass(frozen=True)
class Standing:
    """size_mm: along the platform's axes, as the model is turned; problem: what the machine does not reach of it in one piece, in
    the sentence that `export` has for it, "" where it reaches all."""

    size_mm: tuple[float, float, float]
    problem: str


@lru_cache(maxsize=4)
def standing(bench: Bench) -> Standing | None:
    """The model as it stands on the platform; None without one."""
    if bench.model is None:
        return None
    mesh = standing_mesh(bench)
    x, y, z = (float(side) for side in np.ptp(mesh.bounds_mm, axis=0))
    return Standing((x, y, z), out_of_reach(mesh, bench.profile))


def out_of_reach(mesh: Mesh, profile: Profile) -> str:
    """What the machine does not reach of a mesh on the platform; "" where it reaches all."""
    try:
        check_parts((one_piece(mesh, profile.machine),), profile)
    except MoveError as error:
        return str(error)
    return ""
