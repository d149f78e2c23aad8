"""OrcaSlicer's and Bambu Studio's files: JSON presets that inherit from files beside them, and the settings in a G-code file.

Keys and what percentages are of: OrcaSlicer, src/libslic3r/PrintConfig.cpp. Line widths in percent are of the nozzle, where
PrusaSlicer's are of the layer's height.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from profiles.errors import ProfileError, reason
from profiles.foreign.config import Config, Entry, width_of_nozzle

PROGRAM = "OrcaSlicer"
TYPES = {"process": "process", "filament": "material", "machine": "printer"}
ABOUT = (
    *("type", "name", "from", "inherits", "instantiation", "setting_id", "filament_id", "version", "is_custom_defined"),
    *("compatible_printers", "compatible_prints", "compatible_printers_condition", "compatible_prints_condition"),
)
WIDTHS = {
    "line_width": "extrusion_width",
    "inner_wall_line_width": "perimeter_extrusion_width",
    "outer_wall_line_width": "external_perimeter_extrusion_width",
    "top_surface_line_width": "top_infill_extrusion_width",
    "sparse_infill_line_width": "infill_extrusion_width",
    "internal_solid_infill_line_width": "solid_infill_extrusion_width",
    "support_line_width": "support_material_extrusion_width",
    "initial_layer_line_width": "first_layer_extrusion_width",
}
KEYS = {
    **WIDTHS,
    "initial_layer_print_height": "first_layer_height",
    "wall_loops": "perimeters",
    "only_one_wall_first_layer": "only_one_perimeter_first_layer",
    "fuzzy_skin_point_distance": "fuzzy_skin_point_dist",
    "before_layer_change_gcode": "before_layer_gcode",
    "layer_change_gcode": "layer_gcode",
    "top_shell_layers": "top_solid_layers",
    "bottom_shell_layers": "bottom_solid_layers",
    "top_shell_thickness": "top_solid_min_thickness",
    "bottom_shell_thickness": "bottom_solid_min_thickness",
    "resolution": "gcode_resolution",
    "sparse_infill_density": "fill_density",
    "sparse_infill_pattern": "fill_pattern",
    "top_surface_pattern": "top_fill_pattern",
    "bottom_surface_pattern": "bottom_fill_pattern",
    "infill_direction": "fill_angle",
    "minimum_sparse_infill_area": "solid_infill_below_area",
    "spiral_mode": "spiral_vase",
    "brim_object_gap": "brim_separation",
    "print_sequence": "complete_objects",
    "skirt_loops": "skirts",
    "bridge_flow": "bridge_flow_ratio",
    "ironing_flow": "ironing_flowrate",
    "reduce_crossing_wall": "avoid_crossing_perimeters",
    "outer_wall_speed": "external_perimeter_speed",
    "inner_wall_speed": "perimeter_speed",
    "internal_solid_infill_speed": "solid_infill_speed",
    "top_surface_speed": "top_solid_infill_speed",
    "sparse_infill_speed": "infill_speed",
    "gap_infill_speed": "gap_fill_speed",
    "support_speed": "support_material_speed",
    "support_interface_speed": "support_material_interface_speed",
    "initial_layer_speed": "first_layer_speed",
    "outer_wall_acceleration": "external_perimeter_acceleration",
    "inner_wall_acceleration": "perimeter_acceleration",
    "sparse_infill_acceleration": "infill_acceleration",
    "initial_layer_acceleration": "first_layer_acceleration",
    "enable_support": "support_material",
    "support_threshold_angle": "support_material_threshold",
    "support_top_z_distance": "support_material_contact_distance",
    "support_bottom_z_distance": "support_material_bottom_contact_distance",
    "support_object_xy_distance": "support_material_xy_spacing",
    "support_base_pattern_spacing": "support_material_spacing",
    "support_base_pattern": "support_material_pattern",
    "support_interface_top_layers": "support_material_interface_layers",
    "support_interface_bottom_layers": "support_material_bottom_interface_layers",
    "support_interface_spacing": "support_material_interface_spacing",
    "support_on_build_plate_only": "support_material_buildplate_only",
    "support_type": "support_material_style",
    "nozzle_temperature": "temperature",
    "nozzle_temperature_initial_layer": "first_layer_temperature",
    "filament_flow_ratio": "extrusion_multiplier",
    "fan_max_speed": "max_fan_speed",
    "fan_min_speed": "min_fan_speed",
    "fan_cooling_layer_time": "fan_below_layer_time",
    "overhang_fan_speed": "bridge_fan_speed",
    "slow_down_layer_time": "slowdown_below_layer_time",
    "slow_down_min_speed": "min_print_speed",
    "slow_down_for_layer_cooling": "cooling",
    "close_fan_the_first_x_layers": "disable_fan_first_layers",
    "retraction_length": "retract_length",
    "retraction_speed": "retract_speed",
    "retraction_minimum_travel": "retract_before_travel",
    "z_hop": "retract_lift",
    "filament_retraction_length": "filament_retract_length",
    "filament_retraction_speed": "filament_retract_speed",
    "filament_retraction_minimum_travel": "filament_retract_before_travel",
    "filament_z_hop": "filament_retract_lift",
}
WORDS = {  # values that are called otherwise
    "fill_pattern": {"zig-zag": "rectilinear", "tri-hexagon": "stars"},
    "top_fill_pattern": {"zig-zag": "rectilinear"},
    "bottom_fill_pattern": {"zig-zag": "rectilinear"},
    "complete_objects": {"by layer": "0", "by object": "1"},
    "seam_position": {"back": "rear", "aligned_back": "rear"},
    "support_material_pattern": {"default": "rectilinear"},
}
PLATES = {  # the bed that Bambu Studio and OrcaSlicer heat is that of the plate that lies on it
    "Cool Plate": "cool_plate_temp",
    "Engineering Plate": "eng_plate_temp",
    "High Temp Plate": "hot_plate_temp",
    "Textured PEI Plate": "textured_plate_temp",
}


def read_preset(file: Path, document: Mapping[str, Any]) -> Config:
    """A JSON preset with what it inherits from files beside it. Raises ProfileError."""
    values, missing = _inherited(file, document, ())
    values.setdefault("nozzle_diameter", _nozzle(file, document))
    name, kind = str(document.get("name", file.stem)), TYPES.get(str(document.get("type", "")), "")
    config = of_values(values, name if kind == "process" else "", name if kind == "material" else "")
    return config if not missing else Config(config.program, config.entries, (*config.unknown, missing), name, name)


def of_values(values: Mapping[str, str], process: str = "", material: str = "") -> Config:
    """Settings under OrcaSlicer's names."""
    entries: dict[str, Entry] = {}
    for name, text in values.items():
        key = KEYS.get(name, name)
        entries[key] = Entry(name, _said(key, name, text, values))
    plate = PLATES.get(values.get("curr_bed_type", ""), "hot_plate_temp")
    if plate in values:
        entries["bed_temperature"] = Entry(plate, values[plate])
    if "min_fan_speed" in entries:  # the fan never stands still above the first layers
        entries["fan_always_on"] = Entry(entries["min_fan_speed"].name, "1")
    return Config(PROGRAM, entries, (), process or values.get("print_settings_id", ""), material or _own(values))


def values_of(document: Mapping[str, Any]) -> dict[str, str]:
    """The settings of a preset or a slicer file as texts."""
    return {key: _text(value) for key, value in document.items() if key not in ABOUT}


def _own(values: Mapping[str, str]) -> str:
    return values.get("filament_settings_id", "").split(";")[0].strip('"')


def _said(key: str, name: str, text: str, values: Mapping[str, str]) -> str:
    """A value as PrusaSlicer would say it."""
    if name in WIDTHS:
        return width_of_nozzle(text, values.get("nozzle_diameter", ""))
    return WORDS.get(key, {}).get(text, text)


def _inherited(file: Path, document: Mapping[str, Any], below: tuple[Path, ...]) -> tuple[dict[str, str], str]:
    """All settings of a preset, and the name of a parent that no file beside it has (its settings are then unknown)."""
    own = values_of(document)
    parent = str(document.get("inherits", "") or "")
    if not parent:
        return own, ""
    beside = next((path for path in _beside(file) if path.stem == parent), None)
    if beside is None:
        return own, f"inherits {parent}"
    if beside in (file, *below):
        raise ProfileError(f"profile {file}: inherits itself by way of {parent}")
    values, missing = _inherited(beside, read_json(beside), (*below, file))
    return values | own, missing


def _nozzle(file: Path, document: Mapping[str, Any]) -> str:
    """The nozzle of the printers that a preset is for, by their files beside it; "" where there are none, or they differ."""
    printers, beside = document.get("compatible_printers"), {path.stem: path for path in reversed(_beside(file))}
    found = [beside[name] for name in printers if name in beside] if isinstance(printers, list) else []
    nozzles = {_inherited(printer, read_json(printer), ())[0].get("nozzle_diameter", "") for printer in found}
    return nozzles.pop() if len(nozzles) == 1 else ""


def _beside(file: Path) -> list[Path]:
    """The files that a parent or a printer may be in: of the same folder, of those beside and above it that hold profiles, and of
    a person's own preset in user/NAME/process those of the vendors in system/NAME/process."""
    above = file.parent.parent
    return [
        *sorted(file.parent.glob("*.json")),
        *sorted(above.glob("*/*.json")),
        *sorted(above.glob("*.json")),
        *(sorted((above.parent.parent / "system").glob("*/*/*.json")) if above.parent.name == "user" else ()),
    ]


def read_json(file: Path) -> Mapping[str, Any]:
    """The table of a JSON file. Raises ProfileError."""
    try:
        document = json.loads(file.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ProfileError(f"profile {file}: cannot be read ({reason(error)})") from None
    except (ValueError, RecursionError) as error:
        raise ProfileError(f"profile {file}: is no JSON ({error})") from None
    if not isinstance(document, dict):
        raise ProfileError(f"profile {file}: is no table of settings")
    return document


def _text(value: object) -> str:
    """A value of a preset: texts, or lists of one text an extruder."""
    if isinstance(value, list):
        return ",".join(str(item) for item in value)
    return str(value)
