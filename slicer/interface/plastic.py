"""Plastic: what of a part is printed only because the model is cut, interface by interface."""

from collections.abc import Sequence

import numpy as np

from mdp.mesh import Floats
from slicer.fill.region import Region
from slicer.geometry.polygons import Polygons, half_plane
from slicer.interface.interface import plane_in_frame_of
from slicer.sections import Sections

LEAST_MM2 = 0.01  # a smaller difference of areas in a layer is rounding


def interface_mm3(sections: Sections, regions: Sequence[Region]) -> dict[int, float]:
    """Plastic, mm3, that a part has more of than the uncut model in its place, by the part whose base plane is nearest.

    Walls and skins on the faces of cuts where there would be sparse infill, and what the flow of its first layer on
    plastic adds to the room that it has.
    """
    part, process, heights = sections.part, sections.process, sections.heights
    planes = {} if sections.on_platform else {part.index: np.array([0.0, 0.0, -1.0, 0.0])}
    planes |= {upper.index: plane_in_frame_of(part, upper.base.normal, upper.base.offset_mm) for upper in sections.later}
    more = dict.fromkeys(planes, 0.0)
    for section, region, height_mm, z_mm in zip(sections.own, regions, heights.height_mm, heights.cut_mm, strict=True):
        if not planes or region.uncut.is_empty():
            continue
        closed = (region.uncut ^ section) - region.sparse
        if closed.area() > LEAST_MM2:
            distances = [np.array([-plane[0], -plane[1], plane[3] - plane[2] * z_mm]) for plane in planes.values()]
            for index, area in zip(planes, _nearest_areas(closed, distances), strict=True):
                more[index] += (1.0 - process.infill_density) * float(height_mm) * area
    if not sections.on_platform:
        filled = sections.own[0].area() - (1.0 - process.infill_density) * regions[0].sparse.area()
        more[part.index] += filled * (process.interface_flow - 1.0) * float(heights.height_mm[0])
    return more


def _nearest_areas(whole: Polygons, distances: Sequence[Floats]) -> list[float]:
    """mm2 of the whole where each of several linear functions a x + b y + c of it is the least."""
    if len(distances) == 1:
        return [whole.area()]
    areas = []
    for k, mine in enumerate(distances):
        nearer = whole
        for j, distance in enumerate(distances):
            if j != k and not nearer.is_empty():
                a, b, c = distance - mine
                nearer = half_plane(nearer, a, b, c)
        areas.append(nearer.area())
    return areas
