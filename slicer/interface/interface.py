"""Interface: what a part finds beneath and beside it, in its own frame."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from profiles.process import Process
from slicer.bead import Bead
from slicer.geometry.polygons import Polygons, clean, contours, union
from slicer.paths import Kind
from slicer.section import sections
from slicer.travel.islands import OUTSIDE

BENEATH_MM = 0.02  # the section of earlier parts is taken this far below the base plane, where their cut faces lie


def plastic_beneath(part: Part, earlier: Sequence[Part], section: Polygons) -> Polygons | None:
    """Plastic just below the base plane; None on the platform. Parts not handed over are taken to fill the section."""
    if part.index == 1:
        return None
    if not earlier:
        return section
    return sections_of(earlier, part, np.array([-BENEATH_MM]))[0]


def sections_of(others: Sequence[Part], part: Part, cuts_mm: Floats) -> list[Polygons]:
    """For every height in the part's frame the sections of other parts together."""
    layers = [[clean(loops) for loops in sections(_mesh_in_frame_of(part, other), cuts_mm)] for other in others]
    return [union(layer) for layer in zip(*layers, strict=True)] if layers else [Polygons()] * len(cuts_mm)


def touching(part: Part, others: Sequence[Part], reach_mm: float) -> list[Part]:
    """Those of other parts whose box, in the part's frame, comes as near to its own as that."""
    low, high = part.in_part_frame().bounds_mm
    boxes = [_mesh_in_frame_of(part, other).bounds_mm for other in others]
    near = [bool(np.all((box[0] < high + reach_mm) & (box[1] > low - reach_mm))) for box in boxes]
    return [other for other, is_near in zip(others, near, strict=True) if is_near]


def _mesh_in_frame_of(part: Part, other: Part) -> Mesh:
    return other.mesh.transform(part.rotation, (0.0, 0.0, -part.base.offset_mm))


def strengthen_interface(process: Process, on_plastic: bool, layers: int) -> list[Process]:
    """The process of every layer: a part on plastic has more walls in its first one, if it has walls at all."""
    extra = process.interface_extra_walls if on_plastic and process.walls else 0
    first = process.model_copy(update={"walls": process.walls + extra}) if extra else process
    return [first if i == 0 else process for i in range(layers)]


def begin_inside(beads: Sequence[Bead]) -> list[Bead]:
    """The beads of a first layer on plastic, the longest of its infill or skin first where it has no support: what oozed while
    the table turned is made up for there, not where a wall has its seam.
    """
    if any(bead.rank <= OUTSIDE for bead in beads):
        return list(beads)
    for kind in (Kind.INFILL, Kind.SKIN):
        inner = [k for k, bead in enumerate(beads) if bead.kind is kind]
        if inner:
            longest = max(inner, key=lambda k: (beads[k].length_mm, -k))
            first = replace(beads[longest], rank=OUTSIDE)
            return [first, *beads[:longest], *beads[longest + 1 :]]
    return list(beads)


def interface_edges(part: Part, first: Polygons, below: Polygons | None, later: Sequence[Part]) -> Floats:
    """(n, 6) segments, in the part's frame, of the lines where it meets the parts before and after it on the surface.

    first: section of its first layer, below: plastic under its base plane.
    """
    segments = [] if below is None else [_segments(np.insert(loop, 2, 0.0, axis=1)) for loop in contours(first ^ below)]
    for other in later:
        for loop in contours(clean(sections(other.in_part_frame(), np.array([BENEATH_MM]))[0])):
            placed = np.insert(loop, 2, other.base.offset_mm, axis=1) @ other.rotation
            segments.append(_segments(placed @ part.rotation.T - np.array([0.0, 0.0, part.base.offset_mm])))
    return np.concatenate(segments) if segments else np.zeros((0, 6))


def _segments(loop: Floats) -> Floats:
    """(n, 6) sides of a loop (n, 3) in space."""
    return np.hstack([loop, np.roll(loop, -1, axis=0)])
