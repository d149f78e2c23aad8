"""Shell: what one layer of a part prints of it: walls, the gaps they leave, skin and sparse infill, as shapes without beads."""

from dataclasses import dataclass

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import outer_wall_width_mm, spacing_mm
from slicer.fill.region import sparse_area
from slicer.geometry.polygons import Polygons, contours, edges, islands, offset, opening
from slicer.geometry.polyline import PATH_RESOLUTION_MM
from slicer.walls.gap import LEAST_GAP

LEAST_LINE = 0.35  # of the line width: a thinner place of the section hardly ever gets a bead
LEAST_REST_MM2 = 0.3  # smaller places between the walls hardly ever get a bead


@dataclass(frozen=True)
class Extent:
    """How large an area is: mm2, mm of boundary, connected pieces."""

    area_mm2: float
    boundary_mm: float
    pieces: int


NOTHING = Extent(0.0, 0.0, 0)


@dataclass(frozen=True, eq=False)
class Shell:
    """walls[k]: centrelines of wall k from outside, (n, 2) mm; narrow[k]: what wall k leaves; skin, sparse: what is inside.

    ending: the place of inner walls that end on the face of a cut.
    """

    walls: tuple[tuple[Floats, ...], ...]
    narrow: tuple[Extent, ...]
    skin: Extent
    sparse: Extent
    islands: int
    ending: Extent = NOTHING


def extent_of(area: Polygons) -> Extent:
    """The extent of an area."""
    if area.is_empty():
        return NOTHING
    sides = edges(area)
    length = float(np.hypot(sides[:, 2] - sides[:, 0], sides[:, 3] - sides[:, 1]).sum())
    return Extent(area.area(), length, len(islands(area)))


def shell_of(
    section: Polygons,
    process: Process,
    height_mm: float,
    *,
    covered: Polygons | None,
    model: Polygons | None = None,
    ceiling: Polygons | None = None,
) -> Shell:
    """The shell of a section. covered: what the model covers so far above and below that it need not be skin; None: it is solid.

    model: the islands of the model that it is part of, None: it is the model's own; ceiling: what later parts stand on soon.
    """
    rounds = process.walls if model is None else min(process.interface_walls, process.walls)
    loops, narrow, inside = _walls(section, rounds, process, height_mm)
    uncut = inside if model is None else _walls(model, process.walls, process, height_mm)[2]
    ending = NOTHING
    if model is not None:
        ending = extent_of(opening(inside - uncut, 0.25 * process.line_width_mm))
        inside = inside ^ uncut
    sparse = Polygons()
    if covered is not None and not inside.is_empty():
        sparse = sparse_area(uncut, covered, covered, process)
        sparse = sparse if model is None else sparse ^ inside
        sparse = sparse if ceiling is None or ceiling.is_empty() else sparse - ceiling
    skin = inside if sparse.is_empty() else inside - sparse
    pieces = len(islands(section))
    return Shell(loops, narrow, extent_of(skin), extent_of(sparse), pieces, ending)


def _walls(
    section: Polygons, count: int, process: Process, height_mm: float
) -> tuple[tuple[tuple[Floats, ...], ...], tuple[Extent, ...], Polygons]:
    """Centrelines of so many walls, what each leaves, and what they enclose.

    Walls by offsets alone: a wall turns round where there is core behind it, and what neither it nor the core covers is
    narrow (slicer/walls/layer_walls.py has the exact rule).
    """
    loops: list[tuple[Floats, ...]] = []
    narrow: list[Extent] = []
    area = section
    for level in range(count):
        if area.is_empty():
            break
        width = process.line_width_mm if level else outer_wall_width_mm(process)
        spacing = spacing_mm(width, height_mm)
        half = 0.5 * spacing if level else 0.5 * width
        core = offset(area, -half - 0.5 * spacing)
        line = core if core.is_empty() else offset(core, 0.5 * spacing)
        loops.append(tuple(contours(line)))
        covered = core if core.is_empty() else offset(line, half)
        least = (LEAST_GAP if level else LEAST_LINE) * process.line_width_mm
        bare = area.area() - covered.area() > LEAST_REST_MM2
        narrow.append(extent_of(opening(area - covered, 0.5 * least)) if bare else NOTHING)
        area = core.simplify(PATH_RESOLUTION_MM)
    inside = area if area.is_empty() else opening(area, spacing_mm(process.line_width_mm, height_mm))
    if area.area() - inside.area() > LEAST_REST_MM2:
        narrow.append(extent_of(opening(area - inside, 0.5 * LEAST_GAP * process.line_width_mm)))
    return tuple(loops), tuple(narrow), inside
