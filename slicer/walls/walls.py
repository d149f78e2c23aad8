"""Walls: closed beads that follow the outline of a section, all of one width where they have room.

The outermost bead runs half its width inside the section, the next ones a bead spacing further in. Where less than two beads fit,
no wall turns round.
"""

from dataclasses import dataclass

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead, bulge_flow, mean_width_mm, outer_wall_width_mm, spacing_mm, varying
from slicer.geometry.polygons import Polygons, contours, offset, opening
from slicer.geometry.polyline import PATH_RESOLUTION_MM
from slicer.paths import Kind
from slicer.walls.variable.variable import Wall

BLUNT = 1.1  # mitre limit that claims nothing beyond a corner
LEAST_REST = 0.12  # of the line width: narrower places without a core behind them are corners, which walls run into
LEAST_REST_MM2 = 1e-3  # smaller areas are rounding
SLACK_MM = 0.01  # so that coinciding boundaries of an opening and its original leave no slivers


@dataclass(frozen=True, eq=False)
class Walls:
    """loops[k]: centrelines of wall k from outside; varying: walls as wide as the place.

    inside: what the walls enclose, bounded half a spacing inside the innermost centreline; narrow: what of it walls of one width
    leave that is narrower than two lines, across which those of a fill would only go to and fro.
    """

    loops: tuple[tuple[Floats, ...], ...]
    inside: Polygons
    narrow: Polygons
    varying: tuple[Wall, ...] = ()


def walls(section: Polygons, count: int, process: Process, height_mm: float) -> Walls:
    """Up to `count` walls of a section, of the widths of the process."""
    outer, width = outer_wall_width_mm(process), process.line_width_mm
    spacing, least_mm = spacing_mm(width, height_mm), LEAST_REST * width
    area, levels = section, []
    for level in range(count):
        half, behind = (0.5 * spacing, 0.5 * spacing) if level else (0.5 * outer, 0.5 * spacing_mm(outer, height_mm))
        line = offset(area, -half)
        core = offset(line, -behind)
        levels.append(tuple(contours(_backed(area, line, core, half_mm=half, behind_mm=behind, least_mm=least_mm))))
        area = core.simplify(PATH_RESOLUTION_MM)
        if core.is_empty():
            break
    core = offset(area, -spacing)
    inside = _backed(area, area, core, half_mm=SLACK_MM, behind_mm=spacing, least_mm=least_mm)
    return Walls(tuple(levels), inside, opening(area - inside, 0.5 * least_mm))


def _backed(area: Polygons, line: Polygons, core: Polygons, *, half_mm: float, behind_mm: float, least_mm: float) -> Polygons:
    """What of the centreline of an area's outermost bead has the core behind it: all, where no rest is at least so wide.

    half: reach of the bead outward from its centreline; behind: distance from the centreline to the core.
    """
    if area.is_empty():
        return line
    rest = area - offset(core, half_mm + behind_mm + SLACK_MM, BLUNT)
    if rest.area() < LEAST_REST_MM2 or offset(rest, -0.5 * least_mm).is_empty():
        return line
    return line ^ offset(core, behind_mm + SLACK_MM)


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
    width = mean_width_mm(wall.course)
    flow = bulge_flow(width, height_mm, wall.free, process.outer_bulge * process.line_width_mm)
    rank = wall_rank(wall.level, process)
    return Bead(kind, wall.points, width, rank, flow, line=not wall.closed, course=varying(wall.course))


def wall_rank(level: int, process: Process) -> int:
    """Rank of a wall counted from outside."""
    return -level if process.wall_order == "inner-first" else level - process.walls
