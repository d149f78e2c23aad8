"""Klipper: its own SET_ commands, and two ways to turn a [manual_stepper].

Since Klipper3d/klipper#6888 such a stepper can be registered as a letter of G1 (GCODE_AXIS); until then, and in older
versions for good, MANUAL_STEPPER turns it. A registered stepper cannot be homed, so the start block comes before that.
"""

from dataclasses import replace

from machine.dialects.dialect import Dialect

_STANDS = (
    "SET_KINEMATIC_POSITION X={x_mm} Y={y_mm} Z={z_mm}",
    "MANUAL_STEPPER STEPPER={tilt_stepper} SET_POSITION={tilt_deg}",
    "MANUAL_STEPPER STEPPER={turn_stepper} SET_POSITION={turn_deg}",
)

KLIPPER_STEPPERS = Dialect(
    firmware="Klipper with MANUAL_STEPPER",
    longest_line=120,  # it keeps more; the stream's checksum is made for no longer ones
    nozzle="SET_HEATER_TEMPERATURE HEATER=extruder TARGET={}",
    nozzle_wait="M109 S{}",
    fan_on="M106 S{}",
    progress="M73 P{} R{}",
    acceleration="SET_VELOCITY_LIMIT ACCEL={}",  # M204 P T would take the lesser of the two for all moves
    layer="SET_PRINT_STATS_INFO CURRENT_LAYER={}",
    before_start=("SET_PRINT_STATS_INFO TOTAL_LAYER={layers}",),
    part="EXCLUDE_OBJECT_DEFINE NAME=part_{number}",
    part_begin="EXCLUDE_OBJECT_START NAME=part_{number}",
    part_end="EXCLUDE_OBJECT_END NAME=part_{number}",
    steppers=True,
    largest_delta=True,
    filament_mode="carried",
    macros=True,
    stands=_STANDS,
)

_LETTERS = (
    "MANUAL_STEPPER STEPPER={tilt_stepper} GCODE_AXIS={tilt} LIMIT_VELOCITY={tilt_speed} LIMIT_ACCEL={tilt_acceleration}",
    "MANUAL_STEPPER STEPPER={turn_stepper} GCODE_AXIS={turn} LIMIT_VELOCITY={turn_speed} LIMIT_ACCEL={turn_acceleration}",
)
_FREE = ("MANUAL_STEPPER STEPPER={tilt_stepper} GCODE_AXIS=", "MANUAL_STEPPER STEPPER={turn_stepper} GCODE_AXIS=")

KLIPPER = replace(
    KLIPPER_STEPPERS,
    firmware="Klipper with GCODE_AXIS",
    steppers=False,
    before_start=(*_FREE, *KLIPPER_STEPPERS.before_start),
    after_start=_LETTERS,
    stands=(*_STANDS, *_LETTERS),
    before_end=_FREE,
)
