"""Bars: outlines of uniform thickness with a joint across the axis, and the stress of a load in the joint.

The bar's frame: origin at the centre of the joint, s along the axis, u across it in the plane of the outline. `bend`: a beam of
uniform section, clamped below the joint by a screw or a vice and pulled across at a notch. `tensile`: ISO 527-2 type 5A.
"""

from dataclasses import dataclass
from math import acos, cos, sin, tan

import manifold3d as m3
import numpy as np

from mdp.cut import Solid
from mdp.mesh import Floats

# ISO 527-2 type 5A, the same as ISO 37 type 2: widths of the narrow section and the ends, lengths of the narrow section and
# overall; the larger radius joins the narrow section. It must be 2 mm thick or more; at 4 mm it prints flat as well as upright.
NARROW_MM, END_MM, NARROW_LENGTH_MM, LENGTH_MM, INNER_MM, OUTER_MM = 4.0, 12.5, 25.0, 75.0, 12.5, 8.0
ARC_STEPS = 12
NOTCH_MM = 1.5
FOOT_MM, FOOT_HEIGHT_MM, SCREW_MM, SCREW_HEIGHT_MM = 10.0, 7.0, 4.3, 3.3
SHALLOWER = 0.85  # the lower outline is steeper than the bar's lean, by this fraction of its tangent
BASE_MM, BASE_HEIGHT_MM, BASE_AROUND_MM = 12.5, 3.0, 3.0
STROKE_MM, DIGIT_MM, ENGRAVED_MM = 0.8, (2.4, 4.0), 0.5
SEGMENTS = ("abcdef", "bc", "abdeg", "abcdg", "bcfg", "acdfg", "acdefg", "abc", "abcdefg", "abcdfg")


@dataclass(frozen=True)
class Shape:
    """Dimensions of a bar, mm: thickness, depth along the pull of a bending load at the joint, and distances from the joint to
    the pull (0: along the axis), to the centre of its number and to its upper end."""

    name: str
    thickness_mm: float
    depth_mm: float
    lever_mm: float
    number_mm: float
    above_mm: float

    def strength_mpa(self, load_n: float) -> float:
        """Stress in the joint at a load: M / W = 6 F L / (b d^2) for a beam, F / A for a tensile bar.

        >>> BEND.strength_mpa(64.0), TENSILE.strength_mpa(320.0)
        (9.0, 20.0)
        """
        area = self.thickness_mm * self.depth_mm
        return load_n * self.lever_mm * 6.0 / (area * self.depth_mm) if self.lever_mm > 0.0 else load_n / area


TENSILE = Shape("tensile", 4.0, NARROW_MM, 0.0, 30.0, 0.5 * LENGTH_MM)
BEND = Shape("bend", 6.0, 8.0, 9.0, 4.5, 11.5)
SHAPES = {shape.name: shape for shape in (BEND, TENSILE)}


def dumbbell() -> Floats:
    """(n, 2) u and s of the outline of ISO 527-2 type 5A, counter-clockwise."""
    steep = acos(1.0 - 0.5 * (END_MM - NARROW_MM) / (INNER_MM + OUTER_MM))
    ends = 0.5 * NARROW_LENGTH_MM + (INNER_MM + OUTER_MM) * sin(steep)
    turn = [steep * k / ARC_STEPS for k in range(ARC_STEPS + 1)]
    inner = [(0.5 * NARROW_MM + INNER_MM * (1.0 - cos(angle)), 0.5 * NARROW_LENGTH_MM + INNER_MM * sin(angle)) for angle in turn]
    outer = [(0.5 * END_MM - OUTER_MM * (1.0 - cos(angle)), ends - OUTER_MM * sin(angle)) for angle in turn[-2::-1]]
    side = np.array([*inner, *outer, (0.5 * END_MM, 0.5 * LENGTH_MM)])
    right = np.vstack([side[::-1] * [1.0, -1.0], side])
    return np.vstack([right, right[::-1] * [-1.0, 1.0]])


def upper(shape: Shape) -> m3.CrossSection:
    """Outline above the joint, in the bar's frame."""
    if shape.lever_mm == 0.0:
        return m3.CrossSection([dumbbell()]) ^ _box(-50.0, 0.0, 50.0, 50.0)
    half = 0.5 * shape.depth_mm
    notch = np.array([[-NOTCH_MM, 0.0], [0.0, -NOTCH_MM], [NOTCH_MM, 0.0], [0.0, NOTCH_MM]])
    beam = _box(-half, 0.0, half, shape.above_mm)
    places = np.array([[half, shape.lever_mm], [-half, shape.lever_mm]])
    return beam - m3.CrossSection([notch + place for place in places])


def least_height_mm(shape: Shape, lean_rad: float) -> float:
    """Least height of the joint above the plate that leaves space for the whole foot, or the end of a tensile bar."""
    if shape.lever_mm > 0.0:
        return FOOT_HEIGHT_MM + 3.0
    return 0.5 * LENGTH_MM * cos(lean_rad) + 0.5 * END_MM * sin(lean_rad)


def lower(shape: Shape, lean_rad: float, height_mm: float) -> m3.CrossSection:
    """Outline below the joint in a vertical plane: x away from the plate's centre, y up from the plate. The joint's centre is at
    x = 0 and a height; the bar leans outward."""
    if shape.lever_mm == 0.0:
        grip = _box(-0.5 * END_MM, -200.0, 0.5 * END_MM, -0.5 * LENGTH_MM + 1.0)
        bar = tilted(grip + m3.CrossSection([dumbbell()]) ^ _box(-50.0, -200.0, 50.0, 0.0), lean_rad, height_mm)
        return bar ^ _box(-200.0, 0.0, 200.0, 200.0)
    half = 0.5 * shape.depth_mm * np.array([cos(lean_rad), -sin(lean_rad)])
    out, into = np.array([0.0, height_mm]) + half, np.array([0.0, height_mm]) - half
    right = float(out[0]) - SHALLOWER * max(0.0, float(out[1]) - FOOT_HEIGHT_MM) * tan(lean_rad) if lean_rad else 0.5 * FOOT_MM
    foot = _box(right - FOOT_MM, 0.0, right, FOOT_HEIGHT_MM)
    hull = m3.CrossSection.hull_points(np.vstack([*foot.to_polygons(), out, into]))
    return hull - m3.CrossSection.circle(0.5 * SCREW_MM, 24).translate((right - 0.5 * FOOT_MM, SCREW_HEIGHT_MM))


def bar(shape: Shape, lean_rad: float, height_mm: float, number: int | None = None, lying: bool = False) -> Solid:
    """A whole bar in the plane of `lower`, on its side, with its number engraved in the upper face. A thin bar that will stand on
    its edge, y up, gets a wider base."""
    outline = lower(shape, lean_rad, height_mm) + tilted(upper(shape), lean_rad, height_mm)
    solid = m3.Manifold.extrude(outline, shape.thickness_mm)
    if number is not None:
        digits = tilted(_digits(number).translate((0.0, shape.number_mm)), lean_rad, height_mm)
        solid -= m3.Manifold.extrude(digits, 2.0 * ENGRAVED_MM).translate((0.0, 0.0, shape.thickness_mm - ENGRAVED_MM))
    return solid if lying or shape.lever_mm > 0.0 else solid + _base(solid, shape)


def _base(solid: Solid, shape: Shape) -> Solid:
    x0, _, _, x1, _, _ = solid.trim_by_plane((0.0, -1.0, 0.0), -BASE_HEIGHT_MM).bounding_box()
    base = m3.Manifold.cube((x1 - x0 + 2.0 * BASE_AROUND_MM, BASE_HEIGHT_MM, BASE_MM))
    return base.translate((x0 - BASE_AROUND_MM, 0.0, 0.5 * (shape.thickness_mm - BASE_MM)))


def stand(lying: Solid, shape: Shape, turn_rad: float, radius_mm: float) -> Solid:
    """A bar that was on its side, upright (y up), its x = 0 at a radius from the plate's centre, x outward at a turn."""
    out, aside = (cos(turn_rad), sin(turn_rad)), (sin(turn_rad), -cos(turn_rad))
    moved = lying.translate((radius_mm, 0.0, -0.5 * shape.thickness_mm))
    return moved.transform(np.array([[out[0], 0.0, aside[0], 0.0], [out[1], 0.0, aside[1], 0.0], [0.0, 1.0, 0.0, 0.0]]))


def tilted(outline: m3.CrossSection, lean_rad: float, height_mm: float) -> m3.CrossSection:
    """An outline of the bar's frame in the vertical plane of `lower`."""
    lean, up = (cos(lean_rad), -sin(lean_rad)), (sin(lean_rad), cos(lean_rad))
    return outline.transform(np.array([[lean[0], up[0], 0.0], [lean[1], up[1], height_mm]]))


def _digits(number: int) -> m3.CrossSection:
    """A number in seven segments, about the origin, for engraving."""
    wide, high = DIGIT_MM
    half = 0.5 * STROKE_MM
    strokes = {
        "a": (0.0, high, wide, high),
        "b": (wide, 0.5 * high, wide, high),
        "c": (wide, 0.0, wide, 0.5 * high),
        "d": (0.0, 0.0, wide, 0.0),
        "e": (0.0, 0.0, 0.0, 0.5 * high),
        "f": (0.0, 0.5 * high, 0.0, high),
        "g": (0.0, 0.5 * high, wide, 0.5 * high),
    }
    text = str(number)
    pitch = wide + 2.0 * STROKE_MM
    drawn = m3.CrossSection()
    for place, digit in enumerate(text):
        for segment in SEGMENTS[int(digit)]:
            x0, y0, x1, y1 = strokes[segment]
            drawn += _box(x0 - half, y0 - half, x1 + half, y1 + half).translate((place * pitch, 0.0))
    return drawn.translate((-0.5 * (wide + pitch * (len(text) - 1)), -0.5 * high))


def _box(x0: float, y0: float, x1: float, y1: float) -> m3.CrossSection:
    return m3.CrossSection.square((x1 - x0, y1 - y0)).translate((x0, y0))
