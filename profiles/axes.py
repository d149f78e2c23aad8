"""Axes: the linear axes of a machine, and the rotary axes that tilt and turn its table."""

from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import Field

from profiles.frozen import Effect, Frozen, Limits, Vector, advanced, rare

Letter = Annotated[str, Field(pattern=r"^[ABCUVWIJK]$")]


def _reversed(limits: Limits, name: str) -> list[str]:
    return [f"{name} is {list(limits)}: the first number must be below the second"] if limits[0] >= limits[1] else []


class LinearAxis(Frozen):
    """One of the axes X, Y, Z, in the firmware's coordinates."""

    limits_mm: Limits = advanced("Travel", "limits build volume size stroke")(..., "range that the firmware accepts, mm")
    speed_mm_s: float = advanced("Greatest speed", "maximum feedrate", gt=0, le=5000, effect=Effect.PRICES)(
        ..., "greatest speed, mm/s"
    )
    acceleration_mm_s2: float = advanced("Greatest acceleration", "maximum", gt=0, le=100000, effect=Effect.PRICES)(
        ..., "acceleration, mm/s²"
    )
    home_mm: float | None = rare("Position at home", "endstop")(
        None,
        "position after homing; Marlin assumes it after a restart, mm; left out: the least of limits_mm for X and Y, the "
        "greatest for Z",
    )

    def _problems(self) -> Iterable[str]:
        return _reversed(self.limits_mm, "limits_mm")


class RotaryAxis(Frozen):
    """The tilt or the turn axis of the table.

    A point w of the table moves by the right-handed rotation about `axis` through `point_mm` by -sign * (value - zero_deg): the
    rule of LinuxCNC's xyzac-trt-kins, whose default sign is -1.
    """

    letter: Letter = advanced("Letter in G-code", "axis A B C")(..., "G-code letter")
    stepper: str = rare("Stepper in Klipper", "manual_stepper", pattern=r"^[A-Za-z0-9_]*$")(
        "", "its [manual_stepper] in Klipper; empty: stepper_ and the letter"
    )
    axis: Vector = advanced("Direction of the axis")(..., "direction in the machine frame (any length)")
    point_mm: Vector = advanced("Point on the axis", "centre of rotation calibration offset")(
        ...,
        "point on the axis in the machine frame with both axes at zero_deg; for the turn axis the point where it meets the "
        "table's surface, which is the workpiece origin",
    )
    sign: Literal[-1, 1] = advanced("Sense of turning", "direction invert")(
        ..., "-1: positive values turn the table right-handed about axis; 1: the other way"
    )
    zero_deg: float = advanced("Value when level", "offset zero", ge=-360, le=360)(
        0.0, "value at which the table is level (tilt) or unturned"
    )
    limits_deg: Limits = advanced("Range", "limits angle")(..., "range that the firmware accepts, deg")
    budget_deg: float | None = advanced("Winding of the cables", "limit", ge=180, le=100000)(
        None, "winding that cables allow on each side of zero_deg, deg: the axis is unwound in time; left out: no cable"
    )
    speed_deg_s: float = advanced("Greatest speed", "maximum feedrate", gt=0, le=3600, effect=Effect.PRICES)(
        ..., "greatest speed, deg/s"
    )
    acceleration_deg_s2: float = advanced("Greatest acceleration", "maximum", gt=0, le=100000, effect=Effect.PRICES)(
        ..., "acceleration, deg/s²"
    )
    home_deg: float | None = rare("Position at home", "endstop")(
        None,
        "position after homing; Marlin assumes it after a restart, deg; left out: it is homed to zero_deg, and assumed at the "
        "least of limits_deg after a restart",
    )

    @property
    def reach_deg(self) -> Limits:
        """Least and greatest value that a print may use, limited by the firmware and by how far the cables let the axis turn."""
        if self.budget_deg is None:
            return self.limits_deg
        least, most = self.limits_deg
        return max(least, self.zero_deg - self.budget_deg), min(most, self.zero_deg + self.budget_deg)

    def _problems(self) -> Iterable[str]:
        problems = _reversed(self.limits_deg, "limits_deg") if not isinstance(self, StillAxis) else []
        if sum(x * x for x in self.axis) < 1e-12:
            problems.append(f"axis is {list(self.axis)}: a direction must not be zero")
        if not problems and not self.limits_deg[0] <= self.zero_deg <= self.limits_deg[1]:
            problems.append(f"zero_deg is {self.zero_deg:g}: it must lie inside limits_deg {list(self.limits_deg)}")
        return problems


class StillAxis(RotaryAxis):
    """The rotary axis of a machine without one; it stays at 0."""

    point_mm: Vector = (0.0, 0.0, 0.0)
    sign: Literal[-1, 1] = -1
    limits_deg: Limits = (0.0, 0.0)
    speed_deg_s: float = 1.0
    acceleration_deg_s2: float = 1.0


STANDING = {
    "tilt": StillAxis.model_validate({"letter": "A", "axis": (1.0, 0.0, 0.0)}),
    "turn": StillAxis.model_validate({"letter": "C", "axis": (0.0, 0.0, 1.0)}),
}
