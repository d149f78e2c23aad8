"""RepRapFirmware 3: the words are those of M584 (A C, B C or U V); fans count 0 to 1, M568 sets a tool's temperature.

Mainline has no TCP, so coordinates are the table's. Line numbers are parsed but not checked for sequence, a bad checksum is
dropped in silence (GCodeBuffer/StringParser.cpp, 3.6); USB loses nothing.
"""

from collections.abc import Mapping

from machine.firmware.dialect import Dialect
from machine.firmware.firmware import Firmware
from machine.firmware.line import LineRules
from machine.firmware.simulation import SimulationRules

DIALECT = Dialect(
    firmware="RepRapFirmware",
    longest_line=120,  # it keeps more; the stream's checksum is made for no longer ones
    nozzle="M568 P0 S{}",
    nozzle_wait="M109 S{}",
    fan_on="M106 P0 S{}",
    fan_off="M106 P0 S0",
    fan_full=1,
    progress="M73 P{} R{}",
    acceleration="M204 P{} T{}",
    pressure_advance="M572 D0 S{}",
    pause="M226",
    filament_change="M600",
    parts="M486 T{parts}",
    part_begin='M486 S{index} A"part {number}"',
    part_end="M486 S-1",
    stands=("G92 X{x_mm} Y{y_mm} Z{z_mm} {tilt}{tilt_deg} {turn}{turn_deg}",),
    endstop_word="H",
    statements=frozenset({"IF", "ELIF", "ELSE", "WHILE", "BREAK", "CONTINUE", "ABORT", "ECHO", "VAR", "GLOBAL", "SET", "SKIP"}),
    wait_for_person=('M291 P"{text}" R"calibrate" S3 X1 Y1 Z1',),
)


def position_report(coordinates: Mapping[str, float], steps: Mapping[str, int]) -> str:
    """`X:1.000 Y:2.000 E:0.000 E0:0.0 Count 80 160 Machine 1.000 2.000 Bed comp 0.000`."""
    named = " ".join(f"{letter}:{value:.3f}" for letter, value in coordinates.items())
    counts, bare = " ".join(map(str, steps.values())), " ".join(f"{coordinates[letter]:.3f}" for letter in steps)
    return f"{named} E0:{coordinates['E']:.1f} Count {counts} Machine {bare} Bed comp 0.000"


SIMULATED = SimulationRules(
    identity="FIRMWARE_NAME: RepRapFirmware for Duet 3 MB6HC FIRMWARE_VERSION: 3.6.0-simulated ELECTRONICS: Duet 3 MB6HC v1.01",
    banner=("RepRapFirmware for Duet 3 MB6HC is up and running.",),
    numbers="drop",
    queue_lines=1,
    blocks=40,
    urgent="",
    unknown="Warning: {}: Command is not supported",
    cold=("Warning: Tool 0 was not driven because its heater temperatures were not high enough or it has a heater fault",),
    unhomed="Error: G0/G1: insufficient axes homed",
    kill=("Error: Emergency Stop! Reset the controller to continue.",),
    position=position_report,
    lacks=frozenset({"M503", "M154", "M155", "M113", "M876", "M900"}),
)

REPRAPFIRMWARE = Firmware(
    name="RepRapFirmware",
    signs=("reprapfirmware", "duet"),
    dialects={"reprapfirmware": DIALECT},
    line=LineRules(resends=False, reports_rotary_axes=True, revival="send M999, or press its reset button,"),
    simulated=SIMULATED,
)
