"""Firmware: everything the program knows about one, so that a new one is a value of its own.

Besides its dialects: its baud rates, the overhead of a byte and of a numbered line, the rules of its end of the serial line, its
command that probes along Z, and the rules by which the simulated printer takes lines and answers them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Literal

from machine.firmware.dialect import Dialect
from profiles.errors import PortError

BYTE_BITS = 10  # start, eight, stop
BAUDS = (115200, 250000, 230400, 500000, 1000000, 57600)  # what firmwares are built with, the usual ones first
SLOWEST_BAUD, FASTEST_BAUD = 1200, 4_000_000  # that an adapter is known to take
# Five digits, the questions of a trouble included: a line that fits its firmware when a program is checked fits when it is sent,
# and short numbers leave the line to the program. All are far below 2^31, where a firmware's counter turns.
LAST_NUMBER = 99_900
NUMBER_DIGITS = len(str(LAST_NUMBER))
FRAME_BYTES = len("N *123\n")  # what the sender adds to a command at most, its number's digits aside
FRAME_CHARACTERS = FRAME_BYTES - len("\n") + NUMBER_DIGITS  # of those that a firmware keeps


@dataclass(frozen=True)
class SimulatedSettings:
    """Settings of a simulated printer, per s and s2."""

    letters: str  # of X Y Z and what turns the table, the filament last
    limits: Sequence[tuple[float, float]]  # mm or deg, of all but the filament
    steps: Sequence[float]  # a mm or degree, of all but the filament
    speeds: Sequence[float]
    accelerations: Sequence[float]
    printing: float  # mm/s2 of M204
    travelling: float  # mm/s2 of M204
    jerk: float  # mm/s
    soft_limits: bool
    nozzle_limit_c: float
    bed_limit_c: float


def position_report(coordinates: Mapping[str, float], steps: Mapping[str, int]) -> str:
    """`X:1.00 Y:2.00 Z:3.00 E:0.00 Count X:80 Y:160 Z:1200`."""
    named = " ".join(f"{letter}:{value:.2f}" for letter, value in coordinates.items())
    return f"{named} Count " + " ".join(f"{letter}:{count}" for letter, count in steps.items())


def temperature_report(nozzle_c: float, nozzle_target_c: float, bed_c: float, bed_target_c: float) -> str:
    """`T:19.38 /0.00 B:20.00 /0.00 @:0 B@:0`."""
    return (
        f"T:{nozzle_c:.2f} /{nozzle_target_c:.2f} B:{bed_c:.2f} /{bed_target_c:.2f} "
        f"@:{127 * (nozzle_target_c > 0)} B@:{127 * (bed_target_c > 0)}"
    )


@dataclass(frozen=True)
class SimulationRules:
    """Behaviour of the firmware as a host sees it; {} is the command or the coordinates."""

    identity: str  # the FIRMWARE_NAME line of M115, {axes}: how many
    banner: tuple[str, ...]  # said after a restart
    # resend: lines are checked and asked for again; drop: a line with a bad checksum is dropped in silence, any number is taken;
    # ignore: number and checksum are cut off unread
    numbers: Literal["resend", "drop", "ignore"]
    queue_lines: int  # kept before the one at work is done; more wait
    urgent: Literal["bytes", "lines", ""]  # an M112 is seen before its turn: by an emergency parser, or when its line is read
    unknown: str  # said of a command that it does not know,
    cold: tuple[str, ...]  # of cold extrusion,
    unhomed: str  # of a move before homing,
    kill: tuple[str, ...]  # when it stops for ever
    blocks: int = 15  # planned moves
    min_segment_s: float = 0.0  # shorter moves are stretched while few wait
    cold_moves: bool = True  # a cold move is made without filament
    out_of_range: str = ""  # said of a target outside the limits; "": the target is clamped without a word
    heater_fault: str = ""  # its own reason when a heater fails
    after_kill: tuple[str, ...] = ()  # said to every line once it has stopped for ever, {}: why it has stopped
    answers_killed: Mapping[str, str] = field(default_factory=dict)  # commands that are answered otherwise then
    has_build_options: bool = False  # it is built with options that a host can notice (BuildOptions of the simulator)
    identity_in_ok: bool = False  # the FIRMWARE_NAME line stands behind the ok
    reports_position: bool = False  # G28 and G92 print it
    # coordinates and steps by letter -> the answer to M114
    position: Callable[[Mapping[str, float], Mapping[str, int]], str] = position_report
    # nozzle, its target, bed, its target, deg C -> the answer to M105
    temperatures: Callable[[float, float, float, float], str] = temperature_report
    # a command and the settings -> the lines before its ok
    settings: Callable[[str, SimulatedSettings], list[str]] = lambda command, settings: []
    while_heating: str = " W:?"  # behind the temperatures of a command that waits for them
    lacks: frozenset[str] = frozenset()  # commands it does not know
    # After a restart it believes itself at its home positions, and keeps only axes that were homed inside the limits.
    starts_at_home: bool = False
    answers_blank: bool = False  # an empty line is answered with ok
    idle_after_s: float = inf  # when nothing has moved for that long
    idle_axes: int = 0  # the motors of its first axes go off, which M84 S may forbid,
    # and heaters, too, and nothing moves any more before it is homed; a dwell is a move then, and M84 knows no S.
    idle_shuts_down: bool = False


def check_baud(baud: int) -> None:
    """Refuse a rate that no adapter takes; raises PortError."""
    if not SLOWEST_BAUD <= baud <= FASTEST_BAUD:
        allowed = f"{SLOWEST_BAUD} to {FASTEST_BAUD} is allowed, printers use {BAUDS[0]} or {BAUDS[1]}"
        raise PortError(f"baud rate {baud} is not possible: {allowed}")


@dataclass(frozen=True)
class LineRules:
    """Rules of the firmware's end of the serial line, on which the sender relies."""

    # It asks again for a damaged line; one that does not drops the line without a word, and a repeat could be done twice, so an
    # unanswered line ends the print.
    resends: bool = True
    resend_ok: bool = True  # an `ok` that acknowledges nothing follows Resend
    places: int = 1  # lines in flight while its numbered answers report no free places
    places_plain: int = 1  # lines in flight while its answers carry no numbers
    rx_bytes: int = 127  # an AVR's 128-byte receive ring holds one byte less; a fuller one loses bytes without a word
    # How long a line may stay without answer once it was asked about, None: as the stream's timing says.
    silence_s: float | None = None
    last_number: int = LAST_NUMBER  # then the numbers begin anew
    reports_rotary_axes: bool = False  # M114 names every axis that a program may move
    # How many moves may wait behind the newest acknowledged one where its answers do not report that, None: any number.
    waiting_moves: int | None = None
    keep_awake: str = ""  # sent every minute of a pause, or it lets its motors go by itself; "": it does not
    revival: str = "switch it off and on, or press its reset button,"  # lets it print again after it has halted


@dataclass(frozen=True)
class ProbingRules:
    """A firmware's command that probes downwards, and its answers."""

    command: str  # {low} is the Z to go down to at most, mm, {speed} mm/s, {feed} mm/min
    needs: str  # what it must be built or set up with
    contact: str = ""  # pattern of the answer with the tip's Z at contact; "": M114 is asked, at {low} when nothing was met
    corrected: str = ""  # pattern of an answer whose Z the firmware has corrected by the probe's offset that it knows itself
    limited: bool = True  # {low} is kept; otherwise it goes on to the axis' end
    silent: str = ""  # the answer when nothing was met
    early: str = ""  # the answer when the probe senses something before it moves


@dataclass(frozen=True)
class Firmware:
    """A firmware and its dialects; none of one that prints what is written for another."""

    name: str  # as people call it
    signs: tuple[str, ...] = ()  # words of its FIRMWARE_NAME line in M115, lower case; (): it is not recognised
    dialects: Mapping[str, Dialect] = field(default_factory=dict)  # by their names in machine.dialect
    line: LineRules = field(default_factory=LineRules)
    simulated: SimulationRules | None = None  # None: the simulated printer behaves as Marlin
    probing: ProbingRules | None = None  # None: it is not asked to probe
