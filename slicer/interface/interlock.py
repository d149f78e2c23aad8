"""Interlock: shallow grooves that a part leaves where a later one will stand on it, and the plastic that flows into them.

The later part's first layer is printed at its ordinary height with as much more plastic over the grooves as they hold, so the
tip never dips below the surface; ridges and fillings then also hold each other sideways.
"""

from collections.abc import Sequence
from dataclasses import replace

import manifold3d as m3
import numpy as np

from mdp.cut import mesh_of
from mdp.decomposition import Part
from mdp.mesh import Floats
from profiles.process import Process
from profiles.profile import Profile
from slicer.bead import interface_process
from slicer.geometry.cross_section import cross_sections
from slicer.geometry.polygons import Polygons, clean, offset
from slicer.interface.interface import BELOW_MM, frame_change
from slicer.paths import Kind
from slicer.strokes.split import split
from slicer.strokes.strokes import Strokes

STRIPE = 2.0  # line widths: grooves and ridges as wide as two beads can be printed
SKINS = (Kind.SKIN, Kind.TOP_SKIN, Kind.BRIDGE)


def grooves(part: Part, process: Process) -> Polygons:
    """Grooves under a part's base, in its frame: stripes along x that end before the walls, so that none is seen."""
    base = clean(cross_sections(part.in_part_frame(), np.array([BELOW_MM]))[0])
    first = interface_process(process)
    inside = offset(base, -(first.walls + 1) * first.line_width_mm) if not base.is_empty() else base
    if inside.is_empty():
        return inside
    x0, y0, x1, y1 = inside.bounds()
    wide = STRIPE * process.line_width_mm
    stripe = Polygons.square((x1 - x0 + 2.0, wide))
    rows = np.arange(np.floor(y0 / (2.0 * wide)), np.ceil(y1 / (2.0 * wide)) + 1)
    return inside ^ Polygons.compose([stripe.translate((x0 - 1.0, 2.0 * wide * row)) for row in rows])


def cut_grooves(
    outlines: Sequence[Polygons], part: Part, later: Sequence[Part], cuts_mm: Floats, profile: Profile
) -> list[Polygons]:
    """The part's outlines without the grooves of the parts that will stand on it; profile: of the whole print."""
    left = list(outlines)
    for upper in later:
        process = profile.of_part(upper.index).process
        if process.interlock != "grooves":
            continue
        area = grooves(upper, process)
        if area.is_empty():
            continue
        solid = m3.Manifold.extrude(area, 2.0 * process.interlock_mm).translate((0.0, 0.0, -process.interlock_mm))
        loops = cross_sections(mesh_of(solid).transform(*frame_change(upper, part)), cuts_mm)
        left = [o - Polygons(cut) if cut else o for o, cut in zip(left, loops, strict=True)]
    return left


def fill_grooves(strokes: Strokes, part: Part, process: Process, height_mm: float) -> Strokes:
    """The first layer's strokes of a part on plastic, richer over its grooves by what they hold."""
    area = grooves(part, process)
    if area.is_empty():
        return strokes
    richer = 1.0 + process.interlock_mm / height_mm
    strokes, within = split(strokes, area, strokes.is_of(*SKINS), process.line_width_mm)
    return replace(strokes, flow=np.where(within, strokes.flow * richer, strokes.flow))
