"""Part settings: values that one part of a print, or a volume of it, uses in place of the process's own."""

import re
from collections.abc import Iterable
from typing import Any

from pydantic import Field

from profiles.errors import ProfileError
from profiles.frozen import Frozen
from profiles.messages import key_name, option, phrase
from profiles.problems import table_problems, unfit_for_nozzle, without_replaced
from profiles.process import Process
from profiles.settings.support import Plate, Support
from profiles.toml_text import read_value

MOST_PARTS = 1000
# Settings that decide where a model is cut or what rests on other parts, that concern the plate, or moves between parts.
SUPPORT_OF_A_PART = {
    "overhang_share",
    "bridge_flow",
    "bridge_angle_deg",
    "thick_bridges",
    "infill_bridge_flow",
    "support_pattern",
    "support_density",
    "support_interface_density",
}
OF_THE_PRINT = (
    frozenset(Plate.model_fields)
    | (frozenset(Support.model_fields) - SUPPORT_OF_A_PART)
    | frozenset(key for key in Process.model_fields if key.startswith(("first_layer_", "travel_", "lift_")))
    | frozenset(key for key in Process.model_fields if key.endswith("acceleration_mm_s2"))
    | {"name", "scale", "rotate_deg", "self_supporting_angle_deg", "spiral_vase", "only_one_wall_first_layer"}
)
OF_PARTS_ON_PLASTIC = {
    "interface_overlap",
    "interface_flow",
    "interface_line_width_mm",
    "interface_speed_mm_s",
    "interface_layers",
    "interface_temperature_add_c",
    "interface_first_layer_fan",
    "interface_fan",
    "interface_extra_walls",
    "interlock",
    "interlock_mm",
    "pin_width_nozzles",
    "pin_depth_mm",
    "pin_spacing_mm",
    "most_pins",
}

# Settings that may change within a layer; the others decide where layers and lines are, or apply to a whole layer.
OF_A_PLACE = (
    "walls",
    "top_layers",
    "top_thickness_mm",
    "bottom_layers",
    "bottom_thickness_mm",
    "solid_below_mm2",
    "infill_density",
    "infill_pattern",
    "infill_angle_deg",
    "infill_anchor_mm",
    "infill_joint_mm",
    "ironing",
)
SPEEDS_OF_A_PLACE = (
    "outer_wall_speed_mm_s",
    "inner_wall_speed_mm_s",
    "small_wall_speed_mm_s",
    "overhang_75_speed_mm_s",
    "overhang_50_speed_mm_s",
    "overhang_25_speed_mm_s",
    "overhang_0_speed_mm_s",
    "gap_speed_mm_s",
    "skin_speed_mm_s",
    "top_skin_speed_mm_s",
    "ironing_speed_mm_s",
    "bridge_speed_mm_s",
    "infill_bridge_speed_mm_s",
    "infill_speed_mm_s",
)


class PartSettings(Frozen):
    """Process settings for one part only, by key."""

    part: int = Field(ge=1, le=MOST_PARTS, description="number of the part in print order")
    process: dict[str, Any] = Field(description="keys of the process and their values")

    @property
    def in_words(self) -> str:
        """The settings as a user would write them."""
        return ", ".join(f"{key} = {value}" for key, value in self.process.items())


def part_keys() -> list[str]:
    """The keys of a process that may differ between parts."""
    return [key for key in Process.model_fields if key not in OF_THE_PRINT]


def parse_part_settings(text: str) -> PartSettings:
    """The settings in `2:walls=4,infill_density=0.4`. Raises ProfileError if the text has another form."""
    number, colon, rest = text.partition(":")
    pairs = [pair.partition("=") for pair in rest.split(",")]
    known = colon and number.strip().isascii() and number.strip().isdigit() and 1 <= int(number.strip()[:9]) <= MOST_PARTS
    comma = re.search(r"=-?\d+,\d+(?=,|$)", rest)
    point = comma[0].replace(",", ".") if comma else ""
    if not known or not all(key.strip() and equals and value.strip() for key, equals, value in pairs):
        raise ProfileError(
            f"{option('part', text)}: PART:KEY=VALUE,... is expected, such as 2:walls=4,infill_density=40%; "
            f"PART is 1 to {MOST_PARTS}{'; numbers have a decimal point: ' + text.replace(comma[0], point) if comma else ''}"
        )
    values = {key.strip().removeprefix("process."): read_value(value.strip()) for key, _, value in pairs}
    return PartSettings(part=int(number), process=values)


def merge_part_settings(process: Process, given: Iterable[PartSettings], nozzle_mm: float) -> list[PartSettings]:
    """One entry per part, in print order, with values as in the process; later values override earlier ones.

    Raises ProfileError with every key that is unknown or holds for the whole print, and every value that is not allowed, also
    because of the nozzle diameter.
    """
    merged: dict[int, dict[str, Any]] = {}
    for settings in given:
        merged[settings.part] = merged.get(settings.part, {}) | settings.process
    problems = [
        f"part {part}: {problem}" for part in sorted(merged) for problem in _problems(process, part, merged[part], nozzle_mm)
    ]
    if problems:
        raise ProfileError("; ".join(problems))
    settled = {part: process_of_part(process, own).model_dump() for part, own in sorted(merged.items())}
    return [PartSettings(part=part, process={key: values[key] for key in merged[part]}) for part, values in settled.items()]


def process_of_part(process: Process, own: dict[str, Any]) -> Process:
    """The process with a part's own values. Raises ValidationError."""
    return Process.model_validate(process.model_dump() | own)


def _problems(process: Process, part: int, own: dict[str, Any], nozzle_mm: float) -> Iterable[str]:
    for key in own:
        if key in OF_THE_PRINT:
            yield (
                f"{key_name(f'process.{key}')} holds for the whole print: {phrase('for all', f'--set process.{key}=... sets it')}"
            )
        elif part == 1 and key in OF_PARTS_ON_PLASTIC:
            yield f"{key_name(f'process.{key}')} holds for parts that rest on plastic: part 1 rests on the build plate"
    yield from _value_problems(process, own, nozzle_mm)


def problems_of_place(process: Process, own: dict[str, Any], nozzle_mm: float) -> Iterable[str]:
    """The problems of values for a region of a layer, a sentence each."""
    for key in own:
        if key in Process.model_fields and key not in OF_A_PLACE + SPEEDS_OF_A_PLACE:
            yield (
                f"{key_name(f'process.{key}')} holds for a whole part: {', '.join(OF_A_PLACE)} and the speeds of walls, "
                "gaps, skins, ironing, "
                "bridges and infill are allowed"
            )
    if own.get("walls") == 0:
        yield f"{key_name('process.walls')} is 0: at least 1 is allowed"
    yield from _value_problems(process, own, nozzle_mm)


def _value_problems(process: Process, own: dict[str, Any], nozzle_mm: float) -> Iterable[str]:
    table = process.model_dump()
    problems, checked, replaced = table_problems(Process, "process.", table | own, table)
    yield from problems
    yield from without_replaced(unfit_for_nozzle(checked, nozzle_mm), replaced)
