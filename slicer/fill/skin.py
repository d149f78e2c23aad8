"""Skin: solid fill by lines at alternating +-45 degrees, and by short beads where no such line fits."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from mdp.mesh import Floats
from slicer.bead import Bead, spacing_mm
from slicer.fill.anchor import Limits, anchor_lines
from slicer.fill.monotonic import monotonic_lines
from slicer.fill.pattern import MARGIN_MM, Box, Draw, Lines, clip_pattern, horizontal_lines
from slicer.geometry.edge_index import index_edges
from slicer.geometry.polygons import Polygons, islands, larger, offset, opening, strips
from slicer.geometry.polyline import length_mm
from slicer.paths import Kind
from slicer.walls.walls import LEAST_GAP, gaps

JOIN = 4.0  # spacings along the border: line ends nearer than this are joined
EDGE = 0.15  # spacings that the outermost lines keep from the extreme points, where a line would only touch
RANK = 2  # behind gaps (slicer.walls.walls), before infill
FEW_MM2 = 0.6  # of the line width squared: a smaller place beside the lines stays empty, it is not worth the travel
# Of 2,250 skins of bracket, tree, figure and the bunny (as they stand, default process, commit 5c72b83f) 90 of 100 ask for 0.82
# to 1.06. What asks for less or more are specks whose lines hardly fit.
LEAST_FLOW, MOST_FLOW = 0.85, 1.15


@dataclass(frozen=True)
class SolidLines:
    """How an area is filled completely: direction, width and height of the lines, and how they meet what is around.

    overlap: their reach into the walls around, share of a line width. in_order: every line is printed on the same side of its
    neighbour.
    """

    angle_deg: float
    width_mm: float
    height_mm: float
    overlap: float = 0.0
    in_order: bool = False

    @property
    def spacing_mm(self) -> float:
        """Distance of neighbouring lines."""
        return spacing_mm(self.width_mm, self.height_mm)


def skin_beads(area: Polygons, kind: Kind, solid: SolidLines) -> list[Bead]:
    """Beads that fill an area completely: lines, and what fills the places that they leave."""
    beads, rests = skin_lines(area, kind, solid)
    return beads + gaps(rests, solid.width_mm, solid.height_mm)


def skin_lines(area: Polygons, kind: Kind, solid: SolidLines) -> tuple[list[Bead], list[Polygons]]:
    """The lines that fill an area, those of each connected piece spread evenly, and the places that they leave in each.

    The flow makes the plastic equal to area times height, so that neither the joints at the line ends nor the overlap over-fill
    it.
    """
    spacing, width_mm = solid.spacing_mm, solid.width_mm
    beads, rests = list[Bead](), list[Polygons]()
    for island in islands(area):
        lines = _lines(offset(island, -(0.5 * spacing - solid.overlap * width_mm)), solid)
        rest = uncovered_area(island, lines, width_mm)
        rests.append(rest)
        total = sum(length_mm(line) for line in lines)
        if total > 0:
            flow = min(max((island.area() - rest.area()) / (total * spacing), LEAST_FLOW), MOST_FLOW)
            beads += [Bead(kind, line, width_mm, RANK, flow, follows=solid.in_order and k > 0) for k, line in enumerate(lines)]
    return beads, rests


def _lines(inner: Polygons, solid: SolidLines) -> list[Floats]:
    """The centrelines that fill a piece; inner: as far as they reach."""
    if inner.is_empty():
        return []
    border = index_edges(inner)
    pieces = clip_pattern(border, solid.angle_deg, _even(solid.spacing_mm))
    joint_mm = JOIN * solid.spacing_mm
    if solid.in_order:
        lines = monotonic_lines(pieces, border, solid.angle_deg, solid.spacing_mm, joint_mm)
    else:
        lines = anchor_lines(pieces, border, Limits(0.0, joint_mm, 0.0))
    return [line for line in lines if length_mm(line) > 0.5 * solid.width_mm]


def uncovered_area(area: Polygons, lines: Sequence[Floats], width_mm: float) -> Polygons:
    """What of an area lines of that width do not cover, as far as plastic fits into it."""
    few_mm2 = FEW_MM2 * width_mm**2
    rest = area if area.area() < few_mm2 or not lines else area - strips(lines, 0.5 * width_mm)
    return larger(opening(larger(rest, few_mm2), 0.5 * LEAST_GAP * width_mm), few_mm2)


def angle_of_layer_deg(infill_angle_deg: float, layer: int) -> float:
    """Direction of the skin lines of a layer: neighbours cross at right angles."""
    return infill_angle_deg + 90.0 * (layer % 2)


def _even(spacing: float) -> Draw:
    """Lines spread evenly over the whole extent, at most a spacing apart."""

    def draw(box: Box) -> Lines:
        low, high, edge = box[1] + MARGIN_MM, box[3] - MARGIN_MM, EDGE * spacing
        between = ceil((high - low - 2.0 * edge) / spacing - 0.01)
        ends = (low + edge, high - edge) if between > 0 else (0.5 * (low + high),) * 2
        return horizontal_lines(np.linspace(*ends, max(between, 0) + 1, dtype=np.float64), box)

    return draw
