"""Arrange: places on the plate: of a model, and of several of one size, in rows and columns about it."""

from dataclasses import replace
from itertools import product
from math import ceil, hypot

import numpy as np

from machine.planning.fit import over_edge_mm
from mdp.decomposition import Decomposition, Part
from mdp.mesh import Floats, Mesh
from mdp.plane import Plane
from profiles.machine import Machine
from profiles.settings.plate import MIDDLE

EDGE_MM = 2.0  # kept to the plate's edge

Place = tuple[float, float]


def standing_at(decomposition: Decomposition, place_mm: Place) -> Decomposition:
    """A decomposition moved by x, y over the plate, its planes and marks too."""
    if place_mm == MIDDLE:
        return decomposition
    shift = np.array([*place_mm, 0.0])
    rows = tuple(replace(row, planes=tuple(_plane_moved(plane, shift) for plane in row.planes)) for row in decomposition.front)
    parts = tuple(_part_moved(part, shift) for part in decomposition.parts)
    return replace(decomposition, mesh=mesh_moved(decomposition.mesh, place_mm), parts=parts, front=rows)


def mesh_moved(mesh: Mesh, place_mm: Place) -> Mesh:
    """A mesh moved by x, y over the plate."""
    return Mesh(mesh.vertices + np.array([*place_mm, 0.0]), mesh.faces, mesh.colours)


def _part_moved(part: Part, shift: Floats) -> Part:
    x, y, z = shift.tolist()
    return replace(
        part,
        mesh=mesh_moved(part.mesh, (x, y)),
        base=_plane_moved(part.base, shift),
        no_seam=part.no_seam.repeated([(x, y, z)]),
        no_support=part.no_support.repeated([(x, y, z)]),
    )


def _plane_moved(plane: Plane, shift: Floats) -> Plane:
    limbs_mm = None if plane.limbs_mm is None else plane.limbs_mm + shift
    return Plane(plane.normal, plane.offset_mm + float(plane.normal @ shift), limbs_mm)


def places_on_plate(size_mm: Place, gap_mm: float, count: int, machine: Machine, about_mm: Place = MIDDLE) -> list[Place]:
    """Up to `count` middles (workpiece x, y, mm) of boxes of that size, gap_mm apart, the nearest to a place first.

    Rows and columns may have a box or a gap at that place, or in the middle of the plate: what holds most is taken, among equals
    what stays nearer to the place.
    """
    best: list[Place] = []
    for anchor in dict.fromkeys((about_mm, MIDDLE)):
        for shift in product((0.0, 0.5), (0.0, 0.5)):
            inside = _lattice(size_mm, gap_mm, shift, machine, anchor)
            lattice = sorted(inside, key=lambda middle: (round(_away(middle, about_mm), 6), middle[1], middle[0]))[:count]
            if (len(lattice), -_reach(lattice, about_mm)) > (len(best), -_reach(best, about_mm)):
                best = lattice
    return best


def _away(middle: Place, about_mm: Place) -> float:
    return hypot(middle[0] - about_mm[0], middle[1] - about_mm[1])


def _reach(places: list[Place], about_mm: Place) -> float:
    return max((_away(place, about_mm) for place in places), default=0.0)


def _lattice(size_mm: Place, gap_mm: float, shift: Place, machine: Machine, anchor_mm: Place) -> list[Place]:
    """Those of its places whose boxes lie on the plate."""
    steps = [side + gap_mm for side in size_mm]
    reach_mm = machine.table.radius_mm + hypot(*anchor_mm)
    counts = [ceil(2.0 * reach_mm / step) + 1 for step in steps]
    columns, rows = ([(k + part) * step for k in range(-n, n + 1)] for n, part, step in zip(counts, shift, steps, strict=True))
    middles = np.array(list(product(columns, rows))) + np.array(anchor_mm)
    over_mm, _ = over_edge_mm(np.abs(middles) + 0.5 * np.array(size_mm) + EDGE_MM, machine.table)
    return [(x, y) for x, y in middles[over_mm <= 0.0].tolist()]
