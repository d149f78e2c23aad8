"""Cut faces: the shell of a part that is cut from a model: all walls and skins along the model's surface, few along the face of a
cut, and how much plastic those take."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead, spacing_mm
from slicer.fill.region import Cover, Region, shell_layers
from slicer.fill.skin import uncovered_area
from slicer.geometry.polygons import CLOSING_MM, Polygons, close_loop, closing, half_plane, islands, offset, union
from slicer.geometry.polyline import length_mm
from slicer.interface.base_plane import limb_planes, plane_in_frame_of
from slicer.paths import Kind
from slicer.sections import Sections
from slicer.strokes.split import cut_line
from slicer.walls.walls import Walls, gaps, layer_walls, wall_rank, walls

REACH = 0.1  # of the line width: an inner wall that ends on the wall along a cut overlaps it by this
TOUCHING_MM2 = 1e-3  # a section that gains less by its neighbours has none
LEAST_MM2 = 0.01  # a smaller difference of areas in a layer is rounding
NEAR_MM = 3.0  # how far beside a limb's base the solid shell of its cut face reaches


def model_sections(sections: Sections) -> list[Polygons | None]:
    """For each layer the islands of the model that it belongs to, None where they are its own section."""
    return [joined(*three) for three in zip(sections.ungrooved, sections.own, sections.beside, strict=True)]


def joined(ungrooved: Polygons, own: Polygons, beside: Polygons) -> Polygons | None:
    """The islands of the model that hold some of a section; None where they are the part's own. beside: what other parts have."""
    alone = None if own is ungrooved or ungrooved.area() < own.area() + TOUCHING_MM2 else ungrooved
    if own.is_empty() or beside.is_empty() or not _boxes_meet(own, beside):
        return alone
    whole = closing(union([ungrooved, beside]), CLOSING_MM)
    touched = [island for island in islands(whole) if not (island ^ own).is_empty()]
    return alone if sum(island.area() for island in touched) < ungrooved.area() + TOUCHING_MM2 else Polygons.compose(touched)


def _boxes_meet(own: Polygons, beside: Polygons) -> bool:
    x0, y0, x1, y1 = own.bounds()
    u0, v0, u1, v1 = beside.bounds()
    reach = CLOSING_MM
    return bool(x0 < u1 + reach and u0 < x1 + reach and y0 < v1 + reach and v0 < y1 + reach)


def cover(sections: Sections, model: Sequence[Polygons | None], insides: Sequence[Polygons]) -> Cover:
    """What lies around the layers of a part, for its regions.

    model: as model_sections; insides: what walls would enclose of it. Earlier parts that are not known are taken to fill the
    first section; under the platform is nothing.
    """
    top, bottom = shell_layers(sections.process)
    own, above = sections.own, sections.above
    beside = [whole - mine if whole is not None else Polygons() for whole, mine in zip(model, own, strict=True)]
    later = [*beside, *above]
    below = sections.beneath or [Polygons() if sections.on_platform else own[0]] * bottom
    filled = [mine if whole is None else whole for whole, mine in zip(model, own, strict=True)]
    return Cover(filled, insides, below, above[:top], later if any(not area.is_empty() for area in later) else ())


def cut_walls(
    section: Polygons, model: Polygons | None, process: Process, *, height_mm: float, nozzle_mm: float, usual: int
) -> tuple[Walls, tuple[Bead, ...], Polygons]:
    """The walls of a part's section in its island of the model; None: no other part touches it.

    Those that run round; inner walls along the surface that end on a cut face's, all of one width, and what fills between them;
    what the walls would enclose if the model were not cut. usual: how many walls the model would have here.
    """
    if model is None:
        round_ = layer_walls(section, process.walls, process, height_mm, nozzle_mm)
        fewer = round_ if usual == process.walls else layer_walls(section, usual, process, height_mm, nozzle_mm)
        return round_, (), fewer.inside
    whole = walls(model, process.walls, process, height_mm)
    fewer = whole if usual == process.walls else walls(model, usual, process, height_mm)
    round_ = layer_walls(section, min(process.interface_walls, process.walls), process, height_mm, nozzle_mm)
    if process.interface_walls >= process.walls or round_.inside.is_empty():
        return round_, (), fewer.inside
    width = process.line_width_mm
    within = offset(round_.inside, REACH * width - 0.5 * spacing_mm(width, height_mm))
    loops, ending = [*round_.loops, *((),) * (process.interface_walls - len(round_.loops))], []
    for level in range(process.interface_walls, len(whole.loops)):
        runs = [run for loop in whole.loops[level] for run in _within(loop, within) if length_mm(run) > width]
        beads = [Bead(Kind.INNER_WALL, run, width, wall_rank(level, process)) for run in runs]
        loops.append(tuple(bead.points[:-1] for bead in beads if bead.closed))
        ending += [bead for bead in beads if not bead.closed]
    inside = round_.inside ^ whole.inside
    lines = [
        *(bead.points for bead in ending),
        *(close_loop(loop) for level in loops[process.interface_walls :] for loop in level),
    ]
    ending += gaps([uncovered_area(round_.inside - inside, lines, width)], width, height_mm)
    return replace(round_, loops=tuple(loops), inside=inside), tuple(ending), fewer.inside


def _within(loop: Floats, area: Polygons) -> list[Floats]:
    """What of a loop (n, 2) lies in an area, as open or closed polylines."""
    if area.is_empty():
        return []
    points, within = cut_line(close_loop(loop), area)
    if within.all():
        return [points]
    bounds = [0, *(np.flatnonzero(np.diff(within)) + 1).tolist(), len(within)]
    runs = [points[a : b + 1] for a, b in pairwise(bounds) if within[a]]
    if len(runs) > 1 and within[0] and within[-1]:
        runs = [*runs[1:-1], np.concatenate([runs[-1], runs[0][1:]])]
    return runs


def interface_mm3(sections: Sections, regions: Sequence[Region]) -> dict[int, float]:
    """Plastic, mm3, that a part has more of than the uncut model in its place, by the part whose base plane is nearest.

    Walls and skins on the faces of cuts where there would be sparse infill, and what the flow of its first layer on
    plastic adds to the room that it has.
    """
    part, process, heights = sections.part, sections.process, sections.heights
    planes = {} if sections.on_platform else {part.index: np.array([0.0, 0.0, -1.0, 0.0])}
    planes |= {upper.index: plane_in_frame_of(part, upper.base.normal, upper.base.offset_mm) for upper in sections.later}
    more, near = dict.fromkeys(planes, 0.0), limb_planes(part, sections.later, heights, NEAR_MM)
    for layer, (section, region) in enumerate(zip(sections.own, regions, strict=True)):
        height_mm, z_mm = heights.height_mm[layer], heights.cut_mm[layer]
        if not planes or region.uncut.is_empty():
            continue
        closed = (region.uncut ^ section) - region.sparse
        if closed.area() > LEAST_MM2:
            distances = [np.array([-plane[0], -plane[1], plane[3] - plane[2] * z_mm]) for plane in planes.values()]
            counting = [near[index].band(layer, -np.inf, np.inf) if index in near else None for index in planes]
            for index, area in zip(planes, nearest_areas(closed, distances, counting), strict=True):
                more[index] += (1.0 - process.infill_density) * float(height_mm) * area
    if not sections.on_platform:
        filled = sections.own[0].area() - (1.0 - process.infill_density) * regions[0].sparse.area()
        more[part.index] += filled * (process.interface_flow - 1.0) * float(heights.height_mm[0])
    return more


def nearest_areas(whole: Polygons, distances: Sequence[Floats], near: Sequence[Polygons | None]) -> list[float]:
    """mm2 of an area where each of several linear functions a x + b y + c is the least of those that count there.

    near: where each counts, None: everywhere.
    """
    areas = []
    for k, (mine, own) in enumerate(zip(distances, near, strict=True)):
        nearer = whole if own is None else whole ^ own
        for j, (distance, other) in enumerate(zip(distances, near, strict=True)):
            if j != k and not nearer.is_empty():
                a, b, c = distance - mine
                away = Polygons() if other is None else nearer - other
                nearer = half_plane(nearer, a, b, c)
                nearer = nearer if away.is_empty() else nearer + away
        areas.append(nearer.area())
    return areas
