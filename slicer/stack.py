"""Stack: what every layer of a part consists of, as regions, before any bead is laid."""

from collections.abc import Sequence
from dataclasses import dataclass

from mdp.decomposition import Part
from mdp.mesh import Floats
from profiles.process import Process
from profiles.profile import Profile
from slicer.base import compensated, plate
from slicer.contact import Contact, contacts
from slicer.forbidden import far_mm, forbidden
from slicer.heights import Heights, heights_of
from slicer.infill import pattern_density
from slicer.interface import beneath, interface_edges, strengthened
from slicer.interlock import grooved
from slicer.pedestal import pedestal_layers, without_pedestal
from slicer.polygons import Polygons, cleaned
from slicer.region import Region, regions
from slicer.section import sections
from slicer.support import Supports, supports
from slicer.walls import Walls, walls
from slicer.widths import of_first_layer, of_width


@dataclass(frozen=True, eq=False)
class Stack:
    """A part's layers, one entry each.

    outlines: whole sections; own: without the pedestal; walls and regions: of own; contacts: what hangs and what bridges;
    processes: the settings, with the extra walls of an interface and the widths of part 1's first layer. beneath: the
    plastic under the first layer, None on the platform; floor: the plate's outline, of use to part 1; pedestal_layers: how
    many of the lowest layers the pedestal takes; density: of the sparse infill's pattern; edges: where a seam would lie on
    an interface's edge.
    """

    at: Heights
    outlines: Sequence[Polygons]
    own: Sequence[Polygons]
    walls: Sequence[Walls]
    regions: Sequence[Region]
    contacts: Sequence[Contact]
    processes: Sequence[Process]
    supports: Supports
    beneath: Polygons | None
    floor: Polygons
    pedestal_layers: int
    density: float
    edges: Floats

    def bank(self, layer: int) -> Polygons | None:
        """The plastic that a layer lies on; None for the platform."""
        return self.outlines[layer - 1] if layer else self.beneath


def stack_of(part: Part, profile: Profile, earlier: Sequence[Part], later: Sequence[Part]) -> Stack:
    """The stack of a part that is printed after `earlier` and before `later` parts."""
    process, mesh, on_platform = profile.process, part.in_part_frame(), part.index == 1
    pedestal_mm = profile.search.pedestal_mm if on_platform else 0.0
    at = heights_of(mesh, process, on_platform, pedestal_mm)
    low = pedestal_layers(at.tip_mm, pedestal_mm)
    outlines = [cleaned(loops, process.slit_closing_mm) for loops in sections(mesh, at.cut_mm)]
    outlines = grooved(outlines, part, later, at.cut_mm, process)
    if on_platform:
        outlines[0] = compensated(outlines[0], process.elephant_foot_mm, of_first_layer(process).line_width_mm)
    own = without_pedestal(outlines, mesh, at.cut_mm, pedestal_mm, low) if low else outlines
    processes = strengthened(process, not on_platform, len(outlines))
    if on_platform:
        processes[0] = of_first_layer(process)
    rows = zip(own, processes, at.height_mm, strict=True)
    walled = [walls(s, p.walls, p.line_width_mm, h, p.outer_wall_line_width_mm) for s, p, h in rows]
    below = beneath(part, earlier, outlines[0])
    filled = regions(own, [w.inside for w in walled], below, process)
    over = contacts(mesh, outlines, at.cut_mm, process, below)
    shut = forbidden(part, later, at.tip_mm - at.height_mm, at.tip_mm, process.support_distance_mm, far_mm(mesh))
    floor = plate(profile.machine.table)
    propped = of_width(process, process.support_line_width_mm)
    sparse = of_width(process, process.infill_line_width_mm)
    return Stack(
        at=at,
        outlines=outlines,
        own=own,
        walls=walled,
        regions=filled,
        contacts=over,
        processes=processes,
        supports=supports([c.hanging for c in over], outlines, at, propped, below, shut, floor),
        beneath=below,
        floor=floor,
        pedestal_layers=low,
        density=pattern_density([region.sparse for region in filled], sparse, process.layer_height_mm),
        edges=interface_edges(part, outlines[0], below, later),
    )
