"""Marks: boxes and faces on which a person wants no cut, no seam, no support or support: the zones of the plan."""

from dataclasses import replace
from typing import Any

import numpy as np

from machine.workbench.bench.bench import Bench
from machine.workbench.bench.values import MOST_MM, Asked, number, rotation_rows, vector, whole
from mdp.directions.orientation import standing_still
from mdp.mesh import Mesh
from mdp.overhang import Mask
from mdp.search.plan_file import ZONE_KINDS
from mdp.search.plan_reading import MOST_ZONES
from mdp.zone import FARTHEST_MM, MOST_GROWN_DEG, AnyZone, Grown, Zone, Zones
from profiles.errors import PlanError

WORDS = {
    "keep": "mark: no cut here",
    "no_seam": "mark: no seam here",
    "no_support": "mark: no support here",
    "support": "mark: support here",
}


def mark(bench: Bench, asked: Asked) -> tuple[str, Zones]:
    """A word for a further zone of `kind`, and the zones with it: a box `min_mm`, `max_mm`, along `axes` where it leans, or the
    faces around `point_mm` as far as `angle_deg`; in place of the zone `number`, if one is given. Raises PlanError."""
    kind, zones = _zones(bench, asked)
    index = whole(asked, "number", 1, len(zones)) - 1 if "number" in asked else len(zones)
    if index >= MOST_ZONES:
        raise PlanError(f"there are {index} zones of {kind}: {MOST_ZONES} are allowed")
    return WORDS[kind], _with(bench.zones, kind, (*zones[:index], _zone(asked, bench), *zones[index + 1 :]))


def unmark(bench: Bench, asked: Asked) -> tuple[str, Zones]:
    """The same without the zone `number` of `kind`. Raises PlanError."""
    kind, zones = _zones(bench, asked)
    index = whole(asked, "number", 1, len(zones)) - 1
    return "take a mark away", _with(bench.zones, kind, (*zones[:index], *zones[index + 1 :]))


def _with(zones: Zones, kind: str, several: tuple[AnyZone, ...]) -> Zones:
    changed: dict[str, Any] = {kind: several}
    return replace(zones, **changed)


def _zones(bench: Bench, asked: Asked) -> tuple[str, tuple[AnyZone, ...]]:
    kind = asked.get("kind")
    if kind not in ZONE_KINDS:
        raise PlanError(f"kind is {kind!r}: {', '.join(ZONE_KINDS)} are allowed")
    return kind, getattr(bench.zones, kind)


def _zone(asked: Asked, bench: Bench) -> AnyZone:
    if "point_mm" not in asked:
        low, high = vector(asked, "min_mm", MOST_MM), vector(asked, "max_mm", MOST_MM)
        if not all(least < most for least, most in zip(low, high, strict=True)):
            raise PlanError(f"min_mm is {list(low)} and max_mm {list(high)}: each number of min_mm must be less")
        return Zone(low, high, None if asked.get("axes") is None else rotation_rows(asked, "axes"))
    point = vector(asked, "point_mm", MOST_MM)
    zone, mesh = Grown(point, number(asked, "angle_deg", 0.0, MOST_GROWN_DEG)), workpiece_mesh(bench)
    if (away_mm := zone.away_mm(mesh)) > FARTHEST_MM:
        raise PlanError(f"point_mm is {list(point)}, {away_mm:.3g} mm from the model: up to {FARTHEST_MM:g} is allowed")
    return zone


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
