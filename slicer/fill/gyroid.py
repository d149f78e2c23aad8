"""Gyroid: the level layers of Schoen's minimal surface sin x cos y + sin y cos z + sin z cos x = 0 as wavy lines.

At height z the equation has the form A sin(u + phase) = B in one of x and y: in y when |cos z| > |sin z|, else in x; so
every line is the graph of a function and runs through the whole layer (PrusaSlicer's gyroid has the same lines).
"""

from math import cos, pi, sin

import numpy as np

from mdp.mesh import Floats
from slicer.fill.pattern import Box, LinePattern, Lines, PatternLayer

# Of the lines in a period squared, in periods, mean over all heights, chords instead of arcs: integrated numerically.
LENGTH = 2.454
STEPS = 20  # a period: the chords stay within 0.01 mm at a period of 5 mm


def gyroid(layer: PatternLayer) -> LinePattern:
    """Waves whose plastic is the density on average over the layers."""
    period = LENGTH * layer.spacing_mm / layer.density
    height = 2.0 * pi * layer.z_mm / period
    along_x = abs(cos(height)) > abs(sin(height))
    return LinePattern(layer.angle_deg + (0.0 if along_x else 90.0), lambda box: _waves(box, period, height, along_x))


def _waves(box: Box, period: float, height: float, along_x: bool) -> Lines:
    """Two waves a period; in the frame turned by 90 degrees x is the gyroid's y and y its -x."""
    unit = period / (2.0 * pi)
    low, high = np.floor(box[0] / period * STEPS) - 1, np.ceil(box[2] / period * STEPS) + 1
    run = np.arange(low, high + 1) * (2.0 * pi / STEPS)
    rising, falling = _graphs(run, height) if along_x else _graphs_of_x(run, height)
    first, last = np.floor(box[1] / period) - 2, np.ceil(box[3] / period) + 2
    lines = [graph + 2.0 * pi * k for k in np.arange(first, last + 1) for graph in (rising, falling)]
    points = np.stack([np.stack([run, line], axis=1) for line in lines]) * unit
    return np.ascontiguousarray(points.reshape(-1, 2)), np.arange(len(lines)) * len(run)


def _graphs(x: Floats, z: float) -> tuple[Floats, Floats]:
    """The two y(x) of one period: sin x cos y + cos z sin y = -sin z cos x."""
    amplitude, phase = np.hypot(np.sin(x), cos(z)), np.arctan2(np.full_like(x, cos(z)), np.sin(x))
    away = np.arccos(np.clip(-sin(z) * np.cos(x) / amplitude, -1.0, 1.0))
    return phase + away, phase - away


def _graphs_of_x(y: Floats, z: float) -> tuple[Floats, Floats]:
    """The two -x(y) of one period: cos y sin x + sin z cos x = -sin y cos z."""
    amplitude, phase = np.hypot(np.cos(y), sin(z)), np.unwrap(np.arctan2(np.cos(y), np.full_like(y, sin(z))))
    away = np.arccos(np.clip(-np.sin(y) * cos(z) / amplitude, -1.0, 1.0))
    return -(phase + away), -(phase - away)
