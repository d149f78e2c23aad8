"""Comparison of a print with the same model in one part: as it stands, and in its best single orientation."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from machine.dryrun.dryrun import DryRun
from machine.notices import Report, say
from machine.pipeline.pipeline import build
from machine.pipeline.plate import on_one_plate
from machine.planning.fit import standing_at
from machine.program import Alternative, Program, joints_of_print
from machine.quantities import filament_g
from mdp.cost.cost import needing_upright, weight_of_stairs
from mdp.decomposition import Decomposition, Part
from mdp.directions.orientation import Orientation, best_orientation, in_words, set_on_plate
from mdp.mesh import Mesh
from mdp.overhang import step_shares
from mdp.save import joint_values
from mdp.search.parts import one_piece
from profiles.errors import UserError
from profiles.messages import terminal_words
from profiles.profile import Profile
from slicer.paths import Kind
from slicer.raft import lift_mm

BEST = "best single orientation"
NAMES = ("parts", "upright", "oriented")  # names of the alternatives for scripts
SUPPORT = (Kind.SUPPORT.value, Kind.SUPPORT_INTERFACE.value)


def compare_with_one_part(program: Program, profile: Profile) -> tuple[Alternative, ...]:
    """This print, then the two prints in one part; () for G-code without a decomposition."""
    if program.decomposition is None:
        return ()
    x, y = profile.process.place_mm
    return in_parts(program, profile), *in_one_part(standing_at(program.decomposition, (-x, -y), -lift_mm(profile)), profile)


def in_one_part(ours: Decomposition, profile: Profile, report: Report | None = None) -> tuple[Alternative, Alternative]:
    """The models in one part each, as they stand and in the best orientation, with the same marks and modifiers.

    All get support whatever the process says because they would fail without. An alternative that the machine cannot print is
    returned with the reason. report: shows progress; None: on the terminal. The model is centred on the turn axis.
    """
    tell = say if report is None else report
    tell("comparing: straight up")
    up = straight_up(ours, profile, report)
    if all(np.allclose(_best(part.mesh, profile).rotation, np.eye(3), atol=1e-9) for part in _uncut(ours, profile)):
        return up, replace(up, name=BEST)
    tell(f"comparing: {BEST}")
    return up, best_lying(ours, profile, report)


def in_parts(program: Program, profile: Profile) -> Alternative:
    """The print that is exported. program: of a decomposition."""
    ours = program.decomposition
    assert ours is not None  # programs of other slicers are not compared
    count = len(ours.parts)
    way = Alternative(f"in {count} part{'s' * (count > 1)}", "", count, risky_mm2=ours.residual_area_mm2)
    return replace(_figures(way, program, profile), joints=joints_of_print(program, profile))


def straight_up(ours: Decomposition, profile: Profile, report: Report | None = None) -> Alternative:
    """The models in one part each as they stand."""
    way = Alternative("straight up", "as it stands", 1, risky_mm2=ours.risky_area_mm2)
    return _in_one_part(way, _uncut(ours, profile), profile, report)


def best_lying(ours: Decomposition, profile: Profile, report: Report | None = None) -> Alternative:
    """The models in one part each, oriented for the least support."""
    parts = _uncut(ours, profile)
    best = {part: _best(part.mesh, profile) for part in dict.fromkeys(parts)}
    lying = {part: _laid_down(part, orientation) for part, orientation in best.items()}
    words = "; ".join(dict.fromkeys(map(in_words, best.values())))
    risky = {part: float(part.mesh.areas_mm2[needing_upright(part.mesh, profile)].sum()) for part in lying.values()}
    way = Alternative(BEST, words, 1, risky_mm2=sum(risky[lying[part]] for part in parts))
    return _in_one_part(way, [lying[part] for part in parts], profile, report)


def _uncut(ours: Decomposition, profile: Profile) -> Sequence[Part]:
    """The models in one part each; without marks if those are unknown."""
    return ours.uncut or (one_piece(ours.mesh, profile.machine),)


def _best(mesh: Mesh, profile: Profile) -> Orientation:
    return best_orientation(mesh, profile.process.self_supporting_angle_deg)


def _laid_down(part: Part, best: Orientation) -> Part:
    """A model in one part rotated with its marks."""
    mesh, rotation = set_on_plate(part.mesh, best.rotation), best.rotation
    shift = mesh.vertices[0] - rotation @ part.mesh.vertices[0]
    turned = replace(part, mesh=mesh)
    return turned.with_marks(lambda mark: mark.transform(rotation, shift), lambda modifier: modifier.transform(rotation, shift))


def _in_one_part(way: Alternative, parts: Sequence[Part], profile: Profile, report: Report | None) -> Alternative:
    """Print models in one part each as they stand, with support whatever the process says. way: what is known in advance."""
    bare = profile.of_all_parts
    profile = bare.model_copy(update={"process": bare.process.model_copy(update={"support": "auto"})})
    models = {
        part: Decomposition(way.name, part.mesh, (part,), 1, "classic", way.risky_mm2, way.risky_mm2, 0, 0, 0.0)
        for part in dict.fromkeys(parts)
    }
    try:
        plate, profile = on_one_plate([models[part] for part in parts], profile)
        program = build(plate, profile, report=report)
    except UserError as error:  # the others can still be compared
        return replace(way, message=f"{error}")
    return _figures(way, program, profile)


def _figures(way: Alternative, program: Program, profile: Profile) -> Alternative:
    """An alternative with the figures of its program."""
    run = program.run
    filament_mm = float(np.max(run.program.filament_mm, initial=0.0))
    seam_mm, stairs_mm2 = 0.0, 0.0
    if program.decomposition is not None:
        seam_mm, stairs_mm2 = program.decomposition.seam_mm, _stairs_mm2(program.decomposition, profile)
    return replace(
        way,
        time_s=run.time_s,
        filament_mm=filament_mm,
        filament_g=filament_g(filament_mm, profile.material),
        support_mm3=support_mm3(run),
        risky_mm2=max(way.risky_mm2, 0.0),
        message=run.errors[0].message if run.errors else "",
        unsupported_mm2=sum(area.mm2 for _, _, area in run.program.unsupported),
        seam_mm=seam_mm,
        stairs_mm2=stairs_mm2,
        interface_mm3=program.interface_mm3,
        findings=len(run.findings),
    )


def support_mm3(run: DryRun) -> float:
    """Volume of a program's support, mm³."""
    supports = [number for number, kind in enumerate(run.program.types) if kind in SUPPORT]
    return float(run.segment_mm3[np.isin(run.program.type[run.segment_row], supports)].sum())


def _stairs_mm2(decomposition: Decomposition, profile: Profile) -> float:
    """Stair-stepping of a decomposition, mm², weighted; for one in one piece without a search, that of its surface."""
    if decomposition.chosen is not None:
        return decomposition.stairs_mm2
    mesh, direction = decomposition.mesh, decomposition.parts[0].direction
    return weight_of_stairs(profile) * float(mesh.areas_mm2 @ step_shares(mesh.normals @ direction))


def alternatives_json(alternatives: tuple[Alternative, ...]) -> list[dict[str, Any]]:
    """The alternatives for `export --json`: the exported print, the model upright, and its best single orientation."""
    return [
        {
            "name": name,
            "orientation": alternative.orientation,
            "parts": alternative.parts,
            "time_s": alternative.time_s,
            "filament_mm": alternative.filament_mm,
            "support_mm3": alternative.support_mm3,
            "support_area_mm2": alternative.risky_mm2,
            "unsupported_area_mm2": alternative.unsupported_mm2,
            "seam_mm": alternative.seam_mm,
            "stairs_mm2": alternative.stairs_mm2,
            "findings": alternative.findings,
            "interfaces": [{"part": part, "plastic_mm3": mm3} for part, mm3 in alternative.interface_mm3.items()],
            "joints": joint_values(alternative.joints),
            "message": terminal_words(alternative.message),
        }
        for name, alternative in zip(NAMES, alternatives, strict=True)
    ]
