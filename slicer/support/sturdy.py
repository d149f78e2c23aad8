"""Sturdy: pieces of support are thick enough for what stands on them, as far as there is room, and hollow where that will do.

What is printed of a tree or a column is seen here as pieces, the connected places of a layer, with the height to which support
goes on above each. From it follows the diameter that a piece should have (least_diameter_mm): it grows downward from a branch's
by an angle, and is never less than a share of that height. A thinner piece is grown into the room beside the part, all round or,
where the part is near, on the side that is free. So a branch finds its way as thin as it may be, and thick plastic costs no
place its support: pieces of two branches that have met count as one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, radians, sqrt, tan

from profiles.process import Process
from slicer.bead import spacing_mm
from slicer.geometry.polygons import Polygons, bounding_box, islands, offset, union
from slicer.support.reachable import BEYOND, COARSE_MM, SPECK_MM2, ReachableAreas, dilate, drop_slivers

SLENDER = 12.0  # times its diameter: what stands higher on a piece sways under the nozzle
LOPSIDED = 3.0  # times what a piece lacks all round: how far it grows on the sides that are free
HALVINGS = 4  # of the way between these two


@dataclass(frozen=True, eq=False)
class Piece:
    """A connected place of a layer's support, before and after it grows; top_mm: how high support goes on above it."""

    thin: Polygons
    area: Polygons
    top_mm: float
    bounds: tuple[float, float, float, float]

    def touches(self, other: Polygons, bounds: tuple[float, float, float, float]) -> bool:
        """Whether the thin piece lies over a place."""
        (x0, y0, x1, y1), (a0, b0, a1, b1) = self.bounds, bounds
        return x0 < a1 and x1 > a0 and y0 < b1 and y1 > b0 and not (self.thin ^ other).is_empty()


def least_diameter_mm(above_mm: float, process: Process) -> float:
    """The diameter of a circle as large as a piece on which support stands so high."""
    top_mm = process.support_branch_mm
    tapered = top_mm + 2.0 * above_mm * tan(radians(process.support_branch_diameter_angle_deg))
    return max(min(tapered, max(process.support_trunk_mm, top_mm)), above_mm / SLENDER)


def thicken(bodies: Sequence[Polygons], areas: ReachableAreas) -> list[Polygons]:
    """The support of every layer with its thin pieces grown; what is added lies within the lean of the layer below, or stands."""
    above: list[Piece] = []
    wide: list[Polygons] = list(bodies)
    for m in range(len(bodies) - 1, -1, -1):
        above = [_grown(piece, above, areas, m) for piece in islands(bodies[m])]
        if any(piece.area is not piece.thin for piece in above):
            wide[m] = union([piece.area for piece in above])
    for m in range(1, len(bodies)):
        if wide[m] is not bodies[m]:
            loose = _loose(bodies[m], wide[m], wide[m - 1], areas, m)
            if not loose.is_empty():
                wide[m] = (bodies[m] + (wide[m] - loose)).simplify(COARSE_MM)
    return wide


def _grown(thin: Polygons, above: Sequence[Piece], areas: ReachableAreas, m: int) -> Piece:
    """A piece of a layer, grown where it is thinner than what stands on it asks for, and under what has grown above."""
    bounds, heights = thin.bounds(), areas.heights
    over = [piece for piece in above if piece.touches(thin, bounds)]
    if not over:
        return Piece(thin, thin, float(heights.tip_mm[m]), bounds)
    top_mm = max(piece.top_mm for piece in over)
    least_mm = least_diameter_mm(top_mm - float(heights.bottom_mm[m]), areas.process)
    hung = [offset(piece.area, -float(areas.lean_mm[m + 1])) for piece in over if piece.area is not piece.thin]
    lacking_mm = 0.5 * (least_mm - 2.0 * sqrt(thin.area() / pi))
    if lacking_mm <= 0.0 and not hung:
        return Piece(thin, thin, top_mm, bounds)
    window = bounding_box(union([thin, *hung]), LOPSIDED * max(lacking_mm, 0.0) + areas.radius_mm)
    room = dilate(areas.reachable[m] ^ window, areas.radius_mm)
    area = union([thin, *(piece ^ room for piece in hung)])
    if lacking_mm > 0.0:
        area = _filled(area, thin, room, lacking_mm, 0.25 * pi * least_mm**2)
    return Piece(thin, area.simplify(COARSE_MM), top_mm, bounds)


def _filled(area: Polygons, thin: Polygons, room: Polygons, lacking_mm: float, least_mm2: float) -> Polygons:
    """An area with the room about a thin piece, no farther from it than makes it large enough, or than LOPSIDED allows."""

    def with_room(reach_mm: float) -> Polygons:
        about = islands(dilate(thin, reach_mm) ^ room)
        return union([area, *(piece for piece in about if not (piece ^ thin).is_empty())])

    if area.area() >= least_mm2:
        return area
    near_mm, far_mm = lacking_mm, LOPSIDED * lacking_mm
    filled = with_room(near_mm)
    if filled.area() >= least_mm2:
        return filled
    filled = with_room(far_mm)
    for _ in range(HALVINGS if filled.area() > least_mm2 else 0):
        middle_mm = 0.5 * (near_mm + far_mm)
        less = with_room(middle_mm)
        if less.area() >= least_mm2:
            far_mm, filled = middle_mm, less
        else:
            near_mm = middle_mm
    return filled


def _loose(body: Polygons, wide: Polygons, below: Polygons, areas: ReachableAreas, m: int) -> Polygons:
    """What has grown of a layer's support neither within the lean of the layer below nor beside what ends on something."""
    lean_mm, added = float(areas.lean_mm[m]), wide - below
    loose = added if below.is_empty() else drop_slivers(added - dilate(below, lean_mm))
    if loose.is_empty() or areas.placeable[m].is_empty():
        return loose
    ends = union([piece for piece in islands(body) if (piece ^ below).area() < SPECK_MM2])
    if ends.is_empty():
        return loose
    beside = areas.placeable[m] ^ bounding_box(ends, areas.process.support_branch_mm)
    return loose - dilate(beside, (1.0 - BEYOND) * areas.radius_mm)


def hollow_places(printed: Sequence[Polygons], dense: Sequence[Polygons], process: Process) -> list[Polygons]:
    """The pieces of each layer's support whose walls are enough.

    Those have lines inside that are wider than sparse lines lie apart, from where lines of the layer above lie on them; narrow
    ones only right under dense lines, which may run along them.
    """
    hollow, filled = [Polygons()] * len(printed), Polygons()
    if process.support_walls == 0:
        return hollow
    spacing, cell_mm = spacing_mm(process.line_width_mm, process.layer_height_mm), support_cell_mm(process)
    walls_mm, dense_above = process.support_walls * spacing, Polygons()
    for m in range(len(printed) - 1, -1, -1):
        filling: list[Polygons] = []
        empty: list[Polygons] = []
        for piece in islands(printed[m]):
            x0, y0, x1, y1 = piece.bounds()
            is_small = max(x1 - x0, y1 - y0) <= 2.0 * walls_mm + cell_mm
            is_narrow = is_small or offset(piece, -walls_mm - 0.5 * cell_mm).is_empty()
            lying = dense_above if is_narrow else filled + dense_above
            has_lines = not is_small and not (piece ^ lying).is_empty()
            (filling if has_lines else empty).append(piece)
        hollow[m], filled, dense_above = union(empty), union(filling), dense[m]
    return hollow


def support_cell_mm(process: Process) -> float:
    """How far apart the sparse lines of support lie, mm: what dense lines laid over it have to span."""
    spacing = spacing_mm(process.support_line_width_mm or process.line_width_mm, process.layer_height_mm)
    return (1.0 if process.support_pattern == "lines" else 2.0) * spacing / process.support_density
