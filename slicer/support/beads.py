"""Support beads: outlines, sparse lines that stand on each other, dense lines next to the part; and those of a pedestal.

A pedestal lifts a model off the platform. It is printed like a raft, sparse under a closed roof, and breaks away: the roof ends a
small gap below the model's first layer, which is printed at its own height: it bonds to the roof only here and there, enough to
hold the model upright and tilted, and comes off by hand.
"""

from collections.abc import Sequence

from mdp.mesh import Floats
from profiles.process import Process
from slicer.bead import OUTSIDE, Bead, spacing_mm
from slicer.fill.lines import zigzag_lines
from slicer.fill.skin import SolidLines, skin_beads
from slicer.geometry.polygons import Polygons, close_loop, contours, offset, opening
from slicer.paths import Kind

JOIN = 2.0  # spacings within which neighbouring lines are joined to a zigzag
ROOF_LAYERS = 3  # of a pedestal: the first of them sags between the sparse lines, the last one is even
PEDESTAL_DENSITY = 0.25  # of its inside: lines near enough for the roof to span, as a raft's base
SEAM = 0.1  # of a line width: lines overlap the outline by this and so hold on to it


def support_cell_mm(process: Process) -> float:
    """How far apart the sparse lines of support lie, mm: what dense lines laid over it have to span."""
    spacing = spacing_mm(process.support_line_width_mm or process.line_width_mm, process.layer_height_mm)
    return (1.0 if process.support_pattern == "lines" else 2.0) * spacing / process.support_density


def support_beads(area: Polygons, dense: Polygons, process: Process, height_mm: float, first: bool) -> list[Bead]:
    """The beads of a layer's support, its dense places as an interface; first: the first layer on the platform."""
    if area.is_empty():
        return []
    width = process.line_width_mm
    spacing = spacing_mm(width, height_mm)
    beads = [
        Bead(Kind.SUPPORT, close_loop(loop), width, OUTSIDE)
        for level in range(process.support_walls)
        for loop in contours(offset(area, -0.5 * width - level * spacing))
    ]
    edge = process.support_walls * spacing
    inner = offset(area, SEAM * width - edge) if edge else area
    roof = opening(inner ^ dense, 0.5 * width) if not dense.is_empty() else dense
    rest = inner if roof.is_empty() else opening(inner - roof, 0.25 * width)
    across_deg = process.infill_angle_deg + 90.0
    angles_deg = [process.infill_angle_deg] if process.support_pattern == "lines" else [process.infill_angle_deg, across_deg]
    density = (process.support_foot_density if first else process.support_density) / len(angles_deg)
    beads += [Bead(Kind.SUPPORT, line, width, OUTSIDE) for line in _lines(rest, angles_deg, density, process, spacing)]
    lines = _lines(roof, [across_deg], process.support_interface_density, process, spacing)
    return beads + [Bead(Kind.SUPPORT_INTERFACE, line, width, OUTSIDE) for line in lines]


def _lines(area: Polygons, angles_deg: Sequence[float], density: float, process: Process, spacing: float) -> list[Floats]:
    """Zigzags along each angle; where none meets the area its outline, unless it has one already."""
    width = process.line_width_mm
    apart = spacing / density
    inner = offset(area, -0.5 * width)
    if inner.is_empty():
        return []
    joined = offset(area, -0.25 * width)
    lines = [line for angle_deg in angles_deg for line in zigzag_lines(inner, joined, angle_deg, apart, JOIN * apart)]
    return lines if lines or process.support_walls else [close_loop(loop) for loop in contours(inner)]


def pedestal_beads(outline: Polygons, layer: int, layers: int, process: Process, height_mm: float) -> list[Bead]:
    """One layer of the pedestal: a wall, sparse crossing lines, closed at the platform and at the roof."""
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
