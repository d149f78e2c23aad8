"""Polygons: sets of closed contours in the plane with booleans and offsets by manifold3d.CrossSection.

Outer contours run counter-clockwise, holes clockwise. Only the Positive fill rule is used, so every input must be oriented.
"""

from collections.abc import Sequence
from math import pi
from typing import TypeAlias

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType, OpType

from mdp.kernels.kernel import kernel
from mdp.mesh import Floats
from mdp.topology.cross_section import loop_edges
from slicer.geometry.polyline import length_mm

Polygons: TypeAlias = CrossSection

RESOLUTION_MM = 0.004  # no printer shows finer detail; keeps outer walls within 0.005 mm and the area of a layer within 0.05 mm2
CLOSING_MM = 0.018  # excess of plastic over a section, 4 % of a usual line, where a slit of twice this width is closed
TOUCHING_MM = 0.01  # points this close are equal
MITRE = 3.0  # times the distance: corners sharper than 39 degrees are cut off
ARC_SEGMENTS = 32  # in a full circle: a corner of half a line, 0.2 mm, is round to a micrometre
ROUNDING_MM2 = 1e-9  # an inward offset with less area left is empty
NEAR_MM, LEAST_MM2 = 1e-6, 1e-6  # a contour that is higher by more than this, and larger, is higher for Clipper2 as well


def clean(loops: Sequence[Floats], closing_mm: float = CLOSING_MM) -> Polygons:
    """Loops of a section, (n, 2) mm each, as overlap-free polygons without unprintably fine detail.

    Slits narrower than twice closing_mm are closed.
    """
    if not loops:
        return Polygons()
    whole = of_contours(loops).simplify(RESOLUTION_MM)
    return closing(whole, closing_mm) if closing_mm > 0.0 else whole


def offset(polygons: Polygons, distance_mm: float, mitre: float = MITRE) -> Polygons:
    """The polygons offset outward (negative: inward) by a distance, corners mitred up to `mitre` distances.

    >>> offset(Polygons.square((2.0, 1.0)), 0.5).area()
    6.0
    """
    return _moved(polygons, distance_mm, JoinType.Miter, mitre, 0)


def offset_round(polygons: Polygons, distance_mm: float, segments: int = ARC_SEGMENTS) -> Polygons:
    """The polygons offset outward (negative: inward) by a distance, with round corners; segments: of a full circle."""
    return _moved(polygons, distance_mm, JoinType.Round, MITRE, segments)


def _moved(polygons: Polygons, distance_mm: float, corners: JoinType, mitre: float, segments: int) -> Polygons:
    """The offset, with a workaround for polygons that Clipper2 takes to be inside out.

    It distinguishes outside and inside by the contour that reaches farthest along y (ClipperOffset, GetLowestClosedPathInfo); if
    that is a hole that touches its outer contour there, or a speck whose sign was lost by rounding, the result is empty. A square
    beyond it avoids that.
    """
    area_mm2, (x0, y0, x1, y1) = polygons.area(), polygons.bounds()
    has_room = area_mm2 >= pi * distance_mm**2 and min(x1 - x0, y1 - y0) >= -2.0 * distance_mm  # for a disc, on the way inward
    if polygons.is_empty() or (distance_mm < 0.0 and not has_room):
        return Polygons()
    moved = polygons.offset(distance_mm, corners, mitre, segments)
    if moved.area() >= (area_mm2 if distance_mm > 0.0 else ROUNDING_MM2) or _is_outer_highest(polygons):
        return moved
    reach = 2.0 * mitre * abs(distance_mm) + 1.0
    square = Polygons.square((reach, reach)).translate((x0, y1 + 2.0 * reach))
    beyond = Polygons.square((3.0 * reach, 3.0 * reach)).translate((x0 - reach, y1 + reach))
    return (polygons + square).offset(distance_mm, corners, mitre, segments) - beyond


def _is_outer_highest(polygons: Polygons) -> bool:
    """Whether the contour that extends farthest along y is certainly an outer one."""
    if polygons.num_contour() == 1:
        return bool(polygons.area() > LEAST_MM2)
    loops = contours(polygons)
    heights = [float(loop[:, 1].max()) for loop in loops]
    highest = max(range(len(loops)), key=heights.__getitem__, default=-1)
    alone = sum(height > heights[highest] - NEAR_MM for height in heights) == 1
    return alone and area_mm2(loops[highest]) > LEAST_MM2


def opening(polygons: Polygons, radius_mm: float) -> Polygons:
    """Morphological opening: the polygons without parts narrower than twice the radius."""
    core = offset(polygons, -radius_mm)
    return core if core.is_empty() else offset(core, radius_mm) ^ polygons


def closing(polygons: Polygons, radius_mm: float) -> Polygons:
    """Morphological closing: the polygons with slits narrower than twice the radius filled."""
    return offset(offset(polygons, radius_mm), -radius_mm)


def union(several: Sequence[Polygons]) -> Polygons:
    """The union of several polygons."""
    return Polygons.batch_boolean(list(several), OpType.Add) if several else Polygons()


def unite_layers(some: Sequence[Polygons], others: Sequence[Polygons]) -> list[Polygons]:
    """The unions of two sequences of polygons, layer by layer."""
    return [union(pair) for pair in zip(some, others, strict=True)]


def islands(polygons: Polygons) -> list[Polygons]:
    """The connected pieces, each with its holes.

    For manifold3d, a hole that touches its outer contour in some points is a separate piece of negative area; it is subtracted
    from the piece around it.
    """
    pieces = polygons.decompose() if not polygons.is_empty() else []
    whole = [piece for piece in pieces if piece.area() > 0.0]
    for hole in pieces if len(whole) < len(pieces) else []:
        if whole and hole.area() < 0.0:
            filled = Polygons([loop[::-1] for loop in contours(hole)], FillRule.Positive)
            at = max(range(len(whole)), key=lambda k: (filled ^ whole[k]).area())
            whole[at] = whole[at] - filled
    return whole


def larger(polygons: Polygons, least_mm2: float) -> Polygons:
    """The connected pieces with at least the given area."""
    if polygons.area() < least_mm2:
        return Polygons()
    pieces = islands(polygons)
    large = [piece for piece in pieces if piece.area() >= least_mm2]
    return polygons if len(large) == len(pieces) else Polygons.compose(large) if large else Polygons()


def strips_beside(area: Polygons, whole: Polygons, least_mm: float) -> list[Polygons]:
    """The strips narrower than least_mm between an area and the border of the whole."""
    left, touched = whole - area, offset(area, TOUCHING_MM)
    narrow = (left - opening(left, 0.5 * least_mm)) ^ offset(area, least_mm)
    return [piece for piece in islands(narrow) if not (piece ^ touched).is_empty()]


def bounding_box(polygons: Polygons, reach_mm: float) -> Polygons:
    """The axis-parallel bounding rectangle, extended by a reach."""
    x0, y0, x1, y1 = polygons.bounds()
    return rectangle(x0 - reach_mm, y0 - reach_mm, x1 + reach_mm, y1 + reach_mm)


def rectangle(x0: float, y0: float, x1: float, y1: float) -> Polygons:
    """The axis-parallel rectangle between two corners."""
    return Polygons.square((x1 - x0, y1 - y0)).translate((x0, y0))


def half_plane(polygons: Polygons, a: float, b: float, c: float) -> Polygons:
    """The part of polygons where a x + b y + c > 0; unchanged if that is nowhere negative."""
    if polygons.is_empty():
        return polygons
    x0, y0, x1, y1 = polygons.bounds()
    if c + min(a * x0, a * x1) + min(b * y0, b * y1) >= 0.0:
        return polygons
    if c + max(a * x0, a * x1) + max(b * y0, b * y1) <= 0.0:
        return Polygons()
    across = float(np.hypot(a, b))
    far = abs(c) / across + abs(x0) + abs(x1) + abs(y0) + abs(y1) + 1.0
    along = np.array([a, b]) / across
    aside = np.array([-along[1], along[0]]) * 2.0 * far
    near, end = along * (-c / across), along * 2.0 * far
    return polygons ^ Polygons([np.array([near - aside, end - aside, end + aside, near + aside])])


def strips(lines: Sequence[Floats], reach_mm: float | Floats) -> Polygons:
    """Area within a reach of lines (n, 2), with square ends; an array gives the reach of every segment."""
    starts, ends = np.concatenate([line[:-1] for line in lines]), np.concatenate([line[1:] for line in lines])
    steps = ends - starts
    along = steps * (reach_mm / np.maximum(np.hypot(*steps.T), 1e-9))[:, None]
    left = np.stack([-along[:, 1], along[:, 0]], axis=1)
    a, b = starts - along, ends + along
    return of_contours(list(np.stack([a - left, b - left, b + left, a + left], axis=1)))


def of_contours(loops: Sequence[Floats]) -> Polygons:
    """The polygons of oriented contours; contours taken from polygons may come out rounded."""
    return Polygons(list(loops), FillRule.Positive)


def contours(polygons: Polygons) -> list[Floats]:
    """The contours as (n, 2) arrays, without repeating the first point."""
    return [np.asarray(loop, dtype=np.float64) for loop in polygons.to_polygons() if len(loop) > 2]


def start_at(loop: Floats, at: int) -> Floats:
    """The loop (n, 2) rotated to start at another of its points."""
    return np.concatenate([loop[at:], loop[:at]])


def close_loop(loop: Floats) -> Floats:
    """The loop with its first point repeated at the end."""
    return np.concatenate([loop, loop[:1]])


def perimeter_mm(polygons: Polygons) -> float:
    """Length of all contours, mm."""
    return float(sum(length_mm(close_loop(loop)) for loop in contours(polygons)))


def edges(polygons: Polygons) -> Floats:
    """(n, 4) edges of all contours, x0 y0 x1 y1."""
    return loop_edges(contours(polygons))


@kernel
def area_mm2(loop: Floats) -> float:
    """Signed area of a loop by the shoelace formula, positive if counter-clockwise."""
    x0, y0 = loop[0, 0], loop[0, 1]
    doubled = 0.0
    for i in range(1, len(loop) - 1):
        doubled += (loop[i, 0] - x0) * (loop[i + 1, 1] - y0) - (loop[i + 1, 0] - x0) * (loop[i, 1] - y0)
    return 0.5 * doubled
