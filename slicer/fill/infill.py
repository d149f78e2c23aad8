"""Infill: sparse patterns; a pattern gives the families of lines that one layer takes.

Gyroid: the level layers of Schoen's minimal surface sin x cos y + sin y cos z + sin z cos x = 0 as wavy lines. At height z the
equation has the form A sin(u + phase) = B in one of x and y: in y when |cos z| > |sin z|, else in x; so every line is the graph
of a function and runs through the whole layer (PrusaSlicer's gyroid has the same lines).

Honeycomb: hexagons drawn by zigzag lines that lie side by side where neighbouring cells meet. Every line runs along one flat
side, over a slanted one, along the next flat side and back, so the flat sides are double; the frame turns by 60 degrees from
layer to layer, so that every side is double in one layer of three.
"""

from collections.abc import Sequence
from math import cos, pi, sin, sqrt

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead, spacing_mm
from slicer.fill.lines import (
    Box,
    LinePattern,
    Lines,
    anchor_lines,
    clip_pattern,
    concentric_lines,
    grid_numbers,
    parallel_lines,
)
from slicer.geometry.clip import merge_pieces
from slicer.geometry.edge_index import index_edges
from slicer.geometry.polygons import Polygons, offset
from slicer.geometry.polyline import length_mm
from slicer.paths import Kind

RANK = 3  # behind skins (slicer.fill.skin)
FAMILIES = {"grid": 2, "triangles": 3, "cubic": 3, "gyroid": 3, "honeycomb": 3}  # directions that share the lines; curves: cells
TURNS_DEG = {"grid": [0.0, 90.0], "triangles": [0.0, 60.0, 120.0], "cubic": [0.0, 120.0, 240.0]}  # of straight families
SAMPLES = 6  # layers from which the plastic of anchors is judged
MOST_SHIFT = 0.25  # of the density that anchors and joints may take from the pattern; small areas are mostly border
# Length of the lines in a square period, in periods, averaged over all heights, chords in place of arcs; integrated numerically.
GYROID_LENGTH = 2.454
GYROID_STEPS = 20  # a period: the chords stay within 0.01 mm at a period of 5 mm
TURN_DEG = 60.0  # a third of the half turn after which lines are themselves again


def infill_cell_mm(process: Process) -> float:
    """About how far apart lines of the sparse infill lie, mm: what solid lines laid over it have to span; 0 without infill."""
    width = process.infill_line_width_mm or process.line_width_mm
    spacing, density = spacing_mm(width, process.layer_height_mm), process.infill_density
    return FAMILIES.get(process.infill_pattern, 1) * spacing / density if density > 0.0 else 0.0


def pattern_density(areas: Sequence[Polygons], process: Process, height_mm: float) -> float:
    """The density to draw the pattern with so that it meets the process's density together with its anchors.

    areas: the sparse areas of all layers of a part. One figure for all of them, or lines would not stand on each other.
    """
    asked = process.infill_density
    filled = [i for i, area in enumerate(areas) if not area.is_empty()]
    if not filled or asked <= 0:
        return asked
    chosen = sorted({filled[(2 * k + 1) * len(filled) // (2 * SAMPLES)] for k in range(SAMPLES)})
    spacing = spacing_mm(process.line_width_mm, height_mm)
    drawn = asked
    for _ in range(2):
        step = 0.25 * GYROID_LENGTH * spacing / drawn / len(chosen)  # a gyroid's layers differ over a quarter of its period
        samples = [
            infill_beads(areas[i], process, density=drawn, layer=i, z_mm=(k + 0.5) * step, height_mm=height_mm)
            for k, i in enumerate(chosen)
        ]
        drawn_mm = sum(bead.length_mm for beads in samples for bead in beads)
        got = drawn_mm * spacing / sum(areas[i].area() for i in chosen)
        if got <= 0.0:
            return asked
        drawn = min(max(drawn * asked / got, asked * (1.0 - MOST_SHIFT)), asked * (1.0 + MOST_SHIFT))
    return drawn


def infill_beads(area: Polygons, process: Process, *, density: float, layer: int, z_mm: float, height_mm: float) -> list[Bead]:
    """Beads of the process's pattern in an area of a layer; density (0..1) of the pattern as pattern_density() gives it."""
    width, spacing = process.line_width_mm, spacing_mm(process.line_width_mm, height_mm)
    overlap = process.infill_overlap if process.walls else 0.0
    inner = area if area.is_empty() else offset(area, -(0.5 * spacing - overlap * width))
    if density <= 0 or inner.is_empty():
        return []
    if process.infill_pattern == "concentric":
        apart_mm = spacing / density
        lines = concentric_lines(offset(inner, -0.5 * (apart_mm - spacing)), apart_mm)
    else:
        border = index_edges(inner)
        families = pattern_lines(process, layer, z_mm, spacing, density)
        pieces = merge_pieces([clip_pattern(border, angle_deg, draw) for angle_deg, draw in families])
        lines = anchor_lines(pieces, border, process.infill_joint_mm, process.infill_anchor_mm, width)
    return [Bead(Kind.INFILL, line, width, RANK) for line in lines if length_mm(line) > width]


def pattern_lines(process: Process, layer: int, z_mm: float, spacing_mm: float, density: float) -> list[LinePattern]:
    """The families of lines that the process's pattern has in a layer, which share the density.

    z_mm: height of the layer; spacing_mm: of lines that fill an area completely.
    """
    pattern, angle_deg = process.infill_pattern, process.infill_angle_deg
    if pattern == "gyroid":
        return [gyroid(z_mm, angle_deg, spacing_mm, density)]
    if pattern == "honeycomb":
        return [honeycomb(layer, angle_deg, spacing_mm, density)]
    turns_deg = [90.0 * (layer % 2)] if pattern == "rectilinear" else TURNS_DEG[pattern]
    # cubes that stand on a corner: their faces, three families of planes, move sideways by z / sqrt(2)
    shift_mm = z_mm / sqrt(2.0) if pattern == "cubic" else 0.0
    return [parallel_lines(angle_deg + turn, len(turns_deg) * spacing_mm / density, shift_mm) for turn in turns_deg]


def honeycomb(number: int, angle_deg: float, spacing_mm: float, density: float) -> LinePattern:
    """Zigzags of the density."""
    side = side_mm(spacing_mm, min(density, 1.0))
    return angle_deg + TURN_DEG * (number % 3), lambda box: _rows(box, side, spacing_mm)


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


def gyroid(z_mm: float, angle_deg: float, spacing_mm: float, density: float) -> LinePattern:
    """Waves whose plastic is the density on average over the layers."""
    period = GYROID_LENGTH * spacing_mm / density
    height = 2.0 * pi * z_mm / period
    along_x = abs(cos(height)) > abs(sin(height))
    return angle_deg + (0.0 if along_x else 90.0), lambda box: _waves(box, period, height, along_x)


def _waves(box: Box, period: float, height: float, along_x: bool) -> Lines:
    """Two waves a period; in the frame turned by 90 degrees x is the gyroid's y and y its -x."""
    unit = period / (2.0 * pi)
    low, high = np.floor(box[0] / period * GYROID_STEPS) - 1, np.ceil(box[2] / period * GYROID_STEPS) + 1
    run = np.arange(low, high + 1) * (2.0 * pi / GYROID_STEPS)
    if along_x:  # cos z sin y + sin x cos y = -sin z cos x
        graphs = _solutions(np.full_like(run, cos(height)), np.sin(run), sin(height) * np.cos(run))
    else:  # cos y sin x + sin z cos x = -sin y cos z, for -x
        graphs = [-x for x in _solutions(np.cos(run), np.full_like(run, sin(height)), np.sin(run) * cos(height))]
    first, last = np.floor(box[1] / period) - 2, np.ceil(box[3] / period) + 2
    lines = [graph + 2.0 * pi * k for k in np.arange(first, last + 1) for graph in graphs]
    points = np.stack([np.stack([run, line], axis=1) for line in lines]) * unit
    return np.ascontiguousarray(points.reshape(-1, 2)), np.arange(len(lines)) * len(run)


def _solutions(a: Floats, b: Floats, c: Floats) -> list[Floats]:
    """The two solutions u of a sin u + b cos u = -c in one period."""
    phase, away = np.unwrap(np.arctan2(a, b)), np.arccos(np.clip(-c / np.hypot(b, a), -1.0, 1.0))
    return [phase + away, phase - away]
