"""Printed: the surfaces that a slicer's project prints, its negative volumes taken out."""

from mdp.formats.project import NEGATIVE, PART, Project, ProjectVolume
from mdp.formats.surface import Surface
from mdp.repair.repair import repair
from mdp.repair.shells import subtract
from profiles.errors import MeshError


def printed(project: Project) -> tuple[list[Surface], list[str]]:
    """The surfaces that a project prints, and a sentence for each object that negative volumes were taken out of.

    Raises MeshError where nothing is left, and for a negative volume that is no solid."""
    surfaces, notes = list[Surface](), list[str]()
    for own in project.objects:
        parts, negatives = own.surfaces(PART), [volume for volume in own.volumes if volume.role.kind == NEGATIVE]
        if not parts or not negatives:
            surfaces += parts
            continue
        solid, repairs = repair(parts)
        left = subtract(solid, [solid_of_volume(volume) for volume in negatives])
        count = f"{len(negatives)} negative volume{'s' * (len(negatives) > 1)}"
        notes += [*repairs, f"took {count} out of it" + ("" if len(left.faces) else ": nothing is left of an object")]
        surfaces += [left] if len(left.faces) else []
    if not surfaces:
        raise MeshError("nothing is left where its negative volumes are taken out")
    return surfaces, notes


def solid_of_volume(volume: ProjectVolume) -> Surface:
    """A volume as a closed solid. Raises MeshError, which names it."""
    try:
        return repair([volume.surface])[0]
    except MeshError as error:
        raise MeshError(f"its {volume.role.kind} {volume.role.name!r} {error}") from None
