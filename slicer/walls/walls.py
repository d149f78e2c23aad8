"""Walls: closed beads that follow the outline of a section, and what is too narrow for a pair of them.

The outermost bead runs half its width inside the section, the next ones a bead spacing further in. Where less than two
beads fit, no wall turns round; the place is handed out as narrow and gets one centred line (slicer/walls/centreline.py).
"""

from dataclasses import dataclass

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import PATH_RESOLUTION_MM, Bead, bulge_flow, outer_wall_width_mm, spacing_mm
from slicer.geometry.polygons import Polygons, contours, offset, offset_round, opening
from slicer.paths import Kind
from slicer.walls.gap import LEAST_GAP, LEAST_LINE
from slicer.walls.variable.variable import EVEN_MM, Wall

BLUNT = 1.1  # mitre limit that claims nothing beyond a corner; what it leaves there is looked at again with round beads
LEAST_REST_MM2 = 1e-3
SLACK_MM = 0.01  # so that coinciding boundaries of an opening and its original leave no slivers


@dataclass(frozen=True, eq=False)
class Walls:
    """loops[k]: centrelines of wall k from outside; free: narrow places of the section itself; narrow: between walls.

    inside: what the walls enclose, bounded half a spacing inside the innermost centreline. varying: walls as wide as the place.
    """

    loops: tuple[tuple[Floats, ...], ...]
    free: Polygons
    narrow: Polygons
    inside: Polygons
    varying: tuple[Wall, ...] = ()


def walls(section: Polygons, count: int, width_mm: float, height_mm: float, outer_mm: float | None = None) -> Walls:
    """Up to `count` walls of a section for beads of that width and height, the outermost outer_mm wide where that is given."""
    outer = width_mm if outer_mm is None else outer_mm
    spacing = spacing_mm(width_mm, height_mm)
    area, levels = section, []
    free, narrow = Polygons(), Polygons()
    for level in range(count):
        half, behind = (0.5 * spacing, 0.5 * spacing) if level else (0.5 * outer, 0.5 * spacing_mm(outer, height_mm))
        line = offset(area, -half)
        core = offset(line, -behind)
        line, rest = _split(area, line, core, half, behind, (LEAST_GAP if level else LEAST_LINE) * width_mm)
        if not rest.is_empty():
            free, narrow = (rest, narrow) if level == 0 else (free, narrow + rest)
        levels.append(tuple(contours(line)))
        area = core.simplify(PATH_RESOLUTION_MM)
        if core.is_empty():
            break
    core = offset(area, -spacing)
    area, rest = _split(area, area, core, SLACK_MM, spacing, (LEAST_GAP if count else LEAST_LINE) * width_mm)
    if not rest.is_empty():
        free, narrow = (rest, narrow) if count == 0 else (free, narrow + rest)
    return Walls(tuple(levels), free, narrow, area)


def _split(
    area: Polygons, line: Polygons, core: Polygons, half: float, inner: float, least_mm: float
) -> tuple[Polygons, Polygons]:
    """What of a bead's centreline has the core behind it, and what of the area at least so wide no bead then covers.

    half: reach of the bead outward from its centreline; inner: distance from the centreline to the core.
    """
    if area.is_empty():
        return line, area
    rest = area - offset(core, half + inner + SLACK_MM, BLUNT)
    if rest.area() < LEAST_REST_MM2 or offset(rest, -0.5 * least_mm).is_empty():
        return line, Polygons()
    line = line ^ offset(core, inner + SLACK_MM)
    rest = area - offset_round(line, half + SLACK_MM)
    return line, rest if rest.is_empty() else opening(rest, 0.5 * least_mm)


def wall_beads(walled: Walls, process: Process, height_mm: float) -> list[Bead]:
    """The walls as beads; all ranks are at most 0, so that walls come before gaps, skin and infill.

    Outer beads make up for what their outer round side leaves out of the section.
    """
    outer, beads = outer_wall_width_mm(process), []
    outer_flow = bulge_flow(outer, height_mm, 1, process.outer_bulge * outer)
    for level, loops in enumerate(walled.loops):
        kind, width, flow = (Kind.INNER_WALL, process.line_width_mm, 1.0) if level else (Kind.OUTER_WALL, outer, outer_flow)
        beads += [Bead(kind, loop, width, wall_rank(level, process), flow) for loop in loops]
    return beads + [_varying_bead(wall, process, height_mm) for wall in walled.varying]


def _varying_bead(wall: Wall, process: Process, height_mm: float) -> Bead:
    """A wall of varying width as a bead; one that fills a place from side to side bulges on both."""
    kind = Kind.INNER_WALL if wall.level else Kind.OUTER_WALL
    width = wall.width_mm
    flow = bulge_flow(width, height_mm, wall.free, process.outer_bulge * process.line_width_mm)
    even = float(np.ptp(wall.widths)) <= EVEN_MM
    return Bead(
        kind, wall.points, width, wall_rank(wall.level, process), flow, line=not wall.closed, course=None if even else wall.course
    )


def wall_rank(level: int, process: Process) -> int:
    """Rank of a wall counted from outside."""
    return -level if process.wall_order == "inner-first" else level - process.walls
