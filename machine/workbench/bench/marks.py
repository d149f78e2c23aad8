"""Marks: boxes and faces on which a person wants no cut, no seam, no support or support: the zones of the plan."""

from dataclasses import replace
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from machine.workbench.bench.bench import Bench
from machine.workbench.bench.values import Command, Point, Rotation, check_number
from mdp.directions.orientation import set_on_plate
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
Kind = Literal["keep", "no_seam", "no_support", "support"]


class Marking(Command):
    """A command that gives other zones; it is run in a process, for it may read the model's mesh."""

    kind: Kind

    @property
    def step(self) -> str:
        """The word for its step in the history."""
        raise NotImplementedError

    def zones(self, bench: Bench) -> Zones:
        """The zones after it. Raises PlanError."""
        raise NotImplementedError


class Mark(Marking):
    """A further zone: a box, along `axes` where it leans, or the faces around a point as far as an angle; in place of the zone
    `number`, if one is given."""

    do: Literal["mark"] = "mark"
    number: int | None = None
    min_mm: Point | None = None
    max_mm: Point | None = None
    axes: Rotation | None = None
    point_mm: Point | None = None
    angle_deg: Annotated[float, Field(ge=0, le=MOST_GROWN_DEG)] | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        needed = ("min_mm", "max_mm") if self.point_mm is None else ("angle_deg",)
        for key in needed:
            if getattr(self, key) is None:
                raise ValueError(f"{key} is missing")
        if self.min_mm and self.max_mm and not all(low < high for low, high in zip(self.min_mm, self.max_mm, strict=True)):
            raise ValueError(f"min_mm is {list(self.min_mm)} and max_mm {list(self.max_mm)}: each number of min_mm must be less")
        return self

    @property
    def step(self) -> str:
        return WORDS[self.kind]

    def zones(self, bench: Bench) -> Zones:
        zones: tuple[AnyZone, ...] = getattr(bench.zones, self.kind)
        index = len(zones) if self.number is None else check_number("number", self.number, 1, len(zones)) - 1
        if index >= MOST_ZONES:
            raise PlanError(f"there are {index} zones of {self.kind}: {MOST_ZONES} are allowed")
        return _with(bench.zones, self.kind, (*zones[:index], self._zone(bench), *zones[index + 1 :]))

    def _zone(self, bench: Bench) -> AnyZone:
        if self.min_mm is not None and self.max_mm is not None and self.point_mm is None:
            return Zone(self.min_mm, self.max_mm, self.axes)
        assert self.point_mm is not None
        assert self.angle_deg is not None
        zone = Grown(self.point_mm, self.angle_deg)
        if (away_mm := zone.away_mm(workpiece_mesh(bench))) > FARTHEST_MM:
            raise PlanError(
                f"point_mm is {list(self.point_mm)}, {away_mm:.3g} mm from the model: up to {FARTHEST_MM:g} is allowed"
            )
        return zone


class Unmark(Marking):
    """Without the zone `number` of a kind."""

    do: Literal["unmark"] = "unmark"
    number: int

    @property
    def step(self) -> str:
        return "take a mark away"

    def zones(self, bench: Bench) -> Zones:
        zones: tuple[AnyZone, ...] = getattr(bench.zones, self.kind)
        index = check_number("number", self.number, 1, len(zones)) - 1
        return _with(bench.zones, self.kind, (*zones[:index], *zones[index + 1 :]))


def _with(zones: Zones, kind: str, several: tuple[AnyZone, ...]) -> Zones:
    changed: dict[str, Any] = {kind: several}
    return replace(zones, **changed)


def workpiece_mesh(bench: Bench) -> Mesh:
    """The model as it stands on the platform or a pedestal, in the workpiece frame."""
    assert bench.model is not None
    standing = set_on_plate(bench.model.mesh(), bench.turned)
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
