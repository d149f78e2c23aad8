"""Overhangs: the places of each layer that hang over nothing and are too flat to carry themselves, and which of them bridge."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, radians, sin

import numpy as np

from mdp.mesh import Floats, Mesh
from profiles.process import Process
from slicer.fill.bridge import LEAST, Bridge, find_bridge
from slicer.geometry.polygons import Polygons, edges, offset

RISKY_MARGIN = 1e-4  # faces at exactly the self-supporting angle count as safe whatever the rounding, as in the search
RIM_MM = 0.04  # neighbouring strips of a slope overlap by this so that they unite


@dataclass(frozen=True, eq=False)
class Overhang:
    """Of one layer: hanging wants support, bridges carry themselves."""

    hanging: Polygons
    bridges: tuple[Bridge, ...]


def detect_overhangs(
    mesh: Mesh, outlines: Sequence[Polygons], cuts_mm: Floats, process: Process, below: Polygons | None
) -> list[Overhang]:
    """For every layer the part of its outline above a risky face.

    mesh and cuts_mm: part frame. below: plastic under the first layer, None: the platform, on which it may lie. Without
    support whatever has a bank to hold on to is printed as a bridge, however long.
    """
    longest_mm = inf if process.support == "none" else process.bridge_longest_mm
    overhangs = [Overhang(Polygons(), ())] * len(outlines)
    for i, triangles in _risky(mesh, cuts_mm, process.self_supporting_angle_deg).items():
        if i == 0 and below is None:
            continue
        bank = outlines[i - 1] if i else offset(below, RIM_MM)
        hanging = (outlines[i] - bank) ^ offset(Polygons(triangles), 0.5 * RIM_MM)
        if not hanging.is_empty():
            overhangs[i] = _sort_islands(hanging, bank, process.line_width_mm, longest_mm)
    return overhangs


def _sort_islands(hanging: Polygons, bank: Polygons, width_mm: float, longest_mm: float) -> Overhang:
    """Sorts the connected pieces of a hanging place."""
    islands = hanging.decompose()
    if all(island.area() < LEAST * width_mm**2 for island in islands):
        return Overhang(hanging, ())
    banks = edges(offset(bank, 0.25 * width_mm))
    rest, spans = [], []
    for island in islands:
        span = find_bridge(island, banks, width_mm)
        if span is not None and (longest_mm == inf or span.carries(longest_mm)):
            spans.append(span)
        else:
            rest.append(island)
    return Overhang(Polygons.compose(rest) if rest else Polygons(), tuple(spans))


def _risky(mesh: Mesh, cuts_mm: Floats, angle_deg: float) -> dict[int, list[Floats]]:
    """Risky faces seen from above, (3, 2) counter-clockwise, by the layers whose strip of the surface they belong to."""
    risky = np.flatnonzero(mesh.normals[:, 2] < -(sin(radians(angle_deg)) + RISKY_MARGIN))
    corners = mesh.vertices[mesh.faces[risky]]
    first = np.searchsorted(cuts_mm, corners[:, :, 2].min(axis=1))
    last = np.minimum(np.searchsorted(cuts_mm, corners[:, :, 2].max(axis=1)), len(cuts_mm) - 1)
    masks: dict[int, list[Floats]] = {}
    for corner, a, b in zip(np.ascontiguousarray(corners[:, ::-1, :2]), first.tolist(), last.tolist(), strict=True):
        for layer in range(a, b + 1):
            masks.setdefault(layer, []).append(corner)
    return masks
