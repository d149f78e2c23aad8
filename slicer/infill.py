"""Infill: sparse patterns; each pattern is a function of the area that returns polylines meeting a density."""

from collections.abc import Callable

from mdp.mesh import Floats
from slicer.bead import Bead, length_mm, spacing_mm
from slicer.hatch import hatched
from slicer.paths import Kind
from slicer.polygons import Polygons, closed, contours, grown

JOIN = 3.0  # spacings of solid lines: ends nearer than this are joined, farther ones would add plastic along the wall
RANK = 3


def infill(
    area: Polygons, pattern: str, density: float, angle_deg: float, layer: int, width_mm: float, height_mm: float, overlap: float
) -> list[Bead]:
    """Beads whose plastic is `density` (0..1) of area times height; `overlap` as for skin."""
    spacing = spacing_mm(width_mm, height_mm)
    inner = grown(area, -(0.5 * spacing - overlap * width_mm))
    if density <= 0 or inner.is_empty():
        return []
    lines = PATTERNS[pattern](inner, grown(area, -0.1 * width_mm), angle_deg, layer, spacing, density)
    return [Bead(Kind.INFILL, line, width_mm, RANK) for line in lines if length_mm(line) > width_mm]


def rectilinear(
    inner: Polygons, fence: Polygons, angle_deg: float, layer: int, spacing_mm: float, density: float
) -> list[Floats]:
    """Lines in one direction, turned by 90 degrees from layer to layer."""
    return hatched(inner, fence, angle_deg + 90.0 * (layer % 2), spacing_mm / density, JOIN * spacing_mm)


def grid(inner: Polygons, fence: Polygons, angle_deg: float, layer: int, spacing_mm: float, density: float) -> list[Floats]:
    """Two crossing directions in every layer."""
    apart = 2.0 * spacing_mm / density
    return [line for k in range(2) for line in hatched(inner, fence, angle_deg + 90.0 * k, apart, JOIN * spacing_mm)]


def triangles(inner: Polygons, fence: Polygons, angle_deg: float, layer: int, spacing_mm: float, density: float) -> list[Floats]:
    """Three directions in every layer."""
    apart = 3.0 * spacing_mm / density
    return [line for k in range(3) for line in hatched(inner, fence, angle_deg + 60.0 * k, apart, JOIN * spacing_mm)]


def concentric(inner: Polygons, fence: Polygons, angle_deg: float, layer: int, spacing_mm: float, density: float) -> list[Floats]:
    """Outlines shrunk step by step."""
    lines, area = [], grown(inner, -0.5 * (spacing_mm / density - spacing_mm))
    while not area.is_empty():
        lines += [closed(loop) for loop in contours(area)]
        area = grown(area, -spacing_mm / density)
    return lines


Pattern = Callable[[Polygons, Polygons, float, int, float, float], list[Floats]]
PATTERNS: dict[str, Pattern] = {"rectilinear": rectilinear, "grid": grid, "triangles": triangles, "concentric": concentric}
