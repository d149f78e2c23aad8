"""Firmware: everything the program knows about one, so that a new one is a new file.

Besides its dialects: its baud rates, the overhead of a byte and of a numbered line, the rules of its end of the serial line, its
command that probes along Z, and the rules by which the simulated printer takes lines and answers them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Literal

from machine.firmware.dialect import Dialect
from profiles.errors import PortError

# Coordinates and steps by letter -> the answer to M114.
PositionReport = Callable[[Mapping[str, float], Mapping[str, int]], str]
# Nozzle, its target, bed, its target, all deg C -> what M105 answers.
TemperatureReport = Callable[[float, float, float, float], str]
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
    """Settings of a simulated printer. letters: of X Y Z and what turns the table, the filament last; limits: mm or deg, and
    steps a mm or degree: of all but the filament; speeds, accelerations: of all, per s and s2; printing, travelling: of M204,
    mm/s2; jerk: mm/s."""

    letters: str
    limits: Sequence[tuple[float, float]]
    steps: Sequence[float]
    speeds: Sequence[float]
    accelerations: Sequence[float]
    printing: float
    travelling: float
    jerk: float
    soft_limits: bool
    nozzle_limit_c: float
    bed_limit_c: float


# A command and the settings -> the lines that it is answered with before its ok.
SettingsReport = Callable[[str, SimulatedSettings], list[str]]


def no_settings_report(command: str, settings: SimulatedSettings) -> list[str]:
    """The simulation of a firmware that tells nothing by commands."""
    return []


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
    """Behaviour of the firmware as a host sees it; {} is the command or the coordinates.

    identity: the FIRMWARE_NAME line of M115, {axes}: how many; identity_in_ok: it stands behind the ok. banner: said after a
    restart. numbers: "resend": lines are checked and asked for again; "drop": a bad checksum is dropped in silence, any number
    is taken; "ignore": number and checksum are cut off unread. queue_lines: kept before the one at work is done; more wait.
    blocks: planned moves. min_segment_s: shorter moves are stretched while few wait. urgent: where an M112 is seen before its
    turn ("bytes": an emergency parser, "lines": when its line has been read). unknown, cold, unhomed, out_of_range: what is
    said of such commands; out_of_range "": the target is clamped without a word. cold_moves: a cold move is made without
    filament. heater_fault: its own reason when a heater fails. kill: said when it stops for ever; after_kill: said to every line
    from then on, {}: why it has stopped; answers_killed: commands that are answered otherwise. has_build_options: it is built
    with options that a host can notice (BuildOptions of the simulator). reports_position: G28 and G92 print it. while_heating:
    behind the temperatures of a command that waits for them. lacks: commands it does not know. starts_at_home: after a restart
    it believes itself at its home positions, and keeps only axes that were homed inside the limits.
    settings: its answers to commands that ask for its settings. answers_blank: an empty line is answered with ok.
    idle_after_s: when nothing has moved for that long the motors of its first idle_axes go off, which M84 S may forbid; inf: they
    stay on. idle_shuts_down: heaters go off, too, and nothing moves any more before it is homed; a dwell is a move, and M84 knows
    no S.
    """

    identity: str
    banner: tuple[str, ...]
    numbers: Literal["resend", "drop", "ignore"]
    queue_lines: int
    urgent: Literal["bytes", "lines", ""]
    unknown: str
    cold: tuple[str, ...]
    unhomed: str
    kill: tuple[str, ...]
    blocks: int = 15
    min_segment_s: float = 0.0
    cold_moves: bool = True
    out_of_range: str = ""
    heater_fault: str = ""
    after_kill: tuple[str, ...] = ()
    answers_killed: Mapping[str, str] = field(default_factory=dict)
    has_build_options: bool = False
    identity_in_ok: bool = False
    reports_position: bool = False
    position: PositionReport = position_report
    temperatures: TemperatureReport = temperature_report
    settings: SettingsReport = no_settings_report
    while_heating: str = " W:?"
    lacks: frozenset[str] = frozenset()
    starts_at_home: bool = False
    answers_blank: bool = False
    idle_after_s: float = inf
    idle_axes: int = 0
    idle_shuts_down: bool = False


def check_baud(baud: int) -> None:
    """Refuse a rate that no adapter takes; raises PortError."""
    if not SLOWEST_BAUD <= baud <= FASTEST_BAUD:
        allowed = f"{SLOWEST_BAUD} to {FASTEST_BAUD} is allowed, printers use {BAUDS[0]} or {BAUDS[1]}"
        raise PortError(f"baud rate {baud} is not possible: {allowed}")


@dataclass(frozen=True)
class LineRules:
    """Rules of the firmware's end of the serial line, on which the sender relies.

    resends: it asks again for a damaged line; one that does not drops the line without a word, and a repeat could be done
    twice, so an unanswered line ends the print. resend_ok: an `ok` that acknowledges nothing follows Resend. places: lines in
    flight while its numbered answers report no free places; places_plain: while its answers carry no numbers. rx_bytes: what
    the receive buffer holds. silence_s: how long a line may stay without answer once it was asked about, None: as the
    stream's timing says. last_number: then the numbers begin anew. reports_rotary_axes: M114 names every axis that a program
    may move. waiting_moves: how many may wait behind the newest acknowledged one where its answers do not tell, None: any
    number. revival: what lets it print again after it has halted. keep_awake: said every minute of a pause, or it lets its motors
    go by itself; "": it does not.
    """

    resends: bool = True
    resend_ok: bool = True
    places: int = 1
    places_plain: int = 1
    rx_bytes: int = 127  # an AVR's 128-byte receive ring holds one byte less; a fuller one loses bytes without a word
    silence_s: float | None = None
    last_number: int = LAST_NUMBER
    reports_rotary_axes: bool = False
    waiting_moves: int | None = None
    keep_awake: str = ""
    revival: str = "switch it off and on, or press its reset button,"


@dataclass(frozen=True)
class ProbingRules:
    """{low} is the Z to go down to at most, mm, {speed} mm/s, {feed} mm/min.

    contact: pattern of the answer with the tip's Z at contact; "": M114 is asked where the tip has stopped, at {low} when
    nothing was met. corrected: pattern of an answer whose Z the firmware has corrected by the probe's offset that it knows
    itself. limited: {low} is kept; otherwise it goes on to the axis' end. silent: what it says when nothing was met; early: when
    the probe senses something before it moves. needs: what it must be built or set up with.
    """

    command: str
    needs: str
    contact: str = ""
    corrected: str = ""
    limited: bool = True
    silent: str = ""
    early: str = ""


@dataclass(frozen=True)
class Firmware:
    """A firmware. name: as people call it. signs: words of its FIRMWARE_NAME line in M115, lower case; (): it is not recognised.

    dialects: name in machine.dialect -> what is written for it; none of a firmware that prints what is written for another.
    line: its end of the serial line. simulated: None: the simulated printer behaves as Marlin. probing: None: it is not asked to.
    """

    name: str
    signs: tuple[str, ...] = ()
    dialects: Mapping[str, Dialect] = field(default_factory=dict)
    line: LineRules = field(default_factory=LineRules)
    simulated: SimulationRules | None = None
    probing: ProbingRules | None = None
