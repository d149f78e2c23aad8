"""Conversion: a setting of another slicer as a value of ours, or the reason why it is left.

Where PrusaSlicer's zero means "worked out", as for widths, its own rule is used (src/libslic3r/Flow.cpp,
auto_extrusion_width); where it means "the firmware's", nothing is taken.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

from profiles.foreign.config import Config

AUTO_WIDTH, AUTO_NARROW = 1.125, 1.0  # of the nozzle: walls and infill, uppermost skins and support
ROUND_ENDS = 1.0 - pi / 4.0  # of a bead's height: by how much beads side by side overlap


@dataclass(frozen=True)
class Value:
    """What we say for it. how: what was worked out; empty where it is taken as it is."""

    value: float | bool | str | None
    how: str = ""


@dataclass(frozen=True)
class Left:
    """Why nothing is taken."""

    reason: str


Converted = Value | Left
Convert = Callable[[Config, str], Converted]
NO_NUMBER = Left("is no number")


def number(config: Config, key: str) -> Converted:
    """A number as it is."""
    value = config.number(key)
    return NO_NUMBER if value is None else Value(value)


def whole(config: Config, key: str) -> Converted:
    """A count."""
    value = config.number(key)
    return NO_NUMBER if value is None else Value(round(value))


def flag(config: Config, key: str) -> Converted:
    """On or off."""
    return Value(bool(config.flag(key)))


def above_zero(zero: str) -> Convert:
    """A number where 0 means something else."""

    def convert(config: Config, key: str) -> Converted:
        value = config.number(key)
        if value is None:
            return NO_NUMBER
        return Value(value) if value > 0.0 else Left(f"0: {zero}")

    return convert


def share(config: Config, key: str) -> Converted:
    """A percentage, with its sign or without, as a share."""
    value, plain = config.share(key), config.number(key)
    if value is None and plain is None:
        return Left("is no percentage")
    return Value(round(plain / 100.0 if value is None else value, 6), "percent as a share") if plain is not None else Value(value)


def part_of(base: str, zero: str = "") -> Convert:
    """A number, or a percentage of another setting; zero: what 0 means where it is no value."""

    def convert(config: Config, key: str) -> Converted:
        part, value, whole_value = config.share(key), config.number(key), size(config, base)
        if value is not None:
            return Value(value) if value > 0.0 or not zero else Left(f"0: {zero}")
        if part is None:
            return NO_NUMBER
        if whole_value is None:
            return Left(f"a percentage of {base}, which the file does not tell")
        return Value(round(part * whole_value, 6), f"{100.0 * part:g} % of {base} ({whole_value:g})")

    return convert


def size(config: Config, key: str) -> float | None:
    """The number of a setting, percentages of others and widths worked out."""
    if key.endswith("_extrusion_width"):
        converted = width()(config, key)
        return converted.value if isinstance(converted, Value) and isinstance(converted.value, float) else None
    if key in PARTS and config.text(key) is not None:
        converted = part_of(PARTS[key])(config, key)
        return converted.value if isinstance(converted, Value) and isinstance(converted.value, float) else None
    return config.number(key)


PARTS = {
    "solid_infill_speed": "infill_speed",
    "external_perimeter_speed": "perimeter_speed",
    "external_perimeter_acceleration": "default_acceleration",
}


def width(height: str = "layer_height", auto: float = AUTO_WIDTH) -> Convert:
    """A line's width: in mm, or in percent of the layer's height; 0: as all lines, and where that is 0, by the nozzle."""

    def convert(config: Config, key: str) -> Converted:
        for name in dict.fromkeys((key, "extrusion_width")):
            converted = part_of(height, "by the nozzle")(config, name)
            if isinstance(converted, Value):
                how = converted.how if name == key else f"0 is {name}"
                return Value(converted.value, how)
        nozzle = config.number("nozzle_diameter")
        if nozzle is None:
            return Left("0 is by the nozzle, which the file does not tell")
        return Value(round(auto * nozzle, 6), f"0 is {auto:g} nozzles of {nozzle:g} mm")

    return convert


def density(spacing: str, line: str) -> Callable[[Config], float | None]:
    """The share that lines fill which stand that far apart."""

    def convert(config: Config) -> float | None:
        gap, wide = config.number(spacing), width(auto=AUTO_NARROW)(config, line)
        high = config.number("layer_height")
        if gap is None or gap < 0.0 or high is None or isinstance(wide, Left) or not isinstance(wide.value, float):
            return None
        pitch = wide.value - ROUND_ENDS * high
        return round(pitch / (pitch + gap), 4) if pitch > 0.0 else None

    return convert


def one_of(words: dict[str, str], unknown: str = "there is no such one here") -> Convert:
    """A word for a word."""

    def convert(config: Config, key: str) -> Converted:
        text = config.text(key) or ""
        found = words.get(text)
        if found is None:
            return Left(unknown)
        return Value(found, "" if found == text else "the nearest there is")

    return convert


def left(why: str) -> Convert:
    """A setting that is known and not taken."""
    return lambda config, key: Left(why)
