"""Skin: solid fill by lines at alternating +-45 degrees or along the outline, by short beads where none fits, and ironing.

Monotonic skins are printed in such an order that every line lies on the same side of its neighbour: where lines meet from both
sides of a hole the sheen of a skin changes and a ridge may stand. So lines are taken together in cells, in which each has one
neighbour above and one below; a cell waits for the cells that its first line lies beside. In ironing the nozzle goes once more
over tops that stay visible, in dense lines that hardly push any plastic.
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

JOIN = 12.0  # spacings along the border: line ends nearer than this are joined
EDGE = 0.15  # spacings that the outermost lines keep from the extreme points, where a line would only touch
TIP = 0.27  # and from a corner, where it would be a mere dot
RANK = 2  # behind gaps (slicer.walls.walls), before infill
TOUCHING = 0.01  # of the spacing: neighbouring lines overlap by this at least, however little flow a skin asks for
MOST_FLOW = 1.15  # only specks whose lines hardly fit ask for more
LEVEL = 0.1  # of a spacing: heights nearer to each other are one row
FEW_HIDDEN = 1.0  # of the line width squared: a smaller place beside lines that nobody sees stays open
SINGLE_MM = 1e-6  # a path whose ends differ less in height is one line, which may be printed from either end


@dataclass(frozen=True)
class SolidLines:
    """How an area is filled completely: direction, width and height of the lines, and how they meet what is around.

    overlap: their reach into the walls around, share of a line width. pattern: monotonic, every line on the same side of its
    neighbour; rectilinear, in any order; or concentric, without a direction. seen: from above or below, so that lines reach into
    what stays open beside them, and small places are filled, too.
    """

    angle_deg: float
    width_mm: float
    height_mm: float
    overlap: float = 0.0
    pattern: SkinPattern = "rectilinear"
    seen: bool = False

    @property
    def spacing_mm(self) -> float:
        """Distance of neighbouring lines."""
        return spacing_mm(self.width_mm, self.height_mm)

    @property
    def reach_mm(self) -> float:
        """How far inside the area the lines end."""
        return 0.5 * self.spacing_mm - self.overlap * self.width_mm


def lines_angle_deg(process: Process, layer: int) -> float:
    """Direction of the solid lines of a layer: neighbouring layers cross at right angles."""
    return process.infill_angle_deg + 90.0 * (layer % 2)


def skin_beads(area: Polygons, kind: Kind, solid: SolidLines) -> list[Bead]:
    """Beads that fill an area completely: lines, and what fills the places that they leave."""
    beads, rests = skin_lines(area, kind, solid)
    return beads + gaps(rests, solid.width_mm, solid.height_mm)


def skin_lines(area: Polygons, kind: Kind, solid: SolidLines) -> tuple[list[Bead], list[Polygons]]:
    """The lines that fill an area, those of each connected piece spread evenly, and the places that they leave in each.

    The flow makes the plastic equal to area times height, so that neither the joints at the line ends nor the overlap over-fill
    it. Where lines would no longer touch each other for that, in narrow places that are all line ends, they reach half as far.
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
    """The lines of a connected piece, the places that they leave, and the flow that fills the rest; 0 without lines."""
    lines = _lines(offset(island, -solid.reach_mm), solid)
    rest = uncovered_area(island, lines, solid.width_mm, FEW if solid.seen else FEW_HIDDEN)
    total = sum(length_mm(line) for line in lines)
    return lines, rest, (island.area() - rest.area()) / (total * solid.spacing_mm) if lines else 0.0


def _lines(inner: Polygons, solid: SolidLines) -> list[Floats]:
    """The centrelines that fill a piece; inner: as far as they reach."""
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
    """Spacings that the lowest and the highest line should keep from the extreme points: more where they are dots in a corner."""
    ends = pieces.points.reshape(-1, 2, 2) @ rotation_2d(solid.angle_deg)
    long, height = np.abs(ends[:, 1, 0] - ends[:, 0, 0]), ends[:, 0, 1]
    rows = height < height.min() + LEVEL * solid.spacing_mm, height > height.max() - LEVEL * solid.spacing_mm
    low, high = (TIP if long[row].max() < 0.5 * solid.width_mm else EDGE for row in rows)
    return low, high


def _even(spacing: float, edges: tuple[float, float]) -> Draw:
    """Lines spread evenly over the whole extent, at most a spacing apart; edges: spacings from its ends."""

    def draw(box: Box) -> Lines:
        low, high = box[1] + MARGIN_MM + edges[0] * spacing, box[3] - MARGIN_MM - edges[1] * spacing
        between = ceil((high - low) / spacing - 0.01)
        ends = (low, high) if between > 0 else (0.5 * (low + high),) * 2
        return horizontal_lines(np.linspace(*ends, max(between, 0) + 1, dtype=np.float64), box)

    return draw


def _cells(pieces: Pieces, angle_deg: float, spacing_mm: float) -> tuple[Indices, list[set[int]]]:
    """(k,) the cell of each straight piece, numbered by the row of their first line, and of each cell those that come before it,
    all of them lower numbers."""
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
    """(k,) number of the row of each height; rows are evenly apart, but some may be empty."""
    order = np.argsort(height_mm, kind="stable")
    steps = np.diff(height_mm[order])
    steps[steps < LEVEL * spacing_mm] = 0.0
    if steps.any():
        steps = np.rint(steps / steps[steps > 0.0].min())
    row = np.zeros(len(order), np.int64)
    row[order[1:]] = np.cumsum(steps)
    return row


def _order_lines(by_cell: Sequence[list[Floats]], before: Sequence[set[int]], turned: Floats) -> list[Floats]:
    """Cell after cell, of those that wait for none the nearest; upward inside each."""
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
            single = abs(float((line[-1] - line[0]) @ turned[:, 1])) < SINGLE_MM  # which a path upward is not
            turns = out and single and np.hypot(*(line[-1] - out[-1][-1])) < np.hypot(*(line[0] - out[-1][-1]))
            out.append(line[::-1] if turns else line)
        for later in after[cell]:
            waits[later] -= 1
            if not waits[later]:
                ready.append(later)
    return out
