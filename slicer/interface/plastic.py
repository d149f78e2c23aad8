"""Plastic: what of a part is printed only because the model is cut, interface by interface."""

from collections.abc import Sequence

import numpy as np

from mdp.mesh import Floats
from slicer.fill.region import Region
from slicer.geometry.polygons import Polygons, half_plane, offset
from slicer.interface.base_plane import BasePlane
from slicer.interface.interface import frame_change, plane_in_frame_of
from slicer.interface.limb import shadow_of
from slicer.sections import Sections

LEAST_MM2 = 0.01  # a smaller difference of areas in a layer is rounding
NEAR_MM = 3.0  # how far beside a limb's base the solid shell of its cut face reaches


def interface_mm3(sections: Sections, regions: Sequence[Region]) -> dict[int, float]:
    """Plastic, mm3, that a part has more of than the uncut model in its place, by the part whose base plane is nearest.

    Walls and skins on the faces of cuts where there would be sparse infill, and what the flow of its first layer on
    plastic adds to the room that it has.
    """
    part, process, heights = sections.part, sections.process, sections.heights
    planes = {} if sections.on_platform else {part.index: np.array([0.0, 0.0, -1.0, 0.0])}
    planes |= {upper.index: plane_in_frame_of(part, upper.base.normal, upper.base.offset_mm) for upper in sections.later}
    more, near = dict.fromkeys(planes, 0.0), _near_limbs(sections)
    for layer, (section, region) in enumerate(zip(sections.own, regions, strict=True)):
        height_mm, z_mm = heights.height_mm[layer], heights.cut_mm[layer]
        if not planes or region.uncut.is_empty():
            continue
        closed = (region.uncut ^ section) - region.sparse
        if closed.area() > LEAST_MM2:
            distances = [np.array([-plane[0], -plane[1], plane[3] - plane[2] * z_mm]) for plane in planes.values()]
            counting = [near[index].band(layer, -np.inf, np.inf) if index in near else None for index in planes]
            for index, area in zip(planes, nearest_areas(closed, distances, counting), strict=True):
                more[index] += (1.0 - process.infill_density) * float(height_mm) * area
    if not sections.on_platform:
        filled = sections.own[0].area() - (1.0 - process.infill_density) * regions[0].sparse.area()
        more[part.index] += filled * (process.interface_flow - 1.0) * float(heights.height_mm[0])
    return more


def _near_limbs(sections: Sections) -> dict[int, BasePlane]:
    """The base planes of later limbs by part index, each limited to the surroundings of its limb."""
    part, far_mm = sections.part, 2.0 * float(np.linalg.norm(sections.mesh.vertices, axis=1).max())
    limbs = [upper for upper in sections.later if upper.base.limbs_mm is not None]
    places = {limb.index: offset(shadow_of(limb), NEAR_MM) for limb in limbs}
    return {limb.index: BasePlane(*frame_change(part, limb), sections.heights, far_mm, places[limb.index]) for limb in limbs}


def nearest_areas(whole: Polygons, distances: Sequence[Floats], near: Sequence[Polygons | None]) -> list[float]:
    """mm2 of an area where each of several linear functions a x + b y + c is the least of those that count there.

    near: where each counts, None: everywhere.
    """
    if len(distances) == 1:
        return [whole.area() if near[0] is None else (whole ^ near[0]).area()]
    areas = []
    for k, (mine, own) in enumerate(zip(distances, near, strict=True)):
        nearer = whole if own is None else whole ^ own
        for j, (distance, other) in enumerate(zip(distances, near, strict=True)):
            if j != k and not nearer.is_empty():
                a, b, c = distance - mine
                away = Polygons() if other is None else nearer - other
                nearer = half_plane(nearer, a, b, c)
                nearer = nearer if away.is_empty() else nearer + away
        areas.append(nearer.area())
    return areas
