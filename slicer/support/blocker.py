"""Blocker: where support would be in the way of parts printed later, or the head in that of the table."""

from collections.abc import Sequence

import numpy as np

from mdp.decomposition import Part
from mdp.mesh import Floats, Mesh
from mdp.pose import UP
from slicer.geometry.polygons import Polygons, union
from slicer.heights import Heights

AROUND_MM = 20.0  # support needs no more space around a part than its lean and this
LEVEL = 1e-9  # a plane whose normal is nearer to upright than this forbids all of a layer or nothing


def far_mm(mesh: Mesh) -> float:
    """A distance from the origin that no support of a part ever reaches; mesh: part frame."""
    low, high = mesh.bounds_mm
    return float(np.hypot(*np.maximum(np.abs(low), np.abs(high))[:2]) + 2.0 * high[2]) + AROUND_MM


def blocked_areas(part: Part, later: Sequence[Part], heights: Heights, gap_mm: float, far_mm: float) -> list[Polygons]:
    """For each layer what lies above the base plane of any later part.

    While a part is printed the head moves above its base plane, so nothing may stand there, be it near that part or not.
    Planes count as lower by gap_mm. The half-planes end far_mm from the origin of the part's frame.
    """
    return _above_planes(part, [(other.base.normal, other.base.offset_mm - gap_mm) for other in later], heights, far_mm)


def low_areas(part: Part, least_mm: float, heights: Heights, far_mm: float) -> list[Polygons]:
    """For each layer what lies nearer to the table than that: there the head would meet it."""
    return _above_planes(part, [(-UP, -least_mm)], heights, far_mm)


def _above_planes(part: Part, planes: Sequence[tuple[Floats, float]], heights: Heights, far_mm: float) -> list[Polygons]:
    """For each layer what of it lies above any plane: unit normal and offset in the workpiece frame."""
    layers: list[list[Polygons]] = [[] for _ in heights.tip_mm]
    for upward, offset_mm in planes:
        normal = part.rotation @ upward
        offset = offset_mm - normal[2] * part.base.offset_mm
        below_mm = offset - np.maximum(normal[2] * heights.bottom_mm, normal[2] * heights.tip_mm)
        across = float(np.hypot(normal[0], normal[1]))
        for layer, rest in zip(layers, below_mm.tolist(), strict=True):
            if across < LEVEL:
                if rest < 0.0:
                    layer.append(_beyond(np.array([1.0, 0.0]), -far_mm, far_mm))
            elif rest < across * far_mm:
                layer.append(_beyond(normal[:2] / across, rest / across, far_mm))
    return [union(layer) for layer in layers]


def _beyond(direction: Floats, distance_mm: float, far_mm: float) -> Polygons:
    """The points farther along a unit direction than the distance, up to far_mm."""
    aside = np.array([-direction[1], direction[0]]) * 2.0 * far_mm
    near, far = direction * max(distance_mm, -2.0 * far_mm), direction * 2.0 * far_mm
    return Polygons([np.array([near - aside, far - aside, far + aside, near + aside])])
