"""Strokes: what the shapes of a layer amount to when they are printed: length, time, plastic and how many strokes there are.

A straight pattern of lines a distance s apart crosses the boundary of an area of perimeter P about 2 P / (pi s) times
(Cauchy-Crofton), so it has P / (pi s) lines, whatever the shape.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, pi, radians, sin, sqrt

from mdp.mesh import Floats
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import bulge_flow, outer_wall_width_mm, spacing_mm
from slicer.estimate.duration import line_s, loop_s
from slicer.estimate.hanging import ThickSupport
from slicer.estimate.shell import Extent, Shell
from slicer.geometry.polygons import close_loop
from slicer.geometry.polyline import length_mm
from slicer.paths import Kind, bead_area_mm2
from slicer.strokes.speed import axes_mm_s2, stroke_accelerations, stroke_speeds

NARROW_STROKE_MM = 10.0  # a stroke in a narrow place is hardly longer before its width changes
SPREAD = (0.3, 1.7)  # times the mean: lines of a pattern are of all lengths, and short ones cost more than their share
SKIN_GAPS = 0.01  # of a skin's area is filled by single short strokes, fitted to gap strokes of 60 parts
SKIN_GAP_MM = 2.5  # length of such a stroke
SHALLOW = 0.5  # of the line width: how wide such a stroke is


@dataclass(frozen=True)
class Strokes:
    """All strokes of one kind in a layer: their length, their time at speed_mm_s with acceleration, their plastic, their number.

    pieces: connected pieces of the area that lines fill.
    """

    kind: Kind
    length_mm: float
    time_s: float
    speed_mm_s: float
    mm3: float
    count: float
    pieces: int = 0


@dataclass(frozen=True)
class LayerSpeeds:
    """How fast a layer of that height is printed; fixed_mm_s replaces the process's speeds by kind; first: of part 1."""

    profile: Profile
    height_mm: float
    fixed_mm_s: Mapping[Kind, float] | None = None
    first: bool = False

    @property
    def junction_mm_s(self) -> float:
        """Speed change at a corner."""
        return self.profile.machine.junction_speed_mm_s

    def speed_mm_s(self, kind: Kind, bead_mm2: float, small: bool = False) -> float:
        """Of a kind of bead with that cross-section, no faster than the hot end melts."""
        process = self.profile.process
        speed = (self.fixed_mm_s or stroke_speeds(process))[kind]
        if small and self.fixed_mm_s is None:
            speed = min(speed, process.small_wall_speed_mm_s)
        return min(speed, self.profile.material.volumetric_limit_mm3_s / bead_mm2)

    def acceleration_mm_s2(self, kind: Kind) -> float:
        """Of each axis in strokes of a kind."""
        axes, asked = axes_mm_s2(self.profile), stroke_accelerations(self.profile, self.first)
        return axes if asked is None else min(asked[kind], axes)


def shell_strokes(shell: Shell, process: Process, speeds: LayerSpeeds) -> list[Strokes]:
    """The strokes of a layer's walls, narrow places, skin and infill."""
    height, width = speeds.height_mm, process.line_width_mm
    strokes: list[Strokes] = []
    for level, loops in enumerate(shell.walls):
        kind, own = (Kind.INNER_WALL, width) if level else (Kind.OUTER_WALL, outer_wall_width_mm(process))
        flow = 1.0 if level else bulge_flow(own, height, 1, process.outer_bulge * own)
        strokes += loop_strokes(kind, loops, bead_area_mm2(own, height) * flow, process.small_wall_mm, speeds)
    for level, extent in enumerate(shell.narrow):
        strokes += _narrow_strokes(Kind.INNER_WALL if level else Kind.OUTER_WALL, extent, speeds)
    if shell.ending.area_mm2 > 0.0:
        total = shell.ending.area_mm2 / spacing_mm(width, height)
        count = max(1, shell.ending.pieces) * max(1, process.walls - process.interface_walls)
        strokes += _single_strokes(Kind.INNER_WALL, total, shell.ending.area_mm2 * height, count, speeds)
    angle = process.infill_angle_deg
    strokes += line_strokes(Kind.SKIN, shell.skin, speeds, density=1.0, width_mm=width, angle_deg=angle)
    strokes += _skin_gaps(shell.skin, width, speeds)
    sparse = process.infill_line_width_mm or width
    density = process.infill_density
    return strokes + line_strokes(Kind.INFILL, shell.sparse, speeds, density=density, width_mm=sparse, angle_deg=angle)


def loop_strokes(kind: Kind, loops: Sequence[Floats], bead_mm2: float, small_mm: float, speeds: LayerSpeeds) -> list[Strokes]:
    """Closed strokes (n, 2) with beads of that cross-section; those up to small_mm have the speed of small walls."""
    strokes = []
    lengths = [length_mm(close_loop(loop)) for loop in loops]
    for small in (True, False):
        some = [(loop, length) for loop, length in zip(loops, lengths, strict=True) if (length <= small_mm) == small]
        if some:
            speed = speeds.speed_mm_s(kind, bead_mm2, small)
            acceleration = speeds.acceleration_mm_s2(kind)
            time = sum(loop_s(loop, speed, acceleration, speeds.junction_mm_s) for loop, _ in some)
            total = sum(length for _, length in some)
            strokes.append(Strokes(kind, total, time, speed, total * bead_mm2, len(some)))
    return strokes


def line_strokes(
    kind: Kind, area: Extent, speeds: LayerSpeeds, *, density: float, width_mm: float, angle_deg: float
) -> list[Strokes]:
    """Straight lines at an angle that fill a share of an area, each joined to the next along the border."""
    if area.area_mm2 <= 0.0 or density <= 0.0:
        return []
    spacing, bead_mm2 = spacing_mm(width_mm, speeds.height_mm), bead_area_mm2(width_mm, speeds.height_mm)
    total = area.area_mm2 * density / spacing
    count = area.boundary_mm * density / (pi * spacing)
    mean_mm = total / count
    joint = min(sqrt(2.0) * spacing / density, 0.5 * mean_mm)
    speed = speeds.speed_mm_s(kind, bead_mm2)
    slant = max(abs(cos(radians(angle_deg))), abs(sin(radians(angle_deg))))
    acceleration = speeds.acceleration_mm_s2(kind) / slant
    lengths = [joint, joint, *(share * (mean_mm - joint) for share in SPREAD)]
    time = 0.5 * count * sum(line_s(length, speed, acceleration, speeds.junction_mm_s) for length in lengths)
    return [Strokes(kind, total, time, speed, total * bead_mm2, count, area.pieces)]


def support_strokes(support: ThickSupport, z_mm: float, process: Process, speeds: LayerSpeeds, first: bool) -> list[Strokes]:
    """The strokes of the support at a height; first: the first layer on the platform."""
    k = support.at(z_mm)
    if k is None:
        return []
    width, angle = process.support_line_width_mm or process.line_width_mm, process.infill_angle_deg
    bead_mm2 = bead_area_mm2(width, speeds.height_mm)
    strokes = loop_strokes(Kind.SUPPORT, support.walls[k] * process.support_walls, bead_mm2, 0.0, speeds)
    walled_mm2 = sum(loops.length_mm for loops in strokes) * spacing_mm(width, speeds.height_mm)
    whole = support.areas[k]
    inside = max(whole.area_mm2 - walled_mm2, 0.0)
    share = min(speeds.height_mm / float(support.height_mm[k]), 1.0)
    dense = min(support.contacts[k].area_mm2 * process.support_interface_layers * share, inside)
    if inside <= 0.0:
        return strokes
    boundary = whole.boundary_mm / inside
    density = process.support_foot_density if first else process.support_density
    sparse = Extent(inside - dense, boundary * (inside - dense), whole.pieces)
    roof = Extent(dense, boundary * dense, whole.pieces)
    strokes += line_strokes(Kind.SUPPORT, sparse, speeds, density=density, width_mm=width, angle_deg=angle)
    density = process.support_interface_density
    return strokes + line_strokes(Kind.SUPPORT_INTERFACE, roof, speeds, density=density, width_mm=width, angle_deg=angle)


def _narrow_strokes(kind: Kind, extent: Extent, speeds: LayerSpeeds) -> list[Strokes]:
    """Single strokes along the middle of narrow places."""
    if extent.area_mm2 <= 0.0:
        return []
    total = 0.5 * extent.boundary_mm
    count = max(float(extent.pieces), total / NARROW_STROKE_MM)
    return _single_strokes(kind, total, extent.area_mm2 * speeds.height_mm, count, speeds)


def _skin_gaps(skin: Extent, width_mm: float, speeds: LayerSpeeds) -> list[Strokes]:
    """The short strokes where no line of a skin fits; their plastic counts as the skin's."""
    total = SKIN_GAPS * skin.area_mm2 / (SHALLOW * width_mm)
    return _single_strokes(Kind.GAP, total, 0.0, total / SKIN_GAP_MM, speeds) if total > 0.0 else []


def _single_strokes(kind: Kind, total_mm: float, mm3: float, count: float, speeds: LayerSpeeds) -> list[Strokes]:
    speed = speeds.speed_mm_s(kind, max(mm3 / total_mm, 1e-9))
    time = count * line_s(total_mm / count, speed, speeds.acceleration_mm_s2(kind), 0.0)
    return [Strokes(kind, total_mm, time, speed, mm3, count)]
