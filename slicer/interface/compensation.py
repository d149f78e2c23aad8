"""Compensation: layers whose outsides and holes are larger or smaller, so that the print's sizes are the model's.

Plastic bulges and shrinks where it meets air. A cut face meets plastic: what lies beside it, of a part printed later, stays where
it is, or the parts would leave a gap or be pressed into each other. Nor does what is added beside the end of a cut reach over the
later part's base plane, above which the head moves; over that of a limb only beside the limb.
"""

from collections.abc import Sequence

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats
from profiles.process import Process
from slicer.geometry.polygons import Polygons, area_mm2, closing, contours, half_plane, islands, offset, union
from slicer.heights import Heights
from slicer.interface.base_plane import BasePlane
from slicer.interface.interface import frame_change, plane_in_frame_of
from slicer.interface.limb import shadow_of

TOUCHING_MM = 0.01  # sections of parts on either side of a cut are joined over such gaps
BESIDE_MM = 1.0  # within this distance of a limb the head moves above its base plane


def reach_mm(process: Process) -> float:
    """How far a layer may lie outside the model's section."""
    return max(process.outline_compensation_mm, -process.hole_compensation_mm, 0.0)


def compensate(
    outlines: Sequence[Polygons],
    part: Part,
    later: Sequence[Part],
    beside: Sequence[Polygons],
    cuts_mm: Floats,
    process: Process,
) -> list[Polygons]:
    """The outlines of a part's layers with outsides and holes compensated, but for its cut faces.

    beside: what later parts have of each layer; cuts_mm: heights of the layers' sections.
    """
    if process.outline_compensation_mm == 0.0 and process.hole_compensation_mm == 0.0:
        return list(outlines)
    planes = [plane_in_frame_of(part, upper.base.normal, upper.base.offset_mm) for upper in later if upper.base.limbs_mm is None]
    below = [[(-x, -y, distance - z * cut_mm) for x, y, z, distance in planes] for cut_mm in cuts_mm.tolist()]
    over = _over_limbs(part, [upper for upper in later if upper.base.limbs_mm is not None], cuts_mm, reach_mm(process))
    return [compensated(*layer, process=process) for layer in zip(outlines, beside, below, over, strict=True)]


def _over_limbs(part: Part, limbs: Sequence[Part], cuts_mm: Floats, grown_mm: float) -> list[Polygons]:
    """For each layer of a part the area above the base plane of a later limb, near that limb."""
    over = [Polygons()] * len(cuts_mm)
    far_mm = 2.0 * float(np.linalg.norm(part.in_part_frame().vertices, axis=1).max())
    for limb in limbs:
        places = offset(shadow_of(limb), grown_mm + BESIDE_MM)
        plane = BasePlane(*frame_change(part, limb), Heights(cuts_mm, np.zeros(len(cuts_mm)), cuts_mm), far_mm, places)
        over = [union([before, plane.band(layer, 0.0, np.inf)]) for layer, before in enumerate(over)]
    return over


def compensated(
    own: Polygons, others: Polygons, below: Sequence[Sequence[float]], over: Polygons | None = None, *, process: Process
) -> Polygons:
    """A part's section, which others of its model touch, with the sides compensated that no other touches.

    below: a, b, c of the base plane of each later part that is not a limb; material is added only where a x + b y + c > 0, and
    not within `over`.
    """
    if own.is_empty():
        return own
    whole = own if others.is_empty() else own + closing(own + others, TOUCHING_MM)
    grown = reach_mm(process)
    added = Polygons() if grown == 0.0 else offset(own, grown) - whole
    for a, b, c in below:
        added = half_plane(added, a, b, c)
    if over is not None and not over.is_empty():
        added = added - over
    return (own + added) ^ _resized(whole, process)


def _resized(whole: Polygons, process: Process) -> Polygons:
    """A section of the model with larger or smaller outsides and holes."""
    resized = []
    for island in islands(whole):
        filled = Polygons([loop for loop in contours(island) if area_mm2(loop) > 0])
        outside, holes = offset(filled, process.outline_compensation_mm), filled - island
        resized.append(outside if holes.is_empty() else outside - offset(holes, process.hole_compensation_mm))
    return union(resized)


def compensate_elephant_foot(outline: Polygons, elephant_foot_mm: float, width_mm: float) -> Polygons:
    """The outline less what the first layer is squeezed out by; places that would shrink below a line keep their width."""
    if elephant_foot_mm <= 0.0:
        return outline
    deep = elephant_foot_mm + 0.5 * width_mm
    narrow = outline - offset(offset(outline, -deep), deep + 0.01)
    return offset(outline, -elephant_foot_mm) + narrow
