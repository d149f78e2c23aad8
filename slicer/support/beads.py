"""Auxiliary beads, which are printed for a part and removed from it: support, a pedestal, skirt and brim.

Support has outlines, sparse lines that stack, and dense lines next to the part. A pedestal lifts a model off the build plate. It
is printed like a raft, sparse under a closed roof, and breaks away: the roof ends a small gap below the model's first layer,
which is printed at its own height: it bonds to the roof only in spots, enough to hold the model upright and tilted, and comes off
by hand.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import takewhile
from math import ceil

import numpy as np

from mdp.cost.footing import tips_over
from mdp.kernels.arrays import flags, longs, table
from mdp.kernels.kernel import kernel
from mdp.mesh import Floats, Indices
from profiles.process import Process
from slicer.bead import OUTSIDE, Bead, spacing_mm, support_cell_mm, with_line_width
from slicer.fill.lines import clip_pattern, parallel_lines
from slicer.fill.skin import SolidLines, skin_beads
from slicer.geometry.clip import rotation_2d, runs_within
from slicer.geometry.edge_index import EdgeIndex, free, index_edges
from slicer.geometry.polygons import (
    Polygons,
    area_mm2,
    close_loop,
    closing,
    contours,
    islands,
    offset,
    offset_round,
    opening,
    start_at,
    union,
)
from slicer.geometry.polyline import Segment, length_mm
from slicer.paths import Kind
from slicer.sectioning import Sections
from slicer.support.reachable import SMOOTH_MM
from slicer.support.support import Supports

JOIN = 2.0  # spacings within which neighbouring lines are joined to a zigzag
ROOF_LAYERS = 3  # layers in the roof of a pedestal: the first one sags between the sparse lines, the last one is even
PEDESTAL_DENSITY = 0.25  # density inside a pedestal: lines close enough for the roof to span, as in a raft's base
SEAM = 0.1  # share of a line width: overlap of lines with the outline, which holds them
BRIM_RANK = -2000  # before all walls; the loops count down from it
LEAST_COVERED_MM2 = 1e-3  # smaller areas are rounding


def auxiliary_beads(supports: Supports, process: Process, layer: int) -> list[Bead]:
    """The support, pedestal, skirt and brim of a layer. process: of the layer."""
    sections = supports.sections
    outline, height_mm = sections.outlines[layer], float(sections.heights.height_mm[layer])
    on_plate = layer == 0 and sections.on_plate
    if on_plate and sections.on_raft:
        return []  # beside the first layer lies the raft (slicer.raft)
    support_process = with_line_width(process, process.support_line_width_mm)
    places = supports.areas[layer], supports.dense[layer], supports.hollow[layer]
    beads = support_beads(*places, support_process, height_mm, on_plate)
    if layer < sections.pedestal_layers:
        beads += pedestal_beads(outline, layer, sections.pedestal_layers, process, height_mm)
    if on_plate:
        base = outline if sections.pedestal_layers else sections.own[0]
        beads += beads_around(sections, union([base, supports.areas[0]]), base, process, height_mm)
    return beads


def support_beads(
    area: Polygons, dense: Polygons, hollow: Polygons, process: Process, height_mm: float, first: bool
) -> list[Bead]:
    """The beads of a layer's support: its dense area as an interface, hollow pieces without lines inside their walls. first: the
    first layer on the build plate, which is filled everywhere.
    """
    if area.is_empty():
        return []
    width = process.line_width_mm
    spacing = spacing_mm(width, height_mm)
    beads = [
        Bead(Kind.SUPPORT, close_loop(loop), width, OUTSIDE)
        for level in range(process.support_walls)
        for loop in contours(offset(area, -0.5 * width - level * spacing).simplify(SMOOTH_MM))
    ]
    edge = process.support_walls * spacing
    inner = offset(area, SEAM * width - edge) if edge else area
    roof = opening(_joined(dense, 0.5 * support_cell_mm(process), width) ^ inner, 0.5 * width)
    inner = inner if first or hollow.is_empty() else inner - hollow
    rest = inner if roof.is_empty() else opening(inner - roof, 0.25 * width)
    across_deg = process.infill_angle_deg + 90.0
    angles_deg = [process.infill_angle_deg] if process.support_pattern == "lines" else [process.infill_angle_deg, across_deg]
    density = (process.support_foot_density if first else process.support_density) / len(angles_deg)
    beads += [Bead(Kind.SUPPORT, line, width, OUTSIDE) for line in _lines(rest, angles_deg, density, process, spacing)]
    lines = _lines(roof, [across_deg], process.support_interface_density, process, spacing)
    return beads + [Bead(Kind.SUPPORT_INTERFACE, line, width, OUTSIDE) for line in lines]


def _joined(dense: Polygons, radius_mm: float, width_mm: float) -> Polygons:
    """Dense areas with gaps closed that are narrower than twice radius_mm, the distance between sparse lines.

    Lines that fill one large area lie beside each other; lines of many small areas would hang between the sparse lines.
    """
    if dense.num_contour() < 2:
        return dense
    joined = closing(dense, radius_mm)
    return joined if joined.area() > dense.area() + width_mm**2 else dense


def _lines(area: Polygons, angles_deg: Sequence[float], density: float, process: Process, spacing: float) -> list[Floats]:
    """Zigzag lines along each angle; if there are none, the area's outline, unless it already has one."""
    width = process.line_width_mm
    apart = spacing / density
    inner = offset(area, -0.5 * width)
    if inner.is_empty():
        return []
    joined = offset(area, -0.25 * width)
    lines = [line for angle_deg in angles_deg for line in zigzag_lines(inner, joined, angle_deg, apart, JOIN * apart)]
    return lines if lines or process.support_walls else [close_loop(loop) for loop in contours(inner)]


def zigzag_lines(area: Polygons, fence: Polygons, angle_deg: float, apart_mm: float, reach_mm: float) -> list[Floats]:
    """Lines (n, 2) on the grid of parallel_lines that end on the border of an area.

    Ends of neighbouring lines closer than reach_mm are joined unless the fence lies between them.
    """
    pieces = clip_pattern(index_edges(area), *parallel_lines(angle_deg, apart_mm))
    if not len(pieces.ends):
        return []
    number = np.rint((pieces.points[::2] @ rotation_2d(angle_deg))[:, 1] / apart_mm - 0.5)
    following = np.column_stack([np.searchsorted(number, number + 1.0, side) for side in ("left", "right")])
    points, starts = _join(pieces.points.reshape(-1, 4), following, index_edges(fence), reach_mm)
    return np.split(points, starts[1:])


@kernel
def _join(lines: Floats, following: Indices, fence: EdgeIndex, reach_mm: float) -> tuple[Floats, Indices]:
    """Lines (n, 4) joined end to end where a line of the next row begins within reach and no edge of the fence lies between.

    following: (n, 2) first of the next row's lines, and first after them. Returns points (n, 2) and the start of each polyline.
    """
    points, starts, used = table(2 * len(lines), 2), longs(len(lines), 0), flags(len(lines))
    n = count = 0
    for seed in range(len(lines)):
        if used[seed]:
            continue
        starts[count] = n
        count += 1
        at, end = seed, 2  # the column at which a line is left
        while at >= 0:
            used[at] = True
            for axis in range(2):
                points[n, axis], points[n + 1, axis] = lines[at, 2 - end + axis], lines[at, end + axis]
            x, y = points[n + 1, 0], points[n + 1, 1]
            n += 2
            best, best_end, nearest = -1, 0, reach_mm
            for k in range(following[at, 0], following[at, 1]):
                for begin in range(0, 0 if used[k] else 4, 2):
                    to_x, to_y = lines[k, begin], lines[k, begin + 1]
                    distance = np.hypot(to_x - x, to_y - y)
                    if distance < nearest and free(fence, Segment(x, y, to_x, to_y)):
                        best, best_end, nearest = k, 2 - begin, distance
            at, end = best, best_end
    return points[:n], starts[:count]


def pedestal_beads(outline: Polygons, layer: int, layers: int, process: Process, height_mm: float) -> list[Bead]:
    """One layer of the pedestal: a wall and sparse crossing lines, solid at the build plate and at the roof."""
    width, spacing = process.line_width_mm, spacing_mm(process.line_width_mm, height_mm)
    beads = [Bead(Kind.SUPPORT, close_loop(loop), width, OUTSIDE) for loop in contours(offset(outline, -0.5 * width))]
    inside = offset(outline, -0.5 * (width + spacing))
    angle = process.infill_angle_deg + 90.0 * (layer % 2)
    if layer == 0 or layer >= layers - ROOF_LAYERS:
        kind = Kind.SUPPORT if layer == 0 else Kind.SUPPORT_INTERFACE
        lines = skin_beads(inside, kind, SolidLines(angle, width, height_mm, process.infill_overlap))
        return beads + [Bead(kind, line.points, width, OUTSIDE, line.flow) for line in lines]
    inner, apart = offset(inside, -0.5 * spacing), spacing / PEDESTAL_DENSITY
    sparse = zigzag_lines(inner, offset(inside, -0.25 * width), angle, apart, JOIN * apart)
    return beads + [Bead(Kind.SUPPORT, line, width, OUTSIDE) for line in sparse]


def beads_around(sections: Sections, footprint: Polygons, base: Polygons, process: Process, height_mm: float) -> list[Bead]:
    """The brim of a first layer on the plate, outermost bead first so that it ends at the part, or else the loops of the skirt.

    footprint: the layer's whole area; base: the area on which the print stands. A base that would tip over gets a brim of
    process.small_base_brim_mm around it only, since around support it would hold nothing.
    """
    own = (sections.part, *takewhile(lambda part: not part.on_plate, sections.later))  # until the next model begins
    top_mm = max(float(part.mesh.bounds_mm[1, 2]) for part in own)
    spacing, beads = spacing_mm(process.line_width_mm, height_mm), list[Bead]()
    holds_base = process.brim_mm == 0.0 and process.small_base_brim_mm > 0.0 and tips_over(base, top_mm)
    width = process.small_base_brim_mm if holds_base else process.brim_mm
    if width > 0.0:
        count, nearest = max(ceil(width / spacing - 1e-9), 1), process.brim_gap_mm + 0.5 * spacing
        beads = _loops_around(footprint, sections.plate, process, nearest, spacing, count)
    if holds_base:
        beads = _near_base(beads, offset_round(base, nearest + (count - 0.5) * spacing), count)
    if beads or sections.part.index > 1:  # other models may stand where a skirt would go
        return beads
    nearest = process.skirt_distance_mm + 0.5 * process.line_width_mm
    return _loops_around(footprint, sections.plate, process, nearest, spacing, process.skirt_loops)


def _loops_around(
    footprint: Polygons, plate: Polygons, process: Process, nearest_mm: float, spacing: float, count: int
) -> list[Bead]:
    """Loops around an area as far as the plate has room, the first of them at a distance; outermost first, starting at the
    rear.
    """
    outside = Polygons([loop for loop in contours(footprint) if area_mm2(loop) > 0])  # without its holes
    beads, half = list[Bead](), 0.5 * process.line_width_mm
    for k in reversed(range(count)):
        # Along the plate's edge the loops lie beside each other as elsewhere; a loop without room is left out.
        around = offset_round(outside, nearest_mm + k * spacing) ^ offset(plate, -half - (count - 1 - k) * spacing)
        if (offset_round(outside, min(half, nearest_mm)) - around).area() > LEAST_COVERED_MM2:
            continue
        for loop in contours(around):
            if area_mm2(loop) > 0:
                rear = int(np.lexsort((loop[:, 0], -loop[:, 1]))[0])  # the leftmost of several
                points = close_loop(start_at(loop, rear))
                beads.append(Bead(Kind.SKIRT, points, process.line_width_mm, BRIM_RANK - k))
    return beads


def _near_base(loops: Sequence[Bead], near: Polygons, count: int) -> list[Bead]:
    """The pieces of a brim's loops near a base, by piece of the base. count: number of loops, for their ranks."""
    return [
        replace(loop, points=run, rank=loop.rank - count * number)
        for number, place in enumerate(islands(near))
        for loop in loops
        for run in runs_within(loop.points, place)
        if length_mm(run) > loop.width_mm
    ]
