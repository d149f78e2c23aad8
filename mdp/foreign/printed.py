"""Printed volumes: the surfaces that a slicer file prints, with its negative volumes subtracted."""

import numpy as np

from mdp.formats.slicer_file import NEGATIVE, PART, Build, Role
from mdp.formats.surface import Surface
from mdp.repair.colours import carry_colours
from mdp.repair.repair import repair
from mdp.repair.shells import above, subtract
from profiles.errors import MeshError

SINKING_MM = 0.001  # below the plate; PrusaSlicer takes less for rounding


def printed(build: Build) -> tuple[list[Surface], list[str]]:
    """The surfaces that a slicer file prints, and a note on each object cut by negative volumes or by the plate.

    Raises MeshError if nothing is left, and for a negative volume that is not a solid.
    """
    surfaces, notes, subtracted = list[Surface](), list[str](), 0
    for item in build.objects:
        parts, negatives = item.surfaces(PART), [volume for volume in item.volumes if volume[1].kind == NEGATIVE]
        deep_mm = -min((float(part.vertices[part.faces.ravel(), 2].min()) for part in parts), default=0.0)
        sinks = build.on_plate and deep_mm > SINKING_MM
        if not parts or not (negatives or sinks):
            surfaces += parts
            continue
        left, repairs = repair(parts)
        if negatives:
            left = subtract(left, [solid_of_volume(*volume) for volume in negatives])
            subtracted += len(negatives)
        if sinks:
            left = above(left, 0.0)
            repairs.append(f"leaves out what lies below the plate, {deep_mm:.3g} mm deep")
        left = Surface(left.vertices, left.faces, carry_colours(parts, left))
        notes += [*repairs, *([] if len(left.faces) else ["nothing is left of one of its objects"])]
        surfaces += [left] if len(left.faces) else []
    notes += [f"subtracted {subtracted} negative volume{'s' * (subtracted > 1)}"] if subtracted else []
    if not surfaces:
        raise MeshError("nothing is left of it: negative volumes or the plate cut all of it away")
    return surfaces, notes


def solid_of_volume(surface: Surface, role: Role) -> Surface:
    """A volume as a closed solid. Raises MeshError with the volume's name."""
    try:
        with np.errstate(all="ignore"):  # a volume too far away to have a finite size is refused like any other
            return repair([surface])[0]
    except MeshError as error:
        raise MeshError(f"its {role.kind} {role.name!r} {error}") from None
