"""Arrangement: where models stand on the plate: those of one size in rows and columns, others one by one, the largest first, each
as near as possible to the place that the plate has for them.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from math import ceil, dist, hypot
from typing import NamedTuple

import numpy as np

from machine.planning.fit import Place
from machine.planning.limits import over_edge_mm
from profiles.machine import Machine
from profiles.settings.plate import MIDDLE

EDGE_MM = 2.0  # kept to the plate's edge
STEP_MM = 2.5  # between places that are tried beside those where boxes touch
ROUNDING_MM = 1e-6

IsClear = Callable[[Mapping[int, Place]], bool]


class Misfit(NamedTuple):
    """The box, by its number, that finds no place; how many stand already; whether it has room and only the head does not."""

    number: int
    standing: int
    is_met: bool


def arrange(
    sizes_mm: Sequence[Place], gap_mm: float, machine: Machine, about_mm: Place, is_clear: IsClear
) -> list[Place] | Misfit:
    """The middles (workpiece x, y, mm) of boxes of these sizes, gap_mm apart about a place on the plate; or what does not fit.

    is_clear: whether the head passes boxes, given the places of those that stand, by their numbers.
    """
    if len(set(sizes_mm)) == 1:
        rows = places_on_plate(sizes_mm[0], gap_mm, len(sizes_mm), machine, about_mm)
        if len(rows) < len(sizes_mm):
            return Misfit(len(rows), len(rows), False)
        if is_clear(dict(enumerate(rows))):
            return rows
    found = _one_by_one(sizes_mm, gap_mm, machine, about_mm, is_clear)
    if isinstance(found, Misfit):  # two that fit side by side do not where the first one has the middle
        corner = -machine.table.radius_mm, -machine.table.radius_mm
        from_corner = _one_by_one(sizes_mm, gap_mm, machine, corner, is_clear)
        if isinstance(from_corner, Misfit):
            return max(found, from_corner, key=lambda misfit: misfit.standing)
        found = from_corner
    return _about(found, sizes_mm, machine, about_mm, is_clear)


def _one_by_one(
    sizes_mm: Sequence[Place], gap_mm: float, machine: Machine, near_mm: Place, is_clear: IsClear
) -> list[Place] | Misfit:
    """The largest first, each as near to a place as it may stand."""
    standing: dict[int, Place] = {}
    for k in sorted(range(len(sizes_mm)), key=lambda k: (-sizes_mm[k][0] * sizes_mm[k][1], k)):
        places = _free_places(k, standing, sizes_mm, gap_mm, machine, near_mm)
        place = next((place for place in places if is_clear({**standing, k: place})), None)
        if place is None:
            return Misfit(k, len(standing), bool(places))
        standing[k] = place
    return [standing[k] for k in range(len(sizes_mm))]


def _free_places(
    number: int, standing: Mapping[int, Place], sizes_mm: Sequence[Place], gap_mm: float, machine: Machine, near_mm: Place
) -> list[Place]:
    """Where a box has room, the nearest to a place first: beside and in line with those that stand, and on a lattice."""
    size, reach_mm = np.array(sizes_mm[number]), machine.table.radius_mm
    boxes = np.array([[standing[k], sizes_mm[k]] for k in standing]).reshape(-1, 2, 2)
    apart = 0.5 * (boxes[:, 1] + size) + gap_mm
    aligned = 0.5 * (boxes[:, 1] - size)
    beside = np.concatenate([boxes[:, 0] + sign * way for sign in (-1.0, 0.0, 1.0) for way in (apart, aligned)])
    lattice = np.arange(-ceil(reach_mm / STEP_MM), ceil(reach_mm / STEP_MM) + 1) * STEP_MM
    columns, rows = (np.unique(np.concatenate([beside[:, axis], lattice, [near_mm[axis]]])) for axis in (0, 1))
    places = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    places = places[over_edge_mm(np.abs(places) + 0.5 * size + EDGE_MM, machine.table)[0] <= ROUNDING_MM]
    for (middle, _), least in zip(boxes, apart, strict=True):
        places = places[(np.abs(places - middle) >= least - ROUNDING_MM).any(axis=1)]
    away = np.round(np.hypot(*(places - np.array(near_mm)).T), 6)
    nearest_first = places[np.lexsort((places[:, 0], places[:, 1], away))]
    return [(x, y) for x, y in nearest_first.tolist()]


def _about(places: list[Place], sizes_mm: Sequence[Place], machine: Machine, about_mm: Place, is_clear: IsClear) -> list[Place]:
    """All moved together so that the middle of what they cover is at a place, where that keeps them on the plate."""
    middles, halves = np.array(places), 0.5 * np.array(sizes_mm)
    covered = 0.5 * ((middles - halves).min(axis=0) + (middles + halves).max(axis=0))
    moved = middles + np.array(about_mm) - covered
    if (over_edge_mm(np.abs(moved) + halves + EDGE_MM, machine.table)[0] > ROUNDING_MM).any():
        return places
    together: list[Place] = [(x, y) for x, y in moved.tolist()]
    return together if is_clear(dict(enumerate(together))) else places


def places_on_plate(size_mm: Place, gap_mm: float, count: int, machine: Machine, about_mm: Place = MIDDLE) -> list[Place]:
    """Up to `count` middles (workpiece x, y, mm) of boxes of that size, gap_mm apart, the nearest to a place first.

    Rows and columns may have a box or a gap at that place, or in the middle of the plate: what holds most is taken, among equals
    what stays nearer to the place.
    """
    lattices: list[list[Place]] = []
    for anchor_mm, shift in product(dict.fromkeys((about_mm, MIDDLE)), product((0.0, 0.5), (0.0, 0.5))):
        axes, reach_mm = [], machine.table.radius_mm + hypot(*anchor_mm)
        for side, part in zip(size_mm, shift, strict=True):
            most = ceil(2.0 * reach_mm / (side + gap_mm)) + 1
            axes.append([(k + part) * (side + gap_mm) for k in range(-most, most + 1)])
        middles = np.array(list(product(*axes))) + np.array(anchor_mm)
        over_mm, _ = over_edge_mm(np.abs(middles) + 0.5 * np.array(size_mm) + EDGE_MM, machine.table)
        inside = ((x, y) for x, y in middles[over_mm <= 0.0].tolist())
        lattices.append(sorted(inside, key=lambda place: (round(dist(place, about_mm), 6), place[1], place[0]))[:count])
    return max(lattices, key=lambda places: (len(places), -max((dist(place, about_mm) for place in places), default=0.0)))
