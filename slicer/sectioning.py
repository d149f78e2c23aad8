"""Sectioning: a part's mesh becomes the outlines of its layers, as they are printed, and of the model around them.

Outsides and holes may be compensated, larger or smaller, so that the print's sizes are the model's: plastic bulges and shrinks
where it meets air. A cut face meets plastic: what lies beside it, of a part printed later, stays where it is, or the parts would
leave a gap or be pressed into each other. Nor does what is added beside the end of a cut reach over the later part's base plane,
above which the head moves; over that of a limb only beside the limb.
"""

from collections.abc import Sequence

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM
from mdp.support_need.patches import NARROW
from mdp.topology.cross_section import cross_sections
from profiles.machine import Table
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import (
    first_layer_process,
    least_width_mm,
)
from slicer.fill.region import shell_layers
from slicer.geometry.polygons import (
    CLOSING_MM,
    Polygons,
    area_mm2,
    clean,
    close_loop,
    closing,
    contours,
    half_plane,
    islands,
    offset,
    opening,
    union,
)
from slicer.geometry.polyline import length_mm
from slicer.heights import Heights, part_heights, pedestal_layers
from slicer.interface.base_plane import limb_planes, plane_in_frame_of
from slicer.interface.interface import joints, near_parts, plastic_below, sections_of
from slicer.interface.interlock import Pins, cut_grooves, cut_pins, grooves, plan_pins
from slicer.sections import Sections
from slicer.strokes.vase import vase_profile
from slicer.walls.counts import FEATURE
from slicer.zones import no_seam_segments, no_support_areas

ABOVE_MM = 1e-3  # off the height of a pedestal itself, at which level faces lie
TOUCHING_MM = 0.01  # sections of parts on either side of a cut are joined over such gaps
BESIDE_MM = 1.0  # within this distance of a limb the head moves above its base plane


HAIR_MM = 0.04  # nobody can tell whether a piece only so much thicker than the thinnest gets a line all along


def section_part(
    part: Part,
    profile: Profile,
    earlier: Sequence[Part] = (),
    later: Sequence[Part] = (),
    pins: Pins | None = None,
    heights: Heights | None = None,
) -> Sections:
    """The sections of a part that is printed after `earlier` and before `later` parts.

    profile: of the whole print; pins: of all its parts, planned here if they are not given; heights: of some of the part's
    layers, with the lowest and the highest, all if they are not given. Raises SliceError when the part's mesh is not closed, or
    too high to be meant.
    """
    of_print, profile = profile, vase_profile(profile.of_part(part.index))
    process, mesh, on_platform = profile.process, part.in_part_frame(), part.index == 1
    heights = part_heights(part, later, profile) if heights is None else heights
    pedestal_mm = profile.search.pedestal_mm if on_platform else 0.0
    cuts_mm, pedestal = heights.cut_mm, pedestal_layers(heights, pedestal_mm)
    whole = [clean(loops, process.slit_closing_mm) for loops in cross_sections(mesh, cuts_mm)]
    nozzle_mm = profile.machine.head.nozzle_mm
    outlines = [without_hairs(section, process, process.layer_height_mm, nozzle_mm) for section in whole]
    too_thin = frozenset(i for i, outline in enumerate(outlines) if outline.is_empty() and not whole[i].is_empty())
    if on_platform and not pedestal:
        base = clean(cross_sections(mesh, np.array([PLATFORM_TOLERANCE_MM]))[0], process.slit_closing_mm)
        lowest = int(np.searchsorted(cuts_mm, PLATFORM_TOLERANCE_MM))
        outlines = lay_on_plate(outlines, lowest, base, process.line_width_mm)
    beside, above, beneath = _model_around(part, earlier, later, heights, process)
    outlines = compensate(outlines, part, later, beside, cuts_mm, process)
    if on_platform:
        outlines[0] = compensate_elephant_foot(outlines[0], process.elephant_foot_mm, first_layer_process(process).line_width_mm)
    pins = plan_pins((*earlier, part, *later), of_print) if pins is None else pins
    ungrooved = cut_pins(outlines, part, later, pins, cuts_mm, of_print)
    outlines = own = cut_grooves(ungrooved, part, later, cuts_mm, of_print)
    if pedestal:
        ungrooved = _without_pedestal(ungrooved, mesh, cuts_mm, pedestal_mm, pedestal)
        own = cut_grooves(ungrooved, part, later, cuts_mm, of_print)
    below = plastic_below(part, earlier, outlines[0])
    is_limb = part.base.limbs_mm is not None and bool(earlier)
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
        beside=beside,
        plastic_below=below,
        plate=plate_outline(profile.machine.table),
        above=above,
        beneath=beneath,
        standing=sections_of(earlier, part, cuts_mm) if is_limb and process.support != "none" else (),
        joints=joints(part, later, outlines[0], below),
        pins=pins.get(part.index, np.zeros((0, 3))),
        grooves=grooves(part, process) if process.interlock == "grooves" and not on_platform else Polygons(),
        no_seam=no_seam_segments(part, mesh, cuts_mm),
        no_support=no_support_areas(part, mesh, cuts_mm),
        pedestal_layers=pedestal,
        too_thin=too_thin,
    )


def without_hairs(section: Polygons, process: Process, height_mm: float, nozzle_mm: float) -> Polygons:
    """A section without the pieces that are nowhere wide enough for a line: what is above them begins there."""
    least_mm = FEATURE * least_width_mm(nozzle_mm, height_mm)
    pieces = [] if section.is_empty() else islands(section)
    solid = [piece for piece in pieces if not _is_hair(piece, least_mm + HAIR_MM)]
    return section if len(solid) == len(pieces) else Polygons.compose(solid) if solid else Polygons()


def _is_hair(piece: Polygons, least_mm: float) -> bool:
    around_mm = sum(length_mm(close_loop(loop)) for loop in contours(piece))
    return bool(2.0 * piece.area() < least_mm * around_mm and offset(piece, -0.5 * least_mm).is_empty())


def plate_outline(table: Table) -> Polygons:
    """The plate's outline in the frame of a part that is printed with the table level, part 1's."""
    if table.size_mm is not None:
        return Polygons.square(table.size_mm, True)
    return Polygons.circle(table.radius_mm, 180)


def _model_around(
    part: Part, earlier: Sequence[Part], later: Sequence[Part], heights: Heights, process: Process
) -> tuple[list[Polygons], list[Polygons], list[Polygons]]:
    """What later parts have of a part's layers and of those over them, and what the model has of those under its base plane, the
    nearest first: as many layers as its shells reach."""
    (top, bottom), step = shell_layers(process), process.layer_height_mm
    over = float(heights.tip_mm[-1]) + step * (np.arange(max(top, process.interface_top_layers)) + 0.5)
    far_mm = max(step * max(top, bottom, process.interface_top_layers), reach_mm(process))
    before, after = (near_parts(part, others, far_mm) for others in (earlier, later))
    others, count = sections_of(after, part, np.concatenate([heights.cut_mm, over])), len(heights.cut_mm)
    deep = np.asarray(-step * (np.arange(bottom)[::-1] + 0.5), dtype=np.float64)
    beneath = [closing(model, CLOSING_MM) for model in sections_of([*before, *after], part, deep)[::-1]] if earlier else []
    return others[:count], others[count:], beneath


def _without_pedestal(
    outlines: Sequence[Polygons], mesh: Mesh, cuts_mm: Floats, pedestal_mm: float, layers: int
) -> list[Polygons]:
    """Outlines of the model alone: empty in the pedestal, and its own foot where it is sunk into the pedestal's top."""
    sunk_mm = pedestal_mm + PLATFORM_TOLERANCE_MM
    foot = clean(cross_sections(mesh, np.array([sunk_mm + ABOVE_MM]))[0])
    if foot.is_empty():
        foot = outlines[-1]
    above = [o ^ foot if cut < sunk_mm else o for o, cut in zip(outlines[layers:], cuts_mm[layers:].tolist(), strict=True)]
    return [*([Polygons()] * layers), *above]


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


def reach_mm(process: Process) -> float:
    """How far a layer may lie outside the model's section."""
    return max(process.outline_compensation_mm, -process.hole_compensation_mm, 0.0)


def compensate(
    outlines: Sequence[Polygons],
    part: Part,
    later: Sequence[Part],
    beside: Sequence[Polygons],
    cuts_mm: Floats,
    process: Process,
) -> list[Polygons]:
    """The outlines of a part's layers with outsides and holes compensated, but for its cut faces.

    beside: what later parts have of each layer; cuts_mm: heights of the layers' sections.
    """
    if process.outline_compensation_mm == 0.0 and process.hole_compensation_mm == 0.0:
        return list(outlines)
    planes = [plane_in_frame_of(part, upper.base.normal, upper.base.offset_mm) for upper in later if upper.base.limbs_mm is None]
    below = [[(-x, -y, distance - z * cut_mm) for x, y, z, distance in planes] for cut_mm in cuts_mm.tolist()]
    over, flat = [Polygons()] * len(cuts_mm), Heights(cuts_mm, np.zeros(len(cuts_mm)), cuts_mm)
    for plane in limb_planes(part, later, flat, reach_mm(process) + BESIDE_MM).values():
        over = [union([before, plane.band(layer, 0.0, np.inf)]) for layer, before in enumerate(over)]
    return [compensated(*layer, process=process) for layer in zip(outlines, beside, below, over, strict=True)]


def compensated(
    own: Polygons, others: Polygons, below: Sequence[Sequence[float]], over: Polygons | None = None, *, process: Process
) -> Polygons:
    """A part's section, which others of its model touch, with the sides compensated that no other touches.

    below: a, b, c of the base plane of each later part that is not a limb; material is added only where a x + b y + c > 0, and
    not within `over`.
    """
    if own.is_empty():
        return own
    whole = own if others.is_empty() else own + closing(own + others, TOUCHING_MM)
    grown = reach_mm(process)
    added = Polygons() if grown == 0.0 else offset(own, grown) - whole
    for a, b, c in below:
        added = half_plane(added, a, b, c)
    if over is not None and not over.is_empty():
        added = added - over
    return (own + added) ^ _resized(whole, process)


def _resized(whole: Polygons, process: Process) -> Polygons:
    """A section of the model with larger or smaller outsides and holes."""
    resized = []
    for island in islands(whole):
        filled = Polygons([loop for loop in contours(island) if area_mm2(loop) > 0])
        outside, holes = offset(filled, process.outline_compensation_mm), filled - island
        resized.append(outside if holes.is_empty() else outside - offset(holes, process.hole_compensation_mm))
    return union(resized)


def compensate_elephant_foot(outline: Polygons, elephant_foot_mm: float, width_mm: float) -> Polygons:
    """The outline less what the first layer is squeezed out by; places that would shrink below a line keep their width."""
    if elephant_foot_mm <= 0.0:
        return outline
    deep = elephant_foot_mm + 0.5 * width_mm
    narrow = outline - offset(offset(outline, -deep), deep + 0.01)
    return offset(outline, -elephant_foot_mm) + narrow
