"""Effect: what a changed setting does to a front that was found before: nothing, other prices, the machine may reach less of it,
or it may be another front.

A search reads few of the settings, and what it finds has prices only afterwards. What neither reads is listed here, and what the
search reads of process and material; of a machine, whose shape decides nearly all, what it does not.
"""

from collections.abc import Iterator, Mapping
from enum import IntEnum
from typing import Any

from profiles.profile import Profile


class Effect(IntEnum):
    """From the least to the greatest."""

    NONE = 0
    PRICES = 1
    REACH = 2
    FRONT = 3


# Read neither by a search nor for prices: heat, air and what only the G-code's text has.
UNREAD = frozenset(
    {
        *(f"material.{key}" for key in ("name", "density_g_cm3", "price_per_kg", "currency")),
        *(f"material.{key}_c" for key in ("nozzle", "first_layer_nozzle", "homing_nozzle", "standby", "bed")),
        *(
            f"material.fan{key}"
            for key in ("", "_least", "_layer_time_s", "_bridge", "_infill_bridge", "_off_layers", "_full_layer")
        ),
        *("material.coast_mm", "material.pressure_advance"),
        *(f"process.{key}" for key in ("name", "interface_fan", "interface_first_layer_fan")),
        *(f"machine.gcode.{key}" for key in ("start", "end", "before_part", "after_part", "before_layer", "resume")),
        *(f"machine.{key}" for key in ("name", "sources", "uncalibrated", "thumbnails_px", "receive_bytes")),
        *(f"machine.{key}" for key in ("arcs", "arc_tolerance_mm", "nozzle_limit_c", "bed_limit_c", "lift_mm")),
    }
)
SEARCHED = frozenset(
    {
        *(f"process.{key}" for key in ("scale", "rotate_deg", "self_supporting_angle_deg", "support", "support_least_mm2")),
        *(f"process.{key}_mm" for key in ("layer_height", "line_width", "arch_longest", "bridge_longest")),
        *(f"material.{key}" for key in ("interlayer_strength_mpa", "cold_weld_factor", "bridge_longest_mm")),
    }
)
PLACE = "process.place_mm"  # a search reads it, but the same planes are the best wherever they are reached
# Keys of a machine that only make it quicker or slower, or take more filament.
PACES = ("purge_mm", "heating_c_s", "speed_mm_s", "acceleration_mm_s2", "speed_deg_s", "acceleration_deg_s2")


def effect_of(key: str) -> Effect:
    """What a change of a key, section and dots before it, does to a front."""
    section, _, name = key.partition(".")
    if key in UNREAD:
        return Effect.NONE
    if key == PLACE:
        return Effect.REACH
    if section in ("process", "material"):
        return Effect.FRONT if key in SEARCHED else Effect.PRICES
    return Effect.PRICES if section == "machine" and name.endswith(PACES) else Effect.FRONT


def effect_of_change(before: Profile, after: Profile) -> Effect:
    """The greatest effect of all that differs between two profiles, the settings of single parts aside: no search reads them."""
    old, new = (dict(_leaves("", profile.model_dump(exclude={"parts"}))) for profile in (before, after))
    changed = {key for key in old.keys() | new.keys() if old.get(key) != new.get(key)}
    return max(map(effect_of, changed), default=Effect.NONE)


def _leaves(prefix: str, table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping) and name != "machine.sources":
            yield from _leaves(f"{name}.", value)
        else:
            yield name, value
