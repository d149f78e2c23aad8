"""Line patterns: open lines over a box in a frame turned by an angle, clipped to an area, and the zigzags of support."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import numpy as np

from mdp.mesh import Floats
from slicer.geometry.clip import NO_PIECES, Border, Indices, Pieces, border_of, clip_lines, rotation_2d
from slicer.geometry.polygons import Polygons
from slicer.geometry.scanlines import join_lines, scan_lines

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


def clip_pattern(border: Border, angle_deg: float, draw: Draw) -> Pieces:
    """What of a pattern, drawn in a frame turned by an angle, lies inside a border, in the border's own frame."""
    if not len(border.edges):
        return NO_PIECES
    edges = border.turned(angle_deg)
    x0, y0 = edges[:, :2].min(axis=0)
    x1, y1 = edges[:, :2].max(axis=0)
    pieces = clip_lines(*draw((x0 - MARGIN_MM, y0 - MARGIN_MM, x1 + MARGIN_MM, y1 + MARGIN_MM)), edges)
    return Pieces(pieces.points @ rotation_2d(angle_deg).T, pieces.starts, pieces.ends)


def grid_numbers(low: float, high: float, apart_mm: float) -> Floats:
    """Whole numbers k for which (k + 1/2) apart lies between low and high: a grid that is the same in every layer."""
    return np.arange(ceil(low / apart_mm - 0.5), ceil(high / apart_mm - 0.5), dtype=np.float64)


def zigzag_lines(area: Polygons, fence: Polygons, angle_deg: float, apart_mm: float, reach_mm: float) -> list[Floats]:
    """Lines (n, 2) on the grid of parallel_lines that end on the border of an area.

    Ends of neighbouring lines nearer than reach_mm are joined unless the fence lies between them.
    """
    sides = border_of(area).turned(angle_deg)
    if not len(sides):
        return []
    heights = (grid_numbers(float(sides[:, 1].min()), float(sides[:, 1].max()), apart_mm) + 0.5) * apart_mm
    rows = scan_lines(sides, heights)
    if not len(rows):
        return []
    points, starts = join_lines(rows, border_of(fence).turned(angle_deg), reach_mm)
    return np.split(points @ rotation_2d(angle_deg).T, starts[1:])


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
