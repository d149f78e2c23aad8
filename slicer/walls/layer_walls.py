"""Islands: which pieces of a section need walls of varying width, and what all its walls enclose.

An island that is nowhere narrower than its walls want gets walls of one width, which the variable ones would be too.
"""

import numpy as np

from profiles.process import Process
from slicer.bead import outer_wall_width_mm, spacing_mm
from slicer.geometry.polygons import Polygons, close_loop, contours, islands, offset, offset_round, opening, strips
from slicer.geometry.polyline import PATH_RESOLUTION_MM, length_mm
from slicer.walls.variable.rule import FEATURE, ROOM, Rule
from slicer.walls.variable.variable import Wall, variable_walls
from slicer.walls.walls import SLACK_MM, Walls, walls

LEAST_WIDTH, MOST_WIDTH = 0.6, 2.0  # of beads, in diameters of the nozzle
HAIR_MM = 0.04  # nobody can tell whether a piece only so much thicker than the thinnest gets a line all along
NARROW = 0.1  # of the line width: what walls leave that is narrower than that is a corner


def bead_rule(count: int, process: Process, height_mm: float, nozzle_mm: float) -> Rule:
    """The rule of so many walls of a process in layers of that height."""
    outer, inner = outer_wall_width_mm(process), process.line_width_mm
    taken = inner - spacing_mm(inner, height_mm)
    least = _least_mm(nozzle_mm, height_mm)
    most = max(MOST_WIDTH * nozzle_mm, outer, inner)
    return Rule(count, outer - taken, inner - taken, taken, least, most)


def without_hairs(section: Polygons, process: Process, height_mm: float, nozzle_mm: float) -> Polygons:
    """A section without the pieces that are nowhere wide enough for a line: what is above them begins there."""
    least_mm = FEATURE * _least_mm(nozzle_mm, height_mm)
    pieces = [] if section.is_empty() else islands(section)
    solid = [piece for piece in pieces if not _is_hair(piece, least_mm + HAIR_MM)]
    return section if len(solid) == len(pieces) else Polygons.compose(solid) if solid else Polygons()


def _is_hair(piece: Polygons, least_mm: float) -> bool:
    around_mm = sum(length_mm(close_loop(loop)) for loop in contours(piece))
    return bool(2.0 * piece.area() < least_mm * around_mm and offset(piece, -0.5 * least_mm).is_empty())


def _least_mm(nozzle_mm: float, height_mm: float) -> float:
    """Width of the narrowest bead."""
    return max(LEAST_WIDTH * nozzle_mm, height_mm)


def layer_walls(section: Polygons, count: int, process: Process, height_mm: float, nozzle_mm: float) -> Walls:
    """Up to `count` walls of a section, of varying width where islands are narrow; 0: one where no line of a fill has room."""
    rule = bead_rule(count, process, height_mm, nozzle_mm)
    thick: list[Polygons] = []
    narrow: list[Polygons] = []
    for island in islands(section):
        (thick if _is_thick(island, rule) else narrow).append(island)
    even = walls(Polygons.compose(thick), count, process, height_mm)
    if not narrow:
        return even
    varying = tuple(variable_walls(narrow, rule))
    inside = _enclosed(Polygons.compose(narrow), varying, rule)
    return Walls(even.loops, even.inside + inside, even.narrow, varying)


def _wall_mm(rule: Rule) -> float:
    """How deep all walls reach."""
    return 0.5 * rule.round + rule.outer + (rule.walls - 1) * rule.inner if rule.walls else 0.0


def _is_thick(island: Polygons, rule: Rule) -> bool:
    """Whether all walls and more than a bead between them fit everywhere."""
    deep = _wall_mm(rule) + 0.5 * ROOM * rule.inner
    core = offset(island, -deep)
    if core.is_empty():
        return False
    rest = island - offset(core, deep + SLACK_MM)
    return bool(rest.is_empty() or offset(rest, -0.5 * NARROW * rule.inner).is_empty())


def _enclosed(section: Polygons, varying: tuple[Wall, ...], rule: Rule) -> Polygons:
    """What the walls leave inside, where it has room for more than one bead."""
    inside = offset_round(section, -_wall_mm(rule)).simplify(PATH_RESOLUTION_MM)
    middle = [wall.course for wall in varying if wall.level == rule.walls]
    if middle:
        reach_mm = [0.25 * (course[1:, 2] + course[:-1, 2]) for course in middle]
        inside = inside - strips([course[:, :2] for course in middle], np.concatenate(reach_mm))
    return inside if inside.is_empty() else opening(inside, 0.5 * rule.inner)
