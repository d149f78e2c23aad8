"""Verdicts: the errors that end a connection, one function for each reason."""

from machine.firmware.firmware import BAUDS
from machine.link.protocol.decoder import LineDecoder
from machine.link.protocol.window import GREETING_LINES
from profiles.errors import FirmwareError, PrinterError, SilenceError
from profiles.messages import advice

SYNC_TRIES = 6  # a board that resets on opening spends one or two of them in its boot loader
GARBLED_TRIES = 2  # boot loaders have baud rates of their own; later bytes are the firmware's
LOST = "position and temperatures are lost, the print cannot continue"


def failed_greeting(decoder: LineDecoder, tries: int, baud: int | None, heard: str = "") -> PrinterError | None:
    """The error after `tries` greetings, None while another makes sense. heard: what came instead of an answer."""
    at = "this baud rate" if baud is None else f"{baud} baud"
    if tries >= GARBLED_TRIES and decoder.is_garbled:
        others = ", ".join(str(rate) for rate in BAUDS if rate != baud)
        return PrinterError(
            f"the bytes received at {at} are garbled: the printer speaks at another rate, {advice('baud', others, 'try')}"
        )
    if tries < SYNC_TRIES:
        return None
    if decoder.foreign:
        text = f"a device answers that is not a known printer: to {tries} greetings it sent {decoder.foreign[:60]!r}"
        return PrinterError(text)
    if heard:
        return PrinterError(f"the printer did not accept {tries} greetings: its last answer was {heard[:60]!r}")
    return SilenceError(
        f"the printer did not answer {tries} greetings (M110, M115 with line numbers): it may be off, or speak at another "
        f"rate than {at}"
    )


def no_line_numbers() -> PrinterError:
    """The error for a printer that answers only lines without numbers."""
    return PrinterError(
        "the printer answers M115, but neither M110 nor any line with a number and a checksum: this program sends no other "
        "lines, because a damaged one could not be detected"
    )


def silence(line: int, questions: int) -> PrinterError:
    """The error for a line and questions without answer."""
    return SilenceError(f"the printer has been silent: line {line} and {questions} questions remained without answer")


def restart(line: int, how: str = "in the middle of the print") -> PrinterError:
    """The error for a printer that restarted."""
    return FirmwareError(f"the printer restarted {how}, after line {line}: {LOST}")


def firmware_fault(text: str) -> PrinterError:
    """The error for a fault that the printer reports."""
    return FirmwareError(f"the printer reported: {text}")


def torn_line(line: int) -> PrinterError:
    """The error for part of a line executed without number and checksum."""
    return PrinterError(f"the printer ran part of a torn line after line {line}: its effect is unknown")


def lost_answer(line: int, command: str, firmware: str) -> PrinterError:
    """The error for an unanswered line when the firmware never requests a resend."""
    return PrinterError(
        f"line {line} ({command}) was not answered, and {firmware} never asks for a lost line again: "
        "whether it was executed is unknown"
    )


def refused_line(line: int, command: str, times: int, words: str) -> PrinterError:
    """The error for a line refused again and again while earlier ones passed. words: the printer's message, "" for none."""
    said = f": {words[:80]!r}" if words else ""
    return PrinterError(
        f"the printer has refused line {line} ({command}) {times} times{said}; lines before it passed, so its firmware does not "
        "take this command as it is, or the cable has just become too noisy"
    )


def noise(line: int, too_much: str) -> PrinterError:
    """The error for too many repeated lines."""
    return PrinterError(f"the printer requested {too_much} again, now {line}: the cable or the adapter is too noisy")


def implausible_resend(line: int, sent: int, acknowledged: int) -> PrinterError:
    """The error for a Resend of an impossible line; of a line of the greeting, because the numbers restarted."""
    if line <= GREETING_LINES:
        return restart(acknowledged, "without a word")
    return PrinterError(
        f"the printer asks for line {line}, although line {sent} is the last one sent and {acknowledged} are acknowledged"
    )
