"""Skin: solid fill by lines at alternating +-45 degrees or along the outline, gap fill by short beads, and ironing.

Monotonic skins are printed in an order in which every line lies on the same side of its neighbour: where lines meet from both
sides of a hole, the sheen of a skin would change and a ridge might form. So lines are grouped in cells, in which each has one
neighbour above and one below; a cell waits for the cells beside its first line. In ironing, the nozzle passes once more over
visible tops, in dense lines with hardly any extrusion.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from mdp.mesh import Floats, Indices
from profiles.process import Process
from profiles.settings.layers import SkinPattern
from slicer.bead import ROUND_SIDES, Bead, spacing_mm
from slicer.fill.lines import MARGIN_MM, Box, Draw, Lines, anchor_lines, clip_pattern, concentric_lines, horizontal_lines
from slicer.geometry.clip import Pieces, rotation_2d
from slicer.geometry.edge_index import index_edges
from slicer.geometry.polygons import Polygons, islands, offset
from slicer.geometry.polyline import length_mm
from slicer.paths import Kind
from slicer.walls.walls import FEW, gaps, uncovered_area

JOIN = 12.0  # spacings along the border: closer line ends are joined
EDGE = 0.15  # spacings between the outermost lines and the extreme points, where a line would only touch
TIP = 0.27  # and from a corner, where it would be only a dot
RANK = 2  # after gaps (slicer.walls.walls), before infill
TOUCHING = 0.01  # share of the spacing: least overlap of neighbouring lines, however low a skin's flow
MOST_FLOW = 1.15  # only specks with hardly any room for lines need more
LEVEL = 0.1  # share of a spacing: heights that differ less are one row
FEW_HIDDEN = 1.0  # share of the line width squared: a smaller gap beside invisible lines stays open
SINGLE_MM = 1e-6  # a path whose ends differ less in height is a single line, which may be printed from either end


@dataclass(frozen=True)
class SolidLines:
    """Solid fill of an area: direction, width and height of the lines, and their connection with the surroundings.

    overlap: overlap with the walls around, as a share of a line width. pattern: monotonic, every line on the same side of its
    neighbour; rectilinear, in any order; or concentric, without a direction. seen: visible from above or below, so that lines
    extend into wedges beside them, and small gaps are filled, too.
    """

    angle_deg: float
    width_mm: float
    height_mm: float
    overlap: float = 0.0
    pattern: SkinPattern = "rectilinear"
    seen: bool = False

    @property
    def spacing_mm(self) -> float:
        """Distance of neighbouring lines, mm."""
        return spacing_mm(self.width_mm, self.height_mm)

    @property
    def reach_mm(self) -> float:
        """Inset of line ends from the border of the area, mm."""
        return 0.5 * self.spacing_mm - self.overlap * self.width_mm


def lines_angle_deg(process: Process, layer: int) -> float:
    """Direction of the solid lines of a layer; neighbouring layers cross at right angles."""
    return process.infill_angle_deg + 90.0 * (layer % 2)


def skin_beads(area: Polygons, kind: Kind, solid: SolidLines) -> list[Bead]:
    """Beads that fill an area completely: lines, and gap fill beside them."""
    beads, rests = skin_lines(area, kind, solid)
    return beads + gaps(rests, solid.width_mm, solid.height_mm)


def skin_lines(area: Polygons, kind: Kind, solid: SolidLines) -> tuple[list[Bead], list[Polygons]]:
    """The lines that fill an area, evenly spread in each connected piece, and the gaps left in each.

    The flow makes the plastic equal to area times height, so that neither the joints at the line ends nor the overlap overfill
    it. In narrow areas that consist of line ends, where lines would then no longer touch each other, the overlap is halved.
    """
    in_order = solid.pattern == "monotonic"
    beads, rests = list[Bead](), list[Polygons]()
    least_flow = 1.0 + TOUCHING - solid.height_mm * ROUND_SIDES / solid.spacing_mm
    for island in islands(area):
        lines, rest, flow = _filled(island, solid)
        if lines and flow < least_flow and solid.overlap > 0.0:
            lines, rest, flow = _filled(island, replace(solid, overlap=0.5 * solid.overlap))
        rests.append(rest)
        flow = min(max(flow, least_flow), MOST_FLOW)
        beads += [Bead(kind, line, solid.width_mm, RANK, flow, follows=in_order and k > 0) for k, line in enumerate(lines)]
    return beads, rests


def _filled(island: Polygons, solid: SolidLines) -> tuple[list[Floats], Polygons, float]:
    """The lines of a connected piece, the gaps that they leave, and the flow that fills the rest; 0 without lines."""
    lines = _lines(offset(island, -solid.reach_mm), solid)
    rest = uncovered_area(island, lines, solid.width_mm, FEW if solid.seen else FEW_HIDDEN)
    total = sum(length_mm(line) for line in lines)
    return lines, rest, (island.area() - rest.area()) / (total * solid.spacing_mm) if lines else 0.0


def _lines(inner: Polygons, solid: SolidLines) -> list[Floats]:
    """The centrelines that fill a piece. inner: the area for centrelines."""
    if inner.is_empty():
        return []
    if solid.pattern == "concentric":
        return concentric_lines(inner, solid.spacing_mm)
    border = index_edges(inner)
    pieces = clip_pattern(border, solid.angle_deg, _even(solid.spacing_mm, (EDGE, EDGE)))
    edges = _edges(pieces, solid) if len(pieces.ends) else (EDGE, EDGE)
    if max(edges) > EDGE:
        pieces = clip_pattern(border, solid.angle_deg, _even(solid.spacing_mm, edges))
    if not len(pieces.ends):
        return []
    in_order = solid.pattern == "monotonic"
    cell, before = _cells(pieces, solid.angle_deg, solid.spacing_mm) if in_order else (None, [])
    reach_mm = (solid.spacing_mm, solid.reach_mm) if solid.seen else (0.0, 0.0)
    lines, of = anchor_lines(pieces, border, (JOIN * solid.spacing_mm, 0.0, 0.0), reach_mm, cell)
    if in_order and len(lines) > 1:
        by_cell: list[list[Floats]] = [[] for _ in before]
        for line, own in zip(lines, of.tolist(), strict=True):
            by_cell[own].append(line)
        lines = _order_lines(by_cell, before, rotation_2d(solid.angle_deg))
    return [line for line in lines if length_mm(line) > 0.5 * solid.width_mm]


def _edges(pieces: Pieces, solid: SolidLines) -> tuple[float, float]:
    """Distance of the lowest and the highest line from the extreme points, in spacings: larger if they would be dots in a
    corner.
    """
    ends = pieces.points.reshape(-1, 2, 2) @ rotation_2d(solid.angle_deg)
    long, height = np.abs(ends[:, 1, 0] - ends[:, 0, 0]), ends[:, 0, 1]
    rows = height < height.min() + LEVEL * solid.spacing_mm, height > height.max() - LEVEL * solid.spacing_mm
    low, high = (TIP if long[row].max() < 0.5 * solid.width_mm else EDGE for row in rows)
    return low, high


def _even(spacing: float, edges: tuple[float, float]) -> Draw:
    """Lines spread evenly over the whole extent, at most a spacing apart. edges: margins at its ends, in spacings."""

    def draw(box: Box) -> Lines:
        low, high = box[1] + MARGIN_MM + edges[0] * spacing, box[3] - MARGIN_MM - edges[1] * spacing
        between = ceil((high - low) / spacing - 0.01)
        ends = (low, high) if between > 0 else (0.5 * (low + high),) * 2
        return horizontal_lines(np.linspace(*ends, max(between, 0) + 1, dtype=np.float64), box)

    return draw


def _cells(pieces: Pieces, angle_deg: float, spacing_mm: float) -> tuple[Indices, list[set[int]]]:
    """(k,) the cell of each straight piece, numbered by the row of its first line, and for each cell the cells that come before
    it, all with lower numbers.
    """
    ends = pieces.points.reshape(-1, 2, 2) @ rotation_2d(angle_deg)
    left, right = ends[:, :, 0].min(axis=1), ends[:, :, 0].max(axis=1)
    row = _rows(ends[:, 0, 1], spacing_mm)
    order = np.lexsort((left, row))
    apart = float(right.max() - left.min()) + 1.0
    begin, end = (side[order] - left.min() + apart * row[order] for side in (left, right))
    above = np.searchsorted(end, begin + apart, side="right"), np.searchsorted(begin, end + apart, side="left")
    below = np.searchsorted(end, begin - apart, side="right"), np.searchsorted(begin, end - apart, side="left")
    alone_below = below[1] - below[0] == 1
    of, before = np.full(len(order), -1, np.int64), list[set[int]]()
    for k, (first, last) in enumerate(zip(*(side.tolist() for side in above), strict=True)):
        if of[k] < 0:
            of[k] = len(before)
            before.append({int(of[j]) for j in range(below[0][k], below[1][k])})
        if last - first == 1 and alone_below[first]:
            of[first] = of[k]
    out = np.empty_like(of)
    out[order] = of
    return out, before


def _rows(height_mm: Floats, spacing_mm: float) -> Indices:
    """(k,) row number of each height; rows are evenly spaced, and some may be empty."""
    order = np.argsort(height_mm, kind="stable")
    steps = np.diff(height_mm[order])
    steps[steps < LEVEL * spacing_mm] = 0.0
    if steps.any():
        steps = np.rint(steps / steps[steps > 0.0].min())
    row = np.zeros(len(order), np.int64)
    row[order[1:]] = np.cumsum(steps)
    return row


def _order_lines(by_cell: Sequence[list[Floats]], before: Sequence[set[int]], turned: Floats) -> list[Floats]:
    """Order the lines cell by cell, next the nearest cell that waits for no other; upward within each cell."""
    upward = [[line if (line[-1] - line[0]) @ turned[:, 1] > -SINGLE_MM else line[::-1] for line in lines] for lines in by_cell]
    rising = [sorted(lines, key=lambda line: float(line[0] @ turned[:, 1])) for lines in upward]
    waits = [len(earlier) for earlier in before]
    after: list[list[int]] = [[] for _ in rising]
    for cell, earlier in enumerate(before):
        for first in earlier:
            after[first].append(cell)
    ready, out = [cell for cell, count in enumerate(waits) if not count], list[Floats]()
    while ready:
        cell = min(ready, key=lambda cell: float(np.hypot(*(rising[cell][0][0] - out[-1][-1])))) if out else ready[0]
        ready.remove(cell)
        for line in rising[cell]:
            single = abs(float((line[-1] - line[0]) @ turned[:, 1])) < SINGLE_MM  # an upward path is not a single line
            turns = out and single and np.hypot(*(line[-1] - out[-1][-1])) < np.hypot(*(line[0] - out[-1][-1]))
            out.append(line[::-1] if turns else line)
        for later in after[cell]:
            waits[later] -= 1
            if not waits[later]:
                ready.append(later)
    return out
