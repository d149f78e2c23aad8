"""Firmware: everything the program knows about one, so that a new one is a single value.

Besides its dialects: its baud rates, the overhead of a byte and of a numbered line, the rules of its end of the serial line, its
command that probes along Z, and the rules by which it is simulated.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Literal

from machine.firmware.dialect import Dialect
from profiles.errors import PortError

BYTE_BITS = 10  # start, eight, stop
BAUDS = (115200, 250000, 230400, 500000, 1000000, 57600)  # usual rates of firmwares, the most usual first
SLOWEST_BAUD, FASTEST_BAUD = 1200, 4_000_000  # limits of known adapters
# Five digits, including the queries of a disturbed line: a line that fits its firmware when a program is checked fits when it is
# sent, and short numbers leave space for the command. All are far below 2^31, where a firmware's counter overflows.
LAST_NUMBER = 99_900
NUMBER_DIGITS = len(str(LAST_NUMBER))
FRAME_BYTES = len("N *123\n")  # the most that the sender adds to a command, without the digits of its number
FRAME_CHARACTERS = FRAME_BYTES - len("\n") + NUMBER_DIGITS  # the frame's share of the characters that a firmware keeps


@dataclass(frozen=True)
class SimulatedSettings:
    """Settings of a simulated printer, per s and s²."""

    letters: str  # letters of X Y Z and the rotary axes, the filament last
    limits: Sequence[tuple[float, float]]  # mm or deg, without the filament
    steps: Sequence[float]  # per mm or degree, without the filament
    speeds: Sequence[float]
    accelerations: Sequence[float]
    printing: float  # mm/s² of M204
    travelling: float  # mm/s² of M204
    jerk: float  # mm/s
    soft_limits: bool
    nozzle_limit_c: float
    bed_limit_c: float


def position_report(coordinates: Mapping[str, float], steps: Mapping[str, int]) -> str:
    """Marlin's report, `X:1.00 Y:2.00 Z:3.00 E:0.00 Count X:80 Y:160 Z:1200`."""
    named = " ".join(f"{letter}:{value:.2f}" for letter, value in coordinates.items())
    return f"{named} Count " + " ".join(f"{letter}:{count}" for letter, count in steps.items())


def temperature_report(nozzle_c: float, nozzle_target_c: float, bed_c: float, bed_target_c: float) -> str:
    """Marlin's report, `T:19.38 /0.00 B:20.00 /0.00 @:0 B@:0`."""
    return (
        f"T:{nozzle_c:.2f} /{nozzle_target_c:.2f} B:{bed_c:.2f} /{bed_target_c:.2f} "
        f"@:{127 * (nozzle_target_c > 0)} B@:{127 * (bed_target_c > 0)}"
    )


@dataclass(frozen=True)
class SimulationRules:
    """Behaviour of the firmware as seen by a host; {} is the command or the coordinates."""

    identity: str  # the FIRMWARE_NAME line of M115, {axes}: their number
    banner: tuple[str, ...]  # sent after a restart
    # resend: lines are checked and requested again; drop: a line with a bad checksum is silently dropped, any number is accepted;
    # ignore: number and checksum are cut off unread
    numbers: Literal["resend", "drop", "ignore"]
    queue_lines: int  # queued before the current one is done; further ones wait
    urgent: Literal["bytes", "lines", ""]  # an M112 is executed out of turn: by an emergency parser, or when its line is read
    unknown: str  # message about an unknown command,
    cold: tuple[str, ...]  # about cold extrusion,
    unhomed: str  # about a move before homing,
    kill: tuple[str, ...]  # at a halt
    blocks: int = 15  # planned moves
    min_segment_s: float = 0.0  # shorter moves are stretched while few are queued
    cold_moves: bool = True  # a cold move is executed without filament
    out_of_range: str = ""  # message about a target outside the limits; "": the target is silently clamped
    heater_fault: str = ""  # its own reason for the failure of a heater
    after_kill: tuple[str, ...] = ()  # answer to every line after a halt, {}: its reason
    answers_killed: Mapping[str, str] = field(default_factory=dict)  # commands with another answer then
    has_build_options: bool = False  # its build has options that a host can notice (BuildOptions of the simulator)
    identity_in_ok: bool = False  # the FIRMWARE_NAME line follows the ok
    reports_position: bool = False  # printed by G28 and G92
    # coordinates and steps by letter -> the answer to M114
    position: Callable[[Mapping[str, float], Mapping[str, int]], str] = position_report
    # nozzle, its target, bed, its target, deg C -> the answer to M105
    temperatures: Callable[[float, float, float, float], str] = temperature_report
    # a command and the settings -> the lines before its ok
    settings: Callable[[str, SimulatedSettings], list[str]] = lambda command, settings: []
    while_heating: str = " W:?"  # after the temperatures of a command that waits for them
    lacks: frozenset[str] = frozenset()  # unknown commands
    # After a restart it assumes its home positions, and limits only homed axes.
    starts_at_home: bool = False
    answers_blank: bool = False  # an empty line is answered with ok
    idle_after_s: float = inf  # time without a move
    idle_axes: int = 0  # after which the motors of its first axes go off, unless M84 S forbids it,
    # and heaters too, and nothing moves before homing; a dwell then counts as a move, and M84 has no S.
    idle_shuts_down: bool = False


def check_baud(baud: int) -> None:
    """Refuse a rate that no adapter supports. Raises PortError."""
    if not SLOWEST_BAUD <= baud <= FASTEST_BAUD:
        allowed = f"{SLOWEST_BAUD} to {FASTEST_BAUD} is allowed, printers use {BAUDS[0]} or {BAUDS[1]}"
        raise PortError(f"baud rate {baud} is not possible: {allowed}")


@dataclass(frozen=True)
class LineRules:
    """Rules of the firmware's end of the serial line, on which the sender relies."""

    # It requests damaged lines again. Otherwise it silently drops them, and a repeat could be executed twice, so that an
    # unanswered line ends the print.
    resends: bool = True
    resend_ok: bool = True  # an `ok` that acknowledges nothing follows Resend
    places: int = 1  # lines in flight while its numbered answers report no free places
    places_plain: int = 1  # lines in flight while its answers carry no numbers
    rx_bytes: int = 127  # an AVR's 128-byte receive ring holds one byte less; it silently loses bytes beyond
    # Longest silence after a query about a line, None: the stream's timing.
    silence_s: float | None = None
    last_number: int = LAST_NUMBER  # after it the numbers restart
    reports_rotary_axes: bool = False  # M114 reports every axis that a program may move
    # Number of moves that may wait after the newest acknowledged one if its answers do not report that, None: any number.
    waiting_moves: int | None = None
    keep_awake: str = ""  # sent every minute of a pause to keep the motors on; "": not needed
    revival: str = "switch it off and on, or press its reset button,"  # makes it print again after a halt


@dataclass(frozen=True)
class ProbingRules:
    """A firmware's command for probing downward, and its answers."""

    command: str  # {low} is the lowest Z, mm, {speed} mm/s, {feed} mm/min
    needs: str  # its required build option or setup
    contact: str = ""  # pattern of the answer with the tip's Z at contact; "": M114 is sent, {low} means no contact
    corrected: str = ""  # pattern of an answer whose Z the firmware has corrected by its own probe offset
    limited: bool = True  # it stops at {low}; otherwise at the axis's end
    silent: str = ""  # the answer without contact
    early: str = ""  # the answer when the probe triggers before it moves


@dataclass(frozen=True)
class Firmware:
    """A firmware and its dialects; without any for one that prints another's dialect."""

    name: str  # its usual name
    signs: tuple[str, ...] = ()  # words in its FIRMWARE_NAME line of M115, lower case; (): it is not recognised
    dialects: Mapping[str, Dialect] = field(default_factory=dict)  # by their names in machine.dialect
    line: LineRules = field(default_factory=LineRules)
    simulated: SimulationRules | None = None  # None: the simulated printer behaves as Marlin
    probing: ProbingRules | None = None  # None: it cannot probe
