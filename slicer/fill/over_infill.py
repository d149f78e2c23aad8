"""Skins over sparse infill: they grow along their lines until these end on infill or on something solid.

The lines of a layer are taken as rows. Where a row of skin ends over a void of the layer below, farther than HOLDS from what
holds it, it goes on to the next line of infill or to the end of the void.
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
from slicer.geometry.polygons import Polygons, closing, edges, islands, of_contours, offset, opening, union
from slicer.heights import Heights

NARROW = 2.0  # line widths: narrower strips of skin over sparse infill are no bridges
ANCHORED = 2.0  # line widths that the lines of a bridge reach over its anchors
HIDDEN = 0.6  # line widths that they keep from a top, so that gaps between the ends of the lines lie under the walls around it
HOLDS = 0.75  # line widths that a row may reach beyond what holds it
ROWS = 0.5  # line widths between rows
RIM = 0.1  # line widths by which neighbouring rows overlap, and below which what they add is rounding
KEPT = 1.0  # squares of an infill cell: smaller places that skins leave of the sparse infill become solid
MOST_ROUNDS = 2  # newly solid places may themselves end over a void; what ends there still is held in slicer.fill.ends
SKIN, VOID, LINE = 0, 1, 2  # what a row crosses: the border of a skin, of the sparse infill below, and a line of it


def anchor_skins(
    filled: Sequence[Region],
    leaning: Sequence[Polygons],
    processes: Sequence[Process],
    fillings: Sequence[Filling],
    heights: Heights,
) -> tuple[list[Region], dict[int, list[Bead]]]:
    """The regions of all layers with skins that end on infill or on what is solid, and the infill of those below such skins."""
    done, drawn = list(filled), dict[int, list[Bead]]()
    for layer, (region, process) in enumerate(zip(filled[1:], processes, strict=False), 1):
        k, width = layer - 1, processes[layer].line_width_mm
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
    """The region with its skins grown along lines at an angle, so that all of these end on something. sparse_below: what is
    sparse of the layer below; infill_below: the lines (n, 2) in it, about cell_mm apart."""
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
    grown = region.sparse - sparse  # a model in one piece would have it, too
    return replace(region, solid=region.solid + grown, sparse=sparse, uncut=region.uncut - grown)


def infill_bridges(region: Region, sparse_below: Polygons, width_mm: float) -> Polygons:
    """Where solid lines span the sparse infill of the layer below, and as far beyond as they hold on to what is solid there.
    Strips narrower than NARROW lines are left out: the skin beside them carries their lines."""
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
    """The rows, level lines at heights (k + 0.5) apart_mm, that segments (n, 4) cross, and x there."""
    low, high = np.sort(segments[:, 1::2] / apart_mm - 0.5, axis=1).T
    first = np.ceil(low).astype(np.int64)
    many = np.maximum(np.ceil(high).astype(np.int64) - first, 0)
    which = np.repeat(np.arange(len(segments)), many)
    row = first[which] + np.arange(len(which)) - np.repeat(np.cumsum(many) - many, many)
    x0, y0, x1, y1 = segments[which].T
    return row, x0 + ((row + 0.5) * apart_mm - y0) / (y1 - y0) * (x1 - x0), np.full(len(row), kind)


@kernel
def _missing(rows: Indices, x: Floats, kinds: Indices, holds: float) -> Floats:
    """(n, 3) row, from and to, of skins that end over a void on either side, grown to what holds them there. rows, x and kinds:
    of the crossings of each row, from left to right."""
    out = table(2 * len(rows), 3)
    n = begin = 0
    while begin < len(rows):
        end = begin
        while end < len(rows) and rows[end] == rows[begin]:
            end += 1
        for side in range(2):
            in_skin, in_void = False, False
            held, begun, ended = -1e300, 0.0, 0.0  # the last place that holds a line, and the ends of the last skin
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
