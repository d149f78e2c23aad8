"""Events: the lines of a printer, and the parser of a line."""

import re
from dataclasses import dataclass
from enum import Enum, auto
from typing import NamedTuple


@dataclass(frozen=True, slots=True)
class Temperature:
    """Temperatures and targets, deg C; None if not reported."""

    nozzle_c: float | None = None
    nozzle_target_c: float | None = None
    bed_c: float | None = None
    bed_target_c: float | None = None

    @property
    def words(self) -> str:
        """The temperatures in words; "" for none."""
        degrees = (("nozzle", self.nozzle_c), ("bed", self.bed_c))
        return ", ".join(f"{name} {now_c:.0f} °C" for name, now_c in degrees if now_c is not None)


class Kind(Enum):
    """Kinds of a printer's lines."""

    OK = auto()  # a line was accepted
    RESEND = auto()  # the printer requests this line and all after it; one `ok` that acknowledges nothing follows
    BUSY = auto()  # the printer works and has no time for more lines
    LINE_ERROR = auto()  # an error of the transmission only (checksum, line number); a Resend follows
    FAULT = auto()  # any other error: the printer has stopped or must be stopped
    START = auto()  # the printer has just started: counters, position and temperatures are lost
    BANNER = auto()  # words of a starting firmware; they reveal a restart whose `start` was lost
    WAIT = auto()  # the printer is idle (Repetier says so every second)
    TEMPERATURE = auto()
    POSITION = auto()  # answer to M114 or an autoreport
    IDENTITY = auto()  # the FIRMWARE_NAME line of the answer to M115
    CAPABILITY = auto()  # `Cap:NAME:1` of the answer to M115, as NAME:1
    AREA = auto()  # the geometry report of M115
    ACTION = auto()  # `//action:NAME`: the printer requests something of the sender (pause, cancel, disconnect, ...), as NAME
    ECHO = auto()  # messages to the user: `echo:`, `//`, `Warning:`
    UNKNOWN = auto()  # anything else, including garbled bytes


class Event(NamedTuple):
    """A line of the printer. Temperature, position and identity come on a line of their own or after an ok."""

    kind: Kind
    text: str = ""  # the relevant words
    line: int | None = None  # that an ok acknowledges or a Resend requests
    planner_free: int | None = None  # free places of the planner, by Marlin's ADVANCED_OK
    rx_free: int | None = None  # free places of the receive buffer
    temperature: Temperature | None = None
    position: dict[str, float] | None = None  # letter -> mm or deg, rotary letters included
    identity: str = ""  # the FIRMWARE_NAME words
    area: tuple[tuple[float, float], ...] = ()  # least and greatest value of each axis

    @property
    def unknown_command(self) -> str:
        """Name of a command that the firmware does not know, "" for other lines. Marlin and Klipper quote the whole line,
        RepRapFirmware names the code."""
        match = UNKNOWN.search(self.text) if self.kind is Kind.ECHO else None
        return "" if match is None else match[1] or match[2]

    @property
    def lacks_checksum(self) -> bool:
        """Whether a line was refused for lack of a number or checksum."""
        return self.kind is Kind.LINE_ERROR and any(words in self.text.lower() for words in MISSING)

    @property
    def is_starting(self) -> bool:
        """Whether a firmware refuses a command because it is still starting."""
        return self.kind is Kind.FAULT and any(words in self.text.lower() for words in STARTING)

    @property
    def is_halt(self) -> bool:
        """Whether the firmware reports that it has stopped for good with its heaters off, which no other error implies."""
        if self.kind is Kind.OK:
            return HALTED_OK in self.text
        return self.kind is Kind.FAULT and (self.text == HALTED or any(words in self.text.lower() for words in KILLED))


NAME = "FIRMWARE_NAME:"
OK = re.compile(rb"ok(?: N?(\d{1,10}))?(?: P(\d{1,4}))?(?: B(\d{1,4}))?")
# Teacup adds a reason: "rs N120 Expected checksum 67", "rs N120 Expected line number 120".
RESEND = re.compile(r"(?:resend:|rs)\s*N?:?(\d{1,10})(?:\s+expected (?:checksum|line number) \d+)?", re.IGNORECASE)
NOZZLE = re.compile(r"(?:^|\s)T0?:\s*(-?\d+\.?\d*)(?:\s*/\s*(-?\d+\.?\d*))?")
BED = re.compile(r"(?:^|\s)B:\s*(-?\d+\.?\d*)(?:\s*/\s*(-?\d+\.?\d*))?")
AXIS = re.compile(r"([A-Z]):\s*(-?\d+\.?\d*)")
CAPABILITY = re.compile(r"Cap:(\w+:[01])")
AREA = re.compile(r"area:.*?full:\{min:\{([^}]*)\},?max:\{([^}]*)\}")
REACH = re.compile(r"([a-z]):(-?\d+\.?\d*)")
ACTION = re.compile(r"//\s*action:\s*(\w+)\s*(.*)")
# A boot loader at another rate, and noise of the reset, put garbled bytes before the word.
START = re.compile(r"(?:.*[^ -~])?start")
GREETS = re.compile(
    r"Grbl \d.*|Smoothie|.* is up and running.*|echo: ?Last Updated.*|Marlin \d+\.\d.*|// ?Klipper state: (?:Ready|Disconnect)"
)
# Words that identify a transmission error even with a damaged byte.
OF_THE_LINE = ("checksum", "line number", "last line", "expected line")
# Klipper's gcode.py, _handle_shutdown; and the end of the message (klippy.py, message_shutdown) that answers every later command,
# whose `!!` only gives the reason.
SHUTDOWN = re.compile(r"// ?(Klipper state: Shutdown|Printer is shutdown)")
UNKNOWN = re.compile(r'Unknown command: ?"?([A-Z][A-Z0-9_.]*)|\b([GM]\d+): Command is not supported')
# Klipper's klippy.py, message_startup; older versions begin with the second sentence.
STARTING = ("printer is not ready", "host software is attempting to connect")
MISSING = ("missing checksum", "no checksum", "no line number")
OF_THE_CARD = ("no media", "volume.init", "openroot", "workdir", "open failed", "cannot open", "cannot enter", "sd init")
# Messages of a firmware that has stopped for good, heaters off: Marlin's kill(), Klipper's shutdown, RepRapFirmware's M112.
KILLED = ("printer halted", "kill() called", "shutdown", "emergency stop")
# Smoothieware's GcodeDispatch::on_console_line_received: the answer to M112, and to every line after a halt.
HALTED_OK, HALTED = "Emergency Stop Requested", "!!"
# Words of firmwares that stop, even if the `Error:` before them is damaged.
DEADLY = ("printer halted", "kill() called", "thermal runaway", "heating failed", "system stopped", "mintemp", "maxtemp")


def read_event(raw: bytes) -> Event:
    """The event of a received line without its newline. Never raises: garbled lines are UNKNOWN."""
    if ok := OK.fullmatch(raw):  # nearly every line
        return _plain_ok(ok)
    text = raw.decode("ascii", "replace").strip()
    if text.startswith("ok"):
        return _ok(text)
    folded = text.lower()
    if resend := RESEND.fullmatch(text):
        return Event(Kind.RESEND, line=int(resend[1]))
    if folded.startswith(("error:", "!!", "fatal:", "alarm:")) or any(word in folded for word in DEADLY):
        return Event(_error_kind(folded), text)
    if folded.startswith(("echo:busy:", "busy:")):
        return Event(Kind.BUSY, text)
    return _read_report(text)


def _error_kind(folded: str) -> Kind:
    if any(word in folded for word in OF_THE_LINE):
        return Kind.LINE_ERROR
    return Kind.ECHO if any(word in folded for word in OF_THE_CARD) else Kind.FAULT


def _read_report(text: str) -> Event:
    """The event of a line that is not an answer."""
    if text.startswith("X:"):
        return Event(Kind.POSITION, position=_position(text))
    if text == "wait":
        return Event(Kind.WAIT)
    if START.fullmatch(text):
        return Event(Kind.START)
    if shutdown := SHUTDOWN.fullmatch(text):
        return Event(Kind.FAULT, shutdown[1])
    if action := ACTION.fullmatch(text):
        return Event(Kind.ACTION, f"{action[1].lower()} {action[2]}".strip())
    if GREETS.fullmatch(text):
        return Event(Kind.BANNER, text)
    if text.startswith(("echo:", "//", "Warning:")):  # the last is RepRapFirmware's
        return Event(Kind.ECHO, text.removeprefix("echo:").removeprefix("//").strip())
    if text.startswith(NAME):
        return Event(Kind.IDENTITY, text, identity=text)
    if capability := CAPABILITY.fullmatch(text):
        return Event(Kind.CAPABILITY, capability[1])
    if area := _area(text):
        return Event(Kind.AREA, area=area)
    if (temperature := _temperature(text)) is not None:
        return Event(Kind.TEMPERATURE, temperature=temperature)
    return Event(Kind.UNKNOWN, text)


def _plain_ok(ok: re.Match[bytes]) -> Event:
    """An ok with or without its numbers."""
    line, planner, rx = ok.groups()
    return Event(Kind.OK, ok[0].decode("ascii"), _whole(line), _whole(planner), _whole(rx))


def _ok(text: str) -> Event:
    """An ok followed by other text."""
    if ok := OK.fullmatch(text.encode("ascii", "replace")):
        return _plain_ok(ok)
    if not text.isascii() or not text.startswith("ok "):
        return Event(Kind.UNKNOWN, text)
    if text.startswith(("ok T", "ok B:")):  # Klipper reports the bed first
        return Event(Kind.OK, text, temperature=_temperature(text))
    identity = text[text.index(NAME) :] if NAME in text else ""
    return Event(Kind.OK, text, position=_position(text) if " X:" in text else None, identity=identity)


def _whole(digits: bytes | None) -> int | None:
    return None if digits is None else int(digits)


def _position(text: str) -> dict[str, float]:
    """The axis positions, without those after Count (steps) and Machine (RepRapFirmware, before the bed compensation)."""
    text = text[text.index("X:") :].partition(" Count")[0].partition(" Machine")[0]
    return {letter: float(value) for letter, value in AXIS.findall(text)}


def _temperature(text: str) -> Temperature | None:
    nozzle, bed = _pair(NOZZLE, text), _pair(BED, text)
    return None if nozzle[0] is None and bed[0] is None else Temperature(*nozzle, *bed)


def _pair(pattern: re.Pattern[str], text: str) -> tuple[float | None, float | None]:
    match = pattern.search(text)
    if match is None:
        return None, None
    return float(match[1]), None if match[2] is None else float(match[2])


def _area(text: str) -> tuple[tuple[float, float], ...]:
    match = AREA.match(text)
    if match is None:
        return ()
    least, most = dict(REACH.findall(match[1])), dict(REACH.findall(match[2]))
    return tuple((float(least[letter]), float(most[letter])) for letter in least if letter in most)
