"""Infill: sparse patterns; a pattern returns the families of lines for one layer.

Gyroid: the level layers of Schoen's minimal surface sin x cos y + sin y cos z + sin z cos x = 0 as wavy lines. At height z the
equation has the form A sin(u + phase) = B in one of x and y: in y when |cos z| > |sin z|, else in x; so every line is the graph
of a function and runs through the whole layer (PrusaSlicer's gyroid has the same lines).

Honeycomb: hexagons drawn by zigzag lines that lie side by side where neighbouring cells meet. Every line runs along one flat
side, over a slanted one, along the next flat side and back, so the flat sides are double; the frame turns by 60 degrees from
layer to layer, so that every side is double in one layer of three.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, pi, sin, sqrt

import numpy as np

from mdp.mesh import Floats
from profiles.process import Process
from profiles.settings.layers import Infill
from slicer.bead import Bead, infill_cell_mm, spacing_mm, with_line_width
from slicer.fill.lightning import lightning_lines
from slicer.fill.lines import Box, LinePattern, Lines, anchor_lines, clip_pattern, concentric_lines, grid_numbers, parallel_lines
from slicer.geometry.clip import merge_pieces, runs_within
from slicer.geometry.edge_index import index_edges
from slicer.geometry.polygons import Polygons, close_loop, closing, contours, offset, opening, strips, strips_beside, union
from slicer.geometry.polyline import length_mm
from slicer.heights import Heights
from slicer.modifiers import SLIT_MM, Place, combined
from slicer.paths import Kind

DENSE = 0.5  # infill with gaps below a line width supports skin without bridges
MIDDLE = 0.4  # line widths: offset of a wall from the one below at which its centre lies at the edge of that wall, or over infill
BEYOND = 0.5  # line widths by which a line under leaning walls extends beyond them
SHORTEST = 2.0  # line widths: a wall bridges shorter spans without a line under it
RANK = 3  # after skins (slicer.fill.skin)
# directions of the families of straight lines
TURNS_DEG = {"grid": [0.0, 90.0], "triangles": [0.0, 60.0, 120.0], "cubic": [0.0, 120.0, 240.0]}
SAMPLES = 6  # layers from which the plastic in anchors is measured
MOST_SHIFT = 0.25  # share of the density that anchors and joints may take from the pattern; small areas consist mostly of border
# Length of the lines in a square period, in periods, averaged over all heights, with chords instead of arcs; integrated
# numerically.
GYROID_LENGTH = 2.454
GYROID_STEPS = 20  # per period: chords deviate by up to 0.01 mm at a period of 5 mm
TURN_DEG = 60.0  # a third of the half turn after which lines repeat


@dataclass(frozen=True, eq=False)
class Filling:
    """A sparse infill. place: the modified area that has it, None for all the rest; density: density with which its pattern is
    drawn; lightning: its lines (n, 2) in every layer, for that pattern.
    """

    place: Place | None
    density: float
    lightning: Sequence[Sequence[Floats]] = ()

    def process(self, process: Process) -> Process:
        """The settings of a layer for this infill, with its line width."""
        own = process if self.place is None else self.place.over(process)
        return with_line_width(own, own.infill_line_width_mm)


def has_lightning(process: Process, places: Sequence[Place]) -> bool:
    """Whether any infill of a part has the lightning pattern, which is planned for all layers at once."""
    return any(own.infill_pattern == "lightning" for own in (process, *(place.over(process) for place in places)))


def plan_fillings(
    sparse: Sequence[Polygons], sections: Sequence[Polygons], process: Process, places: Sequence[Place], heights_mm: Floats
) -> list[Filling]:
    """The infills of a part, each with its pattern density.

    sparse: sparse area of each layer; sections: sections of the part itself.
    """
    fillings = [Filling(place, 0.0) for place in (None, *combined(places, Infill.model_fields))]
    areas: list[list[Polygons]] = [[] for _ in fillings]
    for layer, area in enumerate(sparse):
        for part, mine in zip(divided(area, fillings, layer, process, apart=True), areas, strict=True):
            mine.append(part)
    planned = []
    for filling, mine in zip(fillings, areas, strict=True):
        own = filling.process(process)
        if own.infill_pattern == "lightning" and own.infill_density > 0.0:
            spacing = spacing_mm(own.line_width_mm, own.layer_height_mm)
            solid = [section - area for section, area in zip(sections, sparse, strict=True)]
            lines = lightning_lines([_inner(area, own, spacing) for area in mine], solid, infill_cell_mm(own), heights_mm)
            planned.append(Filling(filling.place, own.infill_density, lines))
        else:
            planned.append(Filling(filling.place, pattern_density(mine, own, process.layer_height_mm)))
    return planned


def divided(sparse: Polygons, fillings: Sequence[Filling], layer: int, process: Process, *, apart: bool) -> list[Polygons]:
    """A layer's sparse area divided among the infills: later ones first, each with adjacent strips that are too narrow for lines
    of an earlier one. apart: keep the distance by which both overlap their borders, as into a wall.
    """
    left, parts, width_mm = sparse, list[Polygons](), process.line_width_mm
    apart_mm = 2.0 * process.infill_overlap * width_mm if apart and process.walls else 0.0
    for filling in reversed(fillings):
        if filling.place is None or left.is_empty():
            parts.append(left)
            left = Polygons()
            continue
        own = filling.place.areas[layer]
        own = own if own.is_empty() else opening(left ^ own, width_mm)
        own = own if own.is_empty() else closing(union([own, *strips_beside(own, left, 2.0 * width_mm)]), SLIT_MM)
        parts.append(own)
        left = left if own.is_empty() else left - offset(own, apart_mm)
    return parts[::-1]


def pattern_density(areas: Sequence[Polygons], process: Process, height_mm: float) -> float:
    """The density for drawing the pattern such that pattern and anchors together meet the process's density.

    areas: the sparse areas of all layers of a part. One figure for all layers, otherwise lines would not stack.
    """
    wanted = process.infill_density
    filled = [i for i, area in enumerate(areas) if not area.is_empty()]
    if not filled or wanted <= 0:
        return wanted
    chosen = sorted({filled[(2 * k + 1) * len(filled) // (2 * SAMPLES)] for k in range(SAMPLES)})
    spacing = spacing_mm(process.line_width_mm, height_mm)
    drawn = wanted
    for _ in range(2):
        step = 0.25 * GYROID_LENGTH * spacing / drawn / len(chosen)  # a gyroid's layers differ over a quarter of its period
        samples = [
            infill_beads(areas[i], process, density=drawn, layer=i, z_mm=(k + 0.5) * step, height_mm=height_mm)
            for k, i in enumerate(chosen)
        ]
        drawn_mm = sum(bead.length_mm for beads in samples for bead in beads)
        got = drawn_mm * spacing / sum(areas[i].area() for i in chosen)
        if got <= 0.0:
            return wanted
        drawn = min(max(drawn * wanted / got, wanted * (1.0 - MOST_SHIFT)), wanted * (1.0 + MOST_SHIFT))
    return drawn


def filling_beads(
    sparse: Polygons, leaning: Polygons, fillings: Sequence[Filling], process: Process, heights: Heights, layer: int
) -> list[Bead]:
    """Beads of all infills in the sparse area of a layer. process: the layer's settings.

    leaning: area where walls of the next layer leave those of this one; a line along it supports them.
    """
    width, z_mm, height_mm = process.line_width_mm, float(heights.tip_mm[layer]), float(heights.height_mm[layer])
    lines, sparse = _lines_under_walls(sparse, leaning, width, spacing_mm(width, height_mm))
    beads = [Bead(Kind.INFILL, line, width, RANK) for line in lines]
    for filling, area in zip(fillings, divided(sparse, fillings, layer, process, apart=True), strict=True):
        branches = filling.lightning[layer] if filling.lightning else ()
        own = filling.process(process)
        beads += infill_beads(area, own, density=filling.density, layer=layer, z_mm=z_mm, height_mm=height_mm, lightning=branches)
    return beads


def leaning_walls(
    sparse: Sequence[Polygons], sections: Sequence[Polygons], insides: Sequence[Polygons], runs: Sequence[range], width_mm: float
) -> list[Polygons]:
    """Area over the sparse area of each layer in which a wall of the next layer has its centre beside the wall below, as where a
    shape shrinks. runs: ranges of layers with known walls.
    """
    leaning = [Polygons()] * len(sparse)
    for layer in (layer for run in runs for layer in run[:-1]):
        over = sparse[layer] - insides[layer + 1]
        if over.area() > (MIDDLE * width_mm) ** 2:
            leaning[layer] = opening(over ^ sections[layer + 1], 0.5 * MIDDLE * width_mm)
    return leaning


def _lines_under_walls(sparse: Polygons, leaning: Polygons, width_mm: float, spacing_mm: float) -> tuple[list[Floats], Polygons]:
    """Lines along the border of a sparse area under leaning walls, and the remaining area."""
    middle = leaning if leaning.is_empty() else offset(sparse, -0.5 * spacing_mm)
    if middle.is_empty():
        return [], sparse
    room = offset(leaning, BEYOND * width_mm)
    lines = [
        line for loop in contours(middle) for line in runs_within(close_loop(loop), room) if length_mm(line) > SHORTEST * width_mm
    ]
    return lines, sparse - strips(lines, 0.5 * spacing_mm) if lines else sparse


def open_area(sparse: Polygons, fillings: Sequence[Filling], process: Process, layer: int, lightning: bool = True) -> Polygons:
    """The part of a layer's sparse area whose lines are too far apart to support skin without bridges. lightning: include that
    pattern, whose branches reach the ends of skins.
    """
    areas = zip(fillings, divided(sparse, fillings, layer, process, apart=False), strict=True)
    able = [(filling, area) for filling, area in areas if lightning or not filling.lightning]
    wide = [area for filling, area in able if filling.process(process).infill_density < DENSE]
    return wide[0] if len(wide) == 1 else union(wide)


def widest_cell_mm(fillings: Sequence[Filling], process: Process, layer: int) -> float:
    """Approximate distance of lines of the coarsest infill in a layer, mm."""
    there = [filling for filling in fillings if filling.place is None or not filling.place.areas[layer].is_empty()]
    return max(infill_cell_mm(filling.process(process)) for filling in there)


def infill_beads(
    area: Polygons,
    process: Process,
    *,
    density: float,
    layer: int,
    z_mm: float,
    height_mm: float,
    lightning: Sequence[Floats] = (),
) -> list[Bead]:
    """Beads of the process's pattern in an area of a layer. density (0..1): density for drawing the pattern, from
    pattern_density().

    lightning: the layer's lines of that pattern, which is planned for all layers at once.
    """
    width, spacing = process.line_width_mm, spacing_mm(process.line_width_mm, height_mm)
    inner, anchor_mm = _inner(area, process, spacing), 0.0
    if density <= 0 or inner.is_empty():
        return []
    if process.infill_pattern == "concentric":
        apart_mm = spacing / density
        lines = concentric_lines(offset(inner, -0.5 * (apart_mm - spacing)), apart_mm)
    elif process.infill_pattern == "lightning":
        lines = [run for branch in lightning for run in runs_within(branch, inner)]
    else:
        border = index_edges(inner)
        families = pattern_lines(process, layer, z_mm, spacing, density)
        pieces = merge_pieces([clip_pattern(border, angle_deg, draw) for angle_deg, draw in families])
        anchor_mm = process.infill_anchor_mm
        lines, _ = anchor_lines(pieces, border, (process.infill_joint_mm, anchor_mm, width))
    return [Bead(Kind.INFILL, line, width, RANK, anchor_mm=anchor_mm) for line in lines if length_mm(line) > width]


def _inner(area: Polygons, process: Process, spacing_mm: float) -> Polygons:
    """The area for centrelines of infill: half a line spacing from the walls, or less by infill_overlap."""
    overlap = process.infill_overlap if process.walls else 0.0
    return area if area.is_empty() else offset(area, -(0.5 * spacing_mm - overlap * process.line_width_mm))


def pattern_lines(process: Process, layer: int, z_mm: float, spacing_mm: float, density: float) -> list[LinePattern]:
    """The families of lines of the process's pattern in a layer, which share the density.

    z_mm: height of the layer; spacing_mm: line spacing of a solid fill.
    """
    pattern, angle_deg = process.infill_pattern, process.infill_angle_deg
    if pattern == "gyroid":
        return [gyroid(z_mm, angle_deg, spacing_mm, density)]
    if pattern == "honeycomb":
        return [honeycomb(layer, angle_deg, spacing_mm, density)]
    turns_deg = [90.0 * (layer % 2)] if pattern == "rectilinear" else TURNS_DEG[pattern]
    # cubes that stand on a corner: their faces, three families of planes, shift by z / sqrt(2)
    shift_mm = z_mm / sqrt(2.0) if pattern == "cubic" else 0.0
    return [parallel_lines(angle_deg + turn, len(turns_deg) * spacing_mm / density, shift_mm) for turn in turns_deg]


def honeycomb(number: int, angle_deg: float, spacing_mm: float, density: float) -> LinePattern:
    """Honeycomb zigzags of a density."""
    side = side_mm(spacing_mm, min(density, 1.0))
    return angle_deg + TURN_DEG * (number % 3), lambda box: _rows(box, side, spacing_mm)


def side_mm(spacing_mm: float, density: float) -> float:
    """Side a of the hexagons, mm: a strip of width sqrt(3)/2 a holds one line of length 3 a + 2 d / sqrt(3) per 3 a.

    d = sqrt(3)/2 a - spacing is the extent of the slanted sides between two flat ones.
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
    """Gyroid waves whose mean density over the layers is the given one."""
    period = GYROID_LENGTH * spacing_mm / density
    height = 2.0 * pi * z_mm / period
    along_x = abs(cos(height)) > abs(sin(height))
    return angle_deg + (0.0 if along_x else 90.0), lambda box: _waves(box, period, height, along_x)


def _waves(box: Box, period: float, height: float, along_x: bool) -> Lines:
    """Two waves per period; in the frame turned by 90 degrees x is the gyroid's y and y its -x."""
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
