"""The machine: linear axes, the tilt and turn axes of the table, the head's bodies, the table, its G-code blocks."""

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

Vector = tuple[float, float, float]
Limits = tuple[float, float]
FOLLOWING = ("marlin", "linuxcnc", "grblhal")  # dialects whose firmware can keep the tip on the workpiece (TCP)
Letter = Annotated[str, Field(pattern=r"^[ABCUVWIJK]$")]


class Frozen(BaseModel):
    """A validated value: unknown keys are refused, nothing changes after loading."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _no_truth_as_number(cls, value: Any, info: ValidationInfo) -> Any:
        """Refuses true and false where pydantic would read 1 and 0."""
        if isinstance(value, bool) and cls.model_fields[str(info.field_name)].annotation is not bool:
            raise PydanticCustomError("truth_as_number", "true and false are no numbers")
        return value


def _ordered(limits: Limits, name: str) -> None:
    if limits[0] >= limits[1]:
        raise ValueError(f"{name} is {list(limits)}: the first number must be below the second")


class LinearAxis(Frozen):
    """One of X, Y, Z as the firmware means it."""

    limits_mm: Limits = Field(description="least and greatest position the firmware accepts, mm")
    speed_mm_s: float = Field(gt=0, le=2000, description="greatest speed, mm/s")
    acceleration_mm_s2: float = Field(gt=0, le=100000, description="acceleration, mm/s2")

    @model_validator(mode="after")
    def _check(self) -> Self:
        _ordered(self.limits_mm, "limits_mm")
        return self


class RotaryAxis(Frozen):
    """The tilt or the turn axis of the table.

    A point w of the table moves by the right-handed rotation about `axis` through `point_mm` by
    -sign * (value - zero_deg): the rule of LinuxCNC's xyzac-trt-kins, whose default sign is -1.
    """

    letter: Letter = Field(description="the G-code word of this axis")
    stepper: str = Field(
        "",
        pattern=r"^[A-Za-z0-9_]*$",
        description="name of the axis's [manual_stepper] in Klipper; empty: stepper_ and the letter",
    )
    axis: Vector = Field(description="direction of the axis in the machine frame (any length)")
    point_mm: Vector = Field(
        description="a point of the axis in the machine frame at tilt 0, turn 0; for the turn axis the point where it "
        "meets the table's surface, which is the workpiece origin"
    )
    sign: Literal[-1, 1] = Field(description="-1: positive values turn the table right-handed about axis; 1: the other way")
    zero_deg: float = Field(0.0, ge=-360, le=360, description="axis value at which the table is level (tilt) or unturned")
    limits_deg: Limits = Field(description="least and greatest value the firmware accepts, deg")
    speed_deg_s: float = Field(gt=0, le=3600, description="greatest speed, deg/s")
    acceleration_deg_s2: float = Field(gt=0, le=100000, description="acceleration, deg/s2")

    @model_validator(mode="after")
    def _check(self) -> Self:
        _ordered(self.limits_deg, "limits_deg")
        if sum(x * x for x in self.axis) < 1e-12:
            raise ValueError(f"axis is {list(self.axis)}: a direction must not be zero")
        if not self.limits_deg[0] <= self.zero_deg <= self.limits_deg[1]:
            raise ValueError(f"zero_deg is {self.zero_deg:g}: it must lie inside limits_deg {list(self.limits_deg)}")
        return self


class Box(Frozen):
    """A body that moves with the head, in machine axes relative to the nozzle tip."""

    name: str = Field(description="what it is, for messages")
    min_mm: Vector = Field(description="least x, y, z relative to the tip, mm")
    max_mm: Vector = Field(description="greatest x, y, z relative to the tip, mm")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if any(a >= b for a, b in zip(self.min_mm, self.max_mm, strict=True)):
            raise ValueError(f"box {self.name}: min_mm must be below max_mm on every axis")
        if self.min_mm[2] < 0:
            raise ValueError(f"box {self.name}: min_mm z is {self.min_mm[2]:g}: no body may hang below the tip")
        return self


class Head(Frozen):
    """What must not touch the table: a silhouette revolved about the nozzle, and boxes."""

    nozzle_mm: float = Field(gt=0.05, le=3, description="diameter of the nozzle's bore, mm")
    silhouette_mm: list[tuple[float, float]] = Field(
        min_length=1, description="pairs [radius, height above the tip] of the hot end's lowest points, radii rising"
    )
    boxes: list[Box] = Field(default=[], description="fan duct, carriage, gantry beam")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for (r0, h0), (r1, h1) in zip(self.silhouette_mm, self.silhouette_mm[1:], strict=False):
            if r1 <= r0 or h1 < h0:
                raise ValueError(
                    f"silhouette_mm: [{r1:g}, {h1:g}] follows [{r0:g}, {h0:g}]: radii must rise and heights must not fall"
                )
        if self.silhouette_mm[0][0] < 0 or self.silhouette_mm[0][1] < 0:
            raise ValueError("silhouette_mm: radius and height must not be negative")
        return self


class Table(Frozen):
    """The turning plate."""

    radius_mm: float = Field(gt=0, le=2000, description="radius of the plate, mm")
    thickness_mm: float = Field(gt=0, le=200, description="thickness of the plate, mm")


class Blocks(Frozen):
    """G-code blocks; {placeholders} are listed in docs/profiles.md."""

    start: str = Field(description="before the first part: homing, heating, priming")
    end: str = Field(description="after the last part: heaters off, parking")
    before_part: str = Field("", description="before each reorientation")
    after_part: str = Field("", description="after each part")


class Machine(Frozen):
    """A 5-DOF printer: head on X Y Z, table tilting about one axis and turning about another."""

    name: str = Field(description="what people call it")
    dialect: Literal["marlin", "reprapfirmware", "klipper", "klipper_steppers", "linuxcnc", "grblhal"] = Field(
        description="the firmware's way of writing G-code; klipper: the rotary steppers are axes of G1 (GCODE_AXIS), "
        "klipper_steppers: they are turned by MANUAL_STEPPER"
    )
    coordinates: Literal["table", "workpiece"] = Field(
        "table",
        description="what X Y Z of the file mean; table: axis positions, which any firmware with five plain axes prints; "
        "workpiece: places on the table, for a firmware that follows the table by itself (marlin with G43.4, linuxcnc, grblhal)",
    )
    x: LinearAxis
    y: LinearAxis
    z: LinearAxis
    tilt: RotaryAxis
    turn: RotaryAxis
    tool_mm: Vector = Field((0.0, 0.0, 0.0), description="from the nozzle tip to the point whose position X Y Z tell, mm")
    junction_speed_mm_s: float = Field(
        8.0, ge=0, le=100, description="speed change that the firmware makes at once at a corner (jerk), mm/s"
    )
    extruder_speed_mm_s: float = Field(60.0, gt=0, le=500, description="greatest speed of the filament, mm/s")
    extruder_acceleration_mm_s2: float = Field(1500.0, gt=0, le=100000, description="acceleration of the filament, mm/s2")
    arcs: bool = Field(
        False, description="true: strokes along circles are written as arcs, G2 and G3; the firmware must know them"
    )
    arc_tolerance_mm: float = Field(
        0.025, ge=0.003, le=0.5, description="an arc stays so near to the path it replaces, mm; 0.025 is an eighteenth of a bead"
    )
    table: Table
    head: Head
    clearance_mm: float = Field(1.0, ge=0, le=100, description="least distance kept between head and table, mm")
    lift_mm: float = Field(10.0, ge=0, le=500, description="extra height above everything printed while the table moves, mm")
    nozzle_limit_c: float = Field(300.0, gt=0, le=600, description="greatest nozzle temperature, deg C")
    bed_limit_c: float = Field(120.0, ge=0, le=300, description="greatest bed temperature, deg C; 0: no heated bed")
    uncalibrated: list[str] = Field(default=[], description="keys whose values no source gives; the dry run names them")
    gcode: Blocks

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.coordinates == "workpiece" and self.dialect not in FOLLOWING:
            raise ValueError(
                f"coordinates is workpiece: {self.dialect} does not follow the table, only {', '.join(FOLLOWING)} do; table is left"
            )
        if self.tilt.letter == self.turn.letter:
            raise ValueError(f"tilt.letter and turn.letter are both {self.tilt.letter}: they must differ")
        dot = sum(a * b for a, b in zip(self.tilt.axis, self.turn.axis, strict=True))
        norm = (sum(a * a for a in self.tilt.axis) * sum(b * b for b in self.turn.axis)) ** 0.5
        if abs(dot) > 0.999 * norm:
            raise ValueError("tilt.axis and turn.axis are parallel: the table could not be tilted to any side")
        if self.turn.axis[2] ** 2 < 0.999 * sum(a * a for a in self.turn.axis):
            raise ValueError(f"turn.axis is {list(self.turn.axis)}: it must be vertical at tilt 0")
        return self
