"""Sectioning: a part's mesh becomes the outlines of its layers, as they are to be printed."""

from collections.abc import Sequence

import numpy as np

from mdp.decomposition import Part
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.support_need.patches import NARROW
from profiles.profile import Profile
from slicer.bead import first_layer_process
from slicer.geometry.cross_section import cross_sections
from slicer.geometry.polygons import Polygons, clean, offset, opening
from slicer.heights import Heights, layer_heights, limb_planes_mm
from slicer.interface.compensation import compensate, compensate_elephant_foot
from slicer.interface.interface import plastic_below
from slicer.interface.interlock import cut_grooves
from slicer.interface.model import neighbours_of
from slicer.interface.pins import NONE, Pins, cut_pins
from slicer.sections import Sections
from slicer.strokes.vase import vase_profile
from slicer.support.pedestal import pedestal_layers, without_pedestal
from slicer.walls.brim import plate_outline
from slicer.walls.layer_walls import without_hairs


def section_part(
    part: Part, profile: Profile, earlier: Sequence[Part] = (), later: Sequence[Part] = (), pins: Pins = NONE
) -> Sections:
    """The sections of a part that is printed after `earlier` and before `later` parts; profile: of the whole print; pins: of all
    its parts.

    Raises SliceError when the part's mesh is not closed, or too high to be meant.
    """
    return section_layers(part, profile, heights_of(part, profile, later), earlier, later, pins)


def heights_of(part: Part, profile: Profile, later: Sequence[Part]) -> Heights:
    """Where the layers of a part lie; raises SliceError when it is too high to be meant."""
    profile, on_platform = vase_profile(profile.of_part(part.index)), part.index == 1
    pedestal_mm = profile.search.pedestal_mm if on_platform else 0.0
    return layer_heights(part.in_part_frame(), profile, on_platform, pedestal_mm, limb_planes_mm(part, later))


def section_layers(
    part: Part, profile: Profile, heights: Heights, earlier: Sequence[Part], later: Sequence[Part], pins: Pins = NONE
) -> Sections:
    """The sections of some of a part's layers, rising from its first to its last one, as section_part."""
    of_print, profile = profile, vase_profile(profile.of_part(part.index))
    process, mesh, on_platform = profile.process, part.in_part_frame(), part.index == 1
    pedestal_mm = profile.search.pedestal_mm if on_platform else 0.0
    pedestal = pedestal_layers(heights.tip_mm, pedestal_mm)
    whole = [clean(loops, process.slit_closing_mm) for loops in cross_sections(mesh, heights.cut_mm)]
    nozzle_mm = profile.machine.head.nozzle_mm
    outlines = [without_hairs(section, process, process.layer_height_mm, nozzle_mm) for section in whole]
    too_thin = frozenset(i for i, outline in enumerate(outlines) if outline.is_empty() and not whole[i].is_empty())
    if on_platform and not pedestal:
        base = clean(cross_sections(mesh, np.array([PLATFORM_TOLERANCE_MM]))[0], process.slit_closing_mm)
        outlines = lay_on_plate(
            outlines, int(np.searchsorted(heights.cut_mm, PLATFORM_TOLERANCE_MM)), base, process.line_width_mm
        )
    around = neighbours_of(part, earlier, later, heights, process)
    outlines = compensate(outlines, part, later, around.beside, heights.cut_mm, process)
    outlines = cut_pins(outlines, part, later, pins, heights.cut_mm, of_print)
    if on_platform:
        outlines[0] = compensate_elephant_foot(outlines[0], process.elephant_foot_mm, first_layer_process(process).line_width_mm)
    ungrooved = without_pedestal(outlines, mesh, heights.cut_mm, pedestal_mm, pedestal) if pedestal else outlines
    own = cut_grooves(ungrooved, part, later, heights.cut_mm, of_print)
    outlines = cut_grooves(outlines, part, later, heights.cut_mm, of_print) if pedestal else own
    return Sections(
        part=part,
        earlier=earlier,
        later=later,
        profile=profile,
        mesh=mesh,
        heights=heights,
        outlines=outlines,
        own=own,
        ungrooved=ungrooved,
        neighbours=around,
        plastic_below=plastic_below(part, earlier, outlines[0]),
        plate=plate_outline(profile.machine.table),
        pedestal_layers=pedestal,
        too_thin=too_thin,
        pins=pins.get(part.index, ()),
    )


def lay_on_plate(outlines: Sequence[Polygons], lowest: int, base: Polygons, width_mm: float) -> list[Polygons]:
    """The sections of part 1, its lowest ones with all that stands on the platform.

    base: the section at PLATFORM_TOLERANCE_MM, below which surfaces stand by the search's definition (mdp.overhang.standing), as
    `lowest` layers do. Without it the rest of a base that is not quite level would lie in the second layer, in the air. What
    reaches no farther than a ledge carries itself and stays as it is: fillets and chamfers keep their form.
    """
    ledge_mm = NARROW * width_mm
    wide = opening(base - offset(outlines[0], ledge_mm), 0.5 * width_mm)
    if wide.is_empty():
        return list(outlines)
    laid = offset(wide, ledge_mm + 0.5 * width_mm) ^ base
    return [*(outline + laid for outline in outlines[:lowest]), *outlines[lowest:]]
