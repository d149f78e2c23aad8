"""Copies: a model in one part several times on the plate, printed layer by layer together: the head meets none of them."""

from dataclasses import replace

import numpy as np

from machine.planning.fit import Place, places_on_plate
from mdp.cost.footing import tips_over
from mdp.decomposition import Decomposition
from mdp.mesh import Mesh
from mdp.overhang import Mask
from mdp.topology.cross_section import cross_sections
from profiles.errors import PlanError
from profiles.process import Process
from profiles.profile import Profile
from slicer.geometry.polygons import clean

GAP_MM = 5.0  # between copies, or between their brims
MOST = 1000


def check_copies(count: int) -> None:
    """Raise PlanError for a number of copies that cannot be."""
    if not 1 <= count <= MOST:
        raise PlanError(f"--copies is {count}: 1 to {MOST} is allowed")


def in_copies(decomposition: Decomposition, count: int, profile: Profile) -> tuple[Decomposition, Profile]:
    """A decomposition in one part, so many times about its place on the plate, and what it is printed with.

    Raises PlanError for one in several parts, and for more copies than the plate has places for.
    """
    if count == 1:
        return decomposition, profile
    part = decomposition.parts[0]
    places, process = places_of_copies(part.mesh, decomposition.name, len(decomposition.parts), count, profile)
    mesh = _repeated(part.mesh, places)
    middle = part.mesh.bounds_mm[:, :2].mean(axis=0)
    shifts = [(at_x - float(middle[0]), at_y - float(middle[1]), 0.0) for at_x, at_y in places]
    many = replace(
        part,
        mesh=mesh,
        volume_mm3=mesh.volume_mm3,
        risky_area_mm2=count * part.risky_area_mm2,
        needing=_tiled(part.needing, count),
        needing_upright=_tiled(part.needing_upright, count),
        no_seam=part.no_seam.repeated(shifts),
        no_support=part.no_support.repeated(shifts),
        modifiers=tuple(copy for modifier in part.modifiers for copy in modifier.repeated(shifts)),
        support=part.support.repeated(shifts),
    )
    risky_mm2, residual_mm2 = count * decomposition.risky_area_mm2, count * decomposition.residual_area_mm2
    plated = replace(decomposition, mesh=mesh, parts=(many,), risky_area_mm2=risky_mm2, residual_area_mm2=residual_mm2, front=())
    return plated, profile.model_copy(update={"process": process})


def places_of_copies(mesh: Mesh, name: str, parts: int, count: int, profile: Profile) -> tuple[list[Place], Process]:
    """Where the middles of so many copies of a model are, from the middle of the plate's place for it, the nearest first, and the
    process that prints them. parts: how many it is cut into.

    Raises PlanError for several parts, and for more copies than the plate has places for.
    """
    if parts > 1:
        raise PlanError(f"--copies {count}: {name} is cut into {parts} parts, copies are printed in one piece each: --parts 1")
    process = profile.process
    if process.brim_mm == 0.0 and process.small_base_brim_mm > 0.0 and _tips_over(mesh, profile):
        process = process.model_copy(update={"brim_mm": process.small_base_brim_mm})  # judged alone: together they stand wider
    width, depth = (float(side) for side in np.ptp(mesh.vertices[:, :2], axis=0))
    gap_mm = GAP_MM + 2.0 * process.brim_mm
    x, y = process.place_mm
    places = places_on_plate((width, depth), gap_mm, count, profile.machine, process.place_mm)
    if len(places) < count:
        raise PlanError(
            f"--copies {count}: {name} measures {width:.1f} x {depth:.1f} mm, the plate of {profile.machine.name} "
            f"has room for {len(places)} with {gap_mm:g} mm between them"
        )
    return [(at_x - x, at_y - y) for at_x, at_y in places], process  # all are moved to that place together


def _tips_over(mesh: Mesh, profile: Profile) -> bool:
    """Whether one copy would tip off the plate."""
    base = cross_sections(mesh, np.array([0.5 * profile.process.first_layer_height_mm]))[0]
    return tips_over(clean(base), float(mesh.bounds_mm[1, 2]))


def _repeated(mesh: Mesh, places: list[Place]) -> Mesh:
    """A mesh at every place, its middle there."""
    middle = np.array([*mesh.bounds_mm[:, :2].mean(axis=0), 0.0])
    vertices = [mesh.vertices - middle + np.array([x, y, 0.0]) for x, y in places]
    faces = [mesh.faces + k * len(mesh.vertices) for k in range(len(places))]
    colours = None if mesh.colours is None else np.tile(mesh.colours, len(places))
    return Mesh(np.concatenate(vertices), np.concatenate(faces), colours)


def _tiled(mask: Mask | None, count: int) -> Mask | None:
    return None if mask is None else np.tile(mask, count)
