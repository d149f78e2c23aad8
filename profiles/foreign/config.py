"""Config: the settings of another slicer by PrusaSlicer's keys, each with its name and text in the file.

The other programs use other names, which a table maps to PrusaSlicer's, so that one set of conversion rules serves all.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
OF_NOZZLE = "% of the nozzle"  # ends a width in percent of a nozzle whose diameter the file does not give
NOTHING = ("", "nil")  # PrusaSlicer's filament overrides are nil where the printer's value holds
NAMES = (  # in PrusaSlicer, OrcaSlicer and Cura; empty: PrusaSlicer's name, or none
    ("extrusion_width", "line_width", "line_width"),
    ("perimeter_extrusion_width", "inner_wall_line_width", "wall_line_width_x"),
    ("external_perimeter_extrusion_width", "outer_wall_line_width", "wall_line_width_0"),
    ("top_infill_extrusion_width", "top_surface_line_width", "roofing_line_width"),
    ("infill_extrusion_width", "sparse_infill_line_width", "infill_line_width"),
    ("solid_infill_extrusion_width", "internal_solid_infill_line_width", "skin_line_width"),
    ("support_material_extrusion_width", "support_line_width", "support_line_width"),
    ("first_layer_extrusion_width", "initial_layer_line_width", ""),
    ("first_layer_height", "initial_layer_print_height", "layer_height_0"),
    ("perimeters", "wall_loops", "wall_line_count"),
    ("only_one_perimeter_first_layer", "only_one_wall_first_layer", ""),
    ("fuzzy_skin_point_dist", "fuzzy_skin_point_distance", ""),
    ("before_layer_gcode", "before_layer_change_gcode", ""),
    ("layer_gcode", "layer_change_gcode", ""),
    ("top_solid_layers", "top_shell_layers", "top_layers"),
    ("bottom_solid_layers", "bottom_shell_layers", "bottom_layers"),
    ("top_solid_min_thickness", "top_shell_thickness", "top_thickness"),
    ("bottom_solid_min_thickness", "bottom_shell_thickness", "bottom_thickness"),
    ("gcode_resolution", "resolution", ""),
    ("fill_density", "sparse_infill_density", "infill_sparse_density"),
    ("fill_pattern", "sparse_infill_pattern", "infill_pattern"),
    ("top_fill_pattern", "top_surface_pattern", ""),
    ("bottom_fill_pattern", "bottom_surface_pattern", ""),
    ("fill_angle", "infill_direction", ""),
    ("solid_infill_below_area", "minimum_sparse_infill_area", "min_infill_area"),
    ("spiral_vase", "spiral_mode", "magic_spiralize"),
    ("brim_separation", "brim_object_gap", "brim_gap"),
    ("complete_objects", "print_sequence", "print_sequence"),
    ("skirts", "skirt_loops", "skirt_line_count"),
    ("bridge_flow_ratio", "bridge_flow", ""),
    ("ironing_flowrate", "ironing_flow", ""),
    ("avoid_crossing_perimeters", "reduce_crossing_wall", ""),
    ("external_perimeter_speed", "outer_wall_speed", "speed_wall_0"),
    ("perimeter_speed", "inner_wall_speed", "speed_wall_x"),
    ("solid_infill_speed", "internal_solid_infill_speed", "speed_topbottom"),
    ("top_solid_infill_speed", "top_surface_speed", "speed_roofing"),
    ("infill_speed", "sparse_infill_speed", "speed_infill"),
    ("gap_fill_speed", "gap_infill_speed", ""),
    ("support_material_speed", "support_speed", "speed_support"),
    ("support_material_interface_speed", "support_interface_speed", "speed_support_interface"),
    ("first_layer_speed", "initial_layer_speed", "speed_layer_0"),
    ("external_perimeter_acceleration", "outer_wall_acceleration", "acceleration_wall_0"),
    ("perimeter_acceleration", "inner_wall_acceleration", ""),
    ("infill_acceleration", "sparse_infill_acceleration", "acceleration_infill"),
    ("first_layer_acceleration", "initial_layer_acceleration", "acceleration_layer_0"),
    ("support_material", "enable_support", "support_enable"),
    ("support_material_threshold", "support_threshold_angle", ""),
    ("support_material_contact_distance", "support_top_z_distance", "support_top_distance"),
    ("support_material_bottom_contact_distance", "support_bottom_z_distance", "support_bottom_distance"),
    ("support_material_xy_spacing", "support_object_xy_distance", "support_xy_distance"),
    ("support_material_spacing", "support_base_pattern_spacing", ""),
    ("support_material_pattern", "support_base_pattern", ""),
    ("support_material_interface_layers", "support_interface_top_layers", ""),
    ("support_material_bottom_interface_layers", "support_interface_bottom_layers", ""),
    ("support_material_interface_spacing", "support_interface_spacing", ""),
    ("support_material_buildplate_only", "support_on_build_plate_only", "support_type"),
    ("support_material_style", "support_type", "support_structure"),
    ("temperature", "nozzle_temperature", "material_print_temperature"),
    ("first_layer_temperature", "nozzle_temperature_initial_layer", "material_print_temperature_layer_0"),
    ("extrusion_multiplier", "filament_flow_ratio", "material_flow"),
    ("max_fan_speed", "fan_max_speed", "cool_fan_speed_max"),
    ("min_fan_speed", "fan_min_speed", "cool_fan_speed_min"),
    ("fan_below_layer_time", "fan_cooling_layer_time", "cool_min_layer_time_fan_speed_max"),
    ("bridge_fan_speed", "overhang_fan_speed", ""),
    ("slowdown_below_layer_time", "slow_down_layer_time", "cool_min_layer_time"),
    ("min_print_speed", "slow_down_min_speed", "cool_min_speed"),
    ("cooling", "slow_down_for_layer_cooling", ""),
    ("disable_fan_first_layers", "close_fan_the_first_x_layers", ""),
    ("retract_length", "retraction_length", "retraction_amount"),
    ("retract_speed", "retraction_speed", "retraction_speed"),
    ("retract_before_travel", "retraction_minimum_travel", "retraction_min_travel"),
    ("retract_lift", "z_hop", "retraction_hop"),
    ("filament_retract_length", "filament_retraction_length", ""),
    ("filament_retract_speed", "filament_retraction_speed", ""),
    ("filament_retract_before_travel", "filament_retraction_minimum_travel", ""),
    ("filament_retract_lift", "filament_z_hop", ""),
    ("seam_position", "", "z_seam_type"),
    ("external_perimeters_first", "", "inset_direction"),
    ("external_perimeters_first", "", "outer_inset_first"),
    ("ironing", "", "ironing_enabled"),
    ("ironing_spacing", "", "ironing_line_spacing"),
    ("ironing_speed", "", "speed_ironing"),
    ("travel_speed", "", "speed_travel"),
    ("bridge_speed", "", "bridge_skin_speed"),
    ("default_acceleration", "", "acceleration_print"),
    ("travel_acceleration", "", "acceleration_travel"),
    ("raft_expansion", "", "raft_margin"),
    ("raft_expansion", "", "raft_surface_margin"),
    ("skirt_distance", "", "skirt_gap"),
    ("bed_temperature", "", "material_bed_temperature"),
    ("full_fan_speed_layer", "", "cool_fan_full_layer"),
    ("xy_contour_compensation", "", "xy_offset"),
    ("xy_hole_compensation", "", "hole_xy_offset"),
    ("nozzle_diameter", "", "machine_nozzle_size"),
    ("filament_diameter", "", "material_diameter"),
    ("filament_density", "", "material_density"),
    ("filament_type", "", "material_type"),
)
ORCASLICERS = {orcaslicers: key for key, orcaslicers, _ in NAMES if orcaslicers}
CURAS = {curas: key for key, _, curas in NAMES if curas}

Entry = tuple[str, str]  # name of a setting in its file, and its text as PrusaSlicer would write it


@dataclass(frozen=True)
class Config:
    """The content of a configuration file. entries: by PrusaSlicer's key; unknown: names in the file without a key; process,
    material: names of the presets, empty if the file has none. own: for entries whose text is not the file's, the text in the
    file, or the computed one where the file has none, and how it was computed, "" where the two are equivalent; read: names in
    the file that other entries are computed from.
    """

    program: str
    entries: Mapping[str, Entry]
    unknown: tuple[str, ...] = ()
    process: str = ""
    material: str = ""
    own: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    read: frozenset[str] = frozenset()

    def text(self, key: str) -> str | None:
        """The text of a key, for the first extruder of several; None if it is not set."""
        entry = self.entries.get(key)
        if entry is None:
            return None
        text = first_of(entry[1])
        return None if text in NOTHING else text

    def number(self, key: str) -> float | None:
        """The number of a key; None if it is not set, a percentage, or not a number."""
        return finite(self.text(key) or "")

    def share(self, key: str) -> float | None:
        """The percentage of a key as a share; None if it is not a percentage."""
        text = self.text(key)
        percent = finite(text[:-1]) if text is not None and text.endswith("%") else None
        return None if percent is None else percent / 100.0

    def flag(self, key: str) -> bool | None:
        """Whether a key is on."""
        text = self.text(key)
        return None if text is None else text.lower() in ("1", "true", "yes")


def without_still_fan(entries: dict[str, Entry]) -> dict[str, Entry]:
    """The settings of a program whose fan never stops above the first layers."""
    return entries | ({"fan_always_on": (entries["min_fan_speed"][0], "1")} if "min_fan_speed" in entries else {})


def first_filament(settings: Mapping[str, str]) -> str:
    """The name of the first filament's preset."""
    return settings.get("filament_settings_id", "").split(";")[0].strip().strip('"')


def finite(text: str) -> float | None:
    """The number in a text; None if it is not a number, or not finite."""
    stripped = text.strip()
    number = float(stripped) if NUMBER.fullmatch(stripped) else None
    return number if number is not None and isfinite(number) else None


def width_of_nozzle(text: str, nozzle: str) -> tuple[str, str]:
    """A line width given in percent of the nozzle, in mm, and how it was computed; ending in OF_NOZZLE if the nozzle is unknown;
    any other width unchanged.
    """
    first = first_of(text)
    percent = finite(first[:-1]) if first.endswith("%") else None
    if percent is None:
        return text, ""
    diameter_mm = finite(first_of(nozzle))
    if diameter_mm is None:
        return first[:-1] + OF_NOZZLE, ""
    return f"{percent / 100.0 * diameter_mm:g}", f"{percent:g} % of nozzle_diameter ({diameter_mm:g})"


def first_of(text: str) -> str:
    """The first extruder's value of a list; quoted texts are not split."""
    stripped = text.strip()
    if stripped.startswith('"'):
        return stripped
    numbers = [NUMBER.fullmatch(item.strip().removesuffix("%")) or item.strip() in NOTHING for item in stripped.split(",")]
    return stripped.split(",")[0].strip() if all(numbers) else stripped
