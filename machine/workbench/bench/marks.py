"""Marks: boxes and faces on which a person wants no cut, no seam, no support or support: the zones of the plan."""

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from machine.workbench.bench.bench import Bench
from machine.workbench.bench.values import Point, Rotation, check_number
from mdp.directions.orientation import standing_still
from mdp.mesh import Mesh
from mdp.overhang import Mask
from mdp.search.plan_file import ZONE_KINDS
from mdp.search.plan_reading import MOST_ZONES
from mdp.zone import FARTHEST_MM, MOST_GROWN_DEG, AnyZone, Grown, Zone, Zones
from profiles.errors import PlanError

WORDS = {  # for the step in the history of a mark of each kind
    "keep": "mark: no cut here",
    "no_seam": "mark: no seam here",
    "no_support": "mark: no support here",
    "support": "mark: support here",
}
Kind = Literal["keep", "no_seam", "no_support", "support"]
GrownDeg = Annotated[float, Field(ge=0, le=MOST_GROWN_DEG)]


def mark(
    bench: Bench,
    *,
    kind: Kind,
    number: int | None = None,
    min_mm: Point | None = None,
    max_mm: Point | None = None,
    axes: Rotation | None = None,
    point_mm: Point | None = None,
    angle_deg: GrownDeg | None = None,
) -> Zones:
    """With a further zone: a box, along `axes` where it leans, or the faces around a point as far as an angle; in place of the
    zone `number`, if one is given. Reads the model's mesh. Raises PlanError."""
    zone = _box(min_mm, max_mm, axes) if point_mm is None else _grown(bench, point_mm, angle_deg)
    zones: tuple[AnyZone, ...] = getattr(bench.zones, kind)
    index = len(zones) if number is None else check_number("number", number, 1, len(zones)) - 1
    if index >= MOST_ZONES:
        raise PlanError(f"there are {index} zones of {kind}: {MOST_ZONES} are allowed")
    return _with(bench.zones, kind, (*zones[:index], zone, *zones[index + 1 :]))


def _box(min_mm: Point | None, max_mm: Point | None, axes: Rotation | None) -> Zone:
    if min_mm is None or max_mm is None:
        raise PlanError(f"{'min_mm' if min_mm is None else 'max_mm'} is missing")
    if not all(low < high for low, high in zip(min_mm, max_mm, strict=True)):
        raise PlanError(f"min_mm is {list(min_mm)} and max_mm {list(max_mm)}: each number of min_mm must be less")
    return Zone(min_mm, max_mm, axes)


def _grown(bench: Bench, point_mm: Point, angle_deg: float | None) -> Grown:
    if angle_deg is None:
        raise PlanError("angle_deg is missing")
    zone = Grown(point_mm, angle_deg)
    if (away_mm := zone.away_mm(workpiece_mesh(bench))) > FARTHEST_MM:
        raise PlanError(f"point_mm is {list(point_mm)}, {away_mm:.3g} mm from the model: up to {FARTHEST_MM:g} is allowed")
    return zone


def unmark(bench: Bench, *, kind: Kind, number: int) -> Zones:
    """Without the zone `number` of a kind. Raises PlanError."""
    zones: tuple[AnyZone, ...] = getattr(bench.zones, kind)
    index = check_number("number", number, 1, len(zones)) - 1
    return _with(bench.zones, kind, (*zones[:index], *zones[index + 1 :]))


# The commands that give other zones by their names; each runs in a process, for it may read the model's mesh.
MARKINGS: dict[str, Callable[..., Zones]] = {"mark": mark, "unmark": unmark}


def _with(zones: Zones, kind: str, several: tuple[AnyZone, ...]) -> Zones:
    changed: dict[str, Any] = {kind: several}
    return replace(zones, **changed)


def workpiece_mesh(bench: Bench) -> Mesh:
    """The model as it stands on the platform or a pedestal, in the workpiece frame."""
    assert bench.model is not None
    standing = standing_still(bench.model.mesh(), bench.turned)
    lift_mm = bench.profile.search.pedestal_mm
    return standing.transform(np.eye(3), (0.0, 0.0, lift_mm)) if lift_mm > 0.0 else standing


def named_faces(bench: Bench) -> Mask:
    """(kinds, m) which faces of the model the zones that are no boxes mean."""
    mesh = workpiece_mesh(bench)
    rows = np.zeros((len(ZONE_KINDS), len(mesh.faces)), dtype=np.bool_)
    for row, kind in zip(rows, ZONE_KINDS, strict=True):
        for zone in getattr(bench.zones, kind):
            if not isinstance(zone, Zone):
                row |= zone.faces(mesh)
    return rows
