"""Marks: boxes and faces on which a person wants no cut, no seam or no support: the zones of the plan."""

from dataclasses import replace
from typing import Any

import numpy as np

from machine.app.workbench.bench.bench import Bench
from machine.app.workbench.bench.planes import MOST_MM, is_number, rotation_rows
from mdp.directions.orientation import standing_still
from mdp.mesh import Mesh
from mdp.overhang import Mask
from mdp.plans.plan_file import ZONE_KINDS
from mdp.plans.reading import MOST_ZONES
from mdp.zone import FARTHEST_MM, MOST_GROWN_DEG, AnyZone, Grown, Zone, Zones, faces_of
from profiles.errors import PlanError
from profiles.frozen import Vector

MARKS = ("mark", "unmark")
WORDS = {"keep": "mark: no cut here", "no_seam": "mark: no seam here", "no_support": "mark: no support here"}


def marked(bench: Bench, asked: dict[str, Any]) -> tuple[str, Zones]:
    """A word for what a command does to the zones, and the zones after it. Raises PlanError for what makes no sense.

    mark: a box `min_mm`, `max_mm`, along `axes` of its own where it leans, or the faces around `point_mm` as far as `angle_deg`,
    becomes a zone of `kind`, in place of that of `number`, if one is given; unmark: the zone `number` of `kind` goes.
    """
    if bench.model is None:
        raise PlanError("there is no model on the workbench yet: choose a file first")
    kind = asked.get("kind")
    if kind not in ZONE_KINDS:
        raise PlanError(f"kind is {kind!r}: {', '.join(ZONE_KINDS)} are allowed")
    zones: tuple[AnyZone, ...] = getattr(bench.zones, kind)
    place = _place(asked.get("number"), len(zones)) if asked.get("do") == "unmark" or "number" in asked else len(zones)
    if asked.get("do") == "unmark":
        return "take a mark away", replace(bench.zones, **{kind: (*zones[:place], *zones[place + 1 :])})
    if place >= MOST_ZONES:
        raise PlanError(f"there are {place} zones of {kind}: {MOST_ZONES} are allowed")
    return WORDS[kind], replace(bench.zones, **{kind: (*zones[:place], _zone(asked, bench), *zones[place + 1 :])})


def _place(number: Any, count: int) -> int:
    if not isinstance(number, int) or isinstance(number, bool) or not 1 <= number <= count:
        raise PlanError(f"number is {number!r}: {f'1 to {count} is allowed' if count else 'there is none yet'}")
    return number - 1


def _zone(asked: dict[str, Any], bench: Bench) -> AnyZone:
    if "point_mm" not in asked:
        low, high = _vector(asked, "min_mm"), _vector(asked, "max_mm")
        if not all(least < most for least, most in zip(low, high, strict=True)):
            raise PlanError(f"min_mm is {list(low)} and max_mm {list(high)}: each number of min_mm must be less")
        return Zone(low, high, None if asked.get("axes") is None else rotation_rows(asked["axes"], "axes"))
    point, angle_deg = _vector(asked, "point_mm"), asked.get("angle_deg")
    if not is_number(angle_deg) or not 0.0 <= angle_deg <= MOST_GROWN_DEG:
        raise PlanError(f"angle_deg is {angle_deg!r}: 0 to {MOST_GROWN_DEG:g} is allowed")
    zone, mesh = Grown(point, float(angle_deg)), standing_mesh(bench)
    if (away_mm := zone.away_mm(mesh)) > FARTHEST_MM:
        raise PlanError(f"point_mm is {list(point)}, {away_mm:.3g} mm from the model: up to {FARTHEST_MM:g} is allowed")
    return zone


def _vector(asked: dict[str, Any], key: str) -> Vector:
    value = asked.get(key)
    if not isinstance(value, list) or len(value) != 3 or not all(map(is_number, value)):
        raise PlanError(f"{key}: three numbers are expected")
    if max(map(abs, value)) > MOST_MM:
        raise PlanError(f"{key} is {value}: {-MOST_MM:g} to {MOST_MM:g} is allowed")
    x, y, z = (float(each) for each in value)
    return x, y, z


def standing_mesh(bench: Bench) -> Mesh:
    """The model as it stands on the platform or a pedestal, in the workpiece frame."""
    assert bench.model is not None
    standing = standing_still(bench.model.mesh(), bench.turned)
    lift_mm = bench.profile.search.pedestal_mm
    return standing.transform(np.eye(3), (0.0, 0.0, lift_mm)) if lift_mm > 0.0 else standing


def named_faces(bench: Bench) -> Mask:
    """(kinds, m) which faces of the model the zones that are no boxes mean."""
    mesh = standing_mesh(bench)
    rows = np.zeros((len(ZONE_KINDS), len(mesh.faces)), dtype=np.bool_)
    for row, kind in zip(rows, ZONE_KINDS, strict=True):
        for zone in getattr(bench.zones, kind):
            if not isinstance(zone, Zone):
                row |= faces_of(mesh, zone)
    return rows
