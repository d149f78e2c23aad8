"""Found: what a firmware says of its machine, each value with the words it was read from."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, radians, sin, sqrt
from typing import NamedTuple

from profiles.errors import ProfileError

Value = float | str | bool | list[float]
LIMITS, SPEED, ACCELERATION = "limits", "speed", "acceleration"
PRINTING = "XYZ"
ABC = "ABC"  # by ISO 841 rotary axes about X, Y and Z
HALF_SQUARE = sin(radians(45.0))  # of half the angle between the two sides of a right-angled corner
FARTHEST = 1e7  # mm or deg; a limit beyond it is none (LinuxCNC's 1e99)
BOX, ROUND = True, False
KINEMATICS = {  # of Klipper, Kalico and RepRapFirmware: whether X, Y and Z each move between two limits
    **dict.fromkeys(("cartesian", "corexy", "corexz", "hybrid_corexy", "hybrid_corexz", "generic_cartesian", "markforged"), BOX),
    **dict.fromkeys(("limited_cartesian", "limited_corexy", "limited_corexz", "corexyu", "corexyuv"), BOX),
    **dict.fromkeys(("delta", "deltesian", "lineardelta", "rotary_delta", "rotarydelta", "polar", "scara", "winch"), ROUND),
    "hangprinter": ROUND,
}


class Reading(NamedTuple):
    """A value in the profile's units, and the words of the firmware that it comes from."""

    value: Value
    source: str


AxisReadings = dict[str, Reading]  # by LIMITS, SPEED, ACCELERATION; mm or deg, per s, per s2


@dataclass(frozen=True)
class ConfigText:
    """A text to read. name: its file or port, for messages; beside: finds the texts of files that it names by a pattern with
    * and ?, empty where there is no such file; may raise ProfileError."""

    name: str
    text: str
    beside: Callable[[str], "Sequence[ConfigText]"] = lambda pattern: ()


@dataclass(frozen=True)
class Found:
    """What a firmware says of its machine.

    firmware: name and version, for people; dialect: for machine.dialect; axes: by letter, with rotary axes, E for the filament;
    rotary: letters of axes that turn; doubtful: letter of an axis that may turn -> why that is not known; settings: by key below
    machine; steppers: letter -> [manual_stepper] of Klipper; name: the machine's; probe: its kind; remarks: notes for the person.
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
    """Speed at which a firmware with a junction deviation takes a right-angled corner, mm/s.

    v^2 = a d s / (1 - s) with s the sine of half the corner's angle (Marlin module/planner.cpp, grblHAL planner.c, Klipper
    toolhead.py, whose square_corner_velocity is this speed). At such a corner each of two axes changes its speed by v at once,
    which is what classic jerk allows: Marlin's own rule of d = 0.4 v^2 / a is the same formula, rounded.
    """
    return sqrt(acceleration_mm_s2 * deviation_mm * HALF_SQUARE / (1.0 - HALF_SQUARE))


def limits(name: str, low: float, high: float, source: str) -> Reading:
    """The limits of an axis. name: file and axis, for the message. Raises ProfileError where they are reversed."""
    if not low < high:
        raise ProfileError(f"{name}: {source} tells limits from {low:g} to {high:g}: the first must be below the second")
    return Reading([low, high], source)


def is_limit(value: float | None) -> bool:
    """Whether a number bounds an axis at all."""
    return value is not None and isfinite(value) and abs(value) < FARTHEST


def rounded(value: Value) -> Value:
    """A value as a profile has it: numbers with four decimals."""
    if isinstance(value, list):
        return [round(number, 4) for number in value]
    return round(value, 4) if isinstance(value, float) else value


def has_box(kinematics: str, source: str) -> bool:
    """Whether X, Y and Z each move between two limits. source: file and setting, for the message.

    Raises ProfileError for kinematics that are not known: their axes may be coupled, or follow the table by themselves.
    """
    if kinematics not in KINEMATICS:
        raise ProfileError(
            f"{source} is {kinematics!r}: how that moves X, Y, Z, tilt and turn is not known here; copy the nearest profile and "
            "write machine.tilt and machine.turn yourself (docs/profiles.md, Adding a machine)"
        )
    return KINEMATICS[kinematics]
