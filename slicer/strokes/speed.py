"""Speed: speed and acceleration of each kind of bead, and cooling of layers; strokes with speeds and fan become the printed
table.

A layer that would be finished too soon is slowed down so that it has time to set; the fan follows the time of the layer, with
separate values for bridges and overhangs.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from profiles.material import Material
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import Bead
from slicer.geometry.polygons import Polygons
from slicer.geometry.polyline import length_mm, lengthen_steps, mark_corners
from slicer.paths import KINDS, SKINS, Kind, Layer, bead_area_mm2
from slicer.strokes.strokes import RINGS, Strokes, in_pieces
from slicer.strokes.travels import may_wipe_over

KEYS = tuple(key for key in Process.model_fields if key.endswith("acceleration_mm_s2"))
BY_SHARE = ("overhang_75_speed_mm_s", "overhang_50_speed_mm_s", "overhang_25_speed_mm_s", "overhang_0_speed_mm_s")
SPEED_KEYS = {
    Kind.OUTER_WALL: "outer_wall_speed_mm_s",
    Kind.INNER_WALL: "inner_wall_speed_mm_s",
    Kind.OVERHANG: "overhang_75_speed_mm_s",
    Kind.GAP: "gap_speed_mm_s",
    Kind.INFILL: "infill_speed_mm_s",
    Kind.SKIN: "skin_speed_mm_s",
    Kind.TOP_SKIN: "top_skin_speed_mm_s",
    Kind.BRIDGE: "bridge_speed_mm_s",
    Kind.IRONING: "ironing_speed_mm_s",
    Kind.SKIRT: "first_layer_speed_mm_s",
    Kind.PURGE: "first_layer_speed_mm_s",
    Kind.SUPPORT: "support_speed_mm_s",
    Kind.SUPPORT_INTERFACE: "support_interface_speed_mm_s",
}
INSIDE = (Kind.INFILL, Kind.SKIN, Kind.TOP_SKIN)
HANGING = (Kind.BRIDGE, Kind.OVERHANG)
LEAST_GAIN_S = 0.25  # a faster stretch that saves less is not worth its own speed, since the tip would hardly reach it
LEAST_STEP_GAIN_S = 0.1  # nor is a step between a slower and a faster stretch that saves less
SHORTEST = 0.5  # line widths: shortest step of a skin line
SHORTEST_STROKE = 4.0  # line widths of a stroke whose steps are lengthened
# line widths by which easing may move a line; exact for tops, whose gaps are visible, and for bridges
ASIDE, ASIDE_EXACT = 0.25, 0.15
FAN_STEP = 0.05  # fan values are rounded to this, since finer steps would only enlarge the file


def timed(
    strokes: Strokes, profile: Profile, height_mm: float, kind_mm_s: Floats | None, flow: float, of_places: Sequence[Process] = ()
) -> tuple[Strokes, Floats]:
    """The strokes of a layer, simplified and in pieces of one width, with their (k,) speeds. kind_mm_s: speeds by number of the
    kind, which replace the process's; flow: factor on every stroke; of_places: processes of areas with modified settings, empty
    if kind_mm_s is set. Speeds are limited by what the hot end can melt; a layer faster than least_layer_time_s is slowed down to
    that time, but not below least_speed_mm_s.
    """
    strokes, process = in_pieces(strokes, height_mm), profile.process
    nominal = _of_strokes(strokes, process) if kind_mm_s is None else kind_mm_s[strokes.kind]
    for number, own in enumerate(of_places, start=1):
        nominal = np.where(strokes.place == number, _of_strokes(strokes, own), nominal)
    speeds = steady(np.minimum(nominal, melting_speeds_mm_s(strokes, profile, height_mm, flow)), strokes.lengths_mm)
    time_s = process.least_layer_time_s - travel_time_s(strokes, profile)
    speeds = _slow_down(speeds, strokes.lengths_mm, time_s, process.least_speed_mm_s)
    corners = mark_corners(strokes.points, strokes.starts, process.resolution_mm)
    eased = _without_short_steps(strokes.with_points(strokes.points, corners))
    return eased, np.minimum(speeds, melting_speeds_mm_s(eased, profile, height_mm, flow))


def _without_short_steps(strokes: Strokes) -> Strokes:
    """The strokes without short steps in skins, where that moves them only a little; each keeps its amount of plastic."""
    # A shorter stroke consists only of its two ends, which lie where the layer below holds them.
    eases = strokes.is_of(*SKINS) & (strokes.lengths_mm > SHORTEST_STROKE * strokes.width_mm)
    width_mm = np.where(eases, strokes.width_mm, 0.0)
    aside_mm = width_mm * np.where(strokes.is_of(Kind.TOP_SKIN, Kind.BRIDGE), ASIDE_EXACT, ASIDE)
    eased = strokes.with_points(*lengthen_steps(strokes.points, strokes.starts, SHORTEST * width_mm, aside_mm))
    return replace(eased, flow=strokes.flow * strokes.lengths_mm / np.maximum(eased.lengths_mm, 1e-9))


def melting_speeds_mm_s(strokes: Strokes, profile: Profile, height_mm: float, flow: float) -> Floats:
    """(k,) speeds at the hot end's melting limit. flow: factor on every stroke."""
    areas = bead_area_mm2(strokes.width_mm, height_mm) * strokes.flow * flow
    speeds: Floats = profile.material.volumetric_limit_mm3_s / areas
    return speeds


@kernel
def steady(speeds: Floats, lengths_mm: Floats) -> Floats:
    """(k,) speeds of consecutive strokes, without changes that save LEAST_GAIN_S or LEAST_STEP_GAIN_S or less.

    A stretch of one speed that is faster than its neighbours takes the faster of their speeds, a step between a slower and a
    faster stretch the slower one; no stroke becomes faster.
    """
    steadied, changes = speeds.copy(), True
    while changes:
        changes, begin = False, 0
        while begin < len(steadied):
            end, length_mm = begin, 0.0
            while end < len(steadied) and steadied[end] == steadied[begin]:
                length_mm += lengths_mm[end]
                end += 1
            before, after = steadied[begin - 1] if begin > 0 else 0.0, steadied[end] if end < len(steadied) else 0.0
            step = before > 0.0 and after > 0.0 and max(before, after) > steadied[begin]
            slower, least_s = (min(before, after), LEAST_STEP_GAIN_S) if step else (max(before, after), LEAST_GAIN_S)
            if 0.0 < slower < steadied[begin] and length_mm * (1.0 / slower - 1.0 / steadied[begin]) < least_s:
                steadied[begin:end] = slower
                changes = True
            begin = end
    return steadied


def _of_strokes(strokes: Strokes, process: Process) -> Floats:
    """The speed of each stroke's kind, or of bridges over sparse infill, limited by those of small closed walls and overhangs."""
    usual = stroke_speeds(process)[strokes.kind]
    hanging = np.array([np.inf, *(getattr(process, key) for key in BY_SHARE), process.bridge_speed_mm_s])[strokes.overhang]
    small = np.where(strokes.small & strokes.is_of(*RINGS), process.small_wall_speed_mm_s, np.inf)
    lowered = np.minimum(usual, np.where(strokes.overhang > 0, hanging, small))
    return np.where(strokes.over_infill, process.infill_bridge_speed_mm_s, lowered)


def bead_speed_mm_s(bead: Bead, process: Process, kind_mm_s: Floats | None = None) -> float:
    """Speed of a bead before it becomes a stroke: as in _of_strokes, but without overhangs and cooling. kind_mm_s: speeds by
    number of the kind, which replace the process's.
    """
    if kind_mm_s is not None:
        return float(kind_mm_s[KINDS.index(bead.kind)])
    if bead.over_infill:
        return process.infill_bridge_speed_mm_s
    usual: float = getattr(process, SPEED_KEYS[bead.kind])
    return min(usual, process.small_wall_speed_mm_s) if bead.kind in RINGS and bead.is_small(process.small_wall_mm) else usual


def kinds_apart(processes: Sequence[Process]) -> list[Kind]:
    """The kinds of beads whose speeds differ between some processes."""

    def differ(*keys: str) -> bool:
        return len({tuple(getattr(process, key) for key in keys) for process in processes}) > 1

    speeds = np.array([stroke_speeds(process) for process in processes])
    kinds = [KINDS[k] for k in np.flatnonzero(np.ptp(speeds, axis=0))]
    kinds += [*RINGS, Kind.GAP, Kind.OVERHANG] if differ("small_wall_speed_mm_s", "bridge_speed_mm_s", *BY_SHARE) else []
    return [*kinds, Kind.BRIDGE] if differ("infill_bridge_speed_mm_s") else kinds


def travel_time_s(strokes: Strokes, profile: Profile) -> float:
    """Lower bound of the time for a layer's travels and retractions, s."""
    steps, passes = strokes.first_points[1:] - strokes.last_points[:-1], strokes.approach_starts
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    for k in np.flatnonzero(np.diff(passes)).tolist():
        if k:
            way = [strokes.last_points[k - 1 : k], strokes.approach[passes[k] : passes[k + 1]], strokes.first_points[k : k + 1]]
            lengths[k - 1] = length_mm(np.concatenate(way))
    material = profile.material
    pulls = int(strokes.retract.sum()) * 2.0 * material.retract_mm / material.retract_speed_mm_s
    return float(lengths.sum()) / profile.process.travel_speed_mm_s + pulls


def _slow_down(speeds: Floats, lengths: Floats, time_s: float, least_mm_s: float) -> Floats:
    """Speeds slowed down by one factor so that the lengths take a given time, none below the least speed."""
    floor = np.minimum(speeds, least_mm_s)
    factor = 1.0
    for _ in range(4):  # beads at the lower limit leave the remaining time to the others
        slowed = np.maximum(speeds * factor, floor)
        free = slowed > floor
        missing = time_s - float((lengths / slowed).sum())
        busy = float((lengths[free] / slowed[free]).sum())
        if missing <= 1e-9 or busy <= 0.0:
            break
        factor *= busy / (busy + missing)
    return np.maximum(speeds * factor, floor)


def fan_share(material: Material, process: Process, time_s: float) -> float:
    """Part fan (0..1) of a layer that takes time_s: the material's fan up to least_layer_time_s, then decreasing.

    Linear from `fan` to `fan_least` between least_layer_time_s and fan_layer_time_s, as in PrusaSlicer.
    """
    least = min(material.fan_least, material.fan)
    quick, slow = process.least_layer_time_s, material.fan_layer_time_s
    falling = max(0.0, (slow - time_s) / (slow - quick)) if slow > quick else 0.0
    share = 1.0 if time_s <= quick else falling
    return round((least + share * (material.fan - least)) / FAN_STEP) * FAN_STEP


def rising_fan(material: Material, layer: int) -> float:
    """Factor on the fan of a layer of a part on the plate, counted from 0: 0 up to fan_off_layers, then rising to 1 at
    fan_full_layer.
    """
    if layer < material.fan_off_layers:
        return 0.0
    return min((layer + 1 - material.fan_off_layers) / max(material.fan_full_layer - material.fan_off_layers, 1), 1.0)


def own_fans(strokes: Strokes, material: Material, factor: float, layer_fan: float) -> Floats:
    """(k,) part fan of bridges and overhanging walls, and half-way values for walls that lean; NaN for the layer's fan."""
    hanging = factor * (material.fan if material.fan_bridge is None else material.fan_bridge)
    over_infill = hanging if material.fan_infill_bridge is None else factor * material.fan_infill_bridge
    own = np.where(strokes.over_infill, over_infill, hanging)
    leaning = np.where(strokes.overhang > 0, np.round(0.5 * (layer_fan + own) / FAN_STEP) * FAN_STEP, np.nan)
    return np.where(strokes.is_of(*HANGING), own, leaning)


def stroke_speeds(process: Process) -> Floats:
    """(number of kinds,) speed of each kind of bead, mm/s."""
    return np.array([getattr(process, SPEED_KEYS[kind]) for kind in KINDS])


def first_layer_speeds(process: Process) -> Floats:
    """(number of kinds,) speed of each kind in the first layer on the plate, mm/s."""
    usual = process.first_layer_speed_mm_s
    inside = process.first_layer_infill_speed_mm_s or usual
    return np.array([inside if kind in INSIDE else usual for kind in KINDS])


def stroke_accelerations(profile: Profile, first_layer: bool) -> Floats:
    """(number of kinds,) acceleration of each kind, mm/s2; inf if the process sets none, so that the firmware's value applies."""
    process = profile.process
    usual = process.acceleration_mm_s2 or _axes_mm_s2(profile)
    if first_layer:
        return np.full(len(KINDS), process.first_layer_acceleration_mm_s2 or usual)
    infill, hanging = process.infill_acceleration_mm_s2 or usual, process.bridge_acceleration_mm_s2 or usual
    others = {Kind.OUTER_WALL: process.outer_wall_acceleration_mm_s2 or usual} | dict.fromkeys(HANGING, hanging)
    others |= dict.fromkeys((Kind.INFILL, Kind.SUPPORT, Kind.SUPPORT_INTERFACE), infill)
    return np.array([others.get(kind, usual) for kind in KINDS])


def travel_mm_s2(profile: Profile) -> float:
    """Acceleration of travels, mm/s2; inf as in stroke_accelerations."""
    return profile.process.travel_acceleration_mm_s2 or _axes_mm_s2(profile)


def _axes_mm_s2(profile: Profile) -> float:
    """Acceleration allowed by both X and Y, mm/s2; inf if the process sets no acceleration."""
    process, machine = profile.process, profile.machine
    unset = all(getattr(process, key) is None for key in KEYS)
    return np.inf if unset else min(machine.x.acceleration_mm_s2, machine.y.acceleration_mm_s2)


def layer_of(
    strokes: Strokes,
    speeds: Floats,
    profile: Profile,
    *,
    z_mm: float,
    height_mm: float,
    flow: float,
    fan: float,
    add_c: float = 0.0,
    skin: Polygons | None = None,
) -> Layer:
    """The layer of some strokes.

    flow, fan: factors on the flow of all strokes and on the part fan; add_c: increase of the nozzle temperature, deg C; skin:
    visible wall beside joints.
    """
    process, material = profile.process, profile.material
    # a lower bound, since accelerations are left out
    time_s = float((strokes.lengths_mm / speeds).sum()) + travel_time_s(strokes, profile)
    layer_fan = fan * fan_share(material, process, time_s)
    return Layer(
        z_mm=z_mm,
        height_mm=height_mm,
        fan=layer_fan,
        nozzle_add_c=add_c,
        points=np.ascontiguousarray(strokes.points[:, :2]),
        starts=strokes.starts,
        kind=strokes.kind,
        width_mm=strokes.width_mm,
        speed_mm_s=speeds,
        flow=strokes.flow * flow,
        own_fan=own_fans(strokes, material, fan, layer_fan),
        retract=strokes.retract,
        wiped=may_wipe_over(strokes, Polygons() if skin is None else skin, material.wipe_mm),
        below_mm=np.zeros((len(strokes), 2)),
        approach=strokes.approach,
        approach_starts=strokes.approach_starts,
    )
