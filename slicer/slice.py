"""Slicing: one part of a decomposition becomes layers of paths in its own frame."""

from collections.abc import Callable, Sequence

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats
from profiles.errors import SliceError
from profiles.process import Process
from profiles.profile import Profile
from slicer.base import compensated
from slicer.bead import Bead
from slicer.bridge import Bridge, beside, bridge_beads, bridged
from slicer.brim import brim
from slicer.contact import contacts
from slicer.cooling import fan_share, hanging_fan
from slicer.forbidden import far_mm, forbidden
from slicer.gap import gaps
from slicer.heights import heights_of
from slicer.infill import infill, pattern_density
from slicer.interface import beneath, interface_edges, strengthened
from slicer.interlock import filled as interlocked
from slicer.interlock import grooved
from slicer.order import ordered
from slicer.overhang import overhanging
from slicer.paths import Kind, Layer, Path, SlicedPart
from slicer.pedestal import pedestal_beads, pedestal_layers, without_pedestal
from slicer.polygons import Polygons, cleaned, united
from slicer.props import support_beads
from slicer.region import Region, regions
from slicer.seam import Surroundings, rear_of, seamed
from slicer.section import sections
from slicer.skin import angle_of_layer_deg, skin
from slicer.speed import layer_time_s, speeds_mm_s
from slicer.support import supports
from slicer.walls import Walls, wall_beads, walls


def slice_part(
    part: Part,
    profile: Profile,
    earlier: Sequence[Part] = (),
    later: Sequence[Part] = (),
    show: Callable[[int, int], None] | None = None,
) -> SlicedPart:
    """The part's layers from its base plane upward.

    earlier, later: the parts printed before and after this one; the part with index 1 stands on the platform. The same
    input gives the same paths. show: hears after each layer its number and how many there are. Raises SliceError when the
    part gives no bead at all.
    """
    process, mesh = profile.process, part.in_part_frame()
    pedestal_mm = profile.search.pedestal_mm if part.index == 1 else 0.0
    at = heights_of(mesh, process, part.index == 1, pedestal_mm)
    below_model = pedestal_layers(at.tip_mm, pedestal_mm)
    outlines = grooved([cleaned(loops) for loops in sections(mesh, at.cut_mm)], part, later, at.cut_mm, process)
    if part.index == 1:
        outlines[0] = compensated(outlines[0], process.elephant_foot_mm, process.line_width_mm)
    own = without_pedestal(outlines, mesh, at.cut_mm, pedestal_mm, below_model) if below_model else outlines
    processes = strengthened(process, part.index > 1, len(outlines))
    walled = [walls(s, p.walls, p.line_width_mm, h) for s, p, h in zip(own, processes, at.height_mm, strict=True)]
    below = beneath(part, earlier, outlines[0])
    filled = regions(own, [w.inside for w in walled], below, process)
    density = pattern_density([region.sparse for region in filled], process, process.layer_height_mm)
    over = contacts(mesh, outlines, at.cut_mm, process, below)
    far = far_mm(mesh)
    shut = forbidden(part, later, at.tip_mm - at.height_mm, at.tip_mm, process.support_distance_mm, far)
    props = supports([c.hanging for c in over], outlines, at, process, below, shut, far)
    edges, rear = interface_edges(part, outlines[0], below, later), rear_of(mesh.bounds_mm)
    layers: list[Layer] = []
    tip, seams = None, np.zeros((0, 2))
    for i, outline in enumerate(outlines):
        height = float(at.height_mm[i])
        region, beads = _beads(own[i], walled[i], filled[i], over[i].bridges, i, processes[i], height)
        beads += infill(region.sparse, process, density, i, float(at.tip_mm[i]), height)
        beads += support_beads(props.areas[i], props.dense[i], process, height, i == 0 and part.index == 1)
        if i < below_model:
            beads += pedestal_beads(outline, i, below_model, process, height)
        if i == 0 and part.index == 1:
            top_mm = max(float(each.mesh.bounds_mm[1, 2]) for each in (part, *later))
            beads += brim(united([outline, props.areas[0]]), outline, top_mm, process, height)
        around = Surroundings(rear, seams, rear if tip is None else tip, edges, float(at.cut_mm[i]), i)
        beads, seams = seamed(beads, process, around)
        bank = outlines[i - 1] if i else below
        layer = _layer(beads, outline, bank, i, part, profile, float(at.tip_mm[i]), height, tip)
        if layer.paths:
            tip = layer.paths[-1].points[-1]
            layers.append(layer)
        if show is not None:
            show(i + 1, len(outlines))
    _check(part, mesh.bounds_mm, layers, process)
    worst = sum(layer.z_mm <= at.tip_mm[props.worst_layer] for layer in layers) if props.unsupported_mm2 > 0 else 0
    return SlicedPart(part.index, tuple(layers), props.unsupported_mm2, worst)


def _beads(
    outline: Polygons, around: Walls, region: Region, bridges: Sequence[Bridge], layer: int, process: Process, height_mm: float
) -> tuple[Region, list[Bead]]:
    """What a layer prints of the part itself but for the infill, and the regions beside its bridges."""
    width, overlap = process.line_width_mm, process.infill_overlap if process.walls else 0.0
    angle = angle_of_layer_deg(process.infill_angle_deg, layer)
    beads = wall_beads(around, process, height_mm)
    beads += gaps(around.free, width, height_mm, outline, process.outer_bulge) + gaps(around.narrow, width, height_mm)
    for span in bridges:
        area = bridged(span, around.inside, width)
        if not area.is_empty():
            beads += bridge_beads(area, span.angle_deg, process.bridge_flow, width, height_mm, overlap)
            region = beside(region, area, width)
    beads += skin(region.solid, Kind.SKIN, angle, width, height_mm, overlap)
    return region, beads + skin(region.top, Kind.TOP_SKIN, angle, width, height_mm, overlap)


def _layer(
    beads: list[Bead],
    outline: Polygons,
    bank: Polygons | None,
    index: int,
    part: Part,
    profile: Profile,
    z_mm: float,
    height_mm: float,
    tip: Floats | None,
) -> Layer:
    """The beads in order, with speeds, flow, fan and heat."""
    process, material = profile.process, profile.material
    placed = overhanging(ordered(beads, outline, process, tip), outline, bank, process)
    on_platform = part.index == 1
    if index == 0 and not on_platform and process.interlock_mm > 0.0:
        placed = interlocked(placed, part, process, height_mm)
    flow, fixed, fan, add_c = material.flow, None, 1.0, 0.0
    if not on_platform and index < process.interface_layers:
        fan, add_c = process.interface_fan, process.interface_temperature_add_c
    if index == 0:
        fixed = process.first_layer_speed_mm_s if on_platform else process.interface_speed_mm_s
        flow *= 1.0 if on_platform else process.interface_flow
    speeds = speeds_mm_s(placed, profile, height_mm, fixed, flow)
    if on_platform and index < material.fan_off_layers:
        fan = 0.0
    blown = [hanging_fan(material, p.bead.kind, fan) for p in placed]
    paths = tuple(
        Path(p.bead.kind, p.points, p.bead.width_mm, float(speed), p.bead.flow * flow, p.approach, p.retract, blow)
        for p, blow, speed in zip(placed, blown, speeds, strict=True)
    )
    fan *= fan_share(material, process, layer_time_s(placed, speeds, profile))
    return Layer(z_mm, height_mm, paths, fan, add_c)


def _check(part: Part, bounds_mm: Floats, layers: Sequence[Layer], process: Process) -> None:
    own = (
        path for layer in layers for path in layer.paths if path.kind not in (Kind.SKIRT, Kind.SUPPORT, Kind.SUPPORT_INTERFACE)
    )
    if next(own, None) is None:
        x, y, z = bounds_mm[1] - bounds_mm[0]
        if process.walls == 0 and process.infill_density == 0:
            raise SliceError(
                f"part {part.index} gives no path at all: process.walls and process.infill_density are 0, and "
                f"{process.bottom_layers} bottom and {process.top_layers} top layers give no skin"
            )
        raise SliceError(
            f"part {part.index} gives no path at all: it measures {x:.3g} x {y:.3g} x {z:.3g} mm and no place of it is wider "
            f"than half of process.line_width_mm ({0.5 * process.line_width_mm:g} mm is the least)"
        )
