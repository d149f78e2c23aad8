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
from mdp.plane import Plane
from mdp.sweep import Surface, sweep
from profiles.machine import Machine
from profiles.process import Search

FRAGILE_MM = 1.0


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
    Reason.INTERFACE: "the part would hang on too small an area (search.least_interface_mm2)",
    Reason.FRAGILE: "the plane would leave a sliver",
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
    centre, radius = footprint(mesh) if search.platform_radius_mm is None else (np.zeros(2), search.platform_radius_mm)
    tilt = np.hypot(chosen[:, 0], chosen[:, 1])
    heights = np.zeros(len(chosen))
    if search.clearance:
        heights = np.array([least_height_mm(machine, direction) for direction in chosen])
    return Bounds(
        directions=chosen,
        least_offset_mm=chosen[:, :2] @ centre + radius * tilt,
        least_height_mm=heights,
        least_volume_mm3=search.least_volume_share * mesh.volume_mm3,
        least_interface_mm2=search.least_interface_mm2,
    )


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
class Candidates:
    """The feasible candidates of one solid, one array row each, and how many were refused for which reason."""

    direction: Floats
    offset_mm: Floats
    gain_mm2: Floats
    residual_mm2: Floats
    volume_mm3: Floats
    section_mm2: Floats
    fragile_mm: Floats
    above_platform_mm: Floats
    evaluated: int
    refused: Ints

    def plane(self, row: int) -> Plane:
        """The cutting plane of a row."""
        return Plane(self.direction[row], float(self.offset_mm[row]))


def evaluate(surface: Surface, limits: Bounds, search: Search, angle_deg: float, least_gain_mm2: float) -> Candidates:
    """All candidates of a solid by the sweep; gain is the risky area that a cut makes safe."""
    swept = sweep(surface, limits.directions, search.offset_step_mm, threshold(angle_deg), limits.least_height_mm)
    used = np.arange(swept.up_mm2.shape[1]) < swept.count[:, None]
    row, column = np.nonzero(used)
    offset = (swept.first[row] + column) * search.offset_step_mm
    gain = (swept.up_mm2 - swept.residual_mm2)[used]
    reason = np.zeros(len(row), np.int32)
    checks = {
        Reason.PLATFORM: offset < limits.least_offset_mm[row],
        Reason.FLOATING: swept.pieces[used] > 0,
        Reason.REACH: ~np.isfinite(limits.least_height_mm[row]),
        Reason.CLEARANCE: swept.lowest_mm[used] < limits.least_height_mm[row],
        Reason.VOLUME: swept.volume_mm3[used] < limits.least_volume_mm3,
        Reason.INTERFACE: swept.section_mm2[used] < limits.least_interface_mm2,
        Reason.FRAGILE: swept.fragile_mm[used] < FRAGILE_MM,
        Reason.GAIN: gain < least_gain_mm2,
    }
    for why, out in checks.items():
        reason[out & (reason == 0)] = why
    kept = reason == Reason.FEASIBLE
    return Candidates(
        direction=limits.directions[row[kept]],
        offset_mm=offset[kept],
        gain_mm2=gain[kept],
        residual_mm2=swept.residual_mm2[used][kept],
        volume_mm3=swept.volume_mm3[used][kept],
        section_mm2=swept.section_mm2[used][kept],
        fragile_mm=swept.fragile_mm[used][kept],
        above_platform_mm=(offset - limits.least_offset_mm[row])[kept],
        evaluated=len(row),
        refused=np.bincount(reason, minlength=len(Reason)).astype(np.int32),
    )
