"""Ends of lines: skins over sparse infill grow until their lines end on an anchor, and strokes of skin and infill end on plastic.

The lines of a layer are treated as rows. Where a row of skin ends over a void of the layer below, farther than HOLDS from its
last anchor, it continues to the next line of infill or to the end of the void.

Even then, lines may lie beside the rows by which a skin grew, turns leave wedges along its border, and lines of infill end before
it. A stroke whose last line width lies on nothing is extended to nearby plastic if that stays inside the outline of its own
layer. Otherwise, where the model continues below, it is cut back to the last point with plastic below, and dropped if there is
none; a bridge over open air stays. The runs along walls that anchor lines of infill begin over a void as soon as the lines shift
or separate. They are cut back as well, and grow from layer to layer as far as each supports the next.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.kernels.arrays import table
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from profiles.process import Process
from slicer.bead import Bead
from slicer.fill.infill import Filling, filling_beads, open_area, widest_cell_mm
from slicer.fill.region import Region
from slicer.fill.skin import lines_angle_deg
from slicer.geometry.clip import rotation_2d
from slicer.geometry.edge_index import EdgeIndex, depths, index_edges, index_segments, nearest
from slicer.geometry.polygons import Polygons, closing, edges, islands, of_contours, offset, opening, union
from slicer.geometry.polyline import length_mm
from slicer.heights import Heights
from slicer.paths import SKINS

NARROW = 2.0  # line widths: narrower strips of skin over sparse infill are not bridges
ANCHORED = 2.0  # line widths by which the lines of a bridge overlap its anchors
HIDDEN = 0.6  # line widths between bridge lines and a top, so that gaps between line ends lie under the walls around it
HOLDS = 0.75  # line widths that a row may extend beyond its anchor
ROWS = 0.5  # line widths between rows
RIM = 0.1  # line widths by which neighbouring rows overlap; smaller additions are rounding
KEPT = 1.0  # squares of an infill cell: smaller sparse areas left between skins become solid
MOST_ROUNDS = 2  # newly solid areas may themselves end over a void; remaining ends are handled by hold_ends
STEP = 0.125  # line widths between the points of a stroke tested for plastic below
CARRIES = 0.35  # line widths from the centre of a line within which it supports the centre of a line above
ONWARD = 1.0  # line widths by which a stroke may be extended to plastic
LAP = 0.5  # line widths by which an extended stroke overlaps plastic
LAPS = (LAP, 0.25, 0.0)  # overlaps that are tried: a single wall leaves no room for more inside the outline
CARRYING = 3  # layers below that support infill: a pattern's lines repeat at least every third layer
SKIN, VOID, LINE = 0, 1, 2  # what a row crosses: the border of a skin, the border of the sparse infill below, or an infill line
HELD, EXTEND, CUT = range(3)  # an end on plastic, an end that may be extended, and an end that may also be cut back

Plastic = tuple[EdgeIndex, Floats]  # centrelines of beads, and for each segment the distance within which a bead supports, mm


def anchor_skins(
    filled: Sequence[Region],
    leaning: Sequence[Polygons],
    processes: Sequence[Process],
    fillings: Sequence[Filling],
    heights: Heights,
) -> tuple[list[Region], dict[int, list[Bead]]]:
    """The regions of all layers, with skins grown to end on infill or on solid areas, and the infill of the layers below such
    skins.
    """
    done, drawn = list(filled), dict[int, list[Bead]]()
    for k, process in enumerate(processes[:-1]):  # the layer below and its settings
        layer, region, width = k + 1, filled[k + 1], processes[k + 1].line_width_mm
        below = open_area(done[k].sparse, fillings, process, k, lightning=False)
        if below.is_empty() or ((region.solid + region.top) ^ below).area() < width**2:
            continue
        drawn[k] = filling_beads(done[k].sparse, leaning[k], fillings, process, heights, k)
        lines, angle_deg = [bead.points for bead in drawn[k]], lines_angle_deg(process, layer)
        done[layer] = anchored(region, below, lines, angle_deg, width, widest_cell_mm(fillings, process, k))
    return done, drawn


def anchored(
    region: Region, sparse_below: Polygons, infill_below: Sequence[Floats], angle_deg: float, width_mm: float, cell_mm: float
) -> Region:
    """The region with its skins grown along lines at an angle, so that every line ends on an anchor.

    sparse_below: sparse area of the layer below; infill_below: its lines (n, 2), about cell_mm apart.
    """
    skin, sparse = region.solid + region.top, region.sparse
    for _ in range(MOST_ROUNDS):
        added = _extension(skin, sparse_below, infill_below, angle_deg, width_mm) ^ sparse
        if added.area() < width_mm**2:
            break
        pieces = islands(opening(sparse - added, width_mm))
        large = [piece.area() >= KEPT * cell_mm**2 for piece in pieces]
        beside = Polygons() if all(large) else offset(added, 2.0 * width_mm)
        left = union([piece for piece, kept in zip(pieces, large, strict=True) if kept or (piece ^ beside).is_empty()])
        skin, sparse = skin + (sparse - left), left
    if sparse is region.sparse:
        return region
    grown = region.sparse - sparse  # the uncut model would have this skin, too
    return replace(region, solid=region.solid + grown, sparse=sparse, uncut=region.uncut - grown)


def infill_bridges(region: Region, sparse_below: Polygons, width_mm: float) -> Polygons:
    """Area in which solid lines bridge the sparse infill of the layer below, including their overlap with its solid areas.

    Strips narrower than NARROW lines are left out: the skin beside them supports their lines.
    """
    solid = region.solid + (region.top - offset(region.bare, HIDDEN * width_mm))
    if solid.is_empty() or sparse_below.is_empty():
        return Polygons()
    spanned = solid ^ sparse_below
    if spanned.area() < (NARROW * width_mm) ** 2:
        return Polygons()
    wide = opening(spanned, 0.5 * NARROW * width_mm)
    return wide if wide.is_empty() else opening(offset(wide, ANCHORED * width_mm) ^ solid, 0.5 * width_mm)


def _extension(
    skin: Polygons, sparse_below: Polygons, infill_below: Sequence[Floats], angle_deg: float, width_mm: float
) -> Polygons:
    """The area by which a skin grows along its rows."""
    turn, apart_mm = rotation_2d(angle_deg), ROWS * width_mm
    lines = [np.hstack([line[:-1], line[1:]]) for line in infill_below]
    found = [
        _row_crossings(np.hstack([some[:, :2] @ turn, some[:, 2:] @ turn]), kind, apart_mm)
        for some, kind in ((edges(skin), SKIN), (edges(sparse_below), VOID), (np.concatenate([np.zeros((0, 4)), *lines]), LINE))
    ]
    rows, x, kinds = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.lexsort((kinds, x, rows))
    pieces = _missing(rows[order], x[order], kinds[order], HOLDS * width_mm)
    if not len(pieces):
        return Polygons()
    middle, half = (pieces[:, 0] + 0.5) * apart_mm, (0.5 * NARROW + RIM) * width_mm
    reach = RIM * width_mm
    left, right, low, high = pieces[:, 1] - reach, pieces[:, 2] + reach, middle - half, middle + half
    corners = np.stack([left, low, right, low, right, high, left, high], axis=1).reshape(-1, 4, 2) @ turn.T
    return closing(of_contours(list(corners)), ROWS * width_mm)


def _row_crossings(segments: Floats, kind: int, apart_mm: float) -> tuple[Indices, Floats, Indices]:
    """The rows, horizontal lines at heights (k + 0.5) apart_mm, that segments (n, 4) cross, and the x of each crossing."""
    low, high = np.sort(segments[:, 1::2] / apart_mm - 0.5, axis=1).T
    first = np.ceil(low).astype(np.int64)
    many = np.maximum(np.ceil(high).astype(np.int64) - first, 0)
    which = np.repeat(np.arange(len(segments)), many)
    row = first[which] + np.arange(len(which)) - np.repeat(np.cumsum(many) - many, many)
    x0, y0, x1, y1 = segments[which].T
    return row, x0 + ((row + 0.5) * apart_mm - y0) / (y1 - y0) * (x1 - x0), np.full(len(row), kind)


@kernel
def _missing(rows: Indices, x: Floats, kinds: Indices, holds: float) -> Floats:
    """(n, 3) row, start and end of extensions, for skins that end over a void on either side.

    rows, x and kinds: of the crossings of each row, from left to right.
    """
    out = table(2 * len(rows), 3)
    n = begin = 0
    while begin < len(rows):
        end = begin
        while end < len(rows) and rows[end] == rows[begin]:
            end += 1
        for side in range(2):
            in_skin, in_void = False, False
            held, begun, ended = -1e300, 0.0, 0.0  # the last anchor, and the ends of the last skin
            lacking = False
            for k in range(begin, end):
                at = k if side == 0 else begin + end - 1 - k
                here = x[at] if side == 0 else -x[at]
                if kinds[at] == SKIN:
                    in_skin = not in_skin
                    if not in_skin:
                        if in_void and here - held > holds:
                            lacking, ended = True, here
                        continue
                    grows = lacking  # over the void between two skins
                    begun = begun if lacking else here
                else:
                    in_void = in_void != (kinds[at] == VOID)
                    held, grows = here, lacking and here > ended
                lacking = False
                if grows:
                    out[n, 0] = rows[at]
                    out[n, 1], out[n, 2] = (begun, here) if side == 0 else (-here, -begun)
                    n += 1
        begin = end
    return out[:n]


def plastic_of(beads: Sequence[Bead]) -> Plastic | None:
    """The centrelines of a layer's beads with their reach of support; None if there are no beads."""
    lying = [bead for bead in beads if len(bead.points) > 1]
    if not lying:
        return None
    carries_mm = np.repeat([CARRIES * bead.width_mm for bead in lying], [len(bead.points) - 1 for bead in lying])
    return index_segments(np.concatenate([np.hstack([bead.points[:-1], bead.points[1:]]) for bead in lying])), carries_mm


def hold_ends(
    beads: Sequence[Bead], below: Plastic | None, section: Polygons, section_below: Polygons, width_mm: float
) -> list[Bead]:
    """The beads of a layer with skin strokes that end on the plastic of the layer below, wherever the model is there or near.

    section, section_below: the model's sections in this layer and the layer below.
    """
    skins = [k for k, bead in enumerate(beads) if bead.kind in SKINS and not bead.closed]
    if not skins or below is None:
        return list(beads)
    lines = [line for k in skins for line in (beads[k].points, np.ascontiguousarray(beads[k].points[::-1]))]
    ends = np.array([_first_held(line, below, width_mm, width_mm) < 0.0 for line in lines]).reshape(-1, 2)
    if not ends.any():
        return list(beads)
    inside_mm = depths(np.concatenate([beads[k].points[[0, -1]] for k in skins]), index_edges(section_below)).reshape(-1, 2)
    loose = np.where(ends & (inside_mm > 0.0), CUT, np.where(ends & (inside_mm > -width_mm), EXTEND, HELD))
    needs, outline = dict(zip(skins, loose.tolist(), strict=True)), index_edges(section)
    out, cut = list[Bead](), False  # cut: whether the previous bead, which the next one would follow, was dropped
    for k, bead in enumerate(beads):
        points, (first, last) = bead.points, needs.get(k, (HELD, HELD))
        if first:
            points = _held(points, below, outline, width_mm, first)
        if last and len(points):
            turned = np.ascontiguousarray(points[::-1])
            held = _held(turned, below, outline, width_mm, last)
            points = points if held is turned else held[::-1]
        if points is not bead.points and length_mm(points) < width_mm:
            cut = cut or not bead.follows
            continue
        out.append(bead if points is bead.points and not cut else replace(bead, points=points, follows=bead.follows and not cut))
        cut = False
    return out


def cut_anchors(beads: Sequence[Bead], below: Sequence[Plastic | None]) -> list[Bead]:
    """The beads of a layer with the infill lines' runs along walls limited to what the layers below support.

    An end that is unsupported for longer than an anchor is part of the pattern, and stays.
    """
    layers, out = [plastic for plastic in below if plastic is not None], list(beads)
    for k, bead in enumerate(beads):
        points, width_mm = bead.points, bead.width_mm
        for _ in range(2 if bead.anchor_mm > 0.0 and not bead.closed else 0):
            points = np.ascontiguousarray(points[::-1])
            ways = [_first_held(points, plastic, width_mm, bead.anchor_mm + width_mm) for plastic in layers]
            way = min((way for way in ways if way >= 0.0), default=0.0)
            points = _from(points, way - LAP * width_mm) if way > width_mm else points
        if points is not bead.points and not np.array_equal(points, bead.points) and length_mm(points) >= width_mm:
            out[k] = replace(bead, points=points)
    return out


@kernel
def _first_held(points: Floats, plastic: Plastic, width_mm: float, most_mm: float) -> float:
    """Distance along a stroke to the first point with plastic below, mm; -1.0 if there is none within most_mm."""
    lines, carries_mm = plastic
    farthest_mm = carries_mm.max()
    since = way = 0.0
    for k in range(len(points) - 1):
        x, y = points[k, 0], points[k, 1]
        dx, dy = points[k + 1, 0] - x, points[k + 1, 1] - y
        length = np.hypot(dx, dy)
        while way <= min(since + length, most_mm):
            share = (way - since) / length if length > 0.0 else 0.0
            px, py = x + share * dx, y + share * dy
            nx, ny, which = nearest(lines, px, py, farthest_mm)
            if which >= 0 and np.hypot(nx - px, ny - py) <= carries_mm[which]:
                return way
            way += STEP * width_mm
        since += length
        if since > most_mm:
            break
    return -1.0


def _held(points: Floats, plastic: Plastic, outline: EdgeIndex, width_mm: float, need: int) -> Floats:
    """A stroke (n, 2) extended or cut back to begin on plastic; empty if it may be cut and has no plastic below. need: EXTEND or
    CUT.
    """
    along = points[0] - points[1]
    onward = along * (ONWARD * width_mm / max(float(np.hypot(*along)), 1e-9))
    way = _first_held(np.stack([points[0], points[0] + onward]), plastic, width_mm, ONWARD * width_mm)
    if way >= 0.0:
        ends = points[0] + onward * ((way / width_mm + np.array(LAPS)[:, None]) / ONWARD)
        inside = depths(ends, outline) > 0.5 * width_mm
        if inside.any():
            return np.concatenate([ends[[inside.argmax()]], points[1:]])
    if need == EXTEND:
        return points
    way = _first_held(points, plastic, width_mm, np.inf) - LAP * width_mm
    return _from(points, way) if way >= 0.0 else points[:0]


def _from(points: Floats, way: float) -> Floats:
    """The rest of a stroke from a distance along it."""
    lengths = np.hypot(*np.diff(points, axis=0).T)
    begins = np.cumsum(lengths) - lengths
    k = int(np.searchsorted(begins, way, side="right")) - 1
    begin = points[k] + (points[k + 1] - points[k]) * ((way - begins[k]) / lengths[k])
    return np.concatenate([begin[None], points[k + 1 :]])
