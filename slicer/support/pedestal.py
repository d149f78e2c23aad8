"""Pedestal: what lifts a model off the platform is printed like a raft, sparse under a closed roof, and breaks away.

The roof ends a small gap below the model's first layer, which is printed at its own height: it bonds to the roof only here and
there, enough to hold the model upright and tilted, and comes off by hand.
"""

from collections.abc import Sequence

import numpy as np

from mdp.mesh import Floats, Mesh
from mdp.overhang import PLATFORM_TOLERANCE_MM
from profiles.process import Process
from slicer.bead import OUTSIDE, Bead, spacing_mm
from slicer.fill.pattern import zigzag_lines
from slicer.fill.skin import SolidLines, skin_beads
from slicer.geometry.cross_section import cross_sections
from slicer.geometry.polygons import Polygons, clean, close_loop, contours, offset
from slicer.paths import Kind

ROOF_LAYERS = 3  # the first of them sags between the sparse lines, the last one is even
DENSITY = 0.25  # of its inside: lines near enough for the roof to span, as a raft's base
ABOVE_MM = 1e-3  # off the height itself, at which level faces lie


def pedestal_layers(tip_mm: Floats, pedestal_mm: float) -> int:
    """How many layers belong to the pedestal."""
    return int(np.searchsorted(tip_mm, pedestal_mm + 1e-6))


def without_pedestal(
    outlines: Sequence[Polygons], mesh: Mesh, cuts_mm: Floats, pedestal_mm: float, layers: int
) -> list[Polygons]:
    """Outlines of the model alone: empty in the pedestal, and its own foot where it is sunk into the pedestal's top."""
    sunk_mm = pedestal_mm + PLATFORM_TOLERANCE_MM
    foot = clean(cross_sections(mesh, np.array([sunk_mm + ABOVE_MM]))[0])
    if foot.is_empty():
        foot = outlines[-1]
    above = [o ^ foot if cut < sunk_mm else o for o, cut in zip(outlines[layers:], cuts_mm[layers:].tolist(), strict=True)]
    return [*([Polygons()] * layers), *above]


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
    inner = offset(inside, -0.5 * spacing)
    return beads + [
        Bead(Kind.SUPPORT, line, width, OUTSIDE)
        for line in zigzag_lines(inner, offset(inside, -0.25 * width), angle, spacing / DENSITY, 2.0 * spacing / DENSITY)
    ]
