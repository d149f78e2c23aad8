"""Cut walls: the walls of a layer that has later parts beside it: all of them along the surface, few along the face of a cut."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead, spacing_mm
from slicer.fill.region import Cover
from slicer.fill.skin import uncovered_area
from slicer.geometry.polygons import Polygons, close_loop, edges, offset
from slicer.geometry.polyline import length_mm
from slicer.interface.model import Model
from slicer.paths import Kind
from slicer.strokes.split import Sides, cut_line
from slicer.walls.gap import gaps
from slicer.walls.layer_walls import layer_walls
from slicer.walls.walls import Walls, wall_rank, walls

REACH = 0.1  # of the line width: an inner wall that ends on the wall along a cut overlaps it by this


@dataclass(frozen=True, eq=False)
class CutWalls:
    """walls: those that run round; ending: inner walls along the surface that end on a cut face's, and what fills between them.

    model_inside: what the walls would enclose if the model were not cut.
    """

    walls: Walls
    ending: tuple[Bead, ...]
    model_inside: Polygons


def cut_walls(
    section: Polygons, model: Polygons | None, process: Process, *, height_mm: float, nozzle_mm: float, usual: int
) -> CutWalls:
    """The walls of a part's section in its island of the model; None: no other part touches it.

    usual: how many walls the model would have here. Walls that end on a cut face are all of one width.
    """
    width = process.line_width_mm
    if model is None:
        round_ = layer_walls(section, process.walls, process, height_mm, nozzle_mm)
        fewer = round_ if usual == process.walls else layer_walls(section, usual, process, height_mm, nozzle_mm)
        return CutWalls(round_, (), fewer.inside)
    whole = walls(model, process.walls, process, height_mm)
    fewer = whole if usual == process.walls else walls(model, usual, process, height_mm)
    round_ = layer_walls(section, min(process.interface_walls, process.walls), process, height_mm, nozzle_mm)
    if process.interface_walls >= process.walls or round_.inside.is_empty():
        return CutWalls(round_, (), fewer.inside)
    within = offset(round_.inside, REACH * width - 0.5 * spacing_mm(width, height_mm))
    loops, ending = [*round_.loops, *((),) * (process.interface_walls - len(round_.loops))], []
    for level in range(process.interface_walls, len(whole.loops)):
        runs = [run for loop in whole.loops[level] for run in _within(loop, within) if length_mm(run) > width]
        loops.append(tuple(run[:-1] for run in runs if _is_closed(run)))
        ending += [Bead(Kind.INNER_WALL, run, width, wall_rank(level, process)) for run in runs if not _is_closed(run)]
    inside = round_.inside ^ whole.inside
    lines = [
        *(bead.points for bead in ending),
        *(close_loop(loop) for level in loops[process.interface_walls :] for loop in level),
    ]
    ending += gaps(uncovered_area(round_.inside - inside, lines, width), width, height_mm)
    return CutWalls(replace(round_, loops=tuple(loops), inside=inside), tuple(ending), fewer.inside)


def _is_closed(run: Floats) -> bool:
    return len(run) > 3 and bool((run[0] == run[-1]).all())


def _within(loop: Floats, area: Polygons) -> list[Floats]:
    """What of a loop (n, 2) lies in an area, as open or closed polylines."""
    if area.is_empty():
        return []
    sides = Sides.of(edges(area))
    points, within = cut_line(close_loop(loop), sides)
    if within.all():
        return [points]
    bounds = [0, *(np.flatnonzero(np.diff(within)) + 1).tolist(), len(within)]
    runs = [points[a : b + 1] for a, b in pairwise(bounds) if within[a]]
    if len(runs) > 1 and within[0] and within[-1]:
        runs = [*runs[1:-1], np.concatenate([runs[-1], runs[0][1:]])]
    return runs


def cover(model: Model, own: Sequence[Polygons], walled: Sequence[CutWalls]) -> Cover:
    """What lies around the layers of a part, for its regions. own: its sections."""
    sections = [mine if whole is None else whole for whole, mine in zip(model.sections, own, strict=True)]
    later = model.others if model.is_cut else ()
    return Cover(sections, [layer.model_inside for layer in walled], model.below, model.above, later)
