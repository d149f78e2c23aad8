"""LineRules: how a firmware behaves at the other end of the serial line."""

from dataclasses import dataclass


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
    # Five digits, the questions of a trouble included: a line that fits its firmware when a program is checked fits when it
    # is sent, and short numbers leave the line to the program. All are far below 2^31, where a firmware's counter turns.
    last_number: int = 99_900
    reports_rotary_axes: bool = False
    waiting_moves: int | None = None
    keep_awake: str = ""
    revival: str = "switch it off and on, or press its reset button,"
