"""Speed: how fast each bead is laid down."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import hypot

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import Bead, length_mm
from slicer.paths import Kind, bead_area_mm2
from slicer.travel.order import Placed

INSIDE = (Kind.INFILL, Kind.SKIN, Kind.TOP_SKIN)
RINGS = (Kind.OUTER_WALL, Kind.INNER_WALL)


def of_kind_mm_s(process: Process) -> dict[Kind, float]:
    """The process's speed of every kind of bead."""
    return {
        Kind.OUTER_WALL: process.outer_wall_speed_mm_s,
        Kind.INNER_WALL: process.inner_wall_speed_mm_s,
        Kind.OVERHANG: process.overhang_75_speed_mm_s,
        Kind.GAP: process.gap_speed_mm_s,
        Kind.INFILL: process.infill_speed_mm_s,
        Kind.SKIN: process.skin_speed_mm_s,
        Kind.TOP_SKIN: process.top_skin_speed_mm_s,
        Kind.BRIDGE: process.bridge_speed_mm_s,
        Kind.IRONING: process.ironing_speed_mm_s,
        Kind.SKIRT: process.first_layer_speed_mm_s,
        Kind.PURGE: process.first_layer_speed_mm_s,
        Kind.SUPPORT: process.support_speed_mm_s,
        Kind.SUPPORT_INTERFACE: process.support_interface_speed_mm_s,
    }


def first_layer_mm_s(process: Process, on_platform: bool) -> dict[Kind, float]:
    """Speeds by kind of a part's first layer, on the platform or on plastic."""
    if not on_platform:
        return dict.fromkeys(Kind, process.interface_speed_mm_s)
    inside = process.first_layer_infill_speed_mm_s or process.first_layer_speed_mm_s
    return dict.fromkeys(Kind, process.first_layer_speed_mm_s) | dict.fromkeys(INSIDE, inside)


def speeds_mm_s(
    placed: Sequence[Placed], profile: Profile, height_mm: float, fixed_mm_s: Mapping[Kind, float] | None, flow: float
) -> Floats:
    """(n,) speeds of a layer's beads; fixed_mm_s replaces the process's speeds by kind, flow multiplies every bead's flow.

    Bounded by what the hot end melts; a layer done before least_layer_time_s is slowed down to last as long, but not
    below least_speed_mm_s.
    """
    process, table = profile.process, of_kind_mm_s(profile.process)
    asked = np.array([_of_bead(p.bead, table, process) if fixed_mm_s is None else fixed_mm_s[p.bead.kind] for p in placed])
    areas = np.array([bead_area_mm2(p.bead.width_mm, height_mm) * p.bead.flow * flow for p in placed])
    speeds = np.minimum(asked, profile.material.volumetric_limit_mm3_s / areas)
    lengths = np.array([p.bead.length_mm for p in placed])
    return _slow_down(speeds, lengths, process.least_layer_time_s - travel_time_s(placed, profile), process.least_speed_mm_s)


def _of_bead(bead: Bead, table: dict[Kind, float], process: Process) -> float:
    """The kind's speed, over sparse infill a bridge's own; at most what a small closed wall and an overhang may have."""
    if bead.over_infill:
        return process.infill_bridge_speed_mm_s
    if bead.overhang:
        return min(table[bead.kind], _overhang_mm_s(process)[bead.overhang - 1])
    way = bead.points if bead.course is None else bead.course.points
    if bead.kind in RINGS and length_mm(way) <= process.small_wall_mm:
        ends = way[-1] - way[0]
        if float(np.hypot(ends[0], ends[1])) <= bead.width_mm:  # a seam gap leaves a wall a little open
            return min(table[bead.kind], process.small_wall_speed_mm_s)
    return table[bead.kind]


def _overhang_mm_s(process: Process) -> tuple[float, ...]:
    return (
        process.overhang_75_speed_mm_s,
        process.overhang_50_speed_mm_s,
        process.overhang_25_speed_mm_s,
        process.overhang_0_speed_mm_s,
    )


def travel_time_s(placed: Sequence[Placed], profile: Profile) -> float:
    """What a layer's travels and retractions take at least."""
    material = profile.material
    length = sum(_travel_mm(a, b) for a, b in pairwise(placed))
    pulls = sum(p.retract for p in placed) * 2.0 * material.retract_mm / material.retract_speed_mm_s
    return length / profile.process.travel_speed_mm_s + pulls


def _travel_mm(before: Placed, after: Placed) -> float:
    """Length of the way between two beads."""
    if len(after.approach):
        return length_mm(np.concatenate([before.points[-1:], after.approach, after.points[:1]]))
    (x0, y0), (x1, y1) = before.points[-1].tolist(), after.points[0].tolist()
    return hypot(x1 - x0, y1 - y0)


def layer_time_s(placed: Sequence[Placed], speeds: Floats, profile: Profile) -> float:
    """What a layer takes at least, accelerations left out."""
    lengths = np.array([p.bead.length_mm for p in placed])
    return float((lengths / speeds).sum()) + travel_time_s(placed, profile)


def _slow_down(speeds: Floats, lengths: Floats, time_s: float, least_mm_s: float) -> Floats:
    """Speeds by one factor slower so that the lengths take the time, none pushed below the least speed."""
    floor = np.minimum(speeds, least_mm_s)
    factor = 1.0
    for _ in range(4):  # beads that reach the floor leave the rest of the waiting to the others
        slowed = np.maximum(speeds * factor, floor)
        free = slowed > floor
        missing = time_s - float((lengths / slowed).sum())
        busy = float((lengths[free] / slowed[free]).sum())
        if missing <= 1e-9 or busy <= 0.0:
            break
        factor *= busy / (busy + missing)
    return np.maximum(speeds * factor, floor)
