"""Slicing: one part of a decomposition becomes layers of paths in its own frame."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats
from profiles.errors import SliceError
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import WALLS, Bead, simplify, simplify_bead, with_line_width
from slicer.cooling import fan_share, hanging_fan, rising_fan
from slicer.demand.reason import explain
from slicer.demand.site import Site, survey
from slicer.fill.bridge import bridge_area, bridge_beads, infill_bridge_area, infill_bridge_beads
from slicer.fill.infill import infill_beads
from slicer.fill.skin import angle_of_layer_deg, skin_beads
from slicer.finish.ironing import ironing_beads
from slicer.finish.vase import bottom_layers, vase_layers
from slicer.geometry.polygons import union
from slicer.interface.interface import begin_inside
from slicer.interface.interlock import fill_grooves
from slicer.paths import ON_PLATE_MM, Kind, Layer, Path, SlicedPart, Unsupported
from slicer.speed import first_layer_mm_s, layer_time_s, speeds_mm_s
from slicer.stack import Stack, build_stack
from slicer.support.beads import support_beads
from slicer.support.pedestal import pedestal_beads
from slicer.support.support import Supports
from slicer.travel.order import order_beads
from slicer.walls.brim import brim
from slicer.walls.gap import gaps
from slicer.walls.overhang import split_overhangs
from slicer.walls.seam import Surroundings, place_seams, rear_of
from slicer.walls.thin import thin_walls
from slicer.walls.unwanted_seam import unwanted_segments
from slicer.walls.variable.pieces import in_pieces
from slicer.walls.walls import wall_beads

DENSE = 0.5  # infill with lines nearer than a line's width to each other carries skin without bridges


def slice_part(
    part: Part,
    profile: Profile,
    earlier: Sequence[Part] = (),
    later: Sequence[Part] = (),
    on_layer: Callable[[int, int], None] | None = None,
) -> SlicedPart:
    """The part's layers from its base plane upward.

    earlier, later: the parts printed before and after this one; the part with index 1 stands on the platform. Support is
    the part's own, on its own ground (slice_parts hands it down to earlier parts). The same input gives the same paths.
    on_layer: called after each layer with its number and how many there are. Raises SliceError when the part gives no bead
    at all.
    """
    site = survey(part, profile, earlier, later)
    return slice_site(site, site.supports, on_layer)


def slice_site(site: Site, supports: Supports, on_layer: Callable[[int, int], None] | None = None) -> SlicedPart:
    """The layers of a surveyed part with the support planned for it, as slice_part."""
    part, later, profile = site.part, site.later, site.profile
    stack = build_stack(site, supports)
    bounds_mm = part.in_part_frame().bounds_mm
    rear = rear_of(bounds_mm)
    layers: list[Layer] = []
    tip, seams, unwanted = rear, np.zeros((0, 2)), unwanted_segments(part, stack.heights.cut_mm)
    bare: list[int] = []  # layers that hold something and print none of it
    last = 0
    usual = bottom_layers(profile.process) if profile.process.spiral_vase else len(stack.outlines)
    for i in range(min(usual, len(stack.outlines))):
        around = Surroundings(rear, seams, tip, stack.edges, float(stack.heights.cut_mm[i]), i, unwanted[i])
        own = _part_beads(stack, i)
        if own:
            last = i
        elif profile.process.walls and (i in site.hairs or not stack.own[i].is_empty()):
            bare.append(i)
        beads = [*own, *_auxiliary_beads(stack, i, part, later)]
        beads = [bead if bead.kind in WALLS else simplify_bead(bead) for bead in beads]
        beads, seams = place_seams(beads, profile.process, around)
        beads += stack.ending[i]
        layer = _layer(beads, stack, i, part, profile, tip if layers else None)
        if layer.paths:
            tip = layer.paths[-1].points[-1]
            layers.append(layer)
        if on_layer is not None:
            on_layer(i + 1, len(stack.outlines))
    if usual < len(stack.outlines):
        layers += vase_layers(stack.outlines, stack.supports.areas, stack.heights, profile, tip)
    _check_not_empty(part, bounds_mm, layers, profile.process)
    if site.beneath is None and profile.process.walls:
        _check_on_plate(part, layers, profile.process)
    too_thin = [i for i in bare if i < last and usual == len(stack.outlines)]
    return SlicedPart(
        part.index,
        tuple(layers),
        _unsupported(site, supports, layers),
        stack.interface_mm3,
        len(too_thin),
        float(stack.heights.tip_mm[too_thin[0]]) if too_thin else 0.0,
    )


def _unsupported(site: Site, supports: Supports, layers: Sequence[Layer]) -> tuple[Unsupported, ...]:
    """The places that got no support, with the numbers of the layers that print anything."""
    tops = np.array([layer.z_mm for layer in layers])
    places = explain(site, supports) if supports.unsupported_mm2 > 0.0 or site.left_out else ()
    count = np.searchsorted(tops, site.heights.tip_mm, side="right")
    return tuple(replace(place, layer=int(count[place.layer])) for place in places)


def _part_beads(stack: Stack, layer: int) -> list[Bead]:
    """What a layer prints of the part itself."""
    process, height_mm = stack.processes[layer], float(stack.heights.height_mm[layer])
    region, around, outline = stack.regions[layer], stack.walls[layer], stack.own[layer]
    width, overlap = process.line_width_mm, process.infill_overlap if process.walls else 0.0
    angle = angle_of_layer_deg(process.infill_angle_deg, layer)
    beads = wall_beads(around, process, height_mm)
    beads += thin_walls(around.free, outline, width, height_mm, process.outer_bulge) + gaps(around.narrow, width, height_mm)
    for span in stack.overhangs[layer].bridges:
        area = bridge_area(span, around.inside, width)
        if not area.is_empty():
            beads += bridge_beads(area, span.angle_deg, process.bridge_flow, width, height_mm, overlap)
            region = region.without(area, width)
    if layer and process.infill_density < DENSE:
        area = infill_bridge_area(region.solid, stack.regions[layer - 1].sparse, width)
        if not area.is_empty():
            beads += infill_bridge_beads(area, angle, process, height_mm)
            region = region.without(area, width)
    beads += skin_beads(region.solid, Kind.SKIN, angle, width, height_mm, overlap)
    top_width = process.top_skin_line_width_mm or width
    beads += skin_beads(region.top, Kind.TOP_SKIN, angle, top_width, height_mm, overlap, process.top_skin_monotonic)
    beads += ironing_beads(stack.ironed[layer], angle, process, height_mm)
    sparse = with_line_width(process, process.infill_line_width_mm)
    return beads + infill_beads(region.sparse, sparse, stack.density, layer, float(stack.heights.tip_mm[layer]), height_mm)


def _auxiliary_beads(stack: Stack, layer: int, part: Part, later: Sequence[Part]) -> list[Bead]:
    """What a layer prints for the part: support, pedestal, skirt and brim."""
    process, height_mm = stack.processes[layer], float(stack.heights.height_mm[layer])
    supports, outline, on_platform = stack.supports, stack.outlines[layer], part.index == 1
    on_plate = layer == 0 and on_platform
    support_process = with_line_width(process, process.support_line_width_mm)
    beads = support_beads(supports.areas[layer], supports.dense[layer], support_process, height_mm, on_plate)
    if layer < stack.pedestal_layers:
        beads += pedestal_beads(outline, layer, stack.pedestal_layers, process, height_mm)
    if on_plate:
        top_mm = max(float(each.mesh.bounds_mm[1, 2]) for each in (part, *later))
        beads += brim(union([outline, supports.areas[0]]), outline, stack.floor, top_mm, process, height_mm)
    return beads


def _layer(beads: list[Bead], stack: Stack, index: int, part: Part, profile: Profile, tip: Floats | None) -> Layer:
    """The beads in order, with speeds, flow, fan and heat."""
    process, material, outline = profile.process, profile.material, stack.outlines[index]
    z_mm, height_mm = float(stack.heights.tip_mm[index]), float(stack.heights.height_mm[index])
    own = stack.processes[index]
    on_platform = part.index == 1
    beads = begin_inside(beads) if index == 0 and not on_platform else beads
    ordered = order_beads(beads, outline, own, tip, stack.supports.areas[index])
    ordered = split_overhangs(ordered, outline, stack.bank(index), own)
    if index == 0 and not on_platform and process.interlock_mm > 0.0:
        ordered = fill_grooves(ordered, part, process, height_mm)
    fixed: Mapping[Kind, float] | None = None
    flow, fan, add_c = material.flow, 1.0, 0.0
    if not on_platform and index < process.interface_layers:
        fan, add_c = process.interface_fan, process.interface_temperature_add_c
    if index == 0:
        fixed = first_layer_mm_s(process, on_platform)
        flow *= process.first_layer_flow if on_platform else process.interface_flow
    ordered = in_pieces(ordered, height_mm)
    speeds = speeds_mm_s(ordered, profile, height_mm, fixed, flow)
    if on_platform:
        fan = rising_fan(material, index)
    layer_fan = fan * fan_share(material, process, layer_time_s(ordered, speeds, profile))
    fans = [hanging_fan(material, p.bead, fan, layer_fan) for p in ordered]
    paths = tuple(
        Path(p.bead.kind, simplify(p.points), p.bead.width_mm, float(speed), p.bead.flow * flow, p.approach, p.retract, own_fan)
        for p, own_fan, speed in zip(ordered, fans, speeds, strict=True)
    )
    return Layer(z_mm, height_mm, paths, layer_fan, add_c)


def _check_not_empty(part: Part, bounds_mm: Floats, layers: Sequence[Layer], process: Process) -> None:
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
            f"than half of process.line_width_mm ({0.5 * process.line_width_mm:g} mm is the least): "
            "a larger process.scale or a finer nozzle prints it"
        )


def _check_on_plate(part: Part, layers: Sequence[Layer], process: Process) -> None:
    first = next(layer for layer in layers if any(path.kind is not Kind.SKIRT for path in layer.paths))
    if first.z_mm - first.height_mm > ON_PLATE_MM:
        support = "" if process.support == "auto" else ", or process.support = auto"
        raise SliceError(
            f"part {part.index} would begin in air, {first.z_mm - first.height_mm:.2f} mm above the plate: what lies below is "
            f"too thin for lines of {process.line_width_mm:g} mm: a larger process.scale or a finer nozzle prints it{support}"
        )
