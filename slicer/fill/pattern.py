"""Line patterns: open lines over a box in a frame turned by an angle, clipped to an area, and the zigzags of support."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import numpy as np

from mdp.kernels.arrays import flags, longs, table
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from slicer.geometry.clip import NO_PIECES, Indices, Pieces, clip_lines, rotation_2d
from slicer.geometry.edge_index import EdgeIndex, free, index_edges
from slicer.geometry.polygons import Polygons
from slicer.geometry.segments import Segment

Box = tuple[float, float, float, float]
Lines = tuple[Floats, Indices]  # points (n, 2) mm and the start of each line
Draw = Callable[[Box], Lines]  # for a box x0 y0 x1 y1
LinePattern = tuple[float, Draw]  # the angle of the frame, deg, in which it is drawn
MARGIN_MM = 0.1  # lines begin and end this far outside the box


@dataclass(frozen=True)
class PatternLayer:
    """The layer that a pattern is drawn in, by its number and height; spacing_mm: of lines that fill an area completely."""

    number: int
    z_mm: float
    angle_deg: float
    spacing_mm: float
    density: float


def clip_pattern(border: EdgeIndex, angle_deg: float, draw: Draw) -> Pieces:
    """What of a pattern, drawn in a frame turned by an angle, lies inside a border, in the border's own frame."""
    if not len(border.edges):
        return NO_PIECES
    turn = rotation_2d(angle_deg)
    corners = border.edges[:, :2] @ turn
    (x0, y0), (x1, y1) = corners.min(axis=0) - MARGIN_MM, corners.max(axis=0) + MARGIN_MM
    points, starts = draw((x0, y0, x1, y1))
    return clip_lines(points @ turn.T, starts, border)


def grid_numbers(low: float, high: float, apart_mm: float) -> Floats:
    """Whole numbers k for which (k + 1/2) apart lies between low and high: a grid that is the same in every layer."""
    return np.arange(ceil(low / apart_mm - 0.5), ceil(high / apart_mm - 0.5), dtype=np.float64)


def zigzag_lines(area: Polygons, fence: Polygons, angle_deg: float, apart_mm: float, reach_mm: float) -> list[Floats]:
    """Lines (n, 2) on the grid of parallel_lines that end on the border of an area.

    Ends of neighbouring lines nearer than reach_mm are joined unless the fence lies between them.
    """
    pieces = clip_pattern(index_edges(area), *parallel_lines(angle_deg, apart_mm))
    if not len(pieces.ends):
        return []
    number = np.rint((pieces.points[::2] @ rotation_2d(angle_deg))[:, 1] / apart_mm - 0.5)
    following = np.column_stack([np.searchsorted(number, number + 1.0, side) for side in ("left", "right")])
    points, starts = _join(pieces.points.reshape(-1, 4), following, index_edges(fence), reach_mm)
    return np.split(points, starts[1:])


@kernel
def _join(lines: Floats, following: Indices, fence: EdgeIndex, reach_mm: float) -> tuple[Floats, Indices]:
    """Lines (n, 4) joined end to end where one of the next row begins within reach and no edge of the fence lies between.

    following: (n, 2) first of the next row's lines, and first after them. Returns points (n, 2) and the start of each polyline.
    """
    points, starts, used = table(2 * len(lines), 2), longs(len(lines), 0), flags(len(lines))
    n = count = 0
    for seed in range(len(lines)):
        if used[seed]:
            continue
        starts[count] = n
        count += 1
        at, end = seed, 2  # the column at which a line is left
        while at >= 0:
            used[at] = True
            for axis in range(2):
                points[n, axis], points[n + 1, axis] = lines[at, 2 - end + axis], lines[at, end + axis]
            x, y = points[n + 1, 0], points[n + 1, 1]
            n += 2
            best, best_end, nearest = -1, 0, reach_mm
            for k in range(following[at, 0], following[at, 1]):
                for begin in range(0, 0 if used[k] else 4, 2):
                    to_x, to_y = lines[k, begin], lines[k, begin + 1]
                    distance = np.hypot(to_x - x, to_y - y)
                    if distance < nearest and free(fence, Segment(x, y, to_x, to_y)):
                        best, best_end, nearest = k, 2 - begin, distance
            at, end = best, best_end
    return points[:n], starts[:count]


def horizontal_lines(heights: Floats, box: Box) -> Lines:
    """Horizontal lines across a box."""
    points = np.empty((len(heights), 2, 2))
    points[:, 0, 0], points[:, 1, 0] = box[0], box[2]
    points[:, :, 1] = heights[:, None]
    return points.reshape(-1, 2), 2 * np.arange(len(heights))


def parallel_lines(angle_deg: float, apart_mm: float, shift_mm: float = 0.0) -> LinePattern:
    """Straight lines at an angle, on a grid that is the same in every layer but for a shift across the lines."""

    def draw(box: Box) -> Lines:
        return horizontal_lines((grid_numbers(box[1] - shift_mm, box[3] - shift_mm, apart_mm) + 0.5) * apart_mm + shift_mm, box)

    return angle_deg, draw
