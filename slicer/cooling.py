"""Cooling: how fast a layer's beads are laid so that it has time to set, and how hard the fan blows on it and on what hangs."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import hypot

import numpy as np

from mdp.mesh import Floats
from profiles.material import Material
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import Bead, length_mm
from slicer.paths import Kind, bead_area_mm2
from slicer.speed import stroke_speeds
from slicer.travel.order import Placed

RINGS = (Kind.OUTER_WALL, Kind.INNER_WALL)
HANGING = (Kind.BRIDGE, Kind.OVERHANG)
STEP = 0.05  # the fan is set in such steps: finer ones would only fill the file


def speeds_mm_s(
    placed: Sequence[Placed], profile: Profile, height_mm: float, fixed_mm_s: Mapping[Kind, float] | None, flow: float
) -> Floats:
    """(n,) speeds of a layer's beads; fixed_mm_s replaces the process's speeds by kind, flow multiplies every bead's flow.

    Bounded by what the hot end melts; a layer done before least_layer_time_s is slowed down to last as long, but not
    below least_speed_mm_s.
    """
    process, table = profile.process, stroke_speeds(profile.process)
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


def fan_share(material: Material, process: Process, time_s: float) -> float:
    """Part fan (0..1) of a layer that takes time_s: the material's fan up to least_layer_time_s, then less and less.

    Straight from `fan` to `fan_least` between least_layer_time_s and fan_layer_time_s, as PrusaSlicer has it.
    """
    least = min(material.fan_least, material.fan)
    quick, slow = process.least_layer_time_s, material.fan_layer_time_s
    falling = max(0.0, (slow - time_s) / (slow - quick)) if slow > quick else 0.0
    share = 1.0 if time_s <= quick else falling
    return round((least + share * (material.fan - least)) / STEP) * STEP


def rising_fan(material: Material, layer: int) -> float:
    """Factor on the fan of part 1's layer (counted from 0): none up to fan_off_layers, then rising, 1 from fan_full_layer on."""
    if layer < material.fan_off_layers:
        return 0.0
    return min((layer + 1 - material.fan_off_layers) / max(material.fan_full_layer - material.fan_off_layers, 1), 1.0)


def hanging_fan(material: Material, bead: Bead, factor: float, layer_fan: float) -> float | None:
    """Part fan of a bead where it differs from the layer's: of bridges, overhanging walls, half way there of those that lean."""
    if bead.kind not in HANGING and not bead.overhang:
        return None
    fans = (material.fan_infill_bridge if bead.over_infill else None, material.fan_bridge, material.fan)
    hanging = factor * next(fan for fan in fans if fan is not None)
    return hanging if bead.kind in HANGING else round(0.5 * (layer_fan + hanging) / STEP) * STEP
