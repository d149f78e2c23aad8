"""Pins: blind holes in the face that a part will stand on, which the part's first strokes pour full.

A weld to cold plastic is the weakest place of a print; plastic that runs across it in one piece is stronger (Duty and others,
"Z-Pinning approach for 3D printing mechanically isotropic materials", Additive Manufacturing 27, 2019). The tip does not fit into
a hole as narrow as it can fill, so it stays at the mouth and circles there while it pushes what the hole holds. A hole runs along
the direction of the part that fills it, lies in one earlier part all along, and keeps clear of all else: the surface, other
joints, other pins. For the part below it is a hole like any other, with walls round it and a floor.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import ceil, pi

import manifold3d as m3
import numpy as np

from mdp.cut import Solid, mesh_of
from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import OUTSIDE, Bead
from slicer.geometry.cross_section import cross_sections
from slicer.geometry.polygons import Polygons, area_mm2, clean, islands, offset, offset_round, union
from slicer.geometry.polyline import length_mm
from slicer.heights import Heights, layer_heights, limb_planes_mm
from slicer.interface.interface import BELOW_MM, frame_change, touching
from slicer.paths import Kind, bead_area_mm2
from slicer.sections import Pin

SIDES = 24  # of a hole
MOUTH_MM = 1.0  # holes are cut so far beyond the base plane, where there is nothing, so that no skin is left over them
RANK = OUTSIDE - 1  # before all else of the layer
ROUND = 12  # chords of a circle that the tip goes
MOST_AREA = 3.0  # of a stroke, in squares of the nozzle's diameter: Klipper refuses 4 (max_extrude_cross_section)
HALVINGS = 20
DOT_MM = 1e-3  # a square so small stands for a point
WIDENED, MOST_WIDENED = 1.1, 60  # a grid with too many places, by so much and so often


Pins = Mapping[int, tuple[Pin, ...]]  # by the index of the part that fills them
NONE: Pins = {}


def plan_pins(parts: Sequence[Part], profile: Profile) -> Pins:
    """The pins of all parts of a print, or of those that are known, in print order; {} where no part wants any.

    profile: of the whole print; the part that fills pins says how they are made.
    """
    wanted = [part.index for part in parts[1:] if profile.of_part(part.index).process.interlock == "pins"]
    if not wanted:
        return NONE
    planned: dict[int, tuple[Pin, ...]] = {}
    for k, part in enumerate(parts):
        cut = [(upper, planned[upper.index]) for upper in parts[:k] if planned.get(upper.index)]
        planned[part.index] = tuple(_pins_of(part, parts, cut, profile)) if part.index in wanted else ()
    return planned


def _pins_of(part: Part, parts: Sequence[Part], cut: Sequence[tuple[Part, Sequence[Pin]]], profile: Profile) -> Iterator[Pin]:
    """The pins of one of all parts. cut: the pins that are there already, and the parts that fill them."""
    earlier = [other for other in parts if other.index < part.index]
    process, wide_mm = profile.of_part(part.index).process, pin_width_mm(profile.of_part(part.index))
    base = clean(cross_sections(part.in_part_frame(), np.array([BELOW_MM]))[0])
    middles = np.zeros((0, 2))
    for lower in touching(part, earlier, BELOW_MM):
        below = profile.of_part(lower.index)
        keep_mm = room_around_mm(below.process)
        depths_mm = -np.linspace(process.pin_depth_mm + keep_mm, BELOW_MM, _looks(process, keep_mm))
        meshes = [lower.mesh.transform(part.rotation, (0.0, 0.0, -part.base.offset_mm))]
        meshes += [_holes(pins, profile.of_part(upper.index)).transform(*frame_change(upper, part)) for upper, pins in cut]
        room, within = offset_round(base, -keep_mm - 0.5 * wide_mm), [cross_sections(mesh, depths_mm) for mesh in meshes]
        for solid, *holes in zip(*within, strict=True):
            if room.is_empty():
                break
            free = clean(solid) - union([Polygons(loops) for loops in holes if loops])
            room = room ^ offset_round(free, -keep_mm - 0.5 * wide_mm)
        heights: Heights | None = None
        for x, y in _places(room, process):
            if not len(middles) or np.hypot(*(middles - (x, y)).T).min() >= least_spacing_mm(process, wide_mm):
                middles = np.vstack([middles, [x, y]])
                heights = heights or _heights_of(lower, below, parts)
                hole = mesh_of(_hole(x, y, wide_mm, -process.pin_depth_mm, 0.0))
                yield Pin(x, y, _taken_mm3(hole.transform(*frame_change(part, lower)), heights))


def pin_width_mm(profile: Profile) -> float:
    """Diameter of a hole."""
    return profile.process.pin_width_nozzles * profile.machine.head.nozzle_mm


def least_spacing_mm(process: Process, wide_mm: float) -> float:
    """Between the middles of two holes: two walls part them."""
    return wide_mm + 2.0 * process.line_width_mm


def room_around_mm(process: Process) -> float:
    """What stays between a hole and whatever else there is: the shell's walls and one of the hole's own."""
    return (process.walls + 1) * process.line_width_mm


def _looks(process: Process, keep_mm: float) -> int:
    """At how many depths the part below is looked at: about as often as it has layers."""
    return ceil((process.pin_depth_mm + keep_mm) / process.layer_height_mm) + 1


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
    dot, places = Polygons.square((DOT_MM, DOT_MM), True), list[tuple[float, float]]()
    for island in sorted(islands(room), key=lambda piece: piece.bounds()):
        x0, y0, x1, y1 = island.bounds()
        grid = [(x, y) for y in _row(y0, y1, step_mm) for x in _row(x0, x1, step_mm)]
        places += [place for place in grid if not (dot.translate(place) ^ island).is_empty()] or [_deepest(island)]
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


def _hole(x: float, y: float, wide_mm: float, bottom_mm: float, top_mm: float) -> Solid:
    return m3.Manifold.extrude(Polygons.circle(0.5 * wide_mm, SIDES), top_mm - bottom_mm).translate((x, y, bottom_mm))


def _holes(pins: Sequence[Pin], profile: Profile) -> Mesh:
    """The holes of a part in its frame, by its own profile, as they are cut out of those below."""
    wide_mm, depth_mm = pin_width_mm(profile), profile.process.pin_depth_mm
    return mesh_of(m3.Manifold.compose([_hole(pin.x_mm, pin.y_mm, wide_mm, -depth_mm, MOUTH_MM) for pin in pins]))


def _heights_of(part: Part, profile: Profile, parts: Sequence[Part]) -> Heights:
    later = [other for other in parts if other.index > part.index]
    pedestal_mm = profile.search.pedestal_mm if part.index == 1 else 0.0
    return layer_heights(part.in_part_frame(), profile, part.index == 1, pedestal_mm, limb_planes_mm(part, later))


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
    left = list(outlines)
    for upper in later:
        if pins.get(upper.index):
            holes = _holes(pins[upper.index], profile.of_part(upper.index))
            loops = cross_sections(holes.transform(*frame_change(upper, part)), cuts_mm)
            left = [area - Polygons(cut) if cut else area for area, cut in zip(left, loops, strict=True)]
    return left


def pour(pins: Sequence[Pin], profile: Profile, height_mm: float) -> list[Bead]:
    """The strokes that fill a part's pins: rounds in the mouth, as many as keep the plastic to what every firmware takes."""
    process, nozzle_mm = profile.process, profile.machine.head.nozzle_mm
    radius = 0.5 * (pin_width_mm(profile) - nozzle_mm)
    beads = []
    for pin in pins:
        rounds = max(ceil(pin.volume_mm3 / (MOST_AREA * nozzle_mm**2 * 2.0 * pi * radius)), 1)
        turn = 2.0 * pi * np.arange(rounds * ROUND + 1) / ROUND
        ring = radius * np.column_stack([np.cos(turn), np.sin(turn)])
        points = np.vstack([np.zeros((1, 2)), ring]) + np.array([pin.x_mm, pin.y_mm])
        bead_mm3 = length_mm(points) * bead_area_mm2(process.line_width_mm, height_mm) * process.interface_flow
        beads.append(Bead(Kind.GAP, points, process.line_width_mm, RANK, pin.volume_mm3 / bead_mm3))
    return beads
