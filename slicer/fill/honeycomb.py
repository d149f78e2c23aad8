"""Honeycomb: hexagons drawn by zigzag lines that lie side by side where neighbouring cells meet.

Every line runs along one flat side, over a slanted one, along the next flat side and back, so the flat sides are double;
the frame turns by 60 degrees from layer to layer, so that every side is double in one layer of three.
"""

from math import sqrt

import numpy as np

from slicer.fill.pattern import Box, LinePattern, Lines, PatternLayer, grid_numbers

TURN_DEG = 60.0  # a third of the half turn after which lines are themselves again


def honeycomb(layer: PatternLayer) -> LinePattern:
    """Zigzags of the density."""
    side = side_mm(layer.spacing_mm, min(layer.density, 1.0))
    return LinePattern(layer.angle_deg + TURN_DEG * (layer.number % 3), lambda box: _rows(box, side, layer.spacing_mm))


def side_mm(spacing_mm: float, density: float) -> float:
    """Side a of the hexagons: a strip of sqrt(3)/2 a holds one line of length 3 a + 2 d / sqrt(3) in every 3 a.

    d = sqrt(3)/2 a - spacing is how far the slanted sides reach from one flat side to the next.
    """
    per_side, fixed = 3.0 + 1.0, 2.0 / sqrt(3.0) * spacing_mm
    strip = 1.5 * sqrt(3.0) * density / spacing_mm
    return (per_side + sqrt(per_side**2 - 4.0 * strip * fixed)) / (2.0 * strip)


def _rows(box: Box, side: float, spacing_mm: float) -> Lines:
    strip = 0.5 * sqrt(3.0) * side
    reach = max(strip - spacing_mm, 0.0)
    slant = reach / sqrt(3.0)
    flat = 1.5 * side - slant
    first, last = np.floor(box[0] / (3.0 * side)) - 1, np.ceil(box[2] / (3.0 * side)) + 1
    along = (3.0 * side * np.arange(first, last + 1))[:, None] + np.array([0.0, flat, flat + slant, 2.0 * flat + slant])
    across = np.tile(0.5 * reach * np.array([1.0, 1.0, -1.0, -1.0]), len(along))
    lines = []
    for k in grid_numbers(box[1] - strip, box[3] + strip, strip):
        lines.append(np.stack([along.ravel(), (k + 0.5) * strip + (across if k % 2 == 0 else -across)], axis=1))
    points = np.concatenate(lines) if lines else np.zeros((0, 2))
    return points, np.arange(len(lines)) * along.size
