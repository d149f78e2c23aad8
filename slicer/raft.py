"""Raft: layers printed under a model and its support for adhesion, and peeled off afterwards.

Its first layer is sparse enough to come off the plate and has the widest margin, the layers above it are sparse, and the upper
half of the raft, except for the first layer, is as dense as a support interface. The model begins a small gap above the raft. Its
layers are those of a print on the plate, except that the first one is printed like any other, neither wider nor squeezed. Support
begins on the raft itself, with layers that fill the gap.
"""

from collections.abc import Sequence
from math import ceil

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import Bead, first_layer_process, with_line_width
from slicer.geometry.polygons import Polygons, offset, offset_round, union
from slicer.heights import Heights
from slicer.paths import ON_PLATE_MM, Layer
from slicer.strokes.order import order_beads
from slicer.strokes.speed import first_layer_speeds, layer_of, rising_fan, timed
from slicer.support.beads import beads_around, support_beads
from slicer.support.support import Supports

THICK = 0.75  # share of the nozzle: layers that are not visible are as high as prints well, as in PrusaSlicer


def lift_mm(profile: Profile) -> float:
    """Height of the model's base above the plate on a raft, mm; 0 without one."""
    heights = raft_heights(profile)
    return float(heights.height_mm.sum()) + profile.process.raft_contact_distance_mm if len(heights.tip_mm) else 0.0


def reach_mm(process: Process) -> float:
    """Margin of a raft around the model and its support, mm."""
    return process.raft_expansion_mm + process.raft_first_layer_expansion_mm if process.raft_layers else 0.0


def raft_heights(profile: Profile) -> Heights:
    """The layers of a raft below the model's base plane at z = 0."""
    process, nozzle_mm = profile.process, profile.machine.head.nozzle_mm
    others_mm = THICK * nozzle_mm  # not a setting of a part: all of a print is lifted by the same height
    thick_mm = np.array([process.first_layer_height_mm, *[others_mm] * process.raft_layers][: process.raft_layers])
    tips_mm = np.cumsum(thick_mm) - thick_mm.sum() - process.raft_contact_distance_mm
    return Heights(tips_mm, thick_mm, tips_mm - 0.5 * thick_mm)


def raft_layers(supports: Supports) -> list[Layer]:
    """The layers of a part's raft, then the support that fills the gap and the part's first layer; [] without a raft."""
    sections = supports.sections
    if not sections.on_raft:
        return []
    process, heights, layers = sections.process, raft_heights(sections.profile), list[Layer]()
    for k, area in enumerate(_raft_areas(supports)):
        own, height_mm = process, float(heights.height_mm[k])
        if k == 0:  # the first layer has at most a skirt around it
            bare = {"brim_mm": 0.0, "small_base_brim_mm": 0.0, "support_foot_density": process.raft_first_layer_density}
            own = first_layer_process(process).model_copy(update=bare)
        beads = _raft_beads(area, process.raft_layers - 1 - k, own, height_mm, first=k == 0)
        if k == 0:
            beads += beads_around(sections, area, area, own, height_mm)
        layers.append(_layer(beads, area, sections.profile, float(heights.tip_mm[k]), height_mm, layers))
    return layers + _support_on_raft(supports, layers)


def _raft_areas(supports: Supports) -> list[Polygons]:
    """Area of each layer of the raft: the base, outlines low enough to sag onto the plate, and a margin."""
    sections, process = supports.sections, supports.sections.process
    low = sections.outlines[: int(np.searchsorted(sections.heights.bottom_mm, ON_PLATE_MM))]
    stands, plate = union([*low, supports.areas[0]]), offset(sections.plate, -0.5 * process.line_width_mm)
    first, others = (offset_round(stands, far_mm) ^ plate for far_mm in (reach_mm(process), process.raft_expansion_mm))
    return [first, *[others] * process.raft_layers][: process.raft_layers]


def _raft_beads(area: Polygons, below_top: int, process: Process, height_mm: float, *, first: bool) -> list[Bead]:
    """Beads of one layer. below_top: number of raft layers above it. Dense layers cross each other and the layer below them;
    sparse layers stack line on line.
    """
    dense = (process.raft_layers + 1) // 2
    quarter_turns = dense + 1 if first else min(below_top, dense)
    is_dense = below_top < dense and not first
    angle_deg = process.infill_angle_deg + 90.0 * (quarter_turns % 2) - 90.0 * is_dense  # dense lines cross this angle
    process = with_line_width(process, process.support_line_width_mm).model_copy(update={"infill_angle_deg": angle_deg})
    return support_beads(area, area if is_dense else Polygons(), Polygons(), process, height_mm, first)


def _support_on_raft(supports: Supports, below: Sequence[Layer]) -> list[Layer]:
    """The lowest support as separate layers that also fill the gap to the raft."""
    sections, area = supports.sections, supports.areas[0]
    if area.is_empty():
        return []
    profile, process, tip_mm = sections.profile, sections.support_process, float(sections.heights.tip_mm[0])
    deep_mm = tip_mm + process.raft_contact_distance_mm
    count = ceil(deep_mm / min(process.highest_layer_mm, profile.machine.head.nozzle_mm) - 1e-9)
    layers, height_mm = list[Layer](), deep_mm / count
    for over in reversed(range(count)):
        beads = support_beads(area, supports.dense[0], Polygons(), process, height_mm, False)
        layers.append(_layer(beads, area, profile, tip_mm - height_mm * over, height_mm, [*below, *layers]))
    return layers


def _layer(beads: list[Bead], area: Polygons, profile: Profile, z_mm: float, height_mm: float, below: Sequence[Layer]) -> Layer:
    """A layer from its beads, in order, with speeds and temperature."""
    process, material, number = profile.process, profile.material, len(below)
    tip: Floats | None = below[-1].points[-1] if below and len(below[-1]) else None
    kind_mm_s = None if number else first_layer_speeds(process)
    strokes = order_beads(beads, Polygons(), process, tip, area, kind_mm_s=kind_mm_s)
    flow = material.flow * (1.0 if number else process.first_layer_flow)
    strokes, speeds = timed(strokes, profile, height_mm, kind_mm_s, flow)
    add_c = 0.0 if number else material.first_layer_nozzle_c - material.nozzle_c
    fan = rising_fan(material, number)
    return layer_of(strokes, speeds, profile, z_mm=z_mm, height_mm=height_mm, flow=flow, fan=fan, add_c=add_c)
