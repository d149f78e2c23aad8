"""Estimate: print time and filament of parts without laying a bead, within some 12 % and in tenths of a second.

Some layers of a part stand for all of them (slicer/estimate): their walls, skins and infill are known as shapes, their lines by
counting how often a pattern crosses a boundary, their time by the speeds of the process and the machine's acceleration. It is
there to choose between decompositions; the dry run has the exact figures. Not looked at: slow overhanging walls and bridges,
ironing, grooves, what later parts take from the support of earlier ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

from mdp.decomposition import Part
from profiles.process import Process
from profiles.profile import Profile
from slicer.estimate.duration import line_s
from slicer.estimate.sampled_part import SampledPart, sample_part
from slicer.estimate.shell import extent_of
from slicer.estimate.strokes import LayerSpeeds, Strokes, line_strokes, loop_strokes, shell_strokes, support_strokes
from slicer.geometry.polygons import contours, offset
from slicer.paths import Kind, bead_area_mm2
from slicer.strokes.speed import axes_mm_s2, first_layer_speeds, travel_mm_s2
from slicer.strokes.vase import vase_profile
from slicer.support.beads import PEDESTAL_DENSITY, ROOF_LAYERS
from slicer.walls.brim import brim

# Fitted to dry runs with the standard profiles: 12 models in one piece and in four parts; the hops, 28 prints of 20 models.
HOP_MM = 3.7  # mean travel to a stroke, retractions included
BROKEN = 0.07  # share of a pattern's lines that are not joined to the one before
SPARSE_STARTS = 2.0  # more hops to each piece of sparse infill, whose crossing lines are printed in two goes
SUPPORT_HOPS = 1.3  # hops to a stroke of support, brim or pedestal: branches stand apart, so most of these travels retract
STEADY = 0.6  # of the travels' time counts when a layer is slowed down, which leaves out their acceleration
TURN_S = 2.0  # of the table before a part
PATTERNS = (Kind.SKIN, Kind.INFILL, Kind.SUPPORT_INTERFACE)


@dataclass(frozen=True)
class Estimate:
    """Seconds of printing, mm of filament, and mm3 of it that is support."""

    time_s: float
    filament_mm: float
    support_mm3: float

    def __add__(self, other: "Estimate") -> "Estimate":
        return Estimate(self.time_s + other.time_s, self.filament_mm + other.filament_mm, self.support_mm3 + other.support_mm3)


def estimate(parts: Part | Sequence[Part], profile: Profile) -> Estimate:
    """What printing one part, or several one after the other, takes.

    The same on every machine. Raises SliceError where a part's mesh is not closed or it is too high to be meant.
    """
    several = (parts,) if isinstance(parts, Part) else tuple(parts)
    top_mm = max((float(part.mesh.bounds_mm[1, 2]) for part in several), default=0.0)
    total = Estimate(0.0, 0.0, 0.0)
    for k, part in enumerate(several):
        own = vase_profile(profile.of_part(part.index))
        total += _estimate_part(sample_part(part, own, several[k + 1 :]), own, top_mm)
    return total


def _estimate_part(part: SampledPart, profile: Profile, top_mm: float) -> Estimate:
    """A part, the turn of the table before it and the wait for its heat; top_mm: of the whole print."""
    filament_mm2 = 0.25 * pi * profile.material.diameter_mm**2
    total = Estimate(0.0, 0.0, 0.0)
    if not part.on_platform:
        heating_s = profile.machine.heating_s(profile.process.interface_temperature_add_c, TURN_S)
        total = Estimate(TURN_S + heating_s, profile.material.prime_extra_mm, 0.0)
    for layer, stands_for in zip(part.choice.layers.tolist(), part.choice.counts.tolist(), strict=True):
        speeds = _layer_speeds(part, layer, profile)
        own = _part_strokes(part, layer, speeds)
        support = _auxiliary_strokes(part, layer, speeds, top_mm)
        flow = profile.material.flow * _flow(part, layer, profile.process)
        time_s = _layer_s([*own, *support], _travel_s(part, layer, own, support, profile), profile.process)
        mm3 = flow * sum(strokes.mm3 for strokes in (*own, *support))
        support_mm3 = flow * sum(strokes.mm3 for strokes in support if strokes.kind is not Kind.SKIRT)
        total += Estimate(stands_for * time_s, stands_for * mm3 / filament_mm2, stands_for * support_mm3)
    return total


def _layer_speeds(part: SampledPart, layer: int, profile: Profile) -> LayerSpeeds:
    fixed_mm_s = None if layer else first_layer_speeds(profile.process, part.on_platform)
    return LayerSpeeds(profile, float(part.heights.height_mm[layer]), fixed_mm_s, layer == 0 and part.on_platform)


def _flow(part: SampledPart, layer: int, process: Process) -> float:
    """Factor on the plastic of a first layer."""
    if layer:
        return 1.0
    return process.first_layer_flow if part.on_platform else process.interface_flow


def _part_strokes(part: SampledPart, layer: int, speeds: LayerSpeeds) -> list[Strokes]:
    """What a layer prints of the part itself."""
    return [] if layer < part.pedestal else shell_strokes(part.shell(layer), part.processes[layer], speeds)


def _auxiliary_strokes(part: SampledPart, layer: int, speeds: LayerSpeeds, top_mm: float) -> list[Strokes]:
    """What a layer prints for the part: support, pedestal, skirt and brim."""
    process, on_plate = part.processes[layer], layer == 0 and part.on_platform
    strokes = support_strokes(part.support, float(part.heights.cut_mm[layer]), process, speeds, on_plate)
    if layer < part.pedestal:
        strokes += _pedestal_strokes(part, layer, speeds)
    if on_plate:
        outline = part.sections[0]
        beads = brim(outline + part.support.foot, outline, part.plate, process, top_mm=top_mm, height_mm=speeds.height_mm)
        loops = [bead.points[:-1] for bead in beads]
        strokes += loop_strokes(Kind.SKIRT, loops, bead_area_mm2(process.line_width_mm, speeds.height_mm), 0.0, speeds)
    return strokes


def _pedestal_strokes(part: SampledPart, layer: int, speeds: LayerSpeeds) -> list[Strokes]:
    """A layer of the pedestal: its outline, sparse lines, closed at the platform and at the roof."""
    process, outline = part.processes[layer], part.sections[layer]
    width = process.line_width_mm
    bead_mm2 = bead_area_mm2(width, speeds.height_mm)
    closed = layer == 0 or layer >= part.pedestal - ROOF_LAYERS
    strokes = loop_strokes(Kind.SUPPORT, contours(offset(outline, -0.5 * width)), bead_mm2, 0.0, speeds)
    inside = extent_of(offset(outline, -width))
    density, angle = 1.0 if closed else PEDESTAL_DENSITY, process.infill_angle_deg
    return strokes + line_strokes(Kind.SUPPORT, inside, speeds, density=density, width_mm=width, angle_deg=angle)


def _travel_s(part: SampledPart, layer: int, own: Sequence[Strokes], support: Sequence[Strokes], profile: Profile) -> float:
    """Seconds of a layer's travels, and of the lift to it."""
    process, machine = profile.process, profile.machine
    hops = sum(_starts(strokes) for strokes in own) + SUPPORT_HOPS * sum(_starts(strokes) for strokes in support)
    acceleration = min(travel_mm_s2(profile) or axes_mm_s2(profile), axes_mm_s2(profile))
    speed = min(process.travel_speed_mm_s, machine.x.speed_mm_s, machine.y.speed_mm_s)
    return hops * line_s(HOP_MM, speed, acceleration, 0.0)


def _starts(strokes: Strokes) -> float:
    """How often the tip has to travel to strokes."""
    if strokes.kind in PATTERNS:
        return BROKEN * strokes.count + (SPARSE_STARTS * strokes.pieces if strokes.kind is Kind.INFILL else 0.0)
    return strokes.count


def _layer_s(strokes: Sequence[Strokes], travel_s: float, process: Process) -> float:
    """Seconds of a layer, slowed down to least_layer_time_s as the slicer does it, which knows no acceleration."""
    length_mm = sum(kind.length_mm for kind in strokes)
    if length_mm <= 0.0:
        return 0.0
    steady_s = sum(kind.length_mm / kind.speed_mm_s for kind in strokes)
    lost_s = sum(kind.time_s for kind in strokes) - steady_s
    asked_s = min(process.least_layer_time_s - STEADY * travel_s, length_mm / process.least_speed_mm_s)
    slowed_s = max(steady_s, asked_s)
    return slowed_s + lost_s * steady_s / slowed_s + travel_s
