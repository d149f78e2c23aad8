"""Fit: whether a machine has room for parts, known before slicing: every axis reaches them, they stand on the plate; and a model
moved to its place there.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from machine.kinematics.table import machine_points
from machine.planning.limits import ROUNDING, axis_limits, over_edge_mm
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Floats, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.plane import Plane
from profiles.errors import MoveError
from profiles.profile import Profile
from profiles.settings.plate import MIDDLE
from slicer.paths import SlicedPart
from slicer.raft import lift_mm

Place = tuple[float, float]
STILL = np.eye(3)  # turns nothing


def check_parts(parts: Sequence[Part], profile: Profile) -> None:
    """Raise MoveError when the machine has no room for a part of a model about the turn axis, at its place on the plate.

    A part that stands as its pose has it reaches outside X, Y or Z, or the first one stands over the plate's edge. Half a line
    is left at the sides, for the tip stays so far inside what it prints."""
    for part in parts:
        _check_reach(part, profile)
        if part.on_platform:
            check_standing(part.mesh, profile)


def _check_reach(part: Part, profile: Profile) -> None:
    machine = profile.machine
    reached = machine_points(machine, part.pose, part.mesh.vertices + _shift(profile))
    inset = 0.5 * profile.of_part(part.index).process.line_width_mm * np.array([1.0, 1.0, 0.0])
    ends = np.transpose([reached.min(axis=0) + inset, reached.max(axis=0) - inset])
    for values, (letter, limits) in zip(ends, list(axis_limits(machine).items())[:3], strict=True):
        for value in values:
            if not limits[0] - ROUNDING <= value <= limits[1] + ROUNDING:
                where = f"{machine.tilt.letter}{part.pose.tilt_deg:.1f} {machine.turn.letter}{part.pose.turn_deg:.1f}"
                raise MoveError(
                    f"part {part.index} reaches {letter} {value:.1f} mm at {where}, {letter} goes from {limits[0]:g} to "
                    f"{limits[1]:g} mm on {machine.name}: {_advice(profile)}"
                )


def check_standing(mesh: Mesh, profile: Profile) -> None:
    """Raise MoveError when what stands on the platform of a model about the turn axis lies over the plate's edge at its place.

    Brims and supports are not known yet: the dry run looks at them."""
    machine, inset_mm = profile.machine, 0.5 * profile.of_part(1).process.line_width_mm
    standing = mesh.vertices[mesh.vertices[:, 2] <= PLATFORM_TOLERANCE_MM, :2] + _shift(profile)[:2]
    over, edge = over_edge_mm(np.maximum(np.abs(standing) - inset_mm, 0.0), machine.table)
    over_mm = float(over.max(initial=-np.inf))
    if over_mm > ROUNDING:
        x, y = np.ptp(standing, axis=0)
        raise MoveError(
            f"the first layer on the plate is {x:.1f} x {y:.1f} mm, {over_mm:.1f} mm over the edge of the plate of "
            f"{machine.name}, {edge}: {_advice(profile)}"
        )


def _shift(profile: Profile) -> Floats:
    """(3,) what moves the model to its place, on its raft where it has one, mm."""
    return np.array([*profile.process.place_mm, lift_mm(profile)])


def _advice(profile: Profile) -> str:
    x, y = profile.process.place_mm
    if (x, y) == MIDDLE:
        return "process.scale makes the model smaller"
    return f"process.place_mm moves it from {x:g}, {y:g} mm back towards the middle"


def standing_at(decomposition: Decomposition, place_mm: Place, up_mm: float = 0.0) -> Decomposition:
    """A decomposition moved by x, y over the plate and lifted onto a raft, its planes and marks too."""
    if place_mm == MIDDLE and up_mm == 0.0:
        return decomposition
    shift = np.array([*place_mm, up_mm])
    rows = tuple(replace(row, planes=tuple(_plane_moved(plane, shift) for plane in row.planes)) for row in decomposition.front)
    parts = tuple(_part_moved(part, shift) for part in decomposition.parts)
    return replace(decomposition, mesh=decomposition.mesh.transform(STILL, shift), parts=parts, front=rows)


def lifted(
    decomposition: Decomposition, sliced: Sequence[SlicedPart], profile: Profile
) -> tuple[Decomposition, list[SlicedPart]]:
    """Parts that were sliced as if they stood on the plate, and their layers, above their raft.

    So the layers are those that they have without a raft, and all that keeps clear of the table keeps clear of the raft."""
    up = np.array([0.0, 0.0, lift_mm(profile)])
    moved = [piece.moved(*(part.rotation @ up)[:2].tolist()) for part, piece in zip(decomposition.parts, sliced, strict=True)]
    return standing_at(decomposition, MIDDLE, float(up[2])), moved


def mesh_at_place(mesh: Mesh, profile: Profile) -> Mesh:
    """A mesh at its place on the plate, and on its raft, as it is printed."""
    return mesh.transform(STILL, _shift(profile))


def _part_moved(part: Part, shift: Floats) -> Part:
    lifted_mm = part.lifted_mm + float(shift[2]) if part.on_platform else 0.0
    moved = replace(part, mesh=part.mesh.transform(STILL, shift), base=_plane_moved(part.base, shift), lifted_mm=lifted_mm)
    return moved.with_marks(lambda mark: mark.transform(STILL, shift), lambda modifier: modifier.transform(STILL, shift))


def _plane_moved(plane: Plane, shift: Floats) -> Plane:
    limbs_mm = None if plane.limbs_mm is None else plane.limbs_mm + shift
    return Plane(plane.normal, plane.offset_mm + float(plane.normal @ shift), limbs_mm)
