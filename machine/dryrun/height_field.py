"""Height field: heights of everything below the head at one pose of the table, on a lattice over X and Y of the machine.

A coarse lattice of maxima settles most moves; near the head every cell is tested at its distance from the move.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mdp.head import Head, lowest_of_hot_end
from mdp.kernels.kernel import no_nrt
from mdp.mesh import Floats
from slicer.geometry.polyline import Segment, squared_distance

NOTHING = -1e9
SHIFT = 4
BLOCK = 1 << SHIFT  # cells of the fine lattice along a side of a coarse one
CELL_MM, MOST_CELLS = 0.15, 6_000_000
PIECE_MM = 0.25

Point = tuple[float, float, float]
# Height of the plastic, its height below this layer, and 1 + the row that laid it, 0 without plastic. Stored together, because a
# bead that crosses rows of cells touches another page of memory in each row.
CELL = np.dtype([("top", np.float32), ("below", np.float32), ("owner", np.int32)])


class Field(NamedTuple):
    """A height field. cells: (n,) CELL, row by row, n = shape[0] shape[1].

    coarse: (b,) greatest height of each block; order: blocks, highest first at the time of sorting; highest: (2,) of all, and of
    cells laid since sorting.
    """

    origin: Floats
    cell: float
    shape: NDArray[np.int64]
    cells: NDArray[np.void]
    coarse: Floats
    order: NDArray[np.int64]
    highest: Floats


def empty_field(low: Floats, high: Floats) -> Field:
    """An empty field over a rectangle; its cells grow with the rectangle."""
    size = np.maximum(high - low, 1.0)
    cell = max(CELL_MM, float(np.sqrt(size.prod() / MOST_CELLS)))
    shape = np.ceil(size / cell).astype(np.int64) + 1
    count, blocks = int(shape.prod()), (shape + BLOCK - 1) // BLOCK
    coarse, order = np.full(int(blocks.prod()), NOTHING), np.arange(int(blocks.prod()))
    return Field(np.asarray(low, np.float64), cell, shape, np.zeros(count, CELL), coarse, order, np.full(2, NOTHING))


def highest_first(field: Field) -> Field:
    """The field with its blocks sorted highest first: most moves are above all of them."""
    field.highest[1] = NOTHING
    return field._replace(order=np.argsort(-field.coarse, kind="stable"))


@no_nrt
def _blocks(cells: int) -> int:
    """Number of blocks that cover a row of cells."""
    return (cells + BLOCK - 1) >> SHIFT


@no_nrt
def lay_bead(a: Floats, b: Floats, half: float, row: int, field: Field) -> None:
    """Add a straight bead that reaches `half` to each side: one run of cells across for every cell along. Raised cells keep their
    earlier height in `below`."""
    along = 0 if abs(b[0] - a[0]) >= abs(b[1] - a[1]) else 1
    if a[along] > b[along]:
        a, b = b, a
    across_axis = 1 - along
    length = b[along] - a[along]
    slope = (b[across_axis] - a[across_axis]) / length if length > 1e-9 else 0.0
    rise = (b[2] - a[2]) / length if length > 1e-9 else 0.0
    across, cell = half * np.sqrt(1.0 + slope * slope), field.cell
    wide, blocks = field.shape[1], _blocks(field.shape[1])
    p_cells, q_cells, p_blocks, q_blocks = (wide, 1, blocks, 1) if along == 0 else (1, wide, 1, blocks)
    first = max(int(np.floor((a[along] - field.origin[along]) / cell)), 0)
    last = min(int(np.floor((b[along] - field.origin[along]) / cell)), field.shape[along] - 1)
    for p in range(first, last + 1):
        u = min(max(field.origin[along] + (p + 0.5) * cell, a[along]), b[along]) - a[along]
        v, z = a[across_axis] + slope * u - field.origin[across_axis], a[2] + rise * u
        low = max(int(np.floor((v - across) / cell + 0.5)), 0)
        high = min(int(np.floor((v + across) / cell - 0.5)), field.shape[across_axis] - 1)
        if high < low:
            low = high = min(max(int(np.floor(v / cell)), 0), field.shape[across_axis] - 1)
        for q in range(low, high + 1):
            k = p * p_cells + q * q_cells
            column = field.cells[k]
            top = column.top if column.owner else NOTHING
            if z > top + 1e-4:
                column.below, column.top, column.owner = top, z, row + 1
                c = (p >> SHIFT) * p_blocks + (q >> SHIFT) * q_blocks
                if z > field.coarse[c]:
                    field.coarse[c] = z
                    field.highest[0], field.highest[1] = max(field.highest[0], z), max(field.highest[1], z)


@no_nrt
def _distance_across(px: float, py: float, a: Point, b: Point) -> float:
    """Distance in X and Y of a point from a move."""
    return float(np.sqrt(squared_distance(Segment(a[0], a[1], b[0], b[1]), px, py)))


@no_nrt
def _comes_over(square: Point, a: Point, b: Point, box: Floats) -> bool:
    """Whether a box that moves with the tip from a to b passes over a square; square: its centre and half of its side."""
    px, py, half = square
    low, high = 0.0, 1.0
    for k in range(2):
        delta, p = b[k] - a[k], (px if k == 0 else py) - a[k]
        least, most = p - box[3 + k] - half, p - box[k] + half
        if abs(delta) < 1e-12:
            if least > 0.0 or most < 0.0:
                return False
        else:
            low = max(low, min(least / delta, most / delta))
            high = min(high, max(least / delta, most / delta))
    return low <= high


@no_nrt
def _depth_at(column: tuple[float, float, float, float], slack: float, a: Point, b: Point, head: Head) -> float:
    """Depth of the head in a column during a level move; 0 up to `slack`.

    column: x, y, half of its side, and height of its top above the tip.
    """
    px, py, half, rise = column
    deepest = 0.0
    depth = rise - lowest_of_hot_end(max(_distance_across(px, py, a, b) - 1.4143 * half, 0.0), head.silhouette)
    if depth > slack:
        deepest = depth
    for k in range(len(head.boxes)):
        if rise - head.boxes[k, 2] > max(deepest, slack) and _comes_over((px, py, half), a, b, head.boxes[k]):
            deepest = rise - head.boxes[k, 2]
    return deepest


@no_nrt
def _level_depth(a: Point, b: Point, slack: float, field: Field, head: Head) -> float:
    """Greatest depth of the head in the field during a level move; 0 up to `slack`."""
    deepest, size, cell = 0.0, BLOCK * field.cell, field.cell
    wide = _blocks(field.shape[1])
    sorted_blocks = field.highest[1] - a[2] <= slack
    for c in field.order:
        if field.coarse[c] - a[2] <= slack:
            if sorted_blocks:  # neither do those after it
                break
            continue
        i, j = c // wide, c % wide
        px, py = field.origin[0] + (i + 0.5) * size, field.origin[1] + (j + 0.5) * size
        if _depth_at((px, py, 0.5 * size, field.coarse[c] - a[2]), slack, a, b, head) == 0.0:
            continue
        for p in range(i * BLOCK, min((i + 1) * BLOCK, field.shape[0])):
            for q in range(j * BLOCK, min((j + 1) * BLOCK, field.shape[1])):
                column = field.cells[p * field.shape[1] + q]
                rise = column.top - a[2]
                if column.owner and rise > slack and rise > deepest:
                    x, y = field.origin[0] + (p + 0.5) * cell, field.origin[1] + (q + 0.5) * cell
                    deepest = max(deepest, _depth_at((x, y, 0.0, rise), slack, a, b, head))
    return deepest


@no_nrt
def depth_of(a: Floats, b: Floats, slack: float, field: Field, head: Head) -> float:
    """Greatest depth of the head in the field during a move; a sloped one in pieces, each at its lowest height."""
    if min(a[2], b[2]) + slack >= field.highest[0]:
        return 0.0
    across = max(abs(b[0] - a[0]), abs(b[1] - a[1]))
    pieces = 1
    if abs(b[2] - a[2]) > 1e-6 and across > 1e-6:
        pieces = int(max(across, abs(b[2] - a[2])) / PIECE_MM) + 1
    deepest = 0.0
    for k in range(pieces):
        s, t = k / pieces, (k + 1) / pieces
        z = min(a[2] + s * (b[2] - a[2]), a[2] + t * (b[2] - a[2]))
        c = (a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), z)
        d = (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), z)
        deepest = max(deepest, _level_depth(c, d, slack, field, head))
    return deepest
