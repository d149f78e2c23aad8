"""Marlin 2.1, and other firmwares that print its dialect.

Rotary axes are the words of AXIS4_NAME and AXIS5_NAME; M73, M486 and arcs are optional in builds. TCP (G43.4, G49) exists only in
the fork DerAndere1/Marlin, branch Marlin2ForPipetBot. Its F on mixed moves counts X Y Z. Line numbers, checksums and `ok` as in
gcode/queue.cpp, bugfix-2.1.x of 2024-09.
"""

from collections.abc import Iterable, Mapping

from machine.firmware.dialect import HEATING_S, PROBING_S, Command, Dialect
from machine.firmware.firmware import Firmware, LineRules, ProbingRules, SimulatedSettings, SimulationRules

# Meanings from gcode/gcode.h; what heats: gcode/bedlevel/G26.cpp, gcode/probe/G76_M871.cpp, gcode/temp/M306.cpp.
# fmt: off
COMMANDS = {
    "G12": Command("clean the nozzle", moves="other"),
    "G26": Command("print a test pattern of the mesh", moves="other", heats="any"),
    "G27": Command("park", moves="other"),
    "G42": Command("move to a point of the mesh", moves="other"),
    "G43.4": Command("follow the table", changes=True),
    "G60": Command("store the position"),
    "G61": Command("return to the stored position", moves="other"),
    "G76": Command("tune the probe for heat", moves="other", probes=True, heats="any", answer_s=PROBING_S),
    "M48": Command("repeatability of the probe", moves="other", probes=True, answer_s=PROBING_S),
    "M113": Command("interval of `busy:`"),
    "M120": Command("end stops on"),
    "M121": Command("end stops off"),
    "M154": Command("report the position at an interval in seconds"),
    "M192": Command("wait for the probe's temperature", waits="heat", answer_s=HEATING_S),
    "M193": Command("wait for the cooler", waits="heat", answer_s=HEATING_S),
    "M218": Command("offset of a tool", changes=True),
    "M280": Command("turn a servo"),
    "M290": Command("baby step"),
    "M306": Command("tune a heater's model, which heats it", heats="any", answer_s=HEATING_S),
    "M412": Command("filament sensor"),
    "M425": Command("backlash"),
    "M428": Command("home offset from here", changes=True),
    "M665": Command("geometry of the machine"),
    "M851": Command("offset of the probe", changes=True),
    "M876": Command("answer to a question of the printer"),
    "M906": Command("current of the motors"),
}
# fmt: on

DIALECT = Dialect(
    firmware="Marlin",
    longest_line=95,  # MAX_CMD_SIZE 96 with the final zero: a longer line loses its checksum
    nozzle="M104 S{}",
    nozzle_wait="M109 S{}",
    fan_on="M106 S{}",
    progress="M73 P{} R{}",
    acceleration="M204 P{} T{}",
    pressure_advance="M900 K{}",
    babystep="M290 Z{}",
    babystep_homed=True,  # BABYSTEP_WITHOUT_HOMING is off by default
    filament_change="M600",
    parts="M486 T{parts}",
    part_begin="M486 S{index}",
    part_end="M486 S-1",
    follow_on="G43.4",
    follow_off="G49",
    follow_keeps_coordinates=True,
    filament_mode="set",
    stands=(
        "M17",
        "G92 X{x_mm} Y{y_mm} Z{z_mm} {tilt}{tilt_deg} {turn}{turn_deg}",
    ),
    wait_for_person=("M0 {text}",),
    commands=COMMANDS,
)

# Configuration_adv.h and module/planner.h, bugfix-2.1.x of 2024-09, used by the planners of dry run and simulation.
BLOCK_BUFFER_SIZE, BUFSIZE = 16, 4  # planned moves, and commands read ahead of them
PLANNED_BLOCKS = BLOCK_BUFFER_SIZE - 1  # one place of its ring stays empty
MIN_SEGMENT_S = 0.02  # DEFAULT_MINSEGMENTTIME: a shorter move is stretched while few are queued
FIRST_MOVE_DELAY_S, FIRST_MOVE_BLOCKS = 0.1, 3  # BLOCK_DELAY_FOR_1ST_MOVE: an idle machine waits this long for this many

# gcode/control/M17_M18_M84.cpp: the idle time after which manage_inactivity (MarlinCore.cpp) switches motors off; 0: never.
MOTORS_STAY_ON = "M84 S0"

# MarlinSettings::report in module/settings.cpp and the M..._report functions of gcode/config and gcode/control (Marlin 2.1): M503
# puts `echo:` before every line and a heading before each; single queries M92, M201, M203, M204, M205 and M211 answer with the
# line only, two decimals, axes by their letters.
STEPS_E = 93.0  # per mm of filament
HEADINGS = {
    "M92": "Steps per unit",
    "M203": "Max feedrates (units/s)",
    "M201": "Max Acceleration (units/s2)",
    "M204": "Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>)",
    "M205": "Advanced (B<min_segment_time_us> S<min_feedrate> T<min_travel_feedrate> X<max_jerk> Y<max_jerk> Z<max_jerk>)",
    "M211": "Soft endstops",
}


def settings_report(command: str, settings: SimulatedSettings) -> list[str]:
    """The lines that answer a command without words; [] for one without such an answer."""
    lines = _lines(settings)
    if command == "M503":
        units = ("echo:; Linear Units:", "echo:  G21 ; (mm)")
        return [*units, *(line for name, heading in HEADINGS.items() for line in _under(heading, lines[name]))]
    return lines.get(command, [])


def _lines(settings: SimulatedSettings) -> Mapping[str, list[str]]:
    letters, soft = settings.letters, settings.soft_limits
    least, most = (_words(letters, [ends[side] for ends in settings.limits]) for side in (0, 1))
    accelerations = f"P{settings.printing:.2f} R{settings.accelerations[-1]:.2f} T{settings.travelling:.2f}"
    return {
        "M92": [f"  M92{_words(letters, (*settings.steps, STEPS_E))}"],
        "M203": [f"  M203{_words(letters, settings.speeds)}"],
        "M201": [f"  M201{_words(letters, settings.accelerations)}"],
        "M204": [f"  M204 {accelerations}"],
        "M205": [f"  M205 B20000.00 S0.00 T0.00{_words(letters, [settings.jerk] * len(letters))}"],
        "M211": [f"  M211 S{int(soft)} ; {'ON' if soft else 'OFF'}", f"  Min: {least}   Max: {most}"],
    }


def _under(heading: str, lines: Iterable[str]) -> list[str]:
    return [f"echo:; {heading}:", *(f"echo:{line}" for line in lines)]


def _words(letters: str, values: Iterable[float]) -> str:
    return "".join(f" {letter}{value:.2f}" for letter, value in zip(letters, values, strict=False))


SIMULATED = SimulationRules(
    identity="FIRMWARE_NAME:Marlin bugfix-2.1.x (simulated) SOURCE_CODE_URL:github.com/MarlinFirmware/Marlin "
    "PROTOCOL_VERSION:1.0 MACHINE_TYPE:tiltprint EXTRUDER_COUNT:1 AXIS_COUNT:{axes} UUID:cede2a2f-41a2-4748-9b12-c55c62f367ff",
    banner=("start", "Marlin bugfix-2.1.x (simulated)", "echo: Last Updated: 2024-09-29 | Author: (none, default config)"),
    numbers="resend",
    queue_lines=BUFSIZE,
    blocks=PLANNED_BLOCKS,
    min_segment_s=MIN_SEGMENT_S,
    urgent="bytes",
    unknown='echo:Unknown command: "{}"',
    cold=("echo: cold extrusion prevented",),
    unhomed="echo:Home XYZ First",
    kill=("Error:Printer halted. kill() called!", "//action:poweroff"),
    reports_position=True,
    settings=settings_report,
    has_build_options=True,
    lacks=frozenset({"M116", "M409", "M568", "M572"}),
    # module/motion.cpp, bugfix-2.1.x: current_position begins with the home positions; apply_motion_limits asks axis_was_homed.
    starts_at_home=True,
    # Configuration_adv.h: DEFAULT_STEPPER_TIMEOUT_SEC 120, DISABLE_IDLE_X, _Y, _Z and _E; _I and _J are commented out.
    idle_after_s=120.0,
    idle_axes=3,
)

# gcode/probe/G38.cpp, bugfix-2.1.x: G38.3 stops on contact or at its target and sends nothing; G38.2 would report an error. G30
# always goes down to Z_PROBE_LOW_POINT, so it is not used. M114 reports hundredths of a mm.
PROBING = ProbingRules(command="G38.3 Z{low:.3f} F{feed:.0f}", needs="Marlin built with G38_PROBE_TARGET")

MARLIN = Firmware(
    name="Marlin",
    signs=("marlin",),
    dialects={"marlin": DIALECT},
    line=LineRules(reports_rotary_axes=True, waiting_moves=PLANNED_BLOCKS, keep_awake=MOTORS_STAY_ON),
    simulated=SIMULATED,
    probing=PROBING,
)

# Firmwares that print Marlin's dialect. Repetier: `ok 12` names the line, nothing reports the free places: its own host counts
# characters against the receive buffer. M84 S sets the idle time of its motors as Marlin's does (Commands.cpp,
# STEPPER_INACTIVE_TIME 360). Smoothieware: no ok follows its Resend.
REPETIER = Firmware(name="Repetier-Firmware", signs=("repetier",), line=LineRules(places=16, keep_awake=MOTORS_STAY_ON))
SMOOTHIEWARE = Firmware(name="Smoothieware", signs=("smoothie",), line=LineRules(resend_ok=False))
