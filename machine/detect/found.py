"""Found: what a firmware tells of its machine, every value with the words that told it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, radians, sin, sqrt
from typing import NamedTuple

from profiles.errors import ProfileError

Value = float | str | bool | list[float]
LIMITS, SPEED, ACCELERATION = "limits", "speed", "acceleration"
PRINTING = "XYZ"
HALF_SQUARE = sin(radians(45.0))  # of half the angle between the two sides of a right-angled corner
FARTHEST = 1e7  # mm or deg; a limit beyond it is none (LinuxCNC's 1e99)


class Reading(NamedTuple):
    """A value in the profile's units, and the words of the firmware that it was read from or worked out of."""

    value: Value
    source: str


AxisReadings = dict[str, Reading]  # by LIMITS, SPEED, ACCELERATION; mm or deg, per s, per s2


@dataclass(frozen=True)
class ConfigText:
    """What is read. name: of the file or the port, for messages; beside: the texts of files that this one names, by a pattern
    with * and ?, none where there is no such file; it may raise ProfileError."""

    name: str
    text: str
    beside: Callable[[str], "Sequence[ConfigText]"] = lambda pattern: ()


@dataclass(frozen=True)
class Found:
    """firmware: name and version, for people; dialect: for machine.dialect; axes: by letter, those of rotary axes included, E for
    the filament; rotary: the letters of axes that turn; settings: by key below machine; steppers: letter -> [manual_stepper] of
    Klipper; name: of the machine; probe: what it probes with; remarks: sentences for the person.
    """

    firmware: str
    dialect: str
    axes: Mapping[str, AxisReadings]
    rotary: str = ""
    settings: Mapping[str, Reading] = field(default_factory=dict)
    steppers: Mapping[str, str] = field(default_factory=dict)
    name: str = ""
    probe: str = ""
    remarks: tuple[str, ...] = ()


def corner_speed(deviation_mm: float, acceleration_mm_s2: float) -> float:
    """Speed at which a right-angled corner is taken by a firmware that knows a junction deviation, mm/s.

    v^2 = a d s / (1 - s) with s the sine of half the corner's angle (Marlin module/planner.cpp, grblHAL planner.c, Klipper
    toolhead.py, whose square_corner_velocity is this speed). At such a corner each of two axes changes its speed by v at once,
    which is what classic jerk allows: Marlin's own rule of d = 0.4 v^2 / a is the same formula, rounded.
    """
    return sqrt(acceleration_mm_s2 * deviation_mm * HALF_SQUARE / (1.0 - HALF_SQUARE))


def limits(name: str, low: float, high: float, source: str) -> Reading:
    """The limits of an axis. name: of it with the file, for the message. Raises ProfileError where they are reversed."""
    if not low < high:
        raise ProfileError(f"{name}: {source} tells limits from {low:g} to {high:g}: the first must be below the second")
    return Reading([rounded(low), rounded(high)], source)


def is_limit(value: float | None) -> bool:
    """Whether a number bounds an axis at all."""
    return value is not None and isfinite(value) and abs(value) < FARTHEST


def rounded(value: float) -> float:
    """A number as a profile has it: four places behind the point."""
    return round(value, 4)


def check_whole(found: Found, name: str) -> Found:
    """The same, or ProfileError when X, Y or Z lacks its speed or acceleration, which every firmware tells: half a file."""
    lacking = [
        f"{word} of {letter}" for letter in PRINTING for word in (SPEED, ACCELERATION) if word not in found.axes.get(letter, {})
    ]
    if lacking:
        raise ProfileError(f"{name}: it is {found.firmware}'s, but tells no {', no '.join(lacking[:2])}: is it whole?")
    return found
