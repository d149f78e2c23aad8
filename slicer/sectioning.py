"""Sectioning: outlines of a part's layers as printed, and of the model around them, from its mesh.

Outer contours and holes may be compensated, larger or smaller, for the bulging and shrinking of plastic at free surfaces, so that
the print has the model's dimensions. A cut face meets plastic: the border to a later part is not compensated, otherwise the parts
would leave a gap or be pressed into each other. Nor does the addition beside the end of a cut extend over the later part's base
plane, above which the head moves; over that of a limb only beside the limb. Zones that the user marked on a part are also
converted to layers.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Indices, Mesh
from mdp.overhang import PLATE_TOLERANCE_MM, Mask
from mdp.support_need.patches import NARROW
from mdp.topology.cross_section import cross_sections
from mdp.zone import Marked, Zone, touched
from profiles.part_settings import SPEEDS_OF_A_PLACE
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import first_layer_process, least_width_mm, with_line_width
from slicer.geometry.polygons import (
    CLOSING_MM,
    TOUCHING_MM,
    Polygons,
    area_mm2,
    clean,
    closing,
    contours,
    half_plane,
    islands,
    offset,
    opening,
    perimeter_mm,
    union,
)
from slicer.heights import Heights, part_heights
from slicer.interface.interface import (
    AROUND_MM,
    Pins,
    cut_grooves,
    cut_out,
    grooves,
    joints,
    limb_planes,
    near_parts,
    pin_holes,
    plan_pins,
    plane_in_frame_of,
    plastic_below,
    sections_of,
)
from slicer.modifiers import Place, combined, modified_places, most_shell_layers, volume_sections
from slicer.walls.skeleton import FEATURE

ABOVE_MM = 1e-3  # off the height of a pedestal, at which level faces lie
BESIDE_MM = 1.0  # within this distance of a limb the head moves above its base plane
THICKNESS_MARGIN_MM = 0.04  # in a piece only this much thicker than the thinnest, lines may not cover the whole length
RIM_MM = 0.04  # overlap by which the projections of faces in neighbouring layers unite


@dataclass(frozen=True, eq=False)
class Sections:
    """A part's layers, one entry each, before beads are planned, and the parts around them.

    Part: printed after `earlier` and before `later` parts, with `profile`, its own; mesh: in its frame.

    Layers: `outlines` are complete, as printed; `own` is the area to draw, without the pedestal and less the elephant foot of the
    first layer; `ungrooved` is `own` before grooves for later parts.

    Model around: `beside` is the area of later parts in each layer and `above` in the layers over the last one, as many as shells
    need; `beneath` holds the model's sections under the base plane, nearest first, () if earlier parts are unknown; `standing` is
    the area of earlier parts in each layer of a limb. `plastic_below` lies just under the base plane, None on the build plate;
    `plate` is the plate's outline, for parts that stand on it. `joints`, (k, 6) segments, are the lines on the surface where the
    part meets others.

    Interlock: `pins`, (k, 3) x, y and mm3, and the area of `grooves` that the part fills.

    Zones: walls should not begin at a layer's `no_seam`, (k, 6) segments; its `no_support` area gets no support, and all
    overhangs in its `enforced` area get it, () for none. `places` are areas with modified settings, where later ones override
    earlier ones.

    pedestal_layers: number of lowest layers of the pedestal; too_thin: layers whose material is too thin for any line.
    """

    part: Part
    earlier: Sequence[Part]
    later: Sequence[Part]
    profile: Profile
    mesh: Mesh
    heights: Heights
    outlines: Sequence[Polygons]
    own: Sequence[Polygons]
    ungrooved: Sequence[Polygons]
    beside: Sequence[Polygons]
    plastic_below: Polygons | None
    plate: Polygons
    above: Sequence[Polygons] = ()
    beneath: Sequence[Polygons] = ()
    standing: Sequence[Polygons] = ()
    joints: Floats = field(default_factory=lambda: np.zeros((0, 6)))
    pins: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    grooves: Polygons = field(default_factory=Polygons)
    no_seam: Sequence[Floats] = ()
    no_support: Sequence[Polygons] = ()
    enforced: Sequence[Polygons] = ()
    places: Sequence[Place] = ()
    pedestal_layers: int = 0
    too_thin: frozenset[int] = frozenset()

    @property
    def on_plate(self) -> bool:
        """Whether the part stands on the build plate, or on a raft there."""
        return self.part.on_plate

    @property
    def on_raft(self) -> bool:
        """Whether the part stands on a raft."""
        return self.on_plate and self.process.raft_layers > 0

    @property
    def process(self) -> Process:
        """The settings of the part."""
        return self.profile.process

    @cached_property
    def speed_places(self) -> list[Place]:
        """The areas with modified speeds, as from slicer.modifiers.combined."""
        return combined(self.places, SPEEDS_OF_A_PLACE)

    @cached_property
    def support_process(self) -> Process:
        """The settings of the part's support, with its line width."""
        return with_line_width(self.process, self.process.support_line_width_mm)

    def below(self, layer: int) -> Polygons | None:
        """The plastic below a layer; None for the build plate."""
        return self.outlines[layer - 1] if layer else self.plastic_below


def section_parts(parts: Sequence[Part], profile: Profile) -> list[Sections]:
    """The sections of all parts of a print, in print order. Raises SliceError like section_part."""
    pins = plan_pins(parts, profile)
    return [section_part(part, profile, parts[:k], parts[k + 1 :], pins) for k, part in enumerate(parts)]


def section_part(
    part: Part, profile: Profile, earlier: Sequence[Part] = (), later: Sequence[Part] = (), pins: Pins | None = None
) -> Sections:
    """The sections of a part that is printed after `earlier` and before `later` parts.

    profile: of the whole print; pins: of all its parts, planned here if they are not given. Raises SliceError if the part's mesh
    is not closed, or implausibly high.
    """
    of_print, profile = profile, profile.of_part(part.index)
    if profile.process.spiral_vase:  # its bottom and the layers above it have one wall and no inside
        hollow = {"walls": 1, "infill_density": 0.0, "top_layers": 0, "overhang_extra_walls": 0, "ironing": False}
        profile = profile.model_copy(update={"process": profile.process.model_copy(update=hollow)})
    process, mesh, on_plate = profile.process, part.in_part_frame(), part.on_plate
    heights = part_heights(part, later, profile)
    pedestal_mm = profile.search.pedestal_mm if on_plate else 0.0
    cuts_mm, pedestal = heights.cut_mm, int(np.searchsorted(heights.tip_mm, pedestal_mm + 1e-6))
    whole = [clean(loops, process.slit_closing_mm) for loops in cross_sections(mesh, cuts_mm)]
    outlines = [drop_thin_pieces(section, process, profile.machine.head.nozzle_mm) for section in whole]
    too_thin = frozenset(i for i, outline in enumerate(outlines) if outline.is_empty() and not whole[i].is_empty())
    if on_plate and not pedestal:
        outlines = lay_on_plate(outlines, mesh, cuts_mm, process)
    places = modified_places(part, mesh, process, cuts_mm)
    beside, above, beneath, standing = _model_around(part, earlier, later, heights, process, places)
    outlines = compensate(outlines, part, later, beside, cuts_mm, process)
    pins = plan_pins((*earlier, part, *later), of_print) if pins is None else pins
    ungrooved = cut_out(outlines, pin_holes(part, later, pins, of_print), cuts_mm)
    outlines = own = cut_grooves(ungrooved, part, later, cuts_mm, of_print)
    if pedestal:
        ungrooved = _without_pedestal(ungrooved, mesh, cuts_mm, pedestal_mm, pedestal)
        own = cut_grooves(ungrooved, part, later, cuts_mm, of_print)
    elif on_plate and not process.raft_layers and process.elephant_foot_mm > 0.0:
        width_mm = first_layer_process(process).line_width_mm
        first = compensate_elephant_foot(own[0], process.elephant_foot_mm, width_mm)
        ungrooved, own = [first, *ungrooved[1:]], [first, *own[1:]]
    below, table = plastic_below(part, earlier, outlines[0]), profile.machine.table
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
        plate=Polygons.circle(table.radius_mm, 180) if table.size_mm is None else Polygons.square(table.size_mm, True),
        above=above,
        beneath=beneath,
        standing=standing,
        joints=joints(part, later, outlines[0], below),
        pins=pins.get(part.index, np.zeros((0, 3))),
        grooves=grooves(part, process) if process.interlock == "grooves" and not on_plate else Polygons(),
        no_seam=no_seam_segments(part, mesh, cuts_mm),
        no_support=marked_areas(part.no_support, part, mesh, cuts_mm),
        enforced=marked_areas(part.support, part, mesh, cuts_mm),
        places=places,
        pedestal_layers=pedestal,
        too_thin=too_thin,
    )


def drop_thin_pieces(section: Polygons, process: Process, nozzle_mm: float) -> Polygons:
    """Drop slivers: remove the pieces of a section that are nowhere wide enough for a line; the pieces above them begin there."""
    least_mm = FEATURE * least_width_mm(nozzle_mm, process.layer_height_mm) + THICKNESS_MARGIN_MM
    pieces, solid = [] if section.is_empty() else islands(section), list[Polygons]()
    for piece in pieces:
        if 2.0 * piece.area() >= least_mm * perimeter_mm(piece) or not offset(piece, -0.5 * least_mm).is_empty():
            solid.append(piece)
    return section if len(solid) == len(pieces) else Polygons.compose(solid) if solid else Polygons()


def lay_on_plate(outlines: list[Polygons], mesh: Mesh, cuts_mm: Floats, process: Process) -> list[Polygons]:
    """The sections of a part on the build plate, with the section at PLATE_TOLERANCE_MM added to the lowest ones: below it,
    surfaces stand on the plate by the search's definition (mdp.overhang.standing). Otherwise the rest of a base that is not quite
    level would float in the second layer. Areas no wider than a ledge support themselves and stay unchanged: fillets and chamfers
    keep their shape.
    """
    base = clean(cross_sections(mesh, np.array([PLATE_TOLERANCE_MM]))[0], process.slit_closing_mm)
    width_mm, ledge_mm = process.line_width_mm, NARROW * process.line_width_mm
    wide = opening(base - offset(outlines[0], ledge_mm), 0.5 * width_mm)
    if wide.is_empty():
        return outlines
    lowest, laid = int(np.searchsorted(cuts_mm, PLATE_TOLERANCE_MM)), offset(wide, ledge_mm + 0.5 * width_mm) ^ base
    return [*(outline + laid for outline in outlines[:lowest]), *outlines[lowest:]]


def _model_around(
    part: Part, earlier: Sequence[Part], later: Sequence[Part], heights: Heights, process: Process, places: Sequence[Place]
) -> tuple[list[Polygons], list[Polygons], list[Polygons], Sequence[Polygons]]:
    """Areas of later parts in a part's layers and in those over them; sections of the model under its base plane, nearest first,
    as many layers as its shells need; and areas of earlier parts in the layers of a limb, within the reach of its support, ()
    without support.
    """
    (top, bottom), step = most_shell_layers(process, places), process.layer_height_mm
    over = float(heights.tip_mm[-1]) + step * (np.arange(max(top, process.interface_top_layers)) + 0.5)
    far_mm = max(step * max(top, bottom, process.interface_top_layers), reach_mm(process))
    before, after = (near_parts(part, others, far_mm) for others in (earlier, later))
    others, count = sections_of(after, part, np.concatenate([heights.cut_mm, over])), len(heights.cut_mm)
    deep = np.asarray(-step * (np.arange(bottom)[::-1] + 0.5), dtype=np.float64)
    known = bool(earlier) and not part.on_plate
    under = sections_of([*before, *after], part, deep)[::-1] if known else []
    standing: Sequence[Polygons] = ()
    if part.base.limbs_mm is not None and earlier and process.support != "none":
        standing = sections_of(near_parts(part, earlier, AROUND_MM + process.support_distance_mm), part, heights.cut_mm)
    return others[:count], others[count:], [closing(model, CLOSING_MM) for model in under], standing


def reach_mm(process: Process) -> float:
    """Greatest distance of a layer's outline outside the model's section, mm."""
    return max(process.outline_compensation_mm, -process.hole_compensation_mm, 0.0)


def compensate(
    outlines: Sequence[Polygons], part: Part, later: Sequence[Part], beside: Sequence[Polygons], cuts_mm: Floats, process: Process
) -> list[Polygons]:
    """The outlines of a part's layers with outer contours and holes compensated, except at cut faces.

    beside: area of later parts in each layer; cuts_mm: heights of the layers' sections.
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
    """A part's section, compensated on the sides that touch no other part of the model.

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
    """A section of the model with outer contours and holes compensated."""
    resized = []
    for island in islands(whole):
        filled = Polygons([loop for loop in contours(island) if area_mm2(loop) > 0])
        outside, holes = offset(filled, process.outline_compensation_mm), filled - island
        resized.append(outside if holes.is_empty() else outside - offset(holes, process.hole_compensation_mm))
    return union(resized)


def compensate_elephant_foot(outline: Polygons, elephant_foot_mm: float, width_mm: float) -> Polygons:
    """The outline less the elephant foot of the first layer; areas that would become narrower than a line keep their width."""
    deep = elephant_foot_mm + 0.5 * width_mm
    narrow = outline - offset(offset(outline, -deep), deep + 0.01)
    return offset(outline, -elephant_foot_mm) + narrow


def _without_pedestal(
    outlines: Sequence[Polygons], mesh: Mesh, cuts_mm: Floats, pedestal_mm: float, layers: int
) -> list[Polygons]:
    """Outlines of the model alone: empty in the pedestal, and its own foot where it is sunk into the pedestal's top."""
    sunk_mm = pedestal_mm + PLATE_TOLERANCE_MM
    foot = clean(cross_sections(mesh, np.array([sunk_mm + ABOVE_MM]))[0])
    if foot.is_empty():
        foot = outlines[-1]
    above = [o ^ foot if cut < sunk_mm else o for o, cut in zip(outlines[layers:], cuts_mm[layers:].tolist(), strict=True)]
    return [*([Polygons()] * layers), *above]


def no_seam_segments(part: Part, mesh: Mesh, cuts_mm: Floats) -> list[Floats]:
    """(k, 6) segments for each layer, in the part frame at its mid-height (cuts_mm): the sections of all faces that the part's
    no_seam zones name or that lie within their boxes. mesh: the part's, in its frame.
    """
    marked = part.no_seam
    chords = [_chords(mesh, np.zeros(len(mesh.faces), dtype=np.bool_) if marked.faces is None else marked.faces, cuts_mm)]
    for volume in marked.volumes:
        box = volume if isinstance(volume, Zone) else volume.box
        segments, layer = _chords(mesh, touched(part.mesh, [box]), cuts_mm)
        low, high = _within((segments + np.array([0.0, 0.0, part.base.offset_mm])) @ part.rotation, box)
        inside = low < high
        start, along = segments[inside, 0], segments[inside, 1] - segments[inside, 0]
        ends = start[:, None] + np.stack([low[inside], high[inside]], axis=1)[..., None] * along[:, None]
        chords.append((ends, layer[inside]))
    segments, layer = (np.concatenate(columns) for columns in zip(*chords, strict=True))
    order = np.argsort(layer, kind="stable")
    first = np.searchsorted(layer[order], np.arange(1, len(cuts_mm)))
    return np.split(segments[order].reshape(-1, 6), first)


def _chords(mesh: Mesh, chosen: Mask, cuts_mm: Floats) -> tuple[Floats, Indices]:
    """(k, 2, 3) sections of the chosen faces with level planes, and (k,) the plane of each."""
    corners = mesh.vertices[mesh.faces[chosen]]
    heights = corners[:, :, 2]
    first, last = np.searchsorted(cuts_mm, heights.min(axis=1)), np.searchsorted(cuts_mm, heights.max(axis=1))
    counts = last - first
    face = np.repeat(np.arange(len(corners)), counts)
    layer = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts) + np.repeat(first, counts)
    around = corners[face]
    above = around[:, :, 2] - cuts_mm[layer][:, None]
    after, beyond = np.roll(around, -1, axis=1), np.roll(above, -1, axis=1)
    crossed = (above > 0.0) != (beyond > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        places = around + (above / (above - beyond))[..., None] * (after - around)
    return places[crossed].reshape(-1, 2, 3), layer[crossed.any(axis=1)]


def _within(segments: Floats, box: Zone) -> tuple[Floats, Floats]:
    """Range of (k, 2, 3) segments inside a box, as shares along each; the first is the greater if none of it is inside."""
    segments = box.along(segments)
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        first, last = (np.array(box.min_mm) - start) / along, (np.array(box.max_mm) - start) / along
    outside = (along == 0.0) & ((start < box.min_mm) | (start > box.max_mm))
    enters = np.where(along == 0.0, -np.inf, np.minimum(first, last))
    leaves = np.where(along == 0.0, np.inf, np.maximum(first, last))
    low, high = enters.max(axis=1).clip(0.0, 1.0), leaves.min(axis=1).clip(0.0, 1.0)
    return low, np.where(outside.any(axis=1), low, high)


def marked_areas(marked: Marked, part: Part, mesh: Mesh, cuts_mm: Floats) -> list[Polygons]:
    """The area marked on a part in each layer: sections of volumes, and projections of the faces that belong to the layer; [] if
    nothing is marked.

    mesh: the part's, in its frame; cuts_mm: mid-heights of the layers.
    """
    if not marked.anywhere:
        return []
    named = {} if marked.faces is None else faces_by_layer(mesh, cuts_mm, marked.faces & (mesh.normals[:, 2] != 0.0))
    sections = [volume_sections(part, volume, cuts_mm) for volume in marked.volumes]
    layers = []
    for k in range(len(cuts_mm)):
        pieces = [areas[k] for areas in sections]
        if k in named:
            shadows = [face if area_mm2(face) > 0.0 else face[::-1] for face in named[k]]
            pieces.append(offset(Polygons(shadows), RIM_MM))
        layers.append(union(pieces))
    return layers


def faces_by_layer(mesh: Mesh, cuts_mm: Floats, chosen: Mask) -> dict[int, list[Floats]]:
    """Chosen faces projected to the plane, (3, 2), counter-clockwise if they face down, by the layers to whose strip of the
    surface they belong.
    """
    corners = mesh.vertices[mesh.faces[chosen]]
    # a section contains what lies just below its plane
    first = np.searchsorted(cuts_mm, corners[:, :, 2].min(axis=1), side="right")
    last = np.searchsorted(cuts_mm, corners[:, :, 2].max(axis=1))
    last = np.minimum(np.maximum(last, first), len(cuts_mm) - 1)
    faces: dict[int, list[Floats]] = {}
    for corner, a, b in zip(np.ascontiguousarray(corners[:, ::-1, :2]), first.tolist(), last.tolist(), strict=True):
        for layer in range(a, b + 1):
            faces.setdefault(layer, []).append(corner)
    return faces
