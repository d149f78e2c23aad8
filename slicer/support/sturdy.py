"""Sturdy support: thickening of pieces that are too slender for the support above them, and hollow printing of thick ones.

A piece is a connected area of one layer. The height of support above it gives its required diameter (least_diameter_mm): the
diameter of a branch, which grows downward by an angle, and at least a fixed share of that height. A thinner piece grows into the
free area beside the part, on all sides or, close to the part, on the free sides only. Branches are routed before they are
thickened, so thickness never costs an overhang its support. Branches that have met form one piece.
"""

from collections.abc import Sequence
from itertools import compress
from math import pi, radians, sqrt, tan
from typing import NamedTuple

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import spacing_mm, support_cell_mm
from slicer.geometry.polygons import Polygons, bounding_box, islands, offset, union
from slicer.support.reachable import BEYOND, COARSE_MM, ReachableAreas, dilate, drop_slivers

SLENDER = 12.0  # greatest height above a piece, in diameters of the piece; taller support sways under the nozzle
LONG = 3.0  # distances between sparse lines; in a longer piece a zigzag would rest on the walls only at its turns, and sag
TRIES = 5  # steps of a distance over which a piece grows into the free area beside it


class Piece(NamedTuple):
    """A connected area of a layer's support, before (thin) and after (area) it grows. top_mm: z of the top of its support."""

    thin: Polygons
    area: Polygons
    top_mm: float


def touching(piece: Polygons, others: Sequence[Polygons], boxes: Floats) -> list[int]:
    """The indices of the areas that a piece overlaps. boxes: (n, 4) their bounding boxes."""
    x0, y0, x1, y1 = piece.bounds()
    near = (boxes[:, 0] < x1) & (boxes[:, 2] > x0) & (boxes[:, 1] < y1) & (boxes[:, 3] > y0)
    return [k for k in np.flatnonzero(near).tolist() if not (others[k] ^ piece).is_empty()]


def least_diameter_mm(above_mm: float, process: Process) -> float:
    """The diameter, mm, of a circle with the area that a piece needs to carry support above_mm high."""
    top_mm = process.support_branch_mm
    tapered = top_mm + 2.0 * above_mm * tan(radians(process.support_branch_diameter_angle_deg))
    return max(min(tapered, max(process.support_trunk_mm, top_mm)), above_mm / SLENDER)


def thicken(bodies: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """The support of every layer with thin pieces grown. Added area is within the lean of the layer below or stands on
    something.
    """
    above: list[Piece] = []
    wide: list[Polygons] = list(bodies)
    for m in range(len(bodies) - 1, -1, -1):
        thin, boxes = [piece.thin for piece in above], np.array([piece.thin.bounds() for piece in above]).reshape(-1, 4)
        pieces = islands(bodies[m])
        above = [_grown(piece, [above[k] for k in touching(piece, thin, boxes)], areas, m) for piece in pieces]
        if any(piece.area is not piece.thin for piece in above):
            wide[m] = union([piece.area for piece in above])
    for m in range(1, len(bodies)):
        if wide[m] is not bodies[m]:
            loose = _loose(bodies[m], wide[m], wide[m - 1], areas, m)
            if not loose.is_empty():
                wide[m] = (bodies[m] + (wide[m] - loose)).simplify(COARSE_MM)
    return wide


def _grown(thin: Polygons, over: Sequence[Piece], areas: ReachableAreas, m: int) -> Piece:
    """Grow a piece of layer m if it is too thin for the support over it, and under the grown area of the pieces over it."""
    if not over:
        return Piece(thin, thin, float(areas.heights.tip_mm[m]))
    top_mm = max(piece.top_mm for piece in over)
    least_mm = least_diameter_mm(top_mm - float(areas.heights.bottom_mm[m]), areas.process)
    lacking_mm, grown = 0.5 * (least_mm - 2.0 * sqrt(thin.area() / pi)), [piece for piece in over if piece.area is not piece.thin]
    if lacking_mm <= 0.0 and not grown:
        return Piece(thin, thin, top_mm)
    room = dilate(areas.reachable[m] ^ bounding_box(thin, least_mm + areas.radius_mm), areas.radius_mm)
    area = thin
    if grown:
        lean_mm, near = float(areas.lean_mm[m + 1]), room ^ bounding_box(thin, least_mm)
        beneath = dilate(thin, lean_mm)
        # The original area of the pieces above keeps the support below that it already has; only their added area needs more.
        hung = union([offset(piece.area, -lean_mm) - (piece.thin - beneath) for piece in grown])
        area = _with_touching(thin, hung ^ near, thin)
    if lacking_mm > 0.0:
        area = _filled(area, thin, room, lacking_mm, least_mm)
    return Piece(thin, area.simplify(COARSE_MM), top_mm)


def _with_touching(area: Polygons, about: Polygons, thin: Polygons) -> Polygons:
    """An area with a thin piece in it, united with those islands of another area that overlap the piece."""
    pieces = [about] if about.num_contour() == 1 else islands(about)
    return union([area, *(piece for piece in pieces if not (piece ^ thin).is_empty())])


def _filled(area: Polygons, thin: Polygons, room: Polygons, lacking_mm: float, least_mm: float) -> Polygons:
    """An area united with the free area around a thin piece until it is as large as a circle of diameter least_mm.

    lacking_mm: the radius that the piece lacks, the first distance to try. Growth ends least_mm from the piece.
    """
    least_mm2, distance_mm, step_mm, before_mm2 = 0.25 * pi * least_mm**2, lacking_mm, lacking_mm, thin.area()
    filled, mm2 = area, area.area()
    for _ in range(TRIES if mm2 < least_mm2 else 0):
        filled = _with_touching(area, dilate(thin, distance_mm) ^ room, thin)
        mm2 = filled.area()
        if mm2 >= least_mm2 or distance_mm >= least_mm:
            break
        # Extrapolate: as many more steps as the missing area needs if each adds as much as the last one.
        more_mm = 1.02 * step_mm * (least_mm2 - mm2) / max(mm2 - before_mm2, 0.1 * mm2)
        step_mm, before_mm2 = min(more_mm, least_mm - distance_mm), mm2
        distance_mm += step_mm
    return filled


def _loose(body: Polygons, wide: Polygons, below: Polygons, areas: ReachableAreas, m: int) -> Polygons:
    """The added area of layer m that neither lies within the lean of the layer below nor stands on something.

    Only pieces thinner than a branch and pieces that begin in this layer may grow onto something to stand on.
    """
    lean_mm, branch_mm, added = float(areas.lean_mm[m]), areas.process.support_branch_mm, wide - below
    loose = added if below.is_empty() else drop_slivers(added - dilate(below, lean_mm))
    if loose.is_empty() or areas.placeable[m].is_empty():
        return loose
    needles = [piece for piece in islands(body) if piece.area() < 0.25 * pi * branch_mm**2 or (piece ^ below).is_empty()]
    if not needles:
        return loose
    beside = areas.placeable[m] ^ union([bounding_box(piece, branch_mm) for piece in needles])
    return loose - dilate(beside, (1.0 - BEYOND) * areas.radius_mm)


def hollow_places(printed: Sequence[Polygons], dense: Sequence[Polygons], process: Process) -> list[Polygons]:
    """The pieces of each layer's support that are printed as walls without lines inside.

    printed, dense: one area per layer. A piece is filled if it is wider than the distance between sparse lines and lies under
    filled or dense support of the layer above. A short, narrower piece is filled only directly under dense support, whose lines
    may run along it. A long one is filled like a wide one: the zigzag in the layer above it would touch walls at its turns only,
    and hang over all of the piece's length. Without walls no piece is hollow.
    """
    hollow, filled = [Polygons()] * len(printed), Polygons()
    if process.support_walls == 0:
        return hollow
    spacing, cell_mm = spacing_mm(process.line_width_mm, process.layer_height_mm), support_cell_mm(process)
    walls_mm, dense_above = process.support_walls * spacing, Polygons()
    for m in range(len(printed) - 1, -1, -1):
        pieces, under_lines = islands(printed[m]), filled + dense_above
        has_lines = [_has_lines(piece, piece ^ under_lines, dense_above, walls_mm, cell_mm) for piece in pieces]
        hollow[m] = union([piece for piece, filling in zip(pieces, has_lines, strict=True) if not filling])
        filled, dense_above = union(list(compress(pieces, has_lines))), dense[m]
    return hollow


def _has_lines(piece: Polygons, lying: Polygons, dense_above: Polygons, walls_mm: float, cell_mm: float) -> bool:
    """Whether lines are printed inside a piece. lying: its area under lines of the layer above."""
    x0, y0, x1, y1 = piece.bounds()
    long_mm = max(x1 - x0, y1 - y0) - 2.0 * walls_mm
    if lying.is_empty() or long_mm <= cell_mm:
        return False
    is_wide = long_mm > LONG * cell_mm or not offset(piece, -walls_mm - 0.5 * cell_mm).is_empty()
    return is_wide or not (lying ^ dense_above).is_empty()
