"""Stack: what every layer of a part consists of, as regions, before any bead is laid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mdp.decomposition import Part
from mdp.mesh import Floats
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import Bead, first_layer_process, with_line_width
from slicer.fill.infill import pattern_density
from slicer.finish.compensation import compensate
from slicer.finish.ironing import ironed_areas
from slicer.geometry.polygons import Polygons, clean
from slicer.heights import Heights, layer_heights
from slicer.interface.cut_walls import cover, cut_walls
from slicer.interface.interface import interface_edges, plastic_beneath, strengthen_interface
from slicer.interface.interlock import cut_grooves
from slicer.interface.model import model_around
from slicer.interface.plastic import interface_mm3
from slicer.plate import compensate_elephant_foot, plate_outline
from slicer.region import Region, regions
from slicer.section import sections
from slicer.support.blocker import blocked_areas, far_mm
from slicer.support.overhang import Overhang, detect_overhangs
from slicer.support.pedestal import pedestal_layers, without_pedestal
from slicer.support.support import Supports, generate_supports
from slicer.walls.overhang import strengthen_overhangs
from slicer.walls.walls import Walls


@dataclass(frozen=True, eq=False)
class Stack:
    """A part's layers, one entry each.

    outlines: whole sections; own: without the pedestal; walls and regions: of own; ending: inner walls that end on the face of
    a cut; overhangs: what hangs and what bridges; ironed: tops that are smoothed; processes: the settings, with the extra walls
    of interfaces and overhangs and the widths of part 1's first layer. beneath: the plastic under the first layer, None on the
    platform; floor: the plate's outline, of use to part 1; pedestal_layers: how many of the lowest layers the pedestal takes;
    density: of the sparse infill's pattern; edges: where a seam would lie on an interface's edge; interface_mm3: as in
    SlicedPart.
    """

    heights: Heights
    outlines: Sequence[Polygons]
    own: Sequence[Polygons]
    walls: Sequence[Walls]
    ending: Sequence[tuple[Bead, ...]]
    regions: Sequence[Region]
    overhangs: Sequence[Overhang]
    ironed: Sequence[Polygons]
    processes: Sequence[Process]
    supports: Supports
    beneath: Polygons | None
    floor: Polygons
    pedestal_layers: int
    density: float
    edges: Floats
    interface_mm3: Mapping[int, float]

    def bank(self, layer: int) -> Polygons | None:
        """The plastic that a layer lies on; None for the platform."""
        return self.outlines[layer - 1] if layer else self.beneath


def build_stack(part: Part, profile: Profile, earlier: Sequence[Part], later: Sequence[Part]) -> Stack:
    """The stack of a part that is printed after `earlier` and before `later` parts."""
    process, mesh, on_platform = profile.process, part.in_part_frame(), part.index == 1
    pedestal_mm = profile.search.pedestal_mm if on_platform else 0.0
    heights = layer_heights(mesh, process, on_platform, pedestal_mm)
    pedestal_count = pedestal_layers(heights.tip_mm, pedestal_mm)
    outlines = [clean(loops, process.slit_closing_mm) for loops in sections(mesh, heights.cut_mm)]
    outlines = compensate(outlines, part, later, heights.cut_mm, process)
    if on_platform:
        outlines[0] = compensate_elephant_foot(outlines[0], process.elephant_foot_mm, first_layer_process(process).line_width_mm)
    uncut = without_pedestal(outlines, mesh, heights.cut_mm, pedestal_mm, pedestal_count) if pedestal_count else outlines
    own = cut_grooves(uncut, part, later, heights.cut_mm, process)
    outlines = cut_grooves(outlines, part, later, heights.cut_mm, process) if pedestal_count else own
    processes = strengthen_interface(process, not on_platform, len(outlines))
    if on_platform:
        processes[0] = first_layer_process(process)
    below = plastic_beneath(part, earlier, outlines[0])
    processes = strengthen_overhangs(processes, own, below)
    model = model_around(part, uncut, own, heights, earlier, later, process)
    nozzle_mm = profile.machine.head.nozzle_mm
    rows = zip(own, model.sections, processes, heights.height_mm.tolist(), strict=True)
    wall_layers = [cut_walls(s, m, p, h, nozzle_mm, process.walls) for s, m, p, h in rows]
    region_layers = regions([w.walls.inside for w in wall_layers], cover(model, own, wall_layers), below is not None, process)
    overhangs = detect_overhangs(mesh, outlines, heights.cut_mm, process, below)
    blocked = blocked_areas(part, later, heights, process.support_distance_mm, far_mm(mesh))
    floor = plate_outline(profile.machine.table)
    support_process = with_line_width(process, process.support_line_width_mm)
    infill_process = with_line_width(process, process.infill_line_width_mm)
    hanging = [overhang.hanging for overhang in overhangs]
    return Stack(
        heights=heights,
        outlines=outlines,
        own=own,
        walls=[each.walls for each in wall_layers],
        ending=[each.ending for each in wall_layers],
        regions=region_layers,
        overhangs=overhangs,
        ironed=ironed_areas(region_layers, part, later, heights, process),
        processes=processes,
        supports=generate_supports(hanging, outlines, heights, support_process, below, blocked, floor),
        beneath=below,
        floor=floor,
        pedestal_layers=pedestal_count,
        density=pattern_density([region.sparse for region in region_layers], infill_process, process.layer_height_mm),
        edges=interface_edges(part, outlines[0], below, later),
        interface_mm3=interface_mm3(part, own, region_layers, heights, later, process),
    )
