"""Beads: pieces of plastic to lay down, before their order, speed and travels are known, and their widths."""

from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np

from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from profiles.process import WIDTHS, Process
from slicer.geometry.polygons import Polygons, offset
from slicer.geometry.polyline import length_mm
from slicer.paths import Kind, bead_area_mm2

WALLS = (Kind.OUTER_WALL, Kind.INNER_WALL, Kind.OVERHANG)
OUTSIDE = -1000  # ranks up to this are not part of an island of the section: skirt, brim, support
BEFORE_WALLS = -500  # beads of this rank come before the walls of their island; walls have higher ranks
FILL, LAST = 1, 99  # beads between these ranks fill the area inside the walls, in any order; ironing comes last
ROUND_SIDES = 1.0 - pi / 4.0  # share of height squared: a square less the two half circles in it, as in PrusaSlicer's Flow
# factor on the line width, one and a half nozzles: a thin bead of this width stays under the flat of the tip
INTERFACE_WIDTH = 4.0 / 3.0
EVEN_MM = 0.03  # widths that differ by less are equal
# line directions that share the density; for curves: cells
FAMILIES = {"grid": 2, "triangles": 3, "cubic": 3, "gyroid": 3, "honeycomb": 3}
NARROWEST = 0.6  # diameters of the nozzle
NOISE_MM = 0.02  # sections of one vertical surface differ by this much after their cleaning


@kernel
def mean_width_mm(course: Floats) -> float:
    """Mean width of a bead along its course (n, 3) of x, y and width."""
    first = course[0, 2]
    more = length = 0.0  # excess over the first width, so that the mean of equal widths is exact
    for k in range(len(course) - 1):
        step = np.hypot(course[k + 1, 0] - course[k, 0], course[k + 1, 1] - course[k, 1])
        more, length = more + (0.5 * (course[k, 2] + course[k + 1, 2]) - first) * step, length + step
    return float(first + more / length) if length > 0.0 else float(first)


def varying(course: Floats) -> Floats | None:
    """The course (n, 3) of a bead if its widths differ by more than EVEN_MM, else None."""
    return course if float(np.ptp(course[:, 2])) > EVEN_MM else None


@dataclass(frozen=True, eq=False)
class Bead:
    """A bead. points: (n, 2) mm, a closed bead repeats its first point.

    rank: beads of an island are printed by ascending rank; those of rank 0 and below are its walls and stay together around each
    outer wall, beads below all ranks of walls come before them. over_infill: a bridge over the sparse infill of the layer below,
    with its own speed and fan. follows: printed right after the previous bead in the list. line: a wall that is not a loop.
    anchor_mm: greatest length of an infill line along walls at its ends. course: (k, 3) x, y and width if the width varies;
    width_mm is then the mean, and the points lie on the course.
    """

    kind: Kind
    points: Floats
    width_mm: float
    rank: int
    flow: float = 1.0
    over_infill: bool = False
    follows: bool = False
    line: bool = False
    anchor_mm: float = 0.0
    course: Floats | None = None

    @property
    def closed(self) -> bool:
        """Whether the bead is a closed loop."""
        return len(self.points) > 3 and bool((self.points[0] == self.points[-1]).all())

    @property
    def one_way(self) -> bool:
        """Whether the bead has a fixed starting point, as walls have at their seam."""
        return self.closed or (self.kind in WALLS and not self.line)

    @cached_property
    def length_mm(self) -> float:
        """Length of the bead, mm."""
        return length_mm(self.points)

    def is_small(self, small_wall_mm: float) -> bool:
        """Whether the bead is a loop, except for the gap at its seam, no longer than small_wall_mm."""
        ends = self.points[-1] - self.points[0]
        return bool(np.hypot(ends[0], ends[1]) <= self.width_mm) and self.length_mm <= small_wall_mm


def spacing_mm(width_mm: float, height_mm: float) -> float:
    """Distance of neighbouring beads at which their rounded sides leave no gap, mm: cross-section / height.

    >>> round(spacing_mm(0.45, 0.2), 3)
    0.407
    """
    return width_mm - height_mm * ROUND_SIDES


def infill_cell_mm(process: Process) -> float:
    """Approximate distance of lines of the sparse infill, mm, which solid lines over it have to bridge; 0 without infill."""
    width = process.infill_line_width_mm or process.line_width_mm
    spacing, density = spacing_mm(width, process.layer_height_mm), process.infill_density
    return FAMILIES.get(process.infill_pattern, 1) * spacing / density if density > 0.0 else 0.0


def support_cell_mm(process: Process) -> float:
    """Distance of sparse lines of support, mm, which dense lines over them have to bridge."""
    spacing = spacing_mm(process.support_line_width_mm or process.line_width_mm, process.layer_height_mm)
    return (1.0 if process.support_pattern == "lines" else 2.0) * spacing / process.support_density


def least_width_mm(nozzle_mm: float, height_mm: float) -> float:
    """Width of the narrowest bead, mm."""
    return max(NARROWEST * nozzle_mm, height_mm)


def wall_rank(level: int, process: Process) -> int:
    """Rank of a wall by its level, counted from outside."""
    return -level if process.wall_order == "inner-first" else level - process.walls


def hanging_area(section: Polygons, below: Polygons, share: float, width_mm: float) -> Polygons:
    """Area in which the centreline of a bead has less than a share of its width on the layer below."""
    return section - offset(below, (0.5 - share) * width_mm + NOISE_MM)


def bulge_flow(width_mm: float, height_mm: float, free_sides: int, most_mm: float) -> float:
    """Flow of a bead that fills the rectangle of its width on its free sides, which no other bead covers.

    The bead bulges by at most most_mm: half of height times (1 - pi/4) would fill the rectangle.
    """
    bulge = min(0.5 * height_mm * ROUND_SIDES, most_mm)
    return 1.0 + free_sides * bulge * height_mm / bead_area_mm2(width_mm, height_mm)


def with_line_width(process: Process, width_mm: float | None) -> Process:
    """The process with another line width; unchanged for None."""
    return process if width_mm is None else process.model_copy(update={"line_width_mm": width_mm})


def first_layer_process(process: Process) -> Process:
    """The process of the first layer on the plate: with one wall if only_one_wall_first_layer is set, and one width for all beads
    if first_layer_line_width_mm is set.
    """
    if process.only_one_wall_first_layer:
        process = process.model_copy(update={"walls": min(process.walls, 1)})
    if process.first_layer_line_width_mm is None:
        return process
    return with_line_width(process.model_copy(update=dict.fromkeys(WIDTHS)), process.first_layer_line_width_mm)


def interface_process(process: Process) -> Process:
    """The process of a first layer on plastic, with one width for all beads."""
    width_mm = process.interface_line_width_mm or INTERFACE_WIDTH * process.line_width_mm
    more = process.interface_extra_walls if process.walls else 0
    return with_line_width(process.model_copy(update=dict.fromkeys(WIDTHS) | {"walls": process.walls + more}), width_mm)


def outer_wall_width_mm(process: Process) -> float:
    """Width of an outer wall, mm."""
    return process.outer_wall_line_width_mm or process.line_width_mm
