"""RepRapFirmware 3: axis letters are those of M584 (A C, B C or U V); fans count 0 to 1, M568 sets a tool's temperature.

Mainline has no TCP, so X Y Z are axis positions. Line numbers are parsed but not checked for sequence, a bad
checksum is silently dropped (GCodeBuffer/StringParser.cpp, 3.6); USB loses nothing.
"""

import json
import re
from collections.abc import Mapping
from typing import Any

from machine.firmware.dialect import PERSON_S, Command, Dialect
from machine.firmware.firmware import Firmware, LineRules, ProbingRules, SimulatedSettings, SimulationRules

# docs.duet3d.com/User_manual/Reference/Gcodes; GCodes/GCodes2.cpp, 3.6: G10 and M568 share SetOrReportOffsets, M144 S1 switches
# the bed to its active temperature. A code that the firmware does not know runs a macro of that name where there is one.
# fmt: off
COMMANDS = {
    "G10": Command("temperatures (S, R) or offsets of a tool, else firmware retraction", moves="filament", heats="nozzle",
                   heats_with="SR"),
    "M98": Command("run a macro", heats="any"),
    "M144": Command("bed to its standby temperature, or its active one", heats="any"),
    "M290": Command("baby step"),
    "M291": Command("ask the user", waits="person", answer_s=PERSON_S),
    "M292": Command("answer a question"),
    "M409": Command("report the object model"),
    "M552": Command("network"),
    "M556": Command("axis skew"),
    "M557": Command("grid of the bed probe"),
    "M558": Command("kind and speed of the probe"),
    "M561": Command("bed transform off"),
    "M564": Command("limits on or off, moves before homing"),
    "M566": Command("jerk"),
    "M568": Command("temperatures and state of a tool", heats="nozzle", repeatable=True),
    "M569": Command("motor drivers"),
    "M579": Command("scale of the axes", changes=True),
    "M584": Command("drivers of the axes"),
    "M703": Command("settings of a filament, a macro", heats="any"),
    "M906": Command("current of the motors"),
    "M913": Command("share of the motors' current"),
    "M915": Command("stall detection"),
}
# fmt: on

DIALECT = Dialect(
    firmware="RepRapFirmware",
    longest_line=120,  # it keeps more, but the stream's checksum supports no longer ones
    nozzle="M568 P0 S{}",
    nozzle_wait="M109 S{}",
    fan_on="M106 P0 S{}",
    fan_off="M106 P0 S0",
    fan_full=1,
    progress="M73 P{} R{}",
    acceleration="M204 P{} T{}",
    pressure_advance="M572 D0 S{}",
    babystep="M290 R1 Z{}",
    pause="M226",
    filament_change="M600",
    parts="M486 T{parts}",
    part_begin='M486 S{index} A"part {number}"',
    part_end="M486 S-1",
    stands=(
        "M17",
        "G92 X{x_mm} Y{y_mm} Z{z_mm} {tilt}{tilt_deg} {turn}{turn_deg}",
    ),
    endstop_word="H",
    statements=frozenset({"IF", "ELIF", "ELSE", "WHILE", "BREAK", "CONTINUE", "ABORT", "ECHO", "VAR", "GLOBAL", "SET", "SKIP"}),
    wait_for_person=('M291 P"{text}" R"calibrate" S3 X1 Y1 Z1',),
    commands=COMMANDS,
)


VERSION = "3.6.0-simulated"
KEY = re.compile(r'K"([^"]*)"')


def position_report(coordinates: Mapping[str, float], steps: Mapping[str, int]) -> str:
    """RepRapFirmware's report, `X:1.000 Y:2.000 E:0.000 E0:0.0 Count 80 160 Machine 1.000 2.000 Bed comp 0.000`."""
    named = " ".join(f"{letter}:{value:.3f}" for letter, value in coordinates.items())
    counts, bare = " ".join(map(str, steps.values())), " ".join(f"{coordinates[letter]:.3f}" for letter in steps)
    return f"{named} E0:{coordinates['E']:.1f} Count {counts} Machine {bare} Bed comp 0.000"


def settings_report(command: str, settings: SimulatedSettings) -> list[str]:
    """Answer to M409: a key of the object model as one line of JSON (Platform/Platform.cpp, its tables of axes and extruders);
    speed and jerk per minute."""
    key = KEY.search(command)
    if not command.startswith("M409") or key is None:
        return []
    axes = [
        {"letter": letter, "min": low, "max": high, **_drive(settings, index)}
        for index, (letter, (low, high)) in enumerate(zip(settings.letters, settings.limits, strict=False))
    ]
    model: dict[str, Any] = {
        "state.status": "idle",
        "boards[0]": {"firmwareName": "RepRapFirmware for Duet 3 MB6HC", "firmwareVersion": VERSION},
        "move.axes": axes,
        "move.extruders": [_drive(settings, len(axes))],
        "tools": [{"heaters": [1]}],
        "heat": {"bedHeaters": [0], "heaters": [{"max": settings.bed_limit_c}, {"max": settings.nozzle_limit_c}]},
    }
    return [json.dumps({"key": key[1], "flags": "d99vn", "result": model.get(key[1])}, separators=(",", ":"))]


def _drive(settings: SimulatedSettings, index: int) -> dict[str, float]:
    acceleration, speed = settings.accelerations[index], settings.speeds[index]
    return {"acceleration": acceleration, "jerk": 60.0 * settings.jerk, "speed": 60.0 * speed}


SIMULATED = SimulationRules(
    identity=f"FIRMWARE_NAME: RepRapFirmware for Duet 3 MB6HC FIRMWARE_VERSION: {VERSION} ELECTRONICS: Duet 3 MB6HC v1.01",
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
    settings=settings_report,
    lacks=frozenset({"M503", "M154", "M155", "M113", "M876", "M900"}),
)

# GCodes/GCodes4.cpp, 3.6, straightProbe0 to 3: G38.3 stops on contact or at its target, at the speed of M558 F, and sends
# nothing; if the probe has triggered before, it does not move. G30 S-1 ("Stopped at height") has no lowest Z, so it is not used.
PROBING = ProbingRules(command="G38.3 Z{low:.3f}", needs="a Z probe set up with M558")

REPRAPFIRMWARE = Firmware(
    name="RepRapFirmware",
    signs=("reprapfirmware", "duet"),
    dialects={"reprapfirmware": DIALECT},
    line=LineRules(resends=False, reports_rotary_axes=True, revival="send M999, or press its reset button,"),
    simulated=SIMULATED,
    probing=PROBING,
)
