"""Found: the values that a firmware reports, each with its source; and the parser of INI-like files of Klipper and LinuxCNC."""

import configparser
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, radians, sin, sqrt
from typing import NamedTuple

from profiles.errors import ProfileError

Value = float | str | bool | list[float]
LIMITS, SPEED, ACCELERATION = "limits", "speed", "acceleration"
PRINTING = "XYZ"
ABC = "ABC"  # by ISO 841 rotary axes about X, Y and Z
HALF_SQUARE = sin(radians(45.0))  # sine of half the angle of a right-angled corner
EXTRUDER = {"extruder_speed_mm_s": SPEED, "extruder_acceleration_mm_s2": ACCELERATION}  # key below machine -> of the axis E
FARTHEST = 1e7  # mm or deg; a limit beyond it means none (LinuxCNC's 1e99)
BOX, ROUND = True, False
KINEMATICS = {  # whether X, Y and Z each move between two limits, for the kinematics of Klipper, Kalico and RepRapFirmware
    **dict.fromkeys(("cartesian", "corexy", "corexz", "hybrid_corexy", "hybrid_corexz", "generic_cartesian", "markforged"), BOX),
    **dict.fromkeys(("limited_cartesian", "limited_corexy", "limited_corexz", "corexyu", "corexyuv"), BOX),
    **dict.fromkeys(("delta", "deltesian", "lineardelta", "rotary_delta", "rotarydelta", "polar", "scara", "winch"), ROUND),
    "hangprinter": ROUND,
}
MOST_INCLUDED = 100  # files; more means that one includes itself
NOTHING = re.compile(r"(?!)")
CONTINUED = re.compile(r"\\[ \t]*\n")  # a line continues on the next one (LinuxCNC, docs/src/config/ini-config.adoc, 5c41560)


class Reading(NamedTuple):
    """A value in the profile's units, and its source in the firmware's words."""

    value: Value
    source: str


AxisReadings = dict[str, Reading]  # by LIMITS, SPEED, ACCELERATION; mm or deg, per s, per s2


@dataclass(frozen=True)
class ConfigText:
    """A text to read. name: its file or port, for messages; beside: finds the files that it includes by a pattern with * and ?,
    empty for none; may raise ProfileError."""

    name: str
    text: str
    beside: Callable[[str], "Sequence[ConfigText]"] = lambda pattern: ()


@dataclass(frozen=True)
class Found:
    """The values that a firmware reports of its machine.

    firmware: name and version, for messages; dialect: for machine.dialect; axes: by letter, with rotary axes, E for the filament;
    rotary: letters of rotary axes; doubtful: letter of a possibly rotary axis -> why it is uncertain; settings: by key below
    machine; steppers: letter -> [manual_stepper] of Klipper; name: the machine's; probe: its kind; remarks: notes for the user.
    """

    firmware: str
    dialect: str
    axes: Mapping[str, AxisReadings]
    rotary: str = ""
    doubtful: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, Reading] = field(default_factory=dict)
    steppers: Mapping[str, str] = field(default_factory=dict)
    name: str = ""
    probe: str = ""
    remarks: Sequence[str] = ()


def corner_speed(deviation_mm: float, acceleration_mm_s2: float) -> float:
    """Speed at which a firmware with junction deviation takes a right-angled corner, mm/s.

    v^2 = a d s / (1 - s) with s the sine of half the corner's angle (Marlin module/planner.cpp, grblHAL planner.c, Klipper
    toolhead.py, whose square_corner_velocity is this speed). At such a corner each of two axes changes its speed by v at once,
    which is what classic jerk allows: Marlin's own rule of d = 0.4 v^2 / a is the same formula, rounded.
    """
    return sqrt(acceleration_mm_s2 * deviation_mm * HALF_SQUARE / (1.0 - HALF_SQUARE))


def reading(value: float | None, source: str, unit: float = 1.0) -> Reading | None:
    """A number in the profile's units, None if unknown. unit: size of the firmware's unit."""
    return None if value is None else Reading(value * unit, source)


def axis_readings(
    name: str, speed: Reading | None, acceleration: Reading | None, low: float | None, high: float | None, source: str
) -> AxisReadings:
    """The known numbers of an axis. name: file and axis, for messages; low, high: its limits, source: their source. Limits beyond
    FARTHEST are ignored. Raises ProfileError for reversed limits."""
    limits = None
    if low is not None and high is not None and abs(low) < FARTHEST and abs(high) < FARTHEST:
        if not low < high:
            raise ProfileError(f"{name}: {source} gives limits from {low:g} to {high:g}: the first must be below the second")
        limits = Reading([low, high], source)
    readings = {SPEED: speed, ACCELERATION: acceleration, LIMITS: limits}
    return {key: reading for key, reading in readings.items() if reading is not None}


def rounded(value: Value) -> Value:
    """A value rounded to four decimals, as in a profile."""
    if isinstance(value, list):
        return [round(number, 4) for number in value]
    return round(value, 4) if isinstance(value, float) else value


def has_box(kinematics: str, source: str) -> bool:
    """Whether X, Y and Z each move between two limits. source: file and setting, for messages.

    Raises ProfileError for unknown kinematics: their axes may be coupled, or follow the table by themselves.
    """
    if kinematics not in KINEMATICS:
        raise ProfileError(
            f"{source} is {kinematics!r}: how that moves X, Y, Z, tilt and turn is not known here; copy the nearest profile and "
            "write machine.tilt and machine.turn yourself (docs/machines.md, Write the profile yourself)"
        )
    return KINEMATICS[kinematics]


@dataclass(frozen=True)
class Sections:
    """A configuration by section and key. name: its file, for messages; missing: included files that do not exist."""

    name: str
    of: dict[str, dict[str, str]]
    missing: list[str] = field(default_factory=list)

    def __getitem__(self, title: str) -> Mapping[str, str]:
        """The settings of a section; empty for a missing one."""
        return self.of.get(title, {})

    def number(self, title: str, key: str) -> float | None:
        """A number, None if missing. Raises ProfileError."""
        text = self[title].get(key)
        if text is None:
            return None
        try:
            value = float(text)
        except ValueError:
            raise ProfileError(f"{self.name}, [{title}]: {key} is {text[:40]!r}, which is no number") from None
        if not isfinite(value):
            raise ProfileError(f"{self.name}, [{title}]: {key} is {text[:40]!r}: a finite number is expected")
        return value

    def reading(self, title: str, key: str) -> Reading | None:
        """A number with its source, None if missing. Raises ProfileError."""
        value = self.number(title, key)
        return None if value is None else Reading(value, f"[{title}] {key}")


def read_sections(config: ConfigText, include: re.Pattern[str] = NOTHING, indents: bool = True) -> Sections:
    """The sections of a text, later ones overriding earlier ones; keys in lower case; comments begin with #, or with ; after a
    blank.

    include: matches a line that names other files in its first group: they are read in its place. indents: an indented line
    continues the value before it. Raises ProfileError.
    """
    parser, missing = configparser.RawConfigParser(strict=False, inline_comment_prefixes=(";", "#")), list[str]()
    for name, lines in _pieces(config, include, missing, [0]):
        try:
            parser.read_string("\n".join(lines if indents else map(str.strip, lines)), name)
        except configparser.MissingSectionHeaderError as error:
            raise ProfileError(f"{name}: {error.line.strip()[:60]!r} stands in no section") from None
        except configparser.ParsingError as error:
            _, line = error.errors[0]
            raise ProfileError(f"{name}: {line[:60]} is neither a section nor a setting: is the file cut off?") from None
    return Sections(config.name, {title: dict(parser.items(title)) for title in parser.sections()}, missing)


def _pieces(
    config: ConfigText, include: re.Pattern[str], missing: list[str], count: list[int]
) -> Iterator[tuple[str, list[str]]]:
    """File names and lines in reading order. count: of files so far."""
    count[0] += 1
    if count[0] > MOST_INCLUDED:
        raise ProfileError(f"{config.name}: more than {MOST_INCLUDED} files are included: does one include itself?")
    lines: list[str] = []
    for line in CONTINUED.sub(" ", config.text).split("\n"):
        if (named := include.match(line)) is None:
            lines.append(line.partition("#")[0])
            continue
        yield config.name, lines
        lines = []
        pattern = named[1].strip()
        others = config.beside(pattern)
        if not others and "*" not in pattern:
            missing.append(pattern)
        for other in others:
            yield from _pieces(other, include, missing, count)
    yield config.name, lines
