"""Conversion: a setting of another slicer as a value of a tiltprint profile, or the reason why it is not imported.

Where PrusaSlicer's zero means "computed", as for widths, its own rule is used (src/libslic3r/Flow.cpp, auto_extrusion_width);
where it means "the firmware's value", nothing is imported.
"""

from collections.abc import Callable
from math import pi

from profiles.foreign.config import OF_NOZZLE, Config

AUTO_WIDTH, AUTO_NARROW = 1.125, 1.0  # share of the nozzle: walls and infill; top skins and support
ROUND_ENDS = 1.0 - pi / 4.0  # share of a bead's height: overlap of adjacent beads

# A value of ours and how it was computed, "" if unchanged; or None and the reason why nothing is imported.
Converted = tuple[float | bool | str | None, str]
Convert = Callable[[Config, str], Converted]
NO_NUMBER: Converted = (None, "is not a number")


def no_number(config: Config, key: str) -> Converted:
    """The reason why a setting gives no number."""
    is_of_nozzle = (config.text(key) or "").endswith(OF_NOZZLE)
    return (None, "a percentage of the nozzle, which the file does not state") if is_of_nozzle else NO_NUMBER


def number(config: Config, key: str) -> Converted:
    """A number, unchanged."""
    value = config.number(key)
    return NO_NUMBER if value is None else (value, "")


def whole(config: Config, key: str) -> Converted:
    """A count."""
    value = config.number(key)
    return NO_NUMBER if value is None else (round(value), "")


def always(value: float | bool | str | None, how: str = "") -> Convert:
    """One value for any setting; None: the setting is known but not imported."""
    return lambda config, key: (value, how)


def by_flag(on: Converted, off: Converted) -> Convert:
    """Values for on and off."""
    return lambda config, key: on if config.flag(key) else off


flag = by_flag((True, ""), (False, ""))


def unless_off(switch: str, off: Converted, convert: Convert) -> Convert:
    """A conversion that applies only where another setting is not off."""
    return lambda config, key: off if config.flag(switch) is False else convert(config, key)


def above_zero(zero: str) -> Convert:
    """A number whose 0 has another meaning."""

    def convert(config: Config, key: str) -> Converted:
        value = config.number(key)
        if value is None:
            return no_number(config, key)
        return (value, "") if value > 0.0 else (None, f"0: {zero}")

    return convert


def share(config: Config, key: str) -> Converted:
    """A percentage, with or without its sign, as a share."""
    value, plain = config.share(key), config.number(key)
    if plain is not None:
        return round(plain / 100.0 if value is None else value, 6), "percent as a share"
    return (None, "is not a percentage") if value is None else (value, "")


def part_of(base: str, zero: str = "") -> Convert:
    """A number, or a percentage of another setting. zero: the meaning of 0 where it is not a value."""

    def convert(config: Config, key: str) -> Converted:
        part, value, whole_value = config.share(key), config.number(key), _size(config, base)
        if value is not None:
            return (value, "") if value > 0.0 or not zero else (None, f"0: {zero}")
        if part is None:
            return no_number(config, key)
        if whole_value is None:
            return None, f"a percentage of {base}, which the file does not state"
        return round(part * whole_value, 6), f"{100.0 * part:g} % of {base} ({whole_value:g})"

    return convert


PARTS = {
    "solid_infill_speed": part_of("infill_speed"),
    "external_perimeter_speed": part_of("perimeter_speed"),
    "external_perimeter_acceleration": part_of("default_acceleration"),
}


def _size(config: Config, key: str) -> float | None:
    """The number of a setting, with percentages and automatic widths computed."""
    if key.endswith("_extrusion_width"):
        value, _ = width()(config, key)
    elif key in PARTS and config.text(key) is not None:
        value, _ = PARTS[key](config, key)
    else:
        return config.number(key)
    return value if isinstance(value, float) else None


def width(height: str = "layer_height", auto: float = AUTO_WIDTH) -> Convert:
    """A line width in mm, or in percent of the layer height; 0: the default line width, and if that is 0, computed from the
    nozzle.
    """

    def convert(config: Config, key: str) -> Converted:
        for name in dict.fromkeys((key, "extrusion_width")):
            if (number := config.number(name)) is not None and number < 0.0:
                return None, "is less than 0"
            value, how = part_of(height, "by the nozzle")(config, name)
            if value is not None:
                return value, how if name == key else f"0 is {name}"
            if config.text(name) is not None and number != 0.0:
                return None, how if name == key else f"0 is {name}, {how}"
        nozzle = config.number("nozzle_diameter")
        if nozzle is None:
            return None, "0 is by the nozzle, which the file does not state"
        return round(auto * nozzle, 6), f"0 is {auto:g} nozzles of {nozzle:g} mm"

    return convert


def density(line: str) -> Convert:
    """The density of lines of a width at the distance that the setting gives."""

    def convert(config: Config, key: str) -> Converted:
        gap, (wide, _) = config.number(key), width(auto=AUTO_NARROW)(config, line)
        high = config.number("layer_height")
        pitch = wide - ROUND_ENDS * high if isinstance(wide, float) and high is not None else 0.0
        if gap is None or gap < 0.0 or pitch <= 0.0:
            return None, "needs a width and a layer height"
        return round(pitch / (pitch + gap), 4), "lines that far apart"

    return convert


def one_of(words: dict[str, str]) -> Convert:
    """A choice mapped to a choice."""

    def convert(config: Config, key: str) -> Converted:
        text = config.text(key) or ""
        found = words.get(text)
        if found is None:
            return None, "has no equivalent here"
        return found, "" if found == text else "the nearest there is"

    return convert
