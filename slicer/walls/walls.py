"""Walls: closed beads that follow the outline of a section, with varying width where it is narrow, and gap fill.

The outermost bead runs half its width inside the section, the next ones a bead spacing further in. An island with room for all
its walls everywhere gets walls of one width, which variable walls would also have. Where fewer than two beads fit, no wall turns
back.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead, least_width_mm, mean_width_mm, outer_wall_width_mm, spacing_mm, varying
from slicer.geometry.edge_index import EdgeIndex, depths, index_edges
from slicer.geometry.polygons import Polygons, area_mm2, contours, islands, larger, offset, offset_round, opening, strips, union
from slicer.geometry.polyline import along_mm, length_mm
from slicer.paths import Kind
from slicer.walls.skeleton import ROOM, SPLIT, Rule
from slicer.walls.variable import Wall, variable_walls

WIDEST = 2.0  # nozzle diameters
NARROW = 0.1  # share of the line width: a narrower remainder beside walls is a corner
BLUNT = 1.1  # mitre limit that adds nothing beyond a corner
LEAST_REST = 0.12  # share of the line width: narrower regions without a core behind them are corners, into which walls run
LEAST_REST_MM2 = 1e-3  # smaller areas are rounding
CORE_MM = 0.0125  # tolerance for simplifying the area inside the walls so far
SLACK_MM = 0.01  # avoids slivers where the boundaries of an opening and its original coincide
RANK = 1  # after walls, which have 0 and less
LEAST_GAP = 0.12  # share of the line width: a narrower gap between beads stays open, as with PrusaSlicer's classic walls
MOST_WIDTH = 2.0  # line widths of a bead, and spacings from which two lie side by side
LEAST_TOP = 3.0  # line widths: narrower tops keep their walls, as in OrcaSlicer
ROUNDS = 50  # greatest number of beads around a gap, counted like walls
SPREAD = 0.25  # share by which the spacing of points of fuzzy walls varies
FEWEST = 3  # points between the ends of a rough wall: a shorter wall stays smooth
SHORTEST = 0.25  # share of the line width: shorter pieces are not beads
FEW = 0.6  # share of the line width squared: a smaller gap beside the lines stays open, since it is not worth the travel
MOST_WIDER = 1.3  # greatest factor on a bead's width to compensate for the tips of its gap that it does not reach


@dataclass(frozen=True, eq=False)
class Walls:
    """Walls of a section. loops[k]: centrelines of wall k from outside; varying: walls of varying width.

    inside: the area inside the walls, bounded half a spacing inside the innermost centreline; narrow: its parts beside walls of
    one width that are narrower than two lines, where fill lines would only go back and forth.
    """

    loops: tuple[tuple[Floats, ...], ...]
    inside: Polygons
    narrow: Polygons
    varying: tuple[Wall, ...] = ()


def layer_walls(section: Polygons, count: int, process: Process, height_mm: float, nozzle_mm: float) -> Walls:
    """Up to `count` walls of a section, with varying width in narrow islands; for 0, one wall where no fill line has room."""
    rule = bead_rule(count, process, height_mm, nozzle_mm)
    thick, narrow = list[Polygons](), list[Polygons]()
    for island in islands(section):
        (thick if _is_thick(island, rule) else narrow).append(island)
    even = walls(Polygons.compose(thick), count, process, height_mm)
    if not narrow:
        return even
    varying = tuple(variable_walls(narrow, rule))
    inside = _enclosed(Polygons.compose(narrow), varying, rule)
    return Walls(even.loops, even.inside + inside, even.narrow, varying)


def walls_under_tops(
    section: Polygons, above: Polygons, count: int, process: Process, height_mm: float, nozzle_mm: float
) -> Walls:
    """Up to `count` walls of a section, but one around its tops, the areas that `above` leaves uncovered over at least LEAST_TOP
    lines.
    """
    width = process.line_width_mm
    outer = layer_walls(section, min(count, 1), process, height_mm, nozzle_mm)
    top = opening(outer.inside - above, 0.5 * LEAST_TOP * width)
    if count < 2 or top.is_empty():
        return layer_walls(section, count, process, height_mm, nozzle_mm)
    covered = opening(outer.inside - top, 0.5 * width)
    beside_walls = offset(covered, 0.5 * (width - spacing_mm(width, height_mm)))  # the round sides of beads overlap
    even = process.model_copy(update={"outer_wall_line_width_mm": None})
    inner = layer_walls(beside_walls, count - 1, even, height_mm, nozzle_mm)
    return Walls(
        (*outer.loops, *inner.loops),
        inner.inside + (outer.inside - covered),
        outer.narrow + inner.narrow,
        (*outer.varying, *(replace(wall, level=wall.level + 1, free=0) for wall in inner.varying)),
    )


def bead_rule(count: int, process: Process, height_mm: float, nozzle_mm: float) -> Rule:
    """The bead rule for a number of walls of a process, in layers of a given height."""
    outer, inner = outer_wall_width_mm(process), process.line_width_mm
    taken, most = inner - spacing_mm(inner, height_mm), max(WIDEST * nozzle_mm, outer, inner)
    return Rule(count, outer - taken, inner - taken, taken, least_width_mm(nozzle_mm, height_mm), most)


def _is_thick(island: Polygons, rule: Rule) -> bool:
    """Whether all walls and more than a bead between them fit everywhere."""
    deep = _wall_mm(rule) + 0.5 * ROOM * rule.inner
    core = offset(island, -deep)
    if core.is_empty():
        return False
    rest = island - offset(core, deep + SLACK_MM)
    return bool(rest.is_empty() or offset(rest, -0.5 * NARROW * rule.inner).is_empty())


def _wall_mm(rule: Rule) -> float:
    """Depth of all walls together, mm."""
    return 0.5 * rule.round + rule.outer + (rule.walls - 1) * rule.inner if rule.walls else 0.0


def walls(section: Polygons, count: int, process: Process, height_mm: float) -> Walls:
    """Up to `count` walls of a section, with the widths of the process."""
    outer, width = outer_wall_width_mm(process), process.line_width_mm
    spacing, least_mm = spacing_mm(width, height_mm), LEAST_REST * width
    area, levels = section, []
    for level in range(count):
        half, behind = (0.5 * spacing, 0.5 * spacing) if level else (0.5 * outer, 0.5 * spacing_mm(outer, height_mm))
        line = offset(area, -half)
        core = offset(line, -behind)
        levels.append(tuple(contours(_backed(area, line, core, half_mm=half, behind_mm=behind, least_mm=least_mm))))
        area = core.simplify(CORE_MM)
        if core.is_empty():
            break
    core = offset(area, -spacing)
    inside = _backed(area, area, core, half_mm=SLACK_MM, behind_mm=spacing, least_mm=least_mm)
    return Walls(tuple(levels), inside, opening(area - inside, 0.5 * least_mm))


def _backed(area: Polygons, line: Polygons, core: Polygons, *, half_mm: float, behind_mm: float, least_mm: float) -> Polygons:
    """The part of the centreline of an area's outermost bead with the core behind it; all of it if no remainder is at least
    least_mm wide.

    half_mm: extent of the bead outward from its centreline; behind_mm: distance from the centreline to the core.
    """
    if area.is_empty():
        return line
    rest = area - offset(core, half_mm + behind_mm + SLACK_MM, BLUNT)
    if rest.area() < LEAST_REST_MM2 or offset(rest, -0.5 * least_mm).is_empty():
        return line
    return line ^ offset(core, behind_mm + SLACK_MM)


def _enclosed(section: Polygons, varying: tuple[Wall, ...], rule: Rule) -> Polygons:
    """The area inside the walls, where it has room for more than one bead."""
    inside = offset_round(section, -_wall_mm(rule)).simplify(CORE_MM)
    middle = [wall.course for wall in varying if wall.level == rule.walls]
    if middle:
        reach_mm = [0.25 * (course[1:, 2] + course[:-1, 2]) for course in middle]
        inside = inside - strips([course[:, :2] for course in middle], np.concatenate(reach_mm))
    return inside if inside.is_empty() else opening(inside, 0.5 * rule.inner)


def gaps(places: Sequence[Polygons], line_width_mm: float, height_mm: float) -> list[Bead]:
    """Gap fill: beads that fill gaps between other beads, whose round sides they cover, with area times height of plastic. They
    are as wide as the gap. Gaps narrower than LEAST_GAP of a line stay open.
    """
    spacing, widest_mm = spacing_mm(line_width_mm, height_mm), MOST_WIDTH * line_width_mm
    rule = Rule(ROUNDS, MOST_WIDTH / SPLIT * spacing, spacing, 0.0, LEAST_GAP * line_width_mm, spacing_mm(widest_mm, height_mm))
    filled = [place for place in places if not place.is_empty()]
    beads: list[Bead] = []
    for piece, there in groupby(variable_walls(filled, rule), key=lambda wall: wall.piece):
        courses = [wall.course for wall in there if length_mm(wall.course) > SHORTEST * line_width_mm]
        covered_mm2 = sum(mean_width_mm(course) * length_mm(course) for course in courses)
        wider = min(filled[piece].area() / covered_mm2, MOST_WIDER) if courses else 1.0
        for course in courses:
            course[:, 2] = np.minimum(wider * course[:, 2] + line_width_mm - spacing, widest_mm)
            points = np.ascontiguousarray(course[:, :2])
            beads.append(Bead(Kind.GAP, points, mean_width_mm(course), RANK, course=varying(course)))
    return beads


def uncovered_area(area: Polygons, lines: Sequence[Floats], width_mm: float, few: float = FEW) -> Polygons:
    """The part of an area that lines of a width leave uncovered, as far as plastic fits into it. few: of the width squared;
    smaller gaps are left out.
    """
    few_mm2 = few * width_mm**2
    rest = area if area.area() < few_mm2 or not lines else area - strips(lines, 0.5 * width_mm)
    return larger(opening(larger(rest, few_mm2), 0.5 * LEAST_GAP * width_mm), few_mm2)


def fuzzy_walls(beads: Sequence[Bead], process: Process, joints: Sequence[Polygons], seed: tuple[int, int]) -> list[Bead]:
    """The beads of a layer, started at their seams, with fuzzy skin: the points of walls are moved at random, which hides the
    layers.

    A wall is resampled at random distances, and every point moved across it, as in PrusaSlicer (PerimeterGenerator.cpp,
    fuzzy_polygon). Its ends stay, so seams stay hidden. joints: the areas of other parts in this layer and its neighbours, beside
    which walls stay smooth; seed: numbers of part and layer, so that the result does not depend on the number of cores.
    """
    reach_mm = process.line_width_mm + process.fuzzy_skin_thickness_mm
    even = index_edges(offset(union(joints), reach_mm) if joints else Polygons())
    rough = list(beads)
    for k, bead in enumerate(beads):
        is_outside = bead.kind is Kind.OUTER_WALL and (process.fuzzy_skin != "external" or area_mm2(bead.points) > 0.0)
        if not bead.line and (is_outside or (bead.kind is Kind.INNER_WALL and process.fuzzy_skin == "allwalls")):
            rough[k] = replace(bead, points=_roughened(bead.points, process, even, (*seed, k)))
    return rough


def _roughened(points: Floats, process: Process, even: EdgeIndex, seed: tuple[int, ...]) -> Floats:
    """A wall (n, 2) resampled outside the area, given by its edges, in which it stays smooth."""
    random, apart_mm = np.random.default_rng(seed), process.fuzzy_skin_point_distance_mm
    steps, along = np.diff(points, axis=0), along_mm(points)
    most = int(along[-1] / ((1.0 - SPREAD) * apart_mm)) + 1
    sampled = np.cumsum(apart_mm * random.uniform(1.0 - SPREAD, 1.0 + SPREAD, most))
    sampled = sampled[sampled < along[-1] - (1.0 - SPREAD) * apart_mm]
    if len(sampled) < FEWEST:
        return points
    moved_mm = process.fuzzy_skin_thickness_mm * random.uniform(-1.0, 1.0, len(sampled))
    step = np.minimum(np.searchsorted(along, sampled, side="right") - 1, len(steps) - 1)
    lengths = np.maximum(np.diff(along), 1e-9)
    tangent = steps[step] / lengths[step, None]
    at = points[step] + (sampled - along[step])[:, None] * tangent
    rough = at + moved_mm[:, None] * np.column_stack([tangent[:, 1], -tangent[:, 0]])
    stays, goes = depths(points, even) > 0.0, depths(at, even) <= 0.0
    stays[[0, -1]] = True
    order = np.argsort(np.concatenate([along[stays], sampled[goes]]), kind="stable")
    return np.ascontiguousarray(np.concatenate([points[stays], rough[goes]])[order])
