"""Monotonic: the lines of a skin that is seen in such an order that every line lies on the same side of its neighbour.

Where lines meet from both sides of a hole the sheen of a skin changes and a ridge may stand. So lines are taken together
in cells, in which each has one neighbour above and one below; a cell waits for the cells that its first line lies beside.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mdp.mesh import Floats
from slicer.fill.anchor import Limits, anchor_lines
from slicer.geometry.clip import Indices, Pieces, rotation_2d
from slicer.geometry.edge_index import EdgeIndex

LEVEL = 0.1  # of a spacing: heights nearer to each other are one row
SINGLE_MM = 1e-6  # a path whose ends differ less in height is one line, which may be printed from either end


@dataclass(frozen=True, eq=False)
class Cells:
    """of: (k,) cell of each piece; before: of each cell those that come before it, all of them lower numbers."""

    of: Indices
    before: list[set[int]]


def monotonic_lines(pieces: Pieces, border: EdgeIndex, angle_deg: float, spacing_mm: float, most_mm: float) -> list[Floats]:
    """Straight pieces as lines (n, 2) in printing order, joined along the border where ends are at most most_mm apart."""
    if not len(pieces.ends):
        return []
    cells = find_cells(pieces, angle_deg, spacing_mm)
    lines = anchor_lines(pieces, border, Limits(0.0, most_mm, 0.0), cells.of)
    return lines if len(lines) < 2 else _order_lines(_by_cell(lines, cells, pieces), cells, rotation_2d(angle_deg))


def find_cells(pieces: Pieces, angle_deg: float, spacing_mm: float) -> Cells:
    """The cells of straight pieces, numbered by the row of their first line."""
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
    return Cells(out, before)


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


def _by_cell(lines: Sequence[Floats], cells: Cells, pieces: Pieces) -> list[list[Floats]]:
    """The lines of each cell."""
    piece = {(x, y): k // 2 for k, (x, y) in enumerate(pieces.points.tolist())}
    out: list[list[Floats]] = [[] for _ in cells.before]
    for line in lines:
        out[cells.of[piece[line[0, 0], line[0, 1]]]].append(line)
    return out


def _order_lines(by_cell: Sequence[list[Floats]], cells: Cells, turned: Floats) -> list[Floats]:
    """Cell after cell, of those that wait for none the nearest; upward inside each."""
    rising, waits = [_rising(lines, turned) for lines in by_cell], [len(earlier) for earlier in cells.before]
    after: list[list[int]] = [[] for _ in rising]
    for cell, earlier in enumerate(cells.before):
        for first in earlier:
            after[first].append(cell)
    ready, out = [cell for cell, count in enumerate(waits) if not count], list[Floats]()
    while ready:
        cell = min(ready, key=lambda cell: _travel_mm(out, rising[cell])) if out else ready[0]
        ready.remove(cell)
        for line in rising[cell]:
            out.append(_nearer_end_first(line, out, turned))
        for later in after[cell]:
            waits[later] -= 1
            if not waits[later]:
                ready.append(later)
    return out


def _nearer_end_first(line: Floats, out: Sequence[Floats], turned: Floats) -> Floats:
    """A single line may be printed from either end; a path upward may not."""
    if not out or abs(float((line[-1] - line[0]) @ turned[:, 1])) >= SINGLE_MM:
        return line
    tip = out[-1][-1]
    return line[::-1] if np.hypot(*(line[-1] - tip)) < np.hypot(*(line[0] - tip)) else line


def _rising(lines: Sequence[Floats], turned: Floats) -> list[Floats]:
    upward = [line if (line[-1] - line[0]) @ turned[:, 1] > -SINGLE_MM else line[::-1] for line in lines]
    return sorted(upward, key=lambda line: float(line[0] @ turned[:, 1]))


def _travel_mm(out: Sequence[Floats], lines: Sequence[Floats]) -> float:
    return float(np.hypot(*(lines[0][0] - out[-1][-1])))
