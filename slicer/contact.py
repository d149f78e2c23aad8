"""Contacts: the places of each layer that hang over nothing and are too flat to carry themselves."""

from collections.abc import Sequence
from math import radians, sin

import numpy as np

from mdp.mesh import Floats, Mesh
from slicer.polygons import Polygons, edges, grown
from slicer.scanline import all_inside, clipped

RISKY_MARGIN = 1e-4  # faces at exactly the self-supporting angle count as safe whatever the rounding, as in the search
RIM_MM = 0.04  # neighbouring strips of a slope overlap by this so that they unite
BRIDGE_MM = 6.0  # spans up to this between two banks print without support
BRIDGE_TURNS = 8
BRIDGE_LEAST = 4.0  # in line widths squared: smaller places fall out later anyway


def contacts(
    mesh: Mesh, outlines: Sequence[Polygons], cuts_mm: Floats, angle_deg: float, below: Polygons | None, width_mm: float
) -> list[Polygons]:
    """For every layer the part of its outline above a risky face, without short bridges; empty where there is none.

    mesh and cuts_mm: part frame. below: plastic under the first layer, None: the platform, on which it may lie.
    """
    masks = _risky(mesh, cuts_mm, angle_deg)
    found = [Polygons()] * len(outlines)
    for i, triangles in masks.items():
        if i == 0 and below is None:
            continue
        bank = outlines[i - 1] if i else below
        hanging = (outlines[i] - bank) ^ grown(Polygons(triangles), 0.5 * RIM_MM)
        islands = hanging.decompose()
        if any(island.area() >= BRIDGE_LEAST * width_mm**2 for island in islands):
            banks = edges(grown(bank, 0.25 * width_mm))
            islands = [island for island in islands if not _bridge(island, banks, width_mm)]
        found[i] = Polygons.compose(islands) if islands else Polygons()
    return found


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


def _bridge(hanging: Polygons, banks: Floats, width_mm: float) -> bool:
    """Whether lines in some direction span the place from bank (edges) to bank and none is longer than BRIDGE_MM."""
    if hanging.area() < BRIDGE_LEAST * width_mm**2 or not len(banks):
        return False
    around = edges(hanging).reshape(-1, 2)
    for k in range(BRIDGE_TURNS):
        angle = np.pi * k / BRIDGE_TURNS
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        sides = np.ascontiguousarray((around @ turn).reshape(-1, 4))
        rows = clipped(sides, np.arange(sides[:, 1].min() + 0.5 * width_mm, sides[:, 1].max(), width_mm))
        if not len(rows) or float((rows[:, 1] - rows[:, 0]).max()) > BRIDGE_MM:
            continue
        ends = np.concatenate([rows[:, [0, 2]], rows[:, [1, 2]]]) @ turn.T
        if all_inside(banks, ends):
            return True
    return False
