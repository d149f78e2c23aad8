"""Trials: a person's planes tried on a bench, as tasks of a process that keeps what it has worked out for the last one.

A bench has a number, which no other one of this run of the program has. It goes along with every task, for the process may have
worked for another bench meanwhile.
"""

from itertools import product

import numpy as np

from machine.pipeline import compilers
from machine.workbench.bench.bench import Bench, plan_of_bench
from machine.workbench.bench.planes import Cuts
from machine.workbench.work.cutting import PLAN_NAME, turned_mesh, with_shapes
from mdp.cut import convex_hull
from mdp.kernels.workers import Tell
from mdp.plane import Plane
from mdp.search.plan_file import PlannedPart
from mdp.search.trial import Trial, Trials
from profiles.profile import load

UNTILTED = 1.0 - 1e-9  # cosine between two normals that are the same but for rounding
_ready: tuple[int, Trials] | None = None  # of the bench that this process has heard of last


def make_ready(tell: Tell, number: int, bench: Bench) -> None:
    """Work out once what planes on a bench of this number need."""
    _trials(number, bench)


def load_kernels(tell: Tell) -> None:
    """Have what planes need loaded, or compiled, before there is a model: a box shows what that is. From now on the process is
    another bench's."""
    global _ready
    _ready = None
    compilers.wait_for((*compilers.JUDGE, *compilers.SEARCH))
    corners = np.array(list(product((0.0, 10.0), repeat=3)))
    Trials(convex_hull(corners), load()).warm()


def try_cuts(tell: Tell, number: int, bench: Bench, cuts: tuple[PlannedPart, ...], most_cuts: float) -> Trial:
    """Planes tried; most_cuts: see mdp.search.trial."""
    return _trials(number, bench).attempt(_planes(cuts), most_cuts)


def near_neck(tell: Tell, number: int, bench: Bench, cuts: tuple[PlannedPart, ...], part: int, reach_mm: float) -> Plane | None:
    """The neck near the plane of a part, as `Trials.neck` finds it."""
    return _trials(number, bench).neck(_planes(cuts), part, reach_mm)


def nearest(tell: Tell, number: int, bench: Bench, orders: list[tuple[Cuts, int]]) -> Cuts | None:
    """Planes in the order in which that of one part, whose number goes with them, is least shifted until all can be cut, as
    `Trials.nearest` finds it; None: that is not so in any."""
    trials, best = _trials(number, bench), None
    for cuts, part in orders:
        wanted, plane = cuts[part - 2].plane, trials.nearest(_planes(cuts), part)
        if plane is None or wanted is None:
            continue
        leans, far_mm = float(plane.normal @ wanted.normal) < UNTILTED, abs(plane.offset_mm - wanted.offset_mm)
        if best is None or (leans, far_mm) < best[0]:
            put = PlannedPart.of(plane)
            best = (leans, far_mm), (*cuts[: part - 2], put, *cuts[part - 1 :])
    return None if best is None else best[1]


def _trials(number: int, bench: Bench) -> Trials:
    global _ready
    if _ready is None or _ready[0] != number:
        _ready = None  # two at once would be too much for the memory
        compilers.wait_for((*compilers.JUDGE, *compilers.SEARCH))
        mesh = turned_mesh(bench)
        zones = with_shapes(bench, plan_of_bench(bench, PLAN_NAME), mesh).zones
        trials = Trials(mesh, bench.profile, zones)
        trials.warm()
        _ready = number, trials
    return _ready[1]


def _planes(cuts: tuple[PlannedPart, ...]) -> list[Plane]:
    return [plane for part in cuts if (plane := part.plane) is not None]
