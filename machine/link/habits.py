"""Habits: how the firmware of each dialect takes lines and words its answers, and what it may have been built with or without.

Marlin: gcode/queue.cpp, bugfix-2.1.x of 2024-09. RepRapFirmware: GCodeBuffer/StringParser.cpp, 3.6. Klipper: klippy/gcode.py.
"""

from dataclasses import dataclass
from typing import Literal

from machine.link.planner import BLOCKS, MIN_SEGMENT_S
from profiles.machine import Machine

BANNER = ("start", "Marlin bugfix-2.1.x (simulated)", "echo: Last Updated: 2024-09-29 | Author: (none, default config)")


@dataclass(frozen=True)
class Habits:
    """Build options. rx_ring: bytes of a UART's receive ring that overflows; None: USB, which waits. queue: Marlin's BUFSIZE,
    lines kept before the one at work is done; None: its default.

    realtime: Marlin's REALTIME_REPORTING_COMMANDS; geometry: its M115_GEOMETRY_REPORT; waits: its NO_TIMEOUTS, `wait` every
    second when idle; resend_ok: an `ok` follows each Resend (Smoothieware has none); must_home: X Y Z are not moved before they
    are homed (Klipper, RepRapFirmware, Marlin's NO_MOTION_BEFORE_HOMING).
    """

    advanced_ok: bool = True
    emergency_parser: bool = True
    busy: bool = True
    autoreport: bool = True
    rx_ring: int | None = None
    realtime: bool = False
    geometry: bool = True
    waits: bool = False
    resend_ok: bool = True
    must_home: bool = False
    queue: int | None = None


@dataclass(frozen=True)
class Manner:
    """A firmware family at its end of the line.

    numbers: "resend": lines are checked and asked for again; "drop": a bad checksum is dropped in silence, any number is
    taken; "ignore": number and checksum are cut off unread. pending: lines kept before the one at work is done; more wait.
    urgent: where an M112 is seen before its turn ("bytes": an emergency parser, "lines": when its line has been read).
    unknown, cold, unhomed, beyond: what is said of such commands; {}: the command or the coordinates. cold_moves: a cold
    move is made without filament. beyond "": a target outside the limits is clamped without a word. tells_place: G28 and
    G92 print it. answers_dead: what is said, with ok, to every line after a kill. options: knows Habits' options of build.
    talks_in_ok: answers of one line stand behind the ok. min_segment_s: shorter moves are stretched while few wait. lacks:
    commands it does not know.
    """

    identity: str
    banner: tuple[str, ...]
    numbers: Literal["resend", "drop", "ignore"]
    pending: int
    blocks: int
    urgent: Literal["bytes", "lines", ""]
    unknown: str
    cold: tuple[str, ...]
    unhomed: str
    kill: tuple[str, ...]
    cold_moves: bool = True
    beyond: str = ""
    tells_place: bool = False
    answers_dead: tuple[str, ...] = ()
    options: bool = False
    talks_in_ok: bool = False
    min_segment_s: float = 0.0
    lacks: frozenset[str] = frozenset()


MARLIN = Manner(
    identity="FIRMWARE_NAME:Marlin bugfix-2.1.x (simulated) SOURCE_CODE_URL:github.com/MarlinFirmware/Marlin "
    "PROTOCOL_VERSION:1.0 MACHINE_TYPE:tiltprint EXTRUDER_COUNT:1 AXIS_COUNT:{axes} UUID:cede2a2f-41a2-4748-9b12-c55c62f367ff",
    banner=BANNER,
    numbers="resend",
    pending=4,
    blocks=BLOCKS,
    urgent="bytes",
    unknown='echo:Unknown command: "{}"',
    cold=("echo: cold extrusion prevented",),
    unhomed="echo:Home XYZ First",
    kill=("Error:Printer halted. kill() called!", "//action:poweroff"),
    tells_place=True,
    options=True,
    min_segment_s=MIN_SEGMENT_S,
    lacks=frozenset({"M116", "M568"}),
)
REPRAPFIRMWARE = Manner(
    identity="FIRMWARE_NAME: RepRapFirmware for Duet 3 MB6HC FIRMWARE_VERSION: 3.6.0-simulated ELECTRONICS: Duet 3 MB6HC v1.01",
    banner=("RepRapFirmware for Duet 3 MB6HC is up and running.",),
    numbers="drop",
    pending=1,
    blocks=40,
    urgent="",
    unknown="Warning: {}: Command is not supported",
    cold=("Warning: Tool 0 was not driven because its heater temperatures were not high enough or it has a heater fault",),
    unhomed="Error: G0/G1: insufficient axes homed",
    kill=("Error: Emergency Stop! Reset the controller to continue.",),
    lacks=frozenset({"M154", "M155", "M113", "M876"}),
)
KLIPPER = Manner(
    identity="FIRMWARE_NAME:Klipper FIRMWARE_VERSION:v0.13.0-simulated",
    banner=("// Klipper state: Ready",),
    numbers="ignore",
    pending=20,
    blocks=100,  # its toolhead looks 2 s ahead, whatever number of moves that is
    urgent="lines",
    unknown='// Unknown command:"{}"',
    cold=(
        "// Extrude below minimum temp",
        "// See the 'min_extrude_temp' config option for details",
        "!! Extrude below minimum temp",
    ),
    unhomed="!! Must home axis first: {}",
    kill=("!! Shutdown due to M112 command", "// Klipper state: Shutdown"),
    cold_moves=False,
    beyond="!! Move out of range: {}",
    answers_dead=("!! Shutdown due to M112 command",),
    talks_in_ok=True,
    lacks=frozenset({"M108", "M113", "M116", "M154", "M155", "M211", "M302", "M410", "M486", "M568", "M665", "M876", "G43.4"}),
)
MANNERS: dict[str, Manner] = {
    "marlin": MARLIN,
    "reprapfirmware": REPRAPFIRMWARE,
    "klipper": KLIPPER,
    "klipper_steppers": KLIPPER,
}


def habits_at(machine: Machine, baud: int | None) -> Habits:
    """The usual build: USB without a baud rate, with one a UART whose ring is machine.receive_bytes."""
    return Habits(rx_ring=machine.receive_bytes if baud else None)


def manner_of(dialect: str) -> Manner:
    """The row of a dialect; those that open files themselves have none and are taken for Marlin."""
    return MANNERS.get(dialect, MARLIN)
