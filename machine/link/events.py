"""What a printer says: one frozen event for each kind of line, and the reading of a line into an event."""

import re
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Temperature:
    """Degrees C now and wanted; None where the line does not tell."""

    nozzle_c: float | None = None
    nozzle_target_c: float | None = None
    bed_c: float | None = None
    bed_target_c: float | None = None


@dataclass(frozen=True, slots=True)
class Ok:
    """A line was accepted. The number and the free places come with Marlin's ADVANCED_OK, a temperature after M105."""

    line: int | None = None
    planner_free: int | None = None
    rx_free: int | None = None
    temperature: Temperature | None = None
    text: str = ""


@dataclass(frozen=True, slots=True)
class Resend:
    """The printer wants this line and all after it again; one `ok` that acknowledges nothing follows."""

    line: int


@dataclass(frozen=True, slots=True)
class Busy:
    """The printer lives but has no time for more lines."""

    text: str


@dataclass(frozen=True, slots=True)
class Position:
    """Answer to M114: (letter, value) pairs, rotary letters included."""

    axes: tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class LineError:
    """An error of the transmission only (checksum, line number); a Resend follows."""

    text: str


@dataclass(frozen=True, slots=True)
class FirmwareFault:
    """Any other error: the printer has stopped or must be stopped."""

    text: str


@dataclass(frozen=True, slots=True)
class Capability:
    """A `Cap:NAME:1` line of the answer to M115."""

    name: str
    present: bool


@dataclass(frozen=True, slots=True)
class Identity:
    """The FIRMWARE_NAME line of the answer to M115."""

    text: str


@dataclass(frozen=True, slots=True)
class Echo:
    """Words for people, `echo:` or `//`."""

    text: str


@dataclass(frozen=True, slots=True)
class Start:
    """The printer has just started: counters, position and temperatures are gone."""


@dataclass(frozen=True, slots=True)
class Wait:
    """The printer has nothing to do (Repetier says so every second)."""


@dataclass(frozen=True, slots=True)
class Unknown:
    """Anything else, rubbish included."""

    text: str


Told = Temperature | Position | Capability | Identity | Echo | Unknown
Event = Ok | Resend | Busy | LineError | FirmwareFault | Start | Wait | Told

OK = re.compile(r"ok(?: N?(\d+))?(?: P(\d+))?(?: B(\d+))?")
RESEND = re.compile(r"(?:resend:|rs)\s*N?(\d+)", re.IGNORECASE)
NOZZLE = re.compile(r"(?:^|\s)T0?:\s*(-?\d+\.?\d*)(?:\s*/\s*(-?\d+\.?\d*))?")
BED = re.compile(r"(?:^|\s)B:\s*(-?\d+\.?\d*)(?:\s*/\s*(-?\d+\.?\d*))?")
AXIS = re.compile(r"([A-Z]):\s*(-?\d+\.?\d*)")
CAPABILITY = re.compile(r"Cap:(\w+):([01])")
# Words by which Marlin's and its forks' transmission errors are known even when a byte of them is damaged.
OF_THE_LINE = ("checksum", "line number", "last line")


def read_event(raw: bytes) -> Event:
    """The event of one received line (without its newline). Never raises: rubbish is Unknown."""
    text = raw.decode("ascii", "replace").strip()
    if text.startswith("ok"):
        return _ok(text)
    folded = text.lower()
    if found := RESEND.fullmatch(text):
        return Resend(int(found[1]))
    if folded.startswith(("error:", "!!", "fatal:")) or "printer halted" in folded:
        of_the_line = any(word in folded for word in OF_THE_LINE)
        return LineError(text) if of_the_line else FirmwareFault(text)
    if folded.startswith(("echo:busy:", "busy:")):
        return Busy(text)
    if text in ("start", "wait"):
        return Start() if text == "start" else Wait()
    if text.startswith(("echo:", "//")):
        return Echo(text.removeprefix("echo:").removeprefix("//").strip())
    if text.startswith("FIRMWARE_NAME:"):
        return Identity(text)
    if found := CAPABILITY.fullmatch(text):
        return Capability(found[1], found[2] == "1")
    if text.startswith("X:"):
        return Position(tuple((letter, float(value)) for letter, value in AXIS.findall(text.partition("Count")[0])))
    return _temperature(text) or Unknown(text)


def _ok(text: str) -> Event:
    if found := OK.fullmatch(text):
        line, planner, rx = found.groups()
        return Ok(_whole(line), _whole(planner), _whole(rx), None, text)
    if text.startswith(("ok T", "ok B:")):  # Klipper tells the bed first
        return Ok(temperature=_temperature(text), text=text)
    return Ok(text=text) if text.startswith("ok ") else Unknown(text)


def _whole(digits: str | None) -> int | None:
    return None if digits is None else int(digits)


def _temperature(text: str) -> Temperature | None:
    nozzle, bed = _pair(NOZZLE, text), _pair(BED, text)
    return None if nozzle[0] is None and bed[0] is None else Temperature(*nozzle, *bed)


def _pair(pattern: re.Pattern[str], text: str) -> tuple[float | None, float | None]:
    found = pattern.search(text)
    if found is None:
        return None, None
    return float(found[1]), None if found[2] is None else float(found[2])
