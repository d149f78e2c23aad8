"""Interface: what a part finds beneath and beside it, in its own frame."""

import atexit
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.topology.cross_section import cross_sections
from profiles.process import Process
from slicer.bead import outer_wall_width_mm
from slicer.geometry.polygons import Polygons, clean, contours, offset, union
from slicer.geometry.segments import near_height

SKIN = 0.8  # line widths inside the section from where on a tip is off the outer wall, whose middle lies at 0.5
SIDES = 32  # of what is round about an edge
BELOW_MM = 0.02  # from a base plane to the section that stands for the cut face in it, of the parts on either side
BASES_KEPT = 64


@lru_cache(BASES_KEPT)
def base_section(part: Part) -> Polygons:
    """The face with which a part stands on its base plane, in its frame."""
    return clean(cross_sections(part.in_part_frame(), np.array([BELOW_MM]))[0])


atexit.register(base_section.cache_clear)  # polygons left when Python ends would make manifold3d print a list of leaks


def plastic_below(part: Part, earlier: Sequence[Part], section: Polygons) -> Polygons | None:
    """Plastic just below the base plane; None on the platform. Parts not handed over are taken to fill the section."""
    if part.index == 1:
        return None
    if not earlier:
        return section
    return sections_of(earlier, part, np.array([-BELOW_MM]))[0]


def sections_of(others: Sequence[Part], part: Part, cuts_mm: Floats) -> list[Polygons]:
    """For every height in the part's frame the sections of other parts together."""
    layers = [[clean(loops) for loops in cross_sections(in_frame_of(part, neighbour), cuts_mm)] for neighbour in others]
    return [union(layer) for layer in zip(*layers, strict=True)] if layers else [Polygons()] * len(cuts_mm)


def near_parts(part: Part, others: Sequence[Part], reach_mm: float) -> list[Part]:
    """Those of other parts whose box, in the part's frame, comes as near to its own as that."""
    low, high = part.in_part_frame().bounds_mm
    boxes = [in_frame_of(part, neighbour).bounds_mm for neighbour in others]
    near = [bool(np.all((box[0] < high + reach_mm) & (box[1] > low - reach_mm))) for box in boxes]
    return [neighbour for neighbour, is_near in zip(others, near, strict=True) if is_near]


def in_frame_of(part: Part, neighbour: Part) -> Mesh:
    """The mesh of a neighbour in the frame of a part."""
    return neighbour.mesh.transform(part.rotation, (0.0, 0.0, -part.base.offset_mm))


def frame_change(part: Part, to: Part) -> tuple[Floats, Floats]:
    """turn (3, 3) and shift (3,) that carry a point of a part's frame into the frame of another part: turn @ x + shift."""
    turn = to.rotation @ part.rotation.T
    return turn, turn[:, 2] * part.base.offset_mm - np.array([0.0, 0.0, to.base.offset_mm])


def joints(part: Part, later: Sequence[Part], section: Polygons, below: Polygons | None) -> Floats:
    """(n, 6) segments, in the part's frame, of the lines where it meets the parts before and after it on the surface.

    section: of its first layer; below: the plastic under it, None on the platform.
    """
    rims = [] if below is None else [np.insert(loop, 2, 0.0, axis=1) for loop in contours(section ^ below)]
    for upper in later:
        for loop in contours(base_section(upper)):
            placed = np.insert(loop, 2, upper.base.offset_mm, axis=1) @ upper.rotation
            rims.append(placed @ part.rotation.T - np.array([0.0, 0.0, part.base.offset_mm]))
    segments = [np.hstack([rim, np.roll(rim, -1, axis=0)]) for rim in rims]
    return np.concatenate(segments) if segments else np.zeros((0, 6))


def skin_beside(edges: Floats, section: Polygons, z_mm: float, process: Process) -> Polygons:
    """Outer walls of a section near the edges of interfaces, where what a travel or wipe leaves shows along the joint."""
    near = _beside(edges, z_mm, process.interface_seam_mm)
    width_mm = min(process.line_width_mm, outer_wall_width_mm(process))
    return near if near.is_empty() else near ^ (section - offset(section, -SKIN * width_mm))


def _beside(edges: Floats, z_mm: float, reach_mm: float) -> Polygons:
    """What of the plane at a height lies about as near as that to segments (n, 6) in space."""
    near = near_height(edges, z_mm, reach_mm)
    if not len(near):
        return Polygons()
    rise = near[:, 5] - near[:, 2]
    level = np.abs(rise) < 1e-9
    at = (z_mm - near[:, 2] + reach_mm * np.array([[-1.0], [1.0]])) / np.where(level, 1.0, rise)
    shares: Floats = np.where(level, [[0.0], [1.0]], np.sort(at, axis=0).clip(0.0, 1.0))  # in order, and within the segments
    begin, end = (near[:, :3] + share[:, None] * (near[:, 3:] - near[:, :3]) for share in shares)
    heights = np.array([begin[:, 2], end[:, 2]]) - z_mm
    least = np.where(heights.prod(axis=0) < 0.0, 0.0, np.abs(heights).min(axis=0))
    reaches = np.sqrt(np.maximum(reach_mm**2 - least**2, 0.0))
    return union([_around(a, b, reach) for a, b, reach in zip(begin, end, reaches.tolist(), strict=True)])


def _around(begin: Floats, end: Floats, reach_mm: float) -> Polygons:
    """What lies as near as that to a segment seen from above."""
    disc = Polygons.circle(reach_mm, SIDES)
    return Polygons.batch_hull([disc.translate((float(x), float(y))) for x, y in (begin[:2], end[:2])])
