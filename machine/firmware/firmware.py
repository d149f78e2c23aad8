"""Firmware: everything the program knows about one, so that a new one is a new file; the serial line: what a byte and a numbered
line cost on it, its rates, how a firmware behaves at its other end, and how it is told to seek contact along Z.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from machine.firmware.dialect import Dialect
from machine.firmware.simulation import SimulationRules
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


def check_baud(baud: int) -> None:
    """Refuse a rate that no adapter takes; raises PortError."""
    if not SLOWEST_BAUD <= baud <= FASTEST_BAUD:
        allowed = f"{SLOWEST_BAUD} to {FASTEST_BAUD} is allowed, printers use {BAUDS[0]} or {BAUDS[1]}"
        raise PortError(f"baud rate {baud} is not possible: {allowed}")


@dataclass(frozen=True)
class LineRules:
    """What the sender may rely on.

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
    """name: what people call it. signs: words of its FIRMWARE_NAME line in M115, lower case; (): it is not recognised.

    dialects: name in machine.dialect -> what is written for it; none of a firmware that prints what is written for another.
    line: its end of the serial line. simulated: None: the simulated printer behaves as Marlin. probing: None: it is not asked to.
    """

    name: str
    signs: tuple[str, ...] = ()
    dialects: Mapping[str, Dialect] = field(default_factory=dict)
    line: LineRules = field(default_factory=LineRules)
    simulated: SimulationRules | None = None
    probing: ProbingRules | None = None
