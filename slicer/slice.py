"""Slicing: one part of a decomposition becomes layers of paths in its own frame."""

from collections.abc import Callable, Sequence

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats
from profiles.errors import SliceError
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import WALLS, Bead, thinned
from slicer.bridge import beside, bridge_beads, bridged, infill_bridge_beads, over_infill
from slicer.brim import brim
from slicer.cooling import fan_share, hanging_fan, rising_fan
from slicer.gap import gaps
from slicer.infill import infill
from slicer.interlock import filled as interlocked
from slicer.order import ordered
from slicer.overhang import overhanging
from slicer.paths import Kind, Layer, Path, SlicedPart
from slicer.pedestal import pedestal_beads
from slicer.polygons import united
from slicer.props import support_beads
from slicer.seam import Surroundings, rear_of, seamed
from slicer.skin import angle_of_layer_deg, skin
from slicer.speed import layer_time_s, speeds_mm_s
from slicer.stack import Stack, stack_of
from slicer.thin import thin_walls
from slicer.walls import wall_beads
from slicer.widths import of_width

DENSE = 0.5  # infill with lines nearer than a line's width to each other carries skin without bridges


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
    stack = stack_of(part, profile, earlier, later)
    bounds_mm = part.in_part_frame().bounds_mm
    rear = rear_of(bounds_mm)
    layers: list[Layer] = []
    tip, seams = rear, np.zeros((0, 2))
    for i in range(len(stack.outlines)):
        around = Surroundings(rear, seams, tip, stack.edges, float(stack.at.cut_mm[i]), i)
        laid = [*_own(stack, i), *_beside(stack, i, part, later)]
        beads, seams = seamed([bead if bead.kind in WALLS else thinned(bead) for bead in laid], profile.process, around)
        layer = _layer(beads, stack, i, part, profile, tip if layers else None)
        if layer.paths:
            tip = layer.paths[-1].points[-1]
            layers.append(layer)
        if show is not None:
            show(i + 1, len(stack.outlines))
    _check(part, bounds_mm, layers, profile.process)
    missed_mm2, at_mm = stack.supports.unsupported_mm2, stack.at.tip_mm[stack.supports.worst_layer]
    worst = sum(layer.z_mm <= at_mm for layer in layers) if missed_mm2 > 0 else 0
    return SlicedPart(part.index, tuple(layers), missed_mm2, worst)


def _own(stack: Stack, layer: int) -> list[Bead]:
    """What a layer prints of the part itself."""
    process, height_mm = stack.processes[layer], float(stack.at.height_mm[layer])
    region, around, outline = stack.regions[layer], stack.walls[layer], stack.own[layer]
    width, overlap = process.line_width_mm, process.infill_overlap if process.walls else 0.0
    angle = angle_of_layer_deg(process.infill_angle_deg, layer)
    beads = wall_beads(around, process, height_mm)
    beads += thin_walls(around.free, outline, width, height_mm, process.outer_bulge) + gaps(around.narrow, width, height_mm)
    for span in stack.contacts[layer].bridges:
        area = bridged(span, around.inside, width)
        if not area.is_empty():
            beads += bridge_beads(area, span.angle_deg, process.bridge_flow, width, height_mm, overlap)
            region = beside(region, area, width)
    if layer and process.infill_density < DENSE:
        area = over_infill(region.solid, stack.regions[layer - 1].sparse, width)
        if not area.is_empty():
            beads += infill_bridge_beads(area, angle, process, height_mm)
            region = beside(region, area, width)
    beads += skin(region.solid, Kind.SKIN, angle, width, height_mm, overlap)
    top_width = process.top_skin_line_width_mm or width
    beads += skin(region.top, Kind.TOP_SKIN, angle, top_width, height_mm, overlap, process.top_skin_monotonic)
    sparse = of_width(process, process.infill_line_width_mm)
    return beads + infill(region.sparse, sparse, stack.density, layer, float(stack.at.tip_mm[layer]), height_mm)


def _beside(stack: Stack, layer: int, part: Part, later: Sequence[Part]) -> list[Bead]:
    """What a layer prints for the part: support, pedestal, skirt and brim."""
    process, height_mm = stack.processes[layer], float(stack.at.height_mm[layer])
    props, outline, on_platform = stack.supports, stack.outlines[layer], part.index == 1
    foot = layer == 0 and on_platform
    propped = of_width(process, process.support_line_width_mm)
    beads = support_beads(props.areas[layer], props.dense[layer], propped, height_mm, foot)
    if layer < stack.pedestal_layers:
        beads += pedestal_beads(outline, layer, stack.pedestal_layers, process, height_mm)
    if foot:
        top_mm = max(float(each.mesh.bounds_mm[1, 2]) for each in (part, *later))
        beads += brim(united([outline, props.areas[0]]), outline, stack.floor, top_mm, process, height_mm)
    return beads


def _layer(beads: list[Bead], stack: Stack, index: int, part: Part, profile: Profile, tip: Floats | None) -> Layer:
    """The beads in order, with speeds, flow, fan and heat."""
    process, material, outline = profile.process, profile.material, stack.outlines[index]
    z_mm, height_mm = float(stack.at.tip_mm[index]), float(stack.at.height_mm[index])
    own = stack.processes[index]
    placed = overhanging(ordered(beads, outline, own, tip), outline, stack.bank(index), own)
    on_platform = part.index == 1
    if index == 0 and not on_platform and process.interlock_mm > 0.0:
        placed = interlocked(placed, part, process, height_mm)
    flow, fixed, fan, add_c = material.flow, None, 1.0, 0.0
    if not on_platform and index < process.interface_layers:
        fan, add_c = process.interface_fan, process.interface_temperature_add_c
    if index == 0:
        fixed = process.first_layer_speed_mm_s if on_platform else process.interface_speed_mm_s
        flow *= process.first_layer_flow if on_platform else process.interface_flow
    speeds = speeds_mm_s(placed, profile, height_mm, fixed, flow)
    if on_platform:
        fan = rising_fan(material, index)
    blown = [hanging_fan(material, p.bead, fan) for p in placed]
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
