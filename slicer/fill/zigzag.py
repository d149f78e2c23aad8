"""Zigzag: parallel lines in any direction inside polygons, joined end to end where they are neighbours."""

from math import ceil, cos, radians, sin

import numpy as np

from mdp.mesh import Floats
from slicer.geometry.polygons import Polygons, edges
from slicer.geometry.scanlines import join_lines, scan_lines


def zigzag_lines(area: Polygons, fence: Polygons, angle_deg: float, spacing_mm: float, reach_mm: float) -> list[Floats]:
    """Lines on a fixed grid, the same in every layer: y = (k + 1/2) spacing in a frame turned by the angle.

    Lines end on the border of `area` (n, 2 polylines, mm); ends of neighbouring lines nearer than reach_mm are joined
    unless the fence lies between them.
    """
    turn = _turn(angle_deg)
    sides = _turned_edges(area, turn)
    if not len(sides):
        return []
    low, high = _extent(sides)
    first, last = ceil(low / spacing_mm - 0.5), ceil(high / spacing_mm - 0.5)
    heights = (np.arange(first, last, dtype=np.float64) + 0.5) * spacing_mm
    return _polylines(sides, _turned_edges(fence, turn), heights, reach_mm, turn)


def _turn(angle_deg: float) -> Floats:
    """(2, 2) rotation of row vectors by -angle: lines at the angle become horizontal."""
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    return np.array([[c, -s], [s, c]])


def _turned_edges(area: Polygons, turn: Floats) -> Floats:
    sides = edges(area)
    return np.ascontiguousarray((sides.reshape(-1, 2) @ turn).reshape(-1, 4))


def _extent(sides: Floats) -> tuple[float, float]:
    return float(sides[:, 1].min()), float(sides[:, 1].max())


def _polylines(sides: Floats, fence: Floats, heights: Floats, reach_mm: float, turn: Floats) -> list[Floats]:
    rows = scan_lines(sides, heights)
    if not len(rows):
        return []
    points, starts = join_lines(rows, fence, reach_mm)
    return np.split(points @ turn.T, starts[1:])
