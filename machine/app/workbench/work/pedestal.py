"""Pedestal: what the model stands on where `search.pedestal_mm` asks for it, and what stands so overhangs, as a task."""

from dataclasses import dataclass

from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.bench.fit import out_of_reach
from machine.app.workbench.work.cutting import standing_mesh
from machine.app.workbench.work.tell import Tell
from mdp.mesh import Mesh
from mdp.overhang import risky_upright
from mdp.pedestal import on_pedestal, pedestal_under


@dataclass(frozen=True, eq=False)
class OnPedestal:
    """The pedestal as a body, the area that overhangs on it, and what the machine does not reach of both, in the sentence of
    `export`."""

    body: Mesh
    overhang_mm2: float
    problem: str


def stand_on_pedestal(tell: Tell, bench: Bench) -> OnPedestal:
    """The model on the bench on its pedestal. Raises MeshError where it cannot be put on one."""
    mesh, height_mm = standing_mesh(bench), bench.profile.search.pedestal_mm
    lifted = on_pedestal(mesh, height_mm)
    risky = risky_upright(lifted, bench.profile.process.self_supporting_angle_deg)
    return OnPedestal(pedestal_under(mesh, height_mm), float(lifted.areas_mm2[risky].sum()), out_of_reach(lifted, bench.profile))
