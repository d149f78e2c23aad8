"""Infill: sparse patterns; a pattern gives the families of lines that one layer takes."""

from collections.abc import Callable, Sequence
from math import sqrt

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import Bead, spacing_mm
from slicer.fill.anchor import Limits, anchor_lines
from slicer.fill.gyroid import LENGTH, gyroid
from slicer.fill.honeycomb import honeycomb
from slicer.fill.pattern import LinePattern, PatternLayer, clip_pattern, parallel_lines
from slicer.geometry.clip import border_of, merge_pieces
from slicer.geometry.polygons import Polygons, close_loop, contours, offset
from slicer.geometry.polyline import length_mm
from slicer.paths import Kind

RANK = 3  # behind skins (slicer.fill.skin)
FAMILIES = {"grid": 2, "triangles": 3, "cubic": 3, "gyroid": 3, "honeycomb": 3}  # directions that share the lines; curves: cells
SAMPLES = 6  # layers from which the plastic of anchors is judged
MOST_SHIFT = 0.25  # of the density that anchors and joints may take from the pattern; small areas are mostly border


def infill_cell_mm(process: Process) -> float:
    """How far apart lines of the sparse infill lie at most, mm: what solid lines laid over it have to span; 0 without infill."""
    width = process.infill_line_width_mm or process.line_width_mm
    spacing, density = spacing_mm(width, process.layer_height_mm), process.infill_density
    return FAMILIES.get(process.infill_pattern, 1) * spacing / density if density > 0.0 else 0.0


def infill_beads(area: Polygons, process: Process, *, density: float, layer: int, z_mm: float, height_mm: float) -> list[Bead]:
    """Beads of the process's pattern in an area of a layer; density (0..1) of the pattern as pattern_density() gives it."""
    width, spacing = process.line_width_mm, spacing_mm(process.line_width_mm, height_mm)
    overlap = process.infill_overlap if process.walls else 0.0
    inner = area if area.is_empty() else offset(area, -(0.5 * spacing - overlap * width))
    if density <= 0 or inner.is_empty():
        return []
    if process.infill_pattern == "concentric":
        lines = _concentric(inner, spacing, density)
    else:
        drawn = PatternLayer(layer, z_mm, process.infill_angle_deg, spacing, density)
        border = border_of(inner)
        pieces = merge_pieces([clip_pattern(border, pattern) for pattern in PATTERNS[process.infill_pattern](drawn)])
        lines = anchor_lines(pieces, border, Limits(process.infill_anchor_mm, process.infill_joint_mm, width))
    return [Bead(Kind.INFILL, line, width, RANK) for line in lines if length_mm(line) > width]


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
        step = 0.25 * LENGTH * spacing / drawn / len(chosen)  # a gyroid's layers differ over a quarter of its period
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


def _rectilinear(layer: PatternLayer) -> list[LinePattern]:
    """Lines in one direction, turned by 90 degrees from layer to layer."""
    return [parallel_lines(layer.angle_deg + 90.0 * (layer.number % 2), layer.spacing_mm / layer.density)]


def _grid(layer: PatternLayer) -> list[LinePattern]:
    """Two crossing directions in every layer."""
    return [parallel_lines(layer.angle_deg + 90.0 * k, 2.0 * layer.spacing_mm / layer.density) for k in range(2)]


def _triangles(layer: PatternLayer) -> list[LinePattern]:
    """Three directions in every layer."""
    return [parallel_lines(layer.angle_deg + 60.0 * k, 3.0 * layer.spacing_mm / layer.density) for k in range(3)]


def _cubic(layer: PatternLayer) -> list[LinePattern]:
    """Cubes that stand on a corner: their faces, three families of planes, move sideways by z / sqrt(2)."""
    apart_mm, shift_mm = 3.0 * layer.spacing_mm / layer.density, layer.z_mm / sqrt(2.0)
    return [parallel_lines(layer.angle_deg + 120.0 * k, apart_mm, shift_mm) for k in range(3)]


def _concentric(inner: Polygons, spacing_mm: float, density: float) -> list[Floats]:
    """Outlines shrunk step by step."""
    lines, area = [], offset(inner, -0.5 * (spacing_mm / density - spacing_mm))
    while not area.is_empty():
        lines += [close_loop(loop) for loop in contours(area)]
        area = offset(area, -spacing_mm / density)
    return lines


PATTERNS: dict[str, Callable[[PatternLayer], list[LinePattern]]] = {
    "rectilinear": _rectilinear,
    "grid": _grid,
    "triangles": _triangles,
    "cubic": _cubic,
    "gyroid": lambda layer: [gyroid(layer)],
    "honeycomb": lambda layer: [honeycomb(layer)],
}
