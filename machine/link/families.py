"""Families: how each firmware behaves at the other end of the line; one row a family, found by its own name in M115."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Family:
    """Habits of a firmware on the line.

    signs: words of its FIRMWARE_NAME line. resends: it asks again for a damaged line; one that does not drops the line
    without a word, and a repeat could be done twice, so an unanswered line ends the print. resend_ok: an `ok` that acknowledges
    nothing follows Resend. places: lines in flight while its numbered answers tell no free places; places_plain: while
    its answers carry no numbers. rx_bytes: what the receive buffer holds. silence_s: how long a line may stay without
    answer once it was asked about, None: as the stream's timing says. last_number: then the numbers begin anew.
    """

    name: str
    signs: tuple[str, ...]
    resends: bool = True
    resend_ok: bool = True
    places: int = 1
    places_plain: int = 1
    rx_bytes: int = 127  # an AVR's 128-byte receive ring holds one byte less; a fuller one loses bytes without a word
    silence_s: float | None = None
    # Five digits, the questions of a trouble included: a line that fits its firmware when a program is checked fits when it
    # is sent, and short numbers leave the line to the program. All are far below 2^31, where a firmware's counter turns.
    last_number: int = 99_900


MARLIN = Family("Marlin", ("marlin",))
# `ok 12` names the line, nothing tells the free places: its own host counts characters against the receive buffer.
REPETIER = Family("Repetier-Firmware", ("repetier",), places=16)
SMOOTHIE = Family("Smoothieware", ("smoothie",), resend_ok=False)
# Numbers are parsed but not checked for sequence, a bad checksum is dropped in silence; USB loses nothing.
REPRAPFIRMWARE = Family("RepRapFirmware", ("reprapfirmware", "duet"), resends=False)
# N and * are stripped and ignored. A macro may work for minutes without a word, and the pseudo-terminal loses nothing: when
# the program behind it dies the port closes.
KLIPPER = Family("Klipper", ("klipper",), resends=False, silence_s=1800.0)

FAMILIES: dict[str, Family] = {
    "marlin": MARLIN,
    "repetier": REPETIER,
    "smoothie": SMOOTHIE,
    "reprapfirmware": REPRAPFIRMWARE,
    "klipper": KLIPPER,
}


def family_of(identity: str, default: Family = MARLIN) -> Family:
    """The row of a FIRMWARE_NAME line; forks keep the name of what they were forked from."""
    folded = identity.lower()
    return next((row for row in FAMILIES.values() if any(sign in folded for sign in row.signs)), default)
