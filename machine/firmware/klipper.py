"""Klipper: its own SET_ commands, and two ways to turn a [manual_stepper].

Since Klipper3d/klipper#6888 such a stepper can be registered as a letter of G1 (GCODE_AXIS); in older versions MANUAL_STEPPER
turns it. A registered stepper cannot be homed, so the start block comes first. N and * are stripped and ignored
(klippy/gcode.py). A macro may run silently for minutes, and the pseudo-terminal loses nothing: when the program behind it dies
the port closes. M114 names only X Y Z E, whatever steppers turn the table.
"""

from collections.abc import Mapping
from dataclasses import replace

from machine.firmware.dialect import HEATING_S, HOMING_S, PERSON_S, PROBING_S, Command, Dialect
from machine.firmware.firmware import Firmware, LineRules, ProbingRules, SimulationRules
from profiles.axes import RotaryAxis

_STANDS = (
    "SET_KINEMATIC_POSITION X={x_mm} Y={y_mm} Z={z_mm}",
    "MANUAL_STEPPER STEPPER={tilt_stepper} SET_POSITION={tilt_deg}",
    "MANUAL_STEPPER STEPPER={turn_stepper} SET_POSITION={turn_deg}",
)

# klipper3d.org/G-Codes.html. Any other name is a macro of the machine's own: most of PRINT_START's kind heat.
# fmt: off
COMMANDS = {
    "HOME_": Command("a macro such as HOME_AB that homes the axes it names", moves="other", homes=True),
    "MANUAL_STEPPER": Command("turn or home a [manual_stepper]", moves="table", answer_s=HOMING_S),
    "FORCE_MOVE": Command("turn a motor", moves="other"),
    "SET_KINEMATIC_POSITION": Command("call the head's place", changes=True),
    "SET_GCODE_OFFSET": Command("offset of all moves, a baby step"),
    "SAVE_GCODE_STATE": Command("store the modes"),
    "RESTORE_GCODE_STATE": Command("return to the stored modes, with MOVE=1 to the place", moves="other", changes=True),
    "PROBE": Command("probe one point", moves="other", probes=True),
    "BED_MESH_CALIBRATE": Command("probe the bed", moves="other", probes=True, answer_s=PROBING_S),
    "BED_MESH_CLEAR": Command("mesh of the bed off"),
    "BED_MESH_PROFILE": Command("load or store a mesh of the bed"),
    "Z_TILT_ADJUST": Command("align the Z motors", moves="other", probes=True),
    "QUAD_GANTRY_LEVEL": Command("level the gantry", moves="other", probes=True),
    "SET_HEATER_TEMPERATURE": Command("set a heater's temperature", heats="named", repeatable=True),
    "TEMPERATURE_WAIT": Command("wait for a temperature", waits="heat", answer_s=HEATING_S, repeatable=True),
    "TURN_OFF_HEATERS": Command("all heaters off"),
    "PID_CALIBRATE": Command("tune a heater, which heats it", heats="any"),
    "SET_VELOCITY_LIMIT": Command("speed and acceleration limits", modal=True, tunes=True),
    "SET_PRESSURE_ADVANCE": Command("pressure advance", modal=True, tunes=True),
    "SET_STEPPER_ENABLE": Command("a motor on or off", motors=True),
    "SET_FAN_SPEED": Command("fan"),
    "SET_LED": Command("lights"),
    "SET_IDLE_TIMEOUT": Command("idle time until heaters and motors go off"),
    "PAUSE": Command("pause, a macro", waits="person", answer_s=PERSON_S),
    "CLEAR_PAUSE": Command("forget the pause"),
    "RESUME": Command("resume, a macro", heats="any"),
    "CANCEL_PRINT": Command("cancel, a macro", heats="any"),
    "SDCARD_PRINT_FILE": Command("start a file", heats="any"),
    "SET_DISPLAY_TEXT": Command("show a text", shows=True, repeatable=True),
    "SET_PRINT_STATS_INFO": Command("layers of the print", shows=True, repeatable=True),
    "EXCLUDE_OBJECT": Command("leave out an object", shows=True),
    "EXCLUDE_OBJECT_DEFINE": Command("name an object", shows=True),
    "EXCLUDE_OBJECT_START": Command("an object begins", shows=True),
    "EXCLUDE_OBJECT_END": Command("an object ends", shows=True),
}
# fmt: on

STEPPERS = Dialect(
    firmware="Klipper with MANUAL_STEPPER",
    longest_line=120,  # it keeps more, but the stream's checksum supports no longer ones
    nozzle="SET_HEATER_TEMPERATURE HEATER=extruder TARGET={}",
    nozzle_wait="M109 S{}",
    fan_on="M106 S{}",
    progress="M73 P{} R{}",
    acceleration="SET_VELOCITY_LIMIT ACCEL={}",  # M204 P T would use the smaller of the two for all moves
    pressure_advance="SET_PRESSURE_ADVANCE ADVANCE={}",
    babystep="SET_GCODE_OFFSET Z_ADJUST={} MOVE=1",
    pause="PAUSE",
    filament_change="PAUSE",
    layer="SET_PRINT_STATS_INFO CURRENT_LAYER={}",
    before_start=("SET_PRINT_STATS_INFO TOTAL_LAYER={layers}",),
    part="EXCLUDE_OBJECT_DEFINE NAME=part_{number}",
    part_begin="EXCLUDE_OBJECT_START NAME=part_{number}",
    part_end="EXCLUDE_OBJECT_END NAME=part_{number}",
    steppers=True,
    largest_delta=True,
    filament_mode="carried",
    bare_g92=True,
    macros=True,
    stands=_STANDS,
    wait_for_person=("M117 {text}", "PAUSE"),
    commands=COMMANDS,
)

_LETTERS = (
    "MANUAL_STEPPER STEPPER={tilt_stepper} GCODE_AXIS={tilt} LIMIT_VELOCITY={tilt_speed} LIMIT_ACCEL={tilt_acceleration}",
    "MANUAL_STEPPER STEPPER={turn_stepper} GCODE_AXIS={turn} LIMIT_VELOCITY={turn_speed} LIMIT_ACCEL={turn_acceleration}",
)
_FREE = ("MANUAL_STEPPER STEPPER={tilt_stepper} GCODE_AXIS=", "MANUAL_STEPPER STEPPER={turn_stepper} GCODE_AXIS=")

AXES = replace(
    STEPPERS,
    firmware="Klipper with GCODE_AXIS",
    steppers=False,
    before_start=(*_FREE, *STEPPERS.before_start),
    after_start=_LETTERS,
    stands=(*_STANDS, *_LETTERS),
    before_end=_FREE,
)


def stepper_name(axis: RotaryAxis) -> str:
    """The name of a rotary axis's [manual_stepper]."""
    return axis.stepper or f"stepper_{axis.letter.lower()}"


def position_report(coordinates: Mapping[str, float], steps: Mapping[str, int]) -> str:
    """Klipper's report, `X:1.000 Y:2.000 Z:3.000 E:0.000`."""
    del steps
    return " ".join(f"{letter}:{coordinates[letter]:.3f}" for letter in "XYZE")


def temperature_report(nozzle_c: float, nozzle_target_c: float, bed_c: float, bed_target_c: float) -> str:
    """Klipper's report, `B:20.0 /0.0 T0:20.0 /0.0`."""
    return f"B:{bed_c:.1f} /{bed_target_c:.1f} T0:{nozzle_c:.1f} /{nozzle_target_c:.1f}"


UNKNOWN = frozenset({
    "M92", "M108", "M113", "M116", "M154", "M155", "M211", "M302", "M409", "M410", "M486", "M503", "M568", "M572", "M665", "M876",
    "M900", "G43.4", "G38.3",
})  # fmt: skip
IDENTITY = "FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.13.0-simulated"

SIMULATED = SimulationRules(
    identity=IDENTITY,
    identity_in_ok=True,
    banner=("// Klipper state: Ready",),
    numbers="ignore",
    answers_blank=True,  # klippy/gcode.py, _process_commands: any line is acknowledged
    queue_lines=20,
    blocks=100,  # its toolhead looks 2 s ahead, whatever number of moves that is
    urgent="lines",
    unknown='// Unknown command:"{}"',
    cold=(
        "// Extrude below minimum temp",
        "// See the 'min_extrude_temp' config option for details",
        "!! Extrude below minimum temp",
    ),
    cold_moves=False,
    unhomed="!! Must home axis first: {}",
    out_of_range="!! Move out of range: {}",
    heater_fault="Heater extruder not heating at expected rate",
    kill=("// Klipper state: Shutdown",),
    # klippy/gcode.py, _respond_error and cmd_default: the next command is answered with the reason, except M105 and commands that
    # work without a printer; klippy/klippy.py, message_shutdown.
    after_kill=(
        "// {}",
        "// Once the underlying issue is corrected, use the",
        '// "FIRMWARE_RESTART" command to reset the firmware, reload the',
        "// config, and restart the host software.",
        "// Printer is shutdown",
        "!! {}",
        "ok",
    ),
    answers_killed={"M105": "ok T:0", "M110": "ok", "M112": "ok", "M115": f"ok {IDENTITY}"},
    position=position_report,
    temperatures=temperature_report,
    while_heating="",
    lacks=UNKNOWN,
    # klippy/extras/idle_timeout.py: timeout 600, TURN_OFF_HEATERS and M84; stepper_enable.py, motor_off: homing is lost.
    idle_after_s=600.0,
    idle_axes=5,
    idle_shuts_down=True,
)

# klippy/extras/probe.py, cmd_PROBE: down to position_min of stepper_z without another limit. Since 2026 it reports the bed's
# position, z_offset subtracted ("Result: at %.3f,%.3f estimate contact at z=%.6f"), before that the tip's ("Result is z=%.6f").
# klippy/extras/homing.py: "No trigger on probe after full movement", "Probe triggered prior to movement".
PROBING = ProbingRules(
    command="PROBE PROBE_SPEED={speed:.1f} SAMPLES=1",
    needs="a [probe] in Klipper's configuration",
    contact=r"\bResult is z=(-?[\d.]+)",
    corrected=r"\bestimate contact at z=(-?[\d.]+)",
    limited=False,
    silent="No trigger on probe after full movement",
    early="Probe triggered prior to movement",
)

KLIPPER = Firmware(
    name="Klipper",
    signs=("klipper",),
    dialects={"klipper": AXES, "klipper_steppers": STEPPERS},
    line=LineRules(
        resends=False,
        silence_s=1800.0,
        revival="send FIRMWARE_RESTART by tiltprint console",
        # toolhead.py, dwell: it moves the print time from which idle_timeout.py counts; M105 and M400 do not.
        keep_awake="G4 P1",
    ),
    simulated=SIMULATED,
    probing=PROBING,
)
