"""The machine: its axes, the bodies of the head, the table, and its G-code blocks."""

from collections.abc import Iterable
from math import acos, cos, degrees, hypot, radians
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, WithJsonSchema, model_validator

from profiles.axes import STANDING, LinearAxis, RotaryAxis
from profiles.frozen import Effect, Frozen, Vector, advanced, rare, simple
from profiles.wording import keys, nearest

# The G-code dialects that a profile may name and machine/firmware/ writes -> whether the firmware can keep the tip on the
# workpiece while the table turns (TCP).
FOLLOWS_TABLE = {
    "marlin": True,
    "reprapfirmware": False,
    "klipper": False,
    "klipper_steppers": False,
    "linuxcnc": True,
    "grblhal": True,
}
if TYPE_CHECKING:
    DialectName = str
else:
    DialectName = Literal[tuple(FOLLOWS_TABLE)]

LEAST_LEAN_DEG = 1.0  # a table that tilts less can print only upright parts
UPRIGHT = 0.9995  # least cosine between the turn axis and the vertical
GCODE = "gcode"  # kind of a text in the schema: lines of G-code
STEADY_S = 10.0  # how long a nozzle must hold its temperature before firmware continues
Block = Annotated[str, WithJsonSchema({"type": "string", "format": GCODE})]
Pixels = Annotated[int, Field(ge=16, le=1024)]


class Box(Frozen):
    """A body that moves with the head, in machine axes relative to the nozzle tip."""

    name: str = Field(description="what it is, for messages")
    min_mm: Vector = Field(description="least x, y, z relative to the tip, mm")
    max_mm: Vector = Field(description="greatest x, y, z relative to the tip, mm")

    def _problems(self) -> Iterable[str]:
        problems = _inverted(self.name, self.min_mm, self.max_mm)
        if self.min_mm[2] < 0:
            problems.append(f"box {self.name}: min_mm z is {self.min_mm[2]:g}: no body may hang below the tip")
        return problems


def _inverted(name: str, least_mm: Vector, most_mm: Vector) -> list[str]:
    wrong = any(a >= b for a, b in zip(least_mm, most_mm, strict=True))
    return [f"box {name}: min_mm must be below max_mm on every axis"] if wrong else []


class TableBox(Frozen):
    """A body beside or on the plate: of the cradle, which does not turn (a yoke's arm, a motor), or a clip, which does."""

    name: str = Field(description="what it is, for messages")
    min_mm: Vector = Field(
        description="least x, y, z from the workpiece origin when level and unturned, mm; the plate's surface is z = 0"
    )
    max_mm: Vector = Field(description="greatest x, y, z from the workpiece origin when level and unturned, mm")

    def _problems(self) -> Iterable[str]:
        return _inverted(self.name, self.min_mm, self.max_mm)

    @property
    def nearest_mm(self) -> float:
        """Least distance of the box from the turn axis, mm."""
        across, along = (max(a, -b, 0.0) for a, b in zip(self.min_mm[:2], self.max_mm[:2], strict=True))
        return hypot(across, along)


class Head(Frozen):
    """Bodies that must not touch the table: a silhouette revolved about the nozzle, and boxes."""

    nozzle_mm: float = simple("Nozzle diameter", "size", gt=0.05, le=3)(..., "diameter of the nozzle's bore, mm")
    silhouette_mm: list[tuple[float, float]] = advanced(
        "Silhouette of the hot end", "extruder clearance radius collision", min_length=1
    )(..., "[radius, height above the tip] of the hot end's lowest points")
    boxes: list[Box] = advanced("Bodies beside the nozzle", "extruder clearance fan duct collision")(
        [], "fan duct, carriage, gantry beam"
    )

    def _problems(self) -> Iterable[str]:
        problems = [
            f"silhouette_mm: [{r1:g}, {h1:g}] follows [{r0:g}, {h0:g}]: radii must rise and heights must not fall"
            for (r0, h0), (r1, h1) in zip(self.silhouette_mm, self.silhouette_mm[1:], strict=False)
            if r1 <= r0 or h1 < h0
        ]
        if self.silhouette_mm[0][0] < 0 or self.silhouette_mm[0][1] < 0:
            problems.append("silhouette_mm: radius and height must not be negative")
        return problems


class Table(Frozen):
    """The turning plate: a disc, or a rectangle about the turn axis."""

    radius_mm: float = simple("Radius", "bed size build plate diameter", gt=0, le=2000)(
        ..., "radius of a round plate, mm; size_mm makes it half a diagonal"
    )
    size_mm: tuple[float, float] | None = simple("Size of a rectangle", "bed size build plate shape")(
        None, "x and y of a rectangular plate, mm; its middle is on the turn axis, at turn 0; left out: round"
    )
    thickness_mm: float = rare("Thickness", "build plate", gt=0, le=200)(..., "thickness of the plate, mm")
    clips: list[TableBox] = rare("Clips", "bed clips binder clip screws magnets disallowed areas excluded area")(
        [], "bodies fixed on the plate that turn with it: clips, screws; models are placed clear of them"
    )

    @model_validator(mode="before")
    @classmethod
    def _circumscribed(cls, given: Any) -> Any:
        """Give a rectangle the radius of its circumscribed circle, so that code that only handles discs is on the safe side."""
        size = given.get("size_mm") if isinstance(given, dict) else None
        numbers = isinstance(size, list | tuple) and all(isinstance(x, int | float) for x in size)
        return given | {"radius_mm": hypot(*size) / 2.0} if size and numbers else given

    def _problems(self) -> Iterable[str]:
        if self.size_mm is not None and min(self.size_mm) <= 0:
            yield f"size_mm is {list(self.size_mm)}: both numbers must be above 0"
        for box in self.clips:
            if box.max_mm[2] <= 0.0:
                yield f"clips: box {box.name} ends at z {box.max_mm[2]:g} mm: it must rise above the plate, z 0"


class Blocks(Frozen):
    """G-code blocks; {placeholders} are listed in docs/machines.md."""

    start: Block = advanced("Start G-code", "custom script begin chamber temperature", effect=Effect.NONE)(
        ..., "before the first part: homing, heating, priming"
    )
    end: Block = advanced("End G-code", "custom script finish", effect=Effect.NONE)(
        ..., "after the last part: heaters off, parking"
    )
    before_part: Block = advanced("G-code before a part", "custom script", effect=Effect.NONE)("", "before each reorientation")
    after_part: Block = advanced("G-code after a part", "custom script", effect=Effect.NONE)("", "after each part")
    before_layer: Block = advanced(
        "G-code before a layer", "custom script layer change filament change before_layer_gcode layer_gcode", effect=Effect.NONE
    )(
        "",
        "before each layer, over the print: only commands that are known to move nothing and to change no mode; macros are "
        "refused",
    )
    resume: Block = rare("G-code after a power cut", "custom script recovery", effect=Effect.NONE)(
        "",
        "after a power cut: gives the axes their positions without touching the print, and leaves the tip at {clear_z_mm} or "
        "above, the table at {tilt_deg} {turn_deg}; {x_mm} {y_mm} {z_mm} is where the tip was. Empty: all axes are assumed to "
        "be there still, the tip rises, X and Y are homed",
    )


class Machine(Frozen):
    """A printer whose head moves on X Y Z over a table that tilts about one axis and turns about another, or stands still."""

    name: str = advanced("Name of the machine", "printer", effect=Effect.NONE)(..., "its name")
    shape: Literal["table", "fixed"] = advanced("Shape", "kinematics 3-axis 5-axis")(
        "table", "table: it tilts and turns; fixed: three axes only, tilt and turn are left out, all is printed in one part"
    )
    dialect: DialectName = advanced("Firmware", "G-code flavor marlin klipper")(
        ...,
        "G-code dialect of the firmware; klipper: the rotary steppers are axes of G1 (GCODE_AXIS), klipper_steppers: they are "
        "turned by MANUAL_STEPPER",
    )
    coordinates: Literal["table", "workpiece"] = advanced("Meaning of X Y Z", "tool centre point TCP")(
        "table",
        "meaning of X Y Z in the file; table: axis positions, which any firmware with five plain axes prints; workpiece: "
        "places on the table, for a firmware that follows the table by itself (marlin with G43.4, linuxcnc, grblhal)",
    )
    x: LinearAxis
    y: LinearAxis
    z: LinearAxis
    tilt: RotaryAxis
    turn: RotaryAxis
    tool_mm: Vector = advanced("From the tip to X Y Z", "tool offset length")(
        (0.0, 0.0, 0.0), "from the nozzle tip to the point at X Y Z, mm"
    )
    junction_speed_mm_s: float = advanced(
        "Corner speed", "jerk junction deviation square corner velocity", ge=0, le=100, effect=Effect.PRICES
    )(8.0, "instant speed change at a corner (jerk), mm/s")
    receive_bytes: int = rare("Receive buffer", "RX_BUFFER_SIZE serial", ge=64, le=65536, effect=Effect.NONE)(
        128, "receive buffer of the serial port, bytes (Marlin: RX_BUFFER_SIZE): less is on its way at a time"
    )
    extruder_speed_mm_s: float = advanced("Extruder speed", "E maximum feedrate", gt=0, le=500, effect=Effect.PRICES)(
        60.0, "greatest speed of the filament, mm/s"
    )
    extruder_acceleration_mm_s2: float = advanced("Extruder acceleration", "E maximum", gt=0, le=100000, effect=Effect.PRICES)(
        1500.0, "acceleration of the filament, mm/s²"
    )
    arcs: bool = advanced("Arcs", "arc fitting G2 G3 welder", effect=Effect.NONE)(
        False, "true: circular strokes are written as G2, G3; the firmware must know them"
    )
    arc_tolerance_mm: float = advanced("Arc tolerance", "arc fitting resolution", ge=0.003, le=0.5, effect=Effect.NONE)(
        0.025, "greatest deviation of an arc, mm; 0.025 is an eighteenth of a bead"
    )
    table: Table
    cradle: list[TableBox] = rare("Bodies that tilt with the table", "collision")([], "bodies that tilt but do not turn")
    head: Head
    clearance_mm: float = advanced("Clearance between head and table", "collision distance", ge=0, le=100)(
        1.0, "least distance between head and table, mm"
    )
    lift_mm: float = advanced("Lift while the table moves", "z hop", ge=0, le=500, effect=Effect.NONE)(
        10.0, "height above the print while the table moves, mm"
    )
    pause_cools_after_min: float = advanced("Nozzle off after a pause of, minutes", "idle timeout", ge=0, le=1440)(
        10.0,
        "minutes of pause before the nozzle is switched off; the bed stays on; the nozzle is heated and primed when the print "
        "continues; as long as Prusa's M600 (M600_TIMEOUT 600 s) and Klipper (idle_timeout) wait, Marlin's M600 waits 45 s "
        "(PAUSE_PARK_NOZZLE_TIMEOUT); 0: never",
    )
    purge_mm: float = simple("Purge line", "prime line intro wipe", ge=0, le=500, effect=Effect.PRICES)(
        0.0,
        "length of a purge line at the plate's edge, mm; it follows the start block, clear of the print; 0: none, or the "
        "start block has its own",
    )
    nozzle_limit_c: float = advanced("Hottest nozzle", "maximum temperature", gt=0, le=600, effect=Effect.NONE)(
        300.0, "greatest nozzle temperature, °C"
    )
    nozzle_heating_c_s: float = rare("Heating of the nozzle", "heat-up rate", gt=0, le=50, effect=Effect.PRICES)(
        1.5, "heating rate of the nozzle near printing temperature, °C/s: estimates of waiting use it"
    )
    bed_limit_c: float = advanced("Hottest bed", "maximum temperature heatbed", ge=0, le=300, effect=Effect.NONE)(
        120.0, "greatest bed temperature, °C; 0: no heated bed"
    )
    thumbnails_px: list[tuple[Pixels, Pixels]] = advanced(
        "Pictures in the G-code", "thumbnails preview", max_length=4, effect=Effect.NONE
    )([], "[width, height] of pictures in the G-code, pixels; web pages show them")
    uncalibrated: list[str] = rare("Keys without a source", "calibration", effect=Effect.NONE)(
        [], "keys without a source; the dry run names them"
    )
    sources: dict[str, str] = rare("Sources of values", effect=Effect.NONE)({}, "sources of keys, or of tables of keys")
    gcode: Blocks

    def heating_s(self, rise_c: float, since_s: float = 0.0) -> float:
        """Seconds until a nozzle that was set hotter by this much since_s ago is hot: the rise, and the time for which Marlin's
        M109 requires a steady temperature (Configuration.h: TEMP_RESIDENCY_TIME); other firmware does not wait longer.
        """
        return max(rise_c / self.nozzle_heating_c_s - since_s, 0.0) + STEADY_S if rise_c > 0.0 else 0.0

    @property
    def tilts(self) -> bool:
        """Whether the machine has rotary axes; False for three axes."""
        return self.shape == "table"

    @property
    def home(self) -> tuple[float, float, float, float, float]:
        """X Y Z tilt turn, mm and deg, as Marlin assumes after a restart (module/motion.cpp: current_position starts with
        X_HOME_POS, Y_HOME_POS, Z_HOME_POS, I_HOME_POS, J_HOME_POS).
        """
        ends = (self.x.limits_mm[0], self.y.limits_mm[0], self.z.limits_mm[1], self.tilt.limits_deg[0], self.turn.limits_deg[0])
        named = (self.x.home_mm, self.y.home_mm, self.z.home_mm, self.tilt.home_deg, self.turn.home_deg)
        x, y, z, tilt, turn = (end if home is None else home for home, end in zip(named, ends, strict=True))
        return x, y, z, tilt, turn

    @model_validator(mode="before")
    @classmethod
    def _stand_still(cls, given: Any) -> Any:
        """Give a fixed machine rotary axes that stay at 0, so that one kinematic chain serves both kinds."""
        if not isinstance(given, dict) or given.get("shape") != "fixed":
            return given
        return given | STANDING

    def _problems(self) -> Iterable[str]:
        return [*self._words(), *(self._axes() if self.tilts else []), *self._named(), *self._in_the_plate()]

    def _words(self) -> Iterable[str]:
        if self.coordinates == "workpiece" and not FOLLOWS_TABLE[self.dialect]:
            able = ", ".join(name for name, follows in FOLLOWS_TABLE.items() if follows)
            yield f"coordinates is workpiece: {self.dialect} does not follow the table, only {able} do; table is left"
        if self.tilt.letter == self.turn.letter:
            yield f"tilt.letter and turn.letter are both {self.tilt.letter}: they must differ"

    def _axes(self) -> Iterable[str]:
        """Check the two rotary axes together: whether they can tilt the table."""
        dot = sum(a * b for a, b in zip(self.tilt.axis, self.turn.axis, strict=True))
        norm = hypot(*self.tilt.axis) * hypot(*self.turn.axis)
        if self.turn.axis[2] ** 2 < UPRIGHT**2 * sum(a * a for a in self.turn.axis):
            yield f"turn.axis is {list(self.turn.axis)}: it must be vertical when the table is level"
        elif abs(dot) > 0.999 * norm:
            yield "tilt.axis and turn.axis are parallel: the table could not be tilted to any side"
        elif (lean := self._greatest_lean_deg(dot / norm)) < LEAST_LEAN_DEG:
            yield (
                f"tilt.limits_deg is {list(self.tilt.limits_deg)}: the table would lean by at most {lean:.2g} deg, at least "
                f'{LEAST_LEAN_DEG:g} is needed; a machine that does not tilt has shape = "fixed"'
            )

    def _greatest_lean_deg(self, cosine: float) -> float:
        """Greatest angle of the turn axis from the vertical within the limits of the tilt; cosine: of the angle between the two
        axes.
        """
        turned = (min(abs(limit - self.tilt.zero_deg), 180.0) for limit in self.tilt.limits_deg)
        leans = (cosine**2 + (1.0 - cosine**2) * cos(radians(angle)) for angle in turned)
        return max(degrees(acos(max(-1.0, min(1.0, lean)))) for lean in leans)

    def _named(self) -> Iterable[str]:
        """Unknown names of keys."""
        known = [key for key, _ in keys(Machine, "machine.")]
        places = {key.rsplit(".", k)[0] for key in known for k in range(key.count(".") + 1)} - {"machine"}
        for field, named in (("uncalibrated", self.uncalibrated), ("sources", self.sources)):
            for key in named:
                if key not in places:
                    near = nearest(key, known)
                    yield f"{field} names {key}, which is not a key of a machine" + (f": did you mean {near}?" if near else "")

    def _in_the_plate(self) -> Iterable[str]:
        """Bodies of the cradle that would collide with the turning plate or a print on it."""
        radius = self.table.radius_mm if self.table.size_mm is None else min(self.table.size_mm) / 2.0
        for box in self.cradle:
            if box.max_mm[2] > -self.table.thickness_mm and box.nearest_mm < radius:
                yield (
                    f"cradle: box {box.name} reaches z {box.max_mm[2]:g} mm within {box.nearest_mm:g} mm of the turn axis: "
                    f"there the plate turns (radius {radius:g} mm, {self.table.thickness_mm:g} mm thick)"
                )
