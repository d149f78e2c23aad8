"""Candidates: directions times offsets, and what the criteria, the axes and the head leave of them.

Criteria of the 2020 paper: I (self-supported above the plane) is the search's relaxed goal, II (what remains stands on the
platform), III (the platform lies below the plane), IV (a large volume above the plane).
"""

from dataclasses import dataclass
from enum import IntEnum
from math import pi, radians, sin, sqrt

import numpy as np

from mdp.clearance import least_height_mm
from mdp.mesh import Floats, Ints, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM, threshold
from mdp.sweep import Remainder, gains, sweep
from profiles.machine import Machine
from profiles.search import Search

# A plane is never laid into a face that overhangs along its direction: that would look like resting on the cut, over air.
COPLANAR_MM = 1e-4
LEAST_FOOTING_MM2 = 1e-6  # a piece that stands on less floats in the air, whatever interface is asked for


class Reason(IntEnum):
    """Why a candidate is out; FEASIBLE: it is not. The first reason that holds is counted."""

    FEASIBLE = 0
    PLATFORM = 1
    FLOATING = 2
    REACH = 3
    CLEARANCE = 4
    VOLUME = 5
    INTERFACE = 6
    FRAGILE = 7
    GAIN = 8


REASONS = {
    Reason.PLATFORM: "the plane would cut the platform (criterion III)",
    Reason.FLOATING: "what remains would not stand on the platform (criterion II)",
    Reason.REACH: "the axes do not reach the direction",
    Reason.CLEARANCE: "the head would meet the table",
    Reason.VOLUME: "the part would be too small (search.least_volume_share)",
    Reason.INTERFACE: "the part or a piece of it would hang on too small an area (search.least_interface_mm2)",
    Reason.FRAGILE: "the plane would leave a sliver (search.fragile_mm)",
    Reason.GAIN: "nothing or too little would become safe (search.least_gain)",
}


def directions(search: Search) -> Floats:
    """(k, 3) unit directions spread evenly over the sphere's cap above the least elevation (a Fibonacci lattice)."""
    index = np.arange(search.directions) + 0.5
    z = 1.0 - (1.0 - sin(radians(search.least_elevation_deg))) * index / search.directions
    angle = index * pi * (3.0 - sqrt(5.0))
    across = np.sqrt(1.0 - z * z)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)


@dataclass(frozen=True, eq=False)
class Bounds:
    """What every direction must respect, worked out once a search: (k,) arrays."""

    directions: Floats
    least_offset_mm: Floats
    least_height_mm: Floats
    least_volume_mm3: float
    least_interface_mm2: float


def bounds(mesh: Mesh, machine: Machine, search: Search, fixed: Floats | None = None) -> Bounds:
    """Bounds of a model's search for the sampled directions, or for `fixed` ones."""
    chosen = directions(search) if fixed is None else fixed
    return bounds_of(chosen, ground(mesh, search), mesh.volume_mm3, machine, search)


def bounds_of(chosen: Floats, disc: tuple[Floats, float], volume_mm3: float, machine: Machine, search: Search) -> Bounds:
    """Bounds for the chosen directions, a disc that every plane must clear, and a model's volume."""
    centre, radius = disc
    tilt = np.hypot(chosen[:, 0], chosen[:, 1])
    heights = np.zeros(len(chosen))
    if search.clearance:
        heights = np.array([least_height_mm(machine, direction) for direction in chosen])
    return Bounds(
        directions=chosen,
        least_offset_mm=chosen[:, :2] @ centre + radius * tilt,
        least_height_mm=heights,
        least_volume_mm3=search.least_volume_share * volume_mm3,
        least_interface_mm2=search.least_interface_mm2,
    )


def ground(mesh: Mesh, search: Search) -> tuple[Floats, float]:
    """Centre and radius of the disc of criterion III: the one that is asked for, or the model's footprint."""
    return footprint(mesh) if search.platform_radius_mm is None else (np.zeros(2), search.platform_radius_mm)


def footprint(mesh: Mesh) -> tuple[Floats, float]:
    """Centre (2,) and radius of a nearly least disc around what stands on the platform (Badoiu and Clarkson)."""
    points = mesh.vertices[mesh.vertices[:, 2] <= PLATFORM_TOLERANCE_MM][:, :2]
    if len(points) == 0:
        return np.zeros(2), 0.0
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    for step in range(1, 200):
        farthest = points[np.argmax(((points - centre) ** 2).sum(axis=1))]
        centre = centre + (farthest - centre) / (step + 1)
    return centre, float(np.sqrt(((points - centre) ** 2).sum(axis=1).max()))


@dataclass(frozen=True, eq=False)
class Worth:
    """The candidates of one solid that would make enough safe above the platform, one array row each; whether they can be
    cut is not known yet. direction is a row of Bounds.directions; evaluated counts all planes looked at."""

    remainder: Remainder
    direction: Ints
    offset_mm: Floats
    gain_mm2: Floats
    residual_mm2: Floats
    evaluated: int


@dataclass(frozen=True, eq=False)
class Checked:
    """What the sweep says of some candidates, one array row each; reason is FEASIBLE or why not.

    fragile_mm is the distance to the nearest surface that the plane would cut into a sliver. footing_mm2 is the least area
    that a piece of the part stands on. A piece lower than the side of a square of least_interface_mm2 is a crumb and may stand
    on less.
    """

    reason: Ints
    volume_mm3: Floats
    section_mm2: Floats
    fragile_mm: Floats
    footing_mm2: Floats


def worth(remainder: Remainder, limits: Bounds, search: Search, angle_deg: float, least_gain_mm2: float) -> Worth:
    """All candidates of a solid that are worth a cut; gain is the risky area that a cut makes safe."""
    found = gains(remainder, limits.directions, search.offset_step_mm, threshold(angle_deg))
    used = np.arange(found.up_mm2.shape[1]) < found.count[:, None]
    gain = found.up_mm2 - found.residual_mm2
    offset: Floats = (found.first[:, None] + np.arange(gain.shape[1])) * np.float64(search.offset_step_mm)
    above = (offset >= limits.least_offset_mm[:, None]) & np.isfinite(limits.least_height_mm)[:, None]
    kept = used & above & (gain >= least_gain_mm2)
    direction = np.nonzero(kept)[0].astype(np.int32)
    return Worth(remainder, direction, offset[kept], gain[kept], found.residual_mm2[kept], int(found.count.sum()))


def check(remainder: Remainder, limits: Bounds, search: Search, direction: Ints, offset_mm: Floats) -> Checked:
    """Which of the planes (rows of Bounds.directions, offsets on the grid) can be cut."""
    rows, inverse = np.unique(direction, return_inverse=True)
    crumb_mm = sqrt(limits.least_interface_mm2)
    found = sweep(remainder, limits.directions[rows], search.offset_step_mm, limits.least_height_mm[rows], crumb_mm)
    at = (inverse, np.rint(offset_mm / search.offset_step_mm).astype(np.int64) - found.first[inverse])
    reason = np.zeros(len(direction), np.int32)
    checks = {
        Reason.PLATFORM: offset_mm < limits.least_offset_mm[direction],
        Reason.FLOATING: found.pieces[at] > 0,
        Reason.REACH: ~np.isfinite(limits.least_height_mm[direction]),
        Reason.CLEARANCE: found.lowest_mm[at] < limits.least_height_mm[direction],
        Reason.VOLUME: found.volume_mm3[at] < limits.least_volume_mm3,
        Reason.INTERFACE: found.footing_mm2[at] < max(limits.least_interface_mm2, LEAST_FOOTING_MM2),
        Reason.FRAGILE: found.fragile_mm[at] < max(search.fragile_mm, COPLANAR_MM),
    }
    for why, out in checks.items():
        reason[out & (reason == 0)] = why
    columns = (found.volume_mm3, found.section_mm2, found.fragile_mm, found.footing_mm2)
    return Checked(reason, *(column[at] for column in columns))


def refusals(remainder: Remainder, limits: Bounds, search: Search, angle_deg: float, least_gain_mm2: float) -> dict[Reason, int]:
    """How many of all candidates of a solid each reason takes, for telling a person why nothing can be cut."""
    found = gains(remainder, limits.directions, search.offset_step_mm, threshold(angle_deg))
    direction, column = np.nonzero(np.arange(found.up_mm2.shape[1]) < found.count[:, None])
    offset: Floats = (found.first[direction] + column) * np.float64(search.offset_step_mm)
    reason = check(remainder, limits, search, direction.astype(np.int32), offset).reason
    gain = (found.up_mm2 - found.residual_mm2)[direction, column]
    reason[(reason == Reason.FEASIBLE) & (gain < least_gain_mm2)] = Reason.GAIN
    return {why: int((reason == why).sum()) for why in Reason}
