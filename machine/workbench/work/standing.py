"""Standing: how the model on the bench stands as it is turned, on its pedestal where it has one, as a task of the workbench."""

from dataclasses import dataclass

import numpy as np

from machine.pipeline.plate import places_of
from machine.planning.fit import Place
from machine.workbench.bench.bench import Bench, plan_of_bench
from machine.workbench.bench.model import mesh_blocks
from machine.workbench.bench.values import vector_of
from machine.workbench.work.cutting import PLAN_NAME, cut_bench, turned_mesh
from machine.workbench.work.pieces import out_of_reach
from mdp.decomposition import Decomposition
from mdp.kernels.workers import Tell
from mdp.mesh import Mesh
from mdp.overhang import risky_upright
from mdp.pedestal import on_pedestal, pedestal_under
from mdp.ranking.ranker import CLASSIC
from mdp.search.parts import one_piece
from profiles.errors import MeshError, PlanError
from profiles.frozen import Vector
from profiles.settings.support import MIDDLE


@dataclass(frozen=True, eq=False)
class Standing:
    """size_mm: along the platform's axes, without the pedestal; overhang_mm2: area that overhangs too far and does not stand on
    the platform; problem: what the machine does not reach in one piece, in the sentence of `export`, "" where it reaches all;
    pedestal: as `mesh_blocks` puts it for the page, b"": there is none; refusal: why there is none although one is wanted;
    copies_mm: x, y of the middles of its copies from its place, the nearest first, where they have no room of one alone;
    copies_problem: why they have none, "": they have."""

    size_mm: Vector
    overhang_mm2: float
    problem: str
    pedestal: bytes = b""
    refusal: str = ""
    copies_mm: tuple[Place, ...] = (MIDDLE,)
    copies_problem: str = ""


def stand(tell: Tell, bench: Bench) -> Standing:
    """How the model on the bench stands."""
    mesh, profile, pedestal, refusal = turned_mesh(bench), bench.profile, b"", ""
    size_mm = vector_of(np.ptp(mesh.bounds_mm, axis=0))
    height_mm = profile.search.pedestal_mm
    if height_mm > 0.0:
        try:
            pedestal = b"".join(mesh_blocks(pedestal_under(mesh, height_mm)))
            mesh = on_pedestal(mesh, height_mm)
        except MeshError as error:
            pedestal, refusal = b"", str(error)
    risky = risky_upright(mesh, profile.process.self_supporting_angle_deg)
    problem = out_of_reach((one_piece(mesh, profile.machine),), profile)
    copies_mm, none = _copies(mesh, bench)
    return Standing(size_mm, float(mesh.areas_mm2[risky].sum()), problem, pedestal, refusal, copies_mm, none)


def _copies(mesh: Mesh, bench: Bench) -> tuple[tuple[Place, ...], str]:
    """Where the copies stand, and why they cannot."""
    if bench.copies == 1 or bench.model is None:
        return (MIDDLE,), ""
    machine, (x, y) = bench.profile.machine, bench.profile.process.place_mm
    try:
        if bench.parts > 1:
            printed = cut_bench(bench, plan_of_bench(bench, PLAN_NAME))
        else:
            printed = Decomposition(bench.model.name, mesh, (one_piece(mesh, machine),), 1, CLASSIC, 0.0, 0.0, 0, 0, 0.0)
        places, _ = places_of([printed] * bench.copies, bench.profile)
    except PlanError as error:
        return (MIDDLE,), str(error)
    return tuple((at_x - x, at_y - y) for at_x, at_y in places), ""
