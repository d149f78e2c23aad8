"""Interlock: how a part's first layer holds on to the plastic below: grooves or pins, and what it begins with.

Grooves are shallow and left where a later part will stand. The later part's first layer is printed at its ordinary height with as
much more plastic over the grooves as they hold, so the tip never dips below the surface; ridges and fillings then also hold each
other sideways.

Pins are blind holes in the face that a part will stand on, which the part's first strokes pour full. A weld to cold plastic is
the weakest place of a print; plastic that runs across it in one piece is stronger (Duty and others, "Z-Pinning approach for 3D
printing mechanically isotropic materials", Additive Manufacturing 27, 2019). The tip does not fit into a hole as narrow as it
can fill, so it stays at the mouth and circles there while it pushes what the hole holds. A hole runs along the direction of the
part that fills it, lies in one earlier part all along, and keeps clear of all else: the surface, other joints, other pins. For
the part below it is a hole like any other, with walls round it and a floor.
"""

from collections.abc import Mapping, Sequence
from itertools import compress
from math import ceil

import manifold3d as m3
import numpy as np

from mdp.cut import Solid, mesh_of
from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.topology.cross_section import cross_sections
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import interface_process
from slicer.geometry.edge_index import index_edges, lie_within
from slicer.geometry.polygons import Polygons, area_mm2, clean, islands, offset, offset_round, union
from slicer.heights import Heights, part_heights
from slicer.interface.interface import BELOW_MM, base_section, frame_change, in_frame_of, near_parts

STRIPE = 2.0  # line widths: grooves and ridges as wide as two beads can be printed
SIDES = 24  # of a hole
MOUTH_MM = 1.0  # holes are cut so far beyond the base plane, where there is nothing, so that no skin is left over them
HALVINGS = 20
WIDENED, MOST_WIDENED = 1.1, 60  # a grid with too many places, by so much and so often

Pins = Mapping[int, Floats]  # by the part that fills them: (k, 3) x and y of the mouth's middle, mm, and the mm3 of its hole


def plan_pins(parts: Sequence[Part], profile: Profile) -> Pins:
    """The pins of all parts of a print, or of those that are known, in print order; {} where no part wants any.

    profile: of the whole print; the part that fills pins says how they are made.
    """
    wanted = [part.index for part in parts[1:] if profile.of_part(part.index).process.interlock == "pins"]
    planned: dict[int, Floats] = {}
    for part in parts if wanted else ():
        planned[part.index] = _pins_of(part, parts, planned, profile) if part.index in wanted else np.zeros((0, 3))
    return planned


def _pins_of(part: Part, parts: Sequence[Part], planned: Pins, profile: Profile) -> Floats:
    """The pins of one of all parts; planned: those of the parts before it."""
    own = profile.of_part(part.index)
    process, wide_mm, pins = own.process, pin_width_mm(own), np.zeros((0, 3))
    for lower in near_parts(part, [other for other in parts if other.index < part.index], BELOW_MM):
        below = profile.of_part(lower.index)
        keep_mm, change = room_around_mm(below.process), frame_change(part, lower)
        looks = ceil((process.pin_depth_mm + keep_mm) / process.layer_height_mm) + 1  # about as many as there are layers
        depths_mm = -np.linspace(process.pin_depth_mm + keep_mm, BELOW_MM, looks)
        meshes = [in_frame_of(part, lower), *_holes(part, parts, planned, profile)]
        room = offset_round(base_section(part), -keep_mm - 0.5 * wide_mm)
        for solid, *holes in zip(*(cross_sections(mesh, depths_mm) for mesh in meshes), strict=True):
            if room.is_empty():
                break
            free = clean(solid) - union([Polygons(loops) for loops in holes if loops])
            room = room ^ offset_round(free, -keep_mm - 0.5 * wide_mm)
        heights: Heights | None = None
        least_mm = wide_mm + 2.0 * process.line_width_mm  # two walls between holes
        for x, y in _places(room, process):
            if not len(pins) or np.hypot(*(pins[:, :2] - (x, y)).T).min() >= least_mm:
                heights = heights or part_heights(lower, [other for other in parts if other.index > lower.index], below)
                hole = mesh_of(_hole(x, y, wide_mm, -process.pin_depth_mm, 0.0)).transform(*change)
                pins = np.vstack([pins, [x, y, _taken_mm3(hole, heights)]])
    return pins


def pin_width_mm(profile: Profile) -> float:
    """Diameter of a hole."""
    return profile.process.pin_width_nozzles * profile.machine.head.nozzle_mm


def room_around_mm(process: Process) -> float:
    """What stays between a hole and whatever else there is: the shell's walls and one of the hole's own."""
    return (process.walls + 1) * process.line_width_mm


def _holes(part: Part, uppers: Sequence[Part], pins: Pins, profile: Profile) -> list[Mesh]:
    """The holes of other parts, by their own profiles, as they are cut out of those below, in the frame of a part."""
    holes = []
    for upper in uppers:
        if len(pins.get(upper.index, ())):
            own = profile.of_part(upper.index)
            wide_mm, depth_mm = pin_width_mm(own), own.process.pin_depth_mm
            several = [_hole(x, y, wide_mm, -depth_mm, MOUTH_MM) for x, y in pins[upper.index][:, :2].tolist()]
            holes.append(mesh_of(m3.Manifold.compose(several)).transform(*frame_change(upper, part)))
    return holes


def _hole(x: float, y: float, wide_mm: float, bottom_mm: float, top_mm: float) -> Solid:
    return m3.Manifold.extrude(Polygons.circle(0.5 * wide_mm, SIDES), top_mm - bottom_mm).translate((x, y, bottom_mm))


def _places(room: Polygons, process: Process) -> list[tuple[float, float]]:
    """Middles of holes: a grid in the room, as wide as leaves no more of them than are wanted."""
    step_mm, places = process.pin_spacing_mm, _grid(room, process.pin_spacing_mm)
    for _ in range(MOST_WIDENED):
        if len(places) <= process.most_pins:
            break
        step_mm *= WIDENED
        places = _grid(room, step_mm)
    return places[: process.most_pins]


def _grid(room: Polygons, step_mm: float) -> list[tuple[float, float]]:
    """In every piece of the room a square grid about its middle, or its deepest place where that meets none."""
    places: list[tuple[float, float]] = []
    for island in sorted(islands(room), key=lambda piece: piece.bounds()):
        x0, y0, x1, y1 = island.bounds()
        grid = [(x, y) for y in _row(y0, y1, step_mm) for x in _row(x0, x1, step_mm)]
        within = lie_within(index_edges(island), np.array(grid)).tolist()
        places += list(compress(grid, within)) or [_deepest(island)]
    return places


def _row(low: float, high: float, step: float) -> list[float]:
    count = int((high - low) / step) + 1
    return [0.5 * (low + high) + step * (k - 0.5 * (count - 1)) for k in range(count)]


def _deepest(island: Polygons) -> tuple[float, float]:
    """The place of a piece that is farthest from its edge."""
    x0, y0, x1, y1 = island.bounds()
    low, high, core = 0.0, min(x1 - x0, y1 - y0), island
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        smaller = offset(island, -middle)
        if smaller.is_empty():
            high = middle
        else:
            low, core = middle, smaller
    x0, y0, x1, y1 = islands(core)[0].bounds()
    return 0.5 * (x0 + x1), 0.5 * (y0 + y1)


def _taken_mm3(hole: Mesh, heights: Heights) -> float:
    """What a hole, in the frame of the part below, takes of its layers."""
    first, last = np.searchsorted(heights.cut_mm, hole.bounds_mm[:, 2])
    sections = cross_sections(hole, heights.cut_mm[first:last])
    areas = [sum(area_mm2(loop) for loop in loops) for loops in sections]
    return float(np.dot(areas, heights.height_mm[first:last]))


def cut_pins(
    outlines: Sequence[Polygons], part: Part, later: Sequence[Part], pins: Pins, cuts_mm: Floats, profile: Profile
) -> list[Polygons]:
    """The part's outlines without the holes of the parts that will stand on it; profile: of the whole print."""
    return _cut_out(outlines, _holes(part, later, pins, profile), cuts_mm)


def _cut_out(outlines: Sequence[Polygons], cutters: Sequence[Mesh], cuts_mm: Floats) -> list[Polygons]:
    """Outlines at heights without what some solids take of them."""
    left = list(outlines)
    for cutter in cutters:
        left = [area - Polygons(cut) if cut else area for area, cut in zip(left, cross_sections(cutter, cuts_mm), strict=True)]
    return left


def cut_grooves(
    outlines: Sequence[Polygons], part: Part, later: Sequence[Part], cuts_mm: Floats, profile: Profile
) -> list[Polygons]:
    """The part's outlines without the grooves of the parts that will stand on it; profile: of the whole print."""
    cutters = []
    for upper in later:
        process = profile.of_part(upper.index).process
        area = grooves(upper, process) if process.interlock == "grooves" else Polygons()
        if not area.is_empty():
            solid = m3.Manifold.extrude(area, 2.0 * process.interlock_mm).translate((0.0, 0.0, -process.interlock_mm))
            cutters.append(mesh_of(solid).transform(*frame_change(upper, part)))
    return _cut_out(outlines, cutters, cuts_mm)


def grooves(part: Part, process: Process) -> Polygons:
    """Grooves under a part's base, in its frame: stripes along x that end before the walls, so that none is seen."""
    base, first = base_section(part), interface_process(process)
    inside = offset(base, -(first.walls + 1) * first.line_width_mm) if not base.is_empty() else base
    if inside.is_empty():
        return inside
    x0, y0, x1, y1 = inside.bounds()
    wide = STRIPE * process.line_width_mm
    stripe = Polygons.square((x1 - x0 + 2.0, wide))
    rows = np.arange(np.floor(y0 / (2.0 * wide)), np.ceil(y1 / (2.0 * wide)) + 1)
    return inside ^ Polygons.compose([stripe.translate((x0 - 1.0, 2.0 * wide * row)) for row in rows])
