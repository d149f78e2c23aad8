"""What a printer says: one frozen event for each kind of line, and the reading of a line into an event."""

import re
from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True, slots=True)
class Temperature:
    """Degrees C now and wanted; None where the line does not report it."""

    nozzle_c: float | None = None
    nozzle_target_c: float | None = None
    bed_c: float | None = None
    bed_target_c: float | None = None

    @property
    def words(self) -> str:
        """How hot it is, for a person; "" where the line does not report it."""
        degrees = (("nozzle", self.nozzle_c), ("bed", self.bed_c))
        return ", ".join(f"{name} {now_c:.0f} °C" for name, now_c in degrees if now_c is not None)


@dataclass(frozen=True, slots=True)
class Position:
    """Answer to M114 or an autoreport: (letter, value) pairs, rotary letters included."""

    axes: tuple[tuple[str, float], ...]


class Ok(NamedTuple):
    """A line was accepted. Number and free places come with Marlin's ADVANCED_OK, a temperature after M105.

    position: Smoothie puts the answer to M114 behind its ok.
    """

    line: int | None = None
    planner_free: int | None = None
    rx_free: int | None = None
    temperature: Temperature | None = None
    text: str = ""
    position: Position | None = None


class PlainOk(Ok):
    """An ok with nothing but number and free places behind it, or nothing at all; equal to the Ok that says the same."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Resend:
    """The printer wants this line and all after it again; one `ok` that acknowledges nothing follows."""

    line: int


@dataclass(frozen=True, slots=True)
class Text:
    """A line, or what of it matters, as it was said."""

    text: str


class Busy(Text):
    """The printer lives but has no time for more lines."""


class LineError(Text):
    """An error of the transmission only (checksum, line number); a Resend follows."""


class FirmwareFault(Text):
    """Any other error: the printer has stopped or must be stopped."""


class Identity(Text):
    """The FIRMWARE_NAME line of the answer to M115."""


class Echo(Text):
    """Words for people: `echo:`, `//`, `Warning:`."""


class Banner(Text):
    """Words that a firmware says only while it starts; they betray a restart whose `start` was lost."""


class Unknown(Text):
    """Anything else, rubbish included."""


@dataclass(frozen=True, slots=True)
class Capability:
    """A `Cap:NAME:1` line of the answer to M115."""

    name: str
    present: bool


@dataclass(frozen=True, slots=True)
class Area:
    """The geometry report of M115: (letter, least, greatest) of each axis. Marlin calls the fourth to sixth axis I, J, K."""

    axes: tuple[tuple[str, float, float], ...]


@dataclass(frozen=True, slots=True)
class Action:
    """`//action:NAME`: the printer asks the sender for something (pause, resume, cancel, disconnect, poweroff, ...)."""

    name: str
    words: str = ""


@dataclass(frozen=True, slots=True)
class Start:
    """The printer has just started: counters, position and temperatures are gone."""


@dataclass(frozen=True, slots=True)
class Wait:
    """The printer has nothing to do (Repetier says so every second)."""


Report = Temperature | Position | Capability | Identity | Area | Action | Echo | Unknown
Event = Ok | Resend | Busy | LineError | FirmwareFault | Start | Banner | Wait | Report

NAME = "FIRMWARE_NAME:"
OK = re.compile(rb"ok(?: N?(\d{1,10}))?(?: P(\d{1,4}))?(?: B(\d{1,4}))?")
# Teacup says why behind it: "rs N120 Expected checksum 67", "rs N120 Expected line number 120".
RESEND = re.compile(r"(?:resend:|rs)\s*N?:?(\d{1,10})(?:\s+expected (?:checksum|line number) \d+)?", re.IGNORECASE)
NOZZLE = re.compile(r"(?:^|\s)T0?:\s*(-?\d+\.?\d*)(?:\s*/\s*(-?\d+\.?\d*))?")
BED = re.compile(r"(?:^|\s)B:\s*(-?\d+\.?\d*)(?:\s*/\s*(-?\d+\.?\d*))?")
AXIS = re.compile(r"([A-Z]):\s*(-?\d+\.?\d*)")
CAPABILITY = re.compile(r"Cap:(\w+):([01])")
AREA = re.compile(r"area:.*?full:\{min:\{([^}]*)\},?max:\{([^}]*)\}")
REACH = re.compile(r"([a-z]):(-?\d+\.?\d*)")
ACTION = re.compile(r"//\s*action:\s*(\w+)\s*(.*)")
# A boot loader at another rate, and the jerk of a reset line, put rubbish in front of the word.
START = re.compile(r"(?:.*[^ -~])?start")
GREETS = re.compile(
    r"Grbl \d.*|Smoothie|.* is up and running.*|echo: ?Last Updated.*|Marlin \d+\.\d.*|// ?Klipper state: (?:Ready|Disconnect)"
)
# Words by which transmission errors are known even when a byte of them is damaged.
OF_THE_LINE = ("checksum", "line number", "last line", "expected line")
# Klipper's gcode.py, _handle_shutdown; and the end of the message (klippy.py, message_shutdown) that answers every later command,
# whose `!!` names nothing but the reason.
SHUTDOWN = re.compile(r"// ?(Klipper state: Shutdown|Printer is shutdown)")
UNKNOWN = re.compile(r'Unknown command: ?"?([A-Z][A-Z0-9_.]*)|\b([GM]\d+): Command is not supported')
# Klipper's klippy.py, message_startup; older ones begin it with the second sentence.
STARTING = ("printer is not ready", "host software is attempting to connect")
MISSING = ("missing checksum", "no checksum", "no line number")
OF_THE_CARD = ("no media", "volume.init", "openroot", "workdir", "open failed", "cannot open", "cannot enter", "sd init")
# Said by a firmware that has stopped for good, its heaters off: Marlin's kill(), Klipper's shutdown, RepRapFirmware's M112.
KILLED = ("printer halted", "kill() called", "shutdown", "emergency stop")
# Smoothieware's, GcodeDispatch::on_console_line_received: the answer to M112, and to every line once it has halted.
HALTED_OK, HALTED = "Emergency Stop Requested", "!!"
# Said by firmwares that stop, whatever became of the `Error:` before them.
DEADLY = ("printer halted", "kill() called", "thermal runaway", "heating failed", "system stopped", "mintemp", "maxtemp")


def read_event(raw: bytes) -> Event:
    """The event of one received line (without its newline). Never raises: rubbish is Unknown."""
    if ok := OK.fullmatch(raw):  # nearly every line
        return _plain_ok(ok)
    text = raw.decode("ascii", "replace").strip()
    if text.startswith("ok"):
        return _ok(text)
    folded = text.lower()
    if resend := RESEND.fullmatch(text):
        return Resend(int(resend[1]))
    if folded.startswith(("error:", "!!", "fatal:", "alarm:")) or any(word in folded for word in DEADLY):
        return _error(text, folded)
    if folded.startswith(("echo:busy:", "busy:")):
        return Busy(text)
    return _read_report(text)


def temperature_in(event: Event) -> Temperature | None:
    """What a line reports of the heaters: by itself, or behind the ok of M105."""
    return event.temperature if isinstance(event, Ok) else event if isinstance(event, Temperature) else None


def position_in(event: Event) -> Position | None:
    """Where a line says that the axes stand: by itself, or behind an ok as Smoothie has it."""
    return event.position if isinstance(event, Ok) else event if isinstance(event, Position) else None


def identity_in(event: Event) -> Identity | None:
    """The firmware's name: a line of its own, or behind an ok as Klipper has it."""
    if isinstance(event, Ok) and NAME in event.text:
        return Identity(event.text[event.text.index(NAME) :])
    return event if isinstance(event, Identity) else None


def unknown_command(event: Event) -> str:
    """The name of a command that the firmware says it does not know, "" of other words. Marlin and Klipper quote the whole line,
    RepRapFirmware names the code.
    """
    match = UNKNOWN.search(event.text) if isinstance(event, Echo) else None
    return "" if match is None else match[1] or match[2]


def lacks_checksum(event: Event) -> bool:
    """Whether a line was refused because it had no number or no checksum."""
    return isinstance(event, LineError) and any(words in event.text.lower() for words in MISSING)


def is_starting(event: Event) -> bool:
    """Whether a firmware refuses a command because it is still starting: it will take it in a few moments."""
    return isinstance(event, FirmwareFault) and any(words in event.text.lower() for words in STARTING)


def is_halt(event: Event) -> bool:
    """Whether the firmware says that it has stopped for good and switched its heaters off. Any other error does not say so."""
    if isinstance(event, Ok):
        return HALTED_OK in event.text
    return isinstance(event, FirmwareFault) and (event.text == HALTED or any(words in event.text.lower() for words in KILLED))


def _error(text: str, folded: str) -> Event:
    if any(word in folded for word in OF_THE_LINE):
        return LineError(text)
    return Echo(text) if any(word in folded for word in OF_THE_CARD) else FirmwareFault(text)


def _read_report(text: str) -> Event:
    """What is no answer to a line."""
    if text.startswith("X:"):
        return _position(text)
    if text == "wait":
        return Wait()
    if START.fullmatch(text):
        return Start()
    if shutdown := SHUTDOWN.fullmatch(text):
        return FirmwareFault(shutdown[1])
    if action := ACTION.fullmatch(text):
        return Action(action[1].lower(), action[2])
    if GREETS.fullmatch(text):
        return Banner(text)
    if text.startswith(("echo:", "//", "Warning:")):  # the last is RepRapFirmware's
        return Echo(text.removeprefix("echo:").removeprefix("//").strip())
    if text.startswith(NAME):
        return Identity(text)
    if capability := CAPABILITY.fullmatch(text):
        return Capability(capability[1], capability[2] == "1")
    return _area(text) or _temperature(text) or Unknown(text)


def _plain_ok(ok: re.Match[bytes]) -> PlainOk:
    """An ok with its numbers, or alone."""
    line, planner, rx = ok.groups()
    return PlainOk(_whole(line), _whole(planner), _whole(rx), None, ok[0].decode("ascii"))


def _ok(text: str) -> Event:
    if ok := OK.fullmatch(text.encode("ascii", "replace")):
        return _plain_ok(ok)
    if not text.isascii() or not text.startswith("ok "):
        return Unknown(text)
    if text.startswith(("ok T", "ok B:")):  # Klipper reports the bed first
        return Ok(temperature=_temperature(text), text=text)
    return Ok(text=text, position=_position(text) if " X:" in text else None)


def _whole(digits: bytes | None) -> int | None:
    return None if digits is None else int(digits)


def _position(text: str) -> Position:
    """The axes' places; what follows Count (steps) and Machine (RepRapFirmware, before the table's map) is left out."""
    text = text[text.index("X:") :].partition(" Count")[0].partition(" Machine")[0]
    return Position(tuple((letter, float(value)) for letter, value in AXIS.findall(text)))


def _temperature(text: str) -> Temperature | None:
    nozzle, bed = _pair(NOZZLE, text), _pair(BED, text)
    return None if nozzle[0] is None and bed[0] is None else Temperature(*nozzle, *bed)


def _pair(pattern: re.Pattern[str], text: str) -> tuple[float | None, float | None]:
    match = pattern.search(text)
    if match is None:
        return None, None
    return float(match[1]), None if match[2] is None else float(match[2])


def _area(text: str) -> Area | None:
    match = AREA.match(text)
    if match is None:
        return None
    least, most = dict(REACH.findall(match[1])), dict(REACH.findall(match[2]))
    return Area(tuple((letter.upper(), float(least[letter]), float(most[letter])) for letter in least if letter in most))
