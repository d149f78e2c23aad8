"""Stack: what every layer of a part consists of, as regions, before any bead is laid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead, first_layer_process, with_line_width
from slicer.demand.site import Site
from slicer.fill.infill import pattern_density
from slicer.finish.ironing import ironed_areas
from slicer.geometry.polygons import Polygons
from slicer.heights import Heights
from slicer.interface.cut_walls import cover, cut_walls
from slicer.interface.interface import interface_edges, strengthen_interface
from slicer.interface.model import model_around
from slicer.interface.plastic import interface_mm3
from slicer.region import Region, regions
from slicer.support.overhang import Overhang, bridge_unheld
from slicer.support.support import Supports
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


def build_stack(site: Site, supports: Supports) -> Stack:
    """The stack of a part with the support that was planned for it."""
    process, part, later, heights = site.profile.process, site.part, site.later, site.heights
    processes = strengthen_interface(process, site.beneath is not None, len(site.outlines))
    if site.beneath is None:
        processes[0] = first_layer_process(process)
    processes = strengthen_overhangs(processes, site.own, site.beneath)
    model = model_around(part, site.uncut, site.own, heights, site.earlier, later, process)
    nozzle_mm = site.profile.machine.head.nozzle_mm
    rows = zip(site.own, model.sections, processes, heights.height_mm.tolist(), strict=True)
    wall_layers = [cut_walls(s, m, p, h, nozzle_mm, process.walls) for s, m, p, h in rows]
    inside, covers = [w.walls.inside for w in wall_layers], cover(model, site.own, wall_layers)
    region_layers = regions(inside, covers, site.beneath is not None, process)
    infill_process = with_line_width(process, process.infill_line_width_mm)
    return Stack(
        heights=heights,
        outlines=site.outlines,
        own=site.own,
        walls=[each.walls for each in wall_layers],
        ending=[each.ending for each in wall_layers],
        regions=region_layers,
        overhangs=bridge_unheld(site.overhangs, site.outlines, site.beneath, supports.areas, heights, process),
        ironed=ironed_areas(region_layers, part, later, heights, process),
        processes=processes,
        supports=supports,
        beneath=site.beneath,
        floor=site.floor,
        pedestal_layers=site.pedestal_layers,
        density=pattern_density([region.sparse for region in region_layers], infill_process, process.layer_height_mm),
        edges=interface_edges(part, site.outlines[0], site.beneath, later),
        interface_mm3=interface_mm3(part, site.own, region_layers, heights, later, process),
    )
