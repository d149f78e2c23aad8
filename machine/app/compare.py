"""Compare: this print beside the same model printed in one part, straight up and in its best single orientation."""

from dataclasses import asdict, dataclass
from math import pi
from typing import Any

import numpy as np

from machine.app.pipeline import Program, build, standing_still
from machine.app.progress import say
from machine.app.report import duration, table
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Mesh
from mdp.orientation import best_orientation, in_words
from mdp.plane import PLATFORM
from mdp.pose import level, rotation
from profiles.errors import UserError
from profiles.profile import Profile
from slicer.paths import Kind

SUPPORT = (Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value)


@dataclass(frozen=True)
class Rival:
    """One way to print a model. risky_mm2: hanging faces that need support; message: why it cannot be printed so, or ""."""

    name: str
    orientation: str
    parts: int
    time_s: float | None
    filament_mm: float | None
    filament_g: float | None
    support_mm3: float | None
    risky_mm2: float
    message: str = ""


def compared(program: Program, profile: Profile) -> tuple[Rival, ...]:
    """This print, then the two in one part, which get support whatever the process says: without it they would fail.

    A rival that the machine cannot print stays in the list, with the reason.
    """
    ours = program.decomposition
    if ours is None:
        return ()
    process = profile.process
    held = profile.model_copy(update={"process": process.model_copy(update={"support": "auto"})})
    best = best_orientation(ours.mesh, process.self_supporting_angle_deg)
    count = len(ours.parts)
    found = [_figures(f"in {count} part{'s' * (count > 1)}", "", count, program, ours.residual_area_mm2, profile)]
    say("comparing: straight up")
    up = _single("straight up", "as it stands", ours.mesh, ours.risky_area_mm2, held)
    found.append(up)
    if np.allclose(best.rotation, np.eye(3), atol=1e-9):
        return (*found, Rival(**(asdict(up) | {"name": "best single orientation"})))
    say("comparing: best single orientation")
    risky = best.risky_mm2 + (best.base_mm2 if profile.search.count_platform_faces else 0.0)
    turned = standing_still(ours.mesh, best.rotation)
    return (*found, _single("best single orientation", in_words(best), turned, risky, held))


def _single(name: str, orientation: str, mesh: Mesh, risky_mm2: float, profile: Profile) -> Rival:
    """A model in one part as it stands."""
    pose = level(profile.machine)
    part = Part(1, mesh, PLATFORM, pose, rotation(profile.machine, pose), mesh.volume_mm3, risky_mm2)
    whole = Decomposition(name, mesh, (part,), 1, "classic", risky_mm2, risky_mm2, 0, 0, 0.0)
    try:
        program = build(whole, profile)
    except UserError as error:
        return Rival(name, orientation, 1, None, None, None, None, risky_mm2, str(error))
    return _figures(name, orientation, 1, program, risky_mm2, profile)


def _figures(name: str, orientation: str, parts: int, program: Program, risky_mm2: float, profile: Profile) -> Rival:
    run, material = program.run, profile.material
    filament_mm = float(np.max(run.program.filament_mm, initial=0.0))
    held = [place for place, kind in enumerate(run.program.types) if kind in SUPPORT]
    support = float(run.segment_mm3[np.isin(run.program.type[run.segment_row], held)].sum())
    grams = filament_mm * pi * material.diameter_mm**2 / 4.0 * material.density_g_cm3 / 1000.0
    message = run.errors[0].message if run.errors else ""
    return Rival(name, orientation, parts, run.time_s, filament_mm, grams, support, max(risky_mm2, 0.0), message)


def plain(rivals: tuple[Rival, ...]) -> list[dict[str, Any]]:
    """The rivals for `export --json`."""
    return [asdict(rival) for rival in rivals]


def compare_table(rivals: tuple[Rival, ...]) -> str:
    """The rivals for a person."""
    rows = [["print", "time", "filament", "mass", "support", "risky area"]]
    for rival in rivals:
        made = (
            [
                duration(rival.time_s),
                f"{(rival.filament_mm or 0.0) / 1000:.2f} m",
                f"{rival.filament_g or 0.0:.1f} g",
                f"{(rival.support_mm3 or 0.0) / 1000:.2f} cm3",
            ]
            if rival.time_s is not None
            else ["-"] * 4
        )
        rows.append([rival.name, *made, f"{rival.risky_mm2:.1f} mm2"])
    head, *lines = table(rows).splitlines()
    notes = [f"{rival.name}: {note}" for rival in rivals for note in (rival.orientation, rival.message) if note]
    return "\n".join(["", head, *lines, *notes]) + "\n"
