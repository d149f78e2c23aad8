"""Rules: the conversion of another slicer's print and filament settings to keys of a process and a material."""

import re
from math import pi

from profiles.foreign.config import Config
from profiles.foreign.conversion import (
    AUTO_NARROW,
    NO_NUMBER,
    Convert,
    Converted,
    above_zero,
    always,
    by_flag,
    density,
    flag,
    number,
    one_of,
    part_of,
    share,
    unless_off,
    whole,
    width,
)

Rule = tuple[str, str, Convert]  # our key, "" if there is none; PrusaSlicer's; the conversion
FIRMWARE = "the firmware's own"
AUTO = "as fast as the plastic melts; ours stays"
SMALL_WALL = always(round(2.0 * pi * 6.5, 2), "a radius of 6.5 mm")  # length of walls that PrusaSlicer calls small
PATTERNS = {
    **dict.fromkeys(("rectilinear", "alignedrectilinear", "line"), "rectilinear"),
    **dict.fromkeys(("cubic", "adaptivecubic", "supportcubic"), "cubic"),
    **dict.fromkeys(("triangles", "stars"), "triangles"),
    **dict.fromkeys(("honeycomb", "3dhoneycomb"), "honeycomb"),
    **{name: name for name in ("grid", "gyroid", "concentric", "lightning")},
}
SKINS = {
    **dict.fromkeys(("monotonic", "monotoniclines", "monotonicline"), "monotonic"),
    **dict.fromkeys(("rectilinear", "alignedrectilinear"), "rectilinear"),
    "concentric": "concentric",
}
STYLES = {
    "grid": "grid",
    "snug": "grid",
    "organic": "tree",
    "tree": "tree",
    "normal(auto)": "grid",
    "normal(manual)": "grid",
    "tree(auto)": "tree",
    "tree(manual)": "tree",
}
FILLS = {"rectilinear": "lines", "rectilinear-grid": "grid"}
ADVANCE = re.compile(r"^(?:M900 K|M572 (?:D\d+ )?S|SET_PRESSURE_ADVANCE (?:EXTRUDER=\S+ )?ADVANCE=)(\d+\.?\d*|\.\d+)(?![\d.])")
BASES = {"PLA": "pla", "PETG": "petg", "PET": "petg", "ABS": "abs", "ASA": "abs", "TPU": "tpu", "FLEX": "tpu", "TPE": "tpu"}
USUAL_BASE = "pla"
FAN_LEAST = unless_off("fan_always_on", (0.0, "fan_always_on is off: long layers have none"), share)
PRESSURE = unless_off("enable_pressure_advance", (None, "enable_pressure_advance is off"), number)
GCODE = "G-code blocks belong to the machine"


def base_of(config: Config) -> tuple[str, str]:
    """The shipped material to inherit, and the type of material in the file."""
    kind = (config.text("filament_type") or "").strip('"').upper()
    return next((BASES[word] for word in re.split(r"[^A-Z]+", kind) if word in BASES), USUAL_BASE), kind


def _first_layer_infill_speed(config: Config, key: str) -> Converted:
    """The speed of skins in the first layer; only if it is a percentage does it differ from other lines."""
    if config.share(key) is None:
        return None, "one speed for all lines"
    return part_of("solid_infill_speed")(config, key)


def _first_layer_width(config: Config, key: str) -> Converted:
    """The first layer's line width; 0 uses the widths of the other layers."""
    return (None, "0: as elsewhere") if config.number(key) == 0.0 else part_of("first_layer_height")(config, key)


def _steepest(config: Config, key: str) -> Converted:
    """The steepest overhang from the printing direction; other slicers count from the horizontal."""
    threshold = config.number(key)
    if threshold is None:
        return NO_NUMBER
    return (None, "0: found by the slicer") if threshold == 0.0 else (90.0 - threshold, f"90 less {threshold:g}")


def _found_by_the_slicer(config: Config, key: str) -> Converted:
    """A number; if negative, the slicer computes it."""
    below = (config.number(key) or 0.0) < 0.0
    return (None, "below 0: computed by the slicer; ours stays") if below else number(config, key)


def _same_as_top(key_above: str, same: float, convert: Convert) -> Convert:
    """A number; one value of it means the value of another key."""

    def converted(config: Config, key: str) -> Converted:
        value = config.number(key)
        above = config.number(key_above)
        if value == same and above is not None:
            return round(above) if float(above).is_integer() and convert is whole else above, f"as {key_above}"
        return convert(config, key)

    return converted


def _one_wall_top(config: Config, key: str) -> Converted:
    wanted = config.text(key)
    return wanted != "none", "on all tops" if wanted == "topmost" else ""


def _brim(config: Config, key: str) -> Converted:
    return (0.0, "brim_type is no_brim") if config.text("brim_type") == "no_brim" else number(config, key)


def _ironing(config: Config, key: str) -> Converted:
    return config.text("ironing_type") != "no ironing" and (bool(config.flag(key)) or key == "ironing_type"), ""


def _holes_of_all(config: Config, key: str) -> Converted:
    grown = config.number(key)
    return NO_NUMBER if grown is None else (-grown or 0.0, "what grows outside closes holes")


def _overhang(percent_on_plastic: str) -> Convert:
    """Speed at an overhang: PrusaSlicer's values hold at one share of the line on plastic, ours up to the next; 0 is off."""

    def convert(config: Config, key: str) -> Converted:
        value, how = part_of("external_perimeter_speed", "not slowed down there; ours stays")(config, key)
        return value, how or percent_on_plastic

    off: Converted = (None, "overhangs are not slowed down there; ours stays")
    return unless_off("enable_dynamic_overhang_speeds", off, unless_off("enable_overhang_speed", off, convert))


def _fan_most(config: Config, key: str) -> Converted:
    """Greatest fan speed: if nothing is cooled by layer time, the least one."""
    if config.flag("cooling") is False and config.text("fan_always_on") is not None:
        least, how = FAN_LEAST(config, "min_fan_speed")
        return least, how if least is None else "cooling is off: the fan stays at its least"
    return share(config, key)


def _bridge_fan(config: Config, key: str) -> Converted:
    """Fan speed over bridges; in SuperSlicer a negative value means the usual one."""
    return (None, "below 0: as elsewhere") if (config.number(key) or 0.0) < 0.0 else share(config, key)


def _override(own: str, convert: Convert = number) -> Convert:
    """The filament's own value if it has one, else the printer's."""

    def converted(config: Config, key: str) -> Converted:
        if config.text(own) is None:
            return convert(config, key)
        value, how = convert(config, own)
        return value, how if value is None else f"the filament's own {own}"

    return converted


def _advance(config: Config, key: str) -> Converted:
    """Pressure advance from a filament's G-code, if no line contradicts it."""
    blocks = (config.text(key) or "").strip('"').replace("\\n", "\n").split("\n")
    found = [match[1] for line in blocks if (match := ADVANCE.match(line.split(";")[0].strip()))]
    if found:
        return float(found[-1]), "out of the filament's G-code"
    asks = any(word in line for line in blocks for word in ("M900", "M572", "SET_PRESSURE_ADVANCE"))
    return None, "sets pressure advance on a condition: look at it, and set material.pressure_advance" if asks else GCODE


def _wipe(config: Config, key: str) -> Converted:
    if config.flag(key) is False:
        return 0.0, "off"
    distance = config.number("wipe_distance")
    return (None, "on: how far is ours") if distance is None else (distance, "wipe_distance")


PROCESS_RULES: tuple[Rule, ...] = (
    ("process.layer_height_mm", "layer_height", number),
    ("", "before_layer_gcode", always(None, "is the machine's here: machine.gcode.before_layer")),
    ("", "layer_gcode", always(None, "is the machine's here: machine.gcode.before_layer")),
    ("process.first_layer_height_mm", "first_layer_height", part_of("layer_height")),
    ("process.least_layer_height_mm", "min_layer_height", above_zero("by the nozzle")),
    ("process.most_layer_height_mm", "max_layer_height", above_zero("by the nozzle")),
    ("process.line_width_mm", "perimeter_extrusion_width", width()),
    ("process.outer_wall_line_width_mm", "external_perimeter_extrusion_width", width()),
    ("process.top_skin_line_width_mm", "top_infill_extrusion_width", width(auto=AUTO_NARROW)),
    ("process.infill_line_width_mm", "infill_extrusion_width", width()),
    ("process.support_line_width_mm", "support_material_extrusion_width", width(auto=AUTO_NARROW)),
    ("process.first_layer_line_width_mm", "first_layer_extrusion_width", _first_layer_width),
    ("", "solid_infill_extrusion_width", always(None, "skins are as wide as process.line_width_mm")),
    ("process.walls", "perimeters", whole),
    ("process.top_layers", "top_solid_layers", whole),
    ("process.bottom_layers", "bottom_solid_layers", whole),
    ("process.top_thickness_mm", "top_solid_min_thickness", number),
    ("process.bottom_thickness_mm", "bottom_solid_min_thickness", number),
    ("process.only_one_wall_top", "top_one_perimeter_type", _one_wall_top),
    ("process.only_one_wall_top", "only_one_wall_top", flag),
    ("process.only_one_wall_first_layer", "only_one_perimeter_first_layer", flag),
    ("process.gap_least_mm", "gap_fill_enabled", by_flag((None, "on: as here"), (1000.0, "off: no gap is so long"))),
    ("process.gap_least_mm", "filter_out_gap_fill", number),
    ("process.fuzzy_skin", "fuzzy_skin", one_of({name: name for name in ("none", "external", "all", "allwalls")})),
    ("process.fuzzy_skin_thickness_mm", "fuzzy_skin_thickness", number),
    ("process.fuzzy_skin_point_distance_mm", "fuzzy_skin_point_dist", number),
    ("process.wall_order", "external_perimeters_first", by_flag(("outer-first", ""), ("inner-first", ""))),
    ("process.seam", "seam_position", one_of({name: name for name in ("aligned", "rear", "nearest", "random")})),
    ("process.spiral_vase", "spiral_vase", flag),
    ("process.slit_closing_mm", "slice_closing_radius", number),
    ("process.resolution_mm", "gcode_resolution", number),
    ("process.elephant_foot_mm", "elefant_foot_compensation", number),
    ("process.outline_compensation_mm", "xy_size_compensation", number),
    ("process.hole_compensation_mm", "xy_size_compensation", _holes_of_all),
    ("process.outline_compensation_mm", "xy_contour_compensation", number),
    ("process.hole_compensation_mm", "xy_hole_compensation", number),
    ("process.infill_density", "fill_density", share),
    ("process.infill_pattern", "fill_pattern", one_of(PATTERNS)),
    ("process.infill_angle_deg", "fill_angle", number),
    ("process.top_skin_pattern", "top_fill_pattern", one_of(SKINS)),
    ("process.bottom_skin_pattern", "bottom_fill_pattern", one_of(SKINS)),
    ("process.skin_angle_deg", "solid_infill_direction", number),
    ("process.solid_below_mm2", "solid_infill_below_area", number),
    ("process.infill_anchor_mm", "infill_anchor", part_of("infill_extrusion_width")),
    ("process.infill_joint_mm", "infill_anchor_max", part_of("infill_extrusion_width")),
    ("", "infill_overlap", always(None, "is counted from another edge there; ours stays")),
    ("process.ironing", "ironing", _ironing),
    ("process.ironing", "ironing_type", _ironing),
    ("process.ironing_flow", "ironing_flowrate", share),
    ("process.ironing_spacing_mm", "ironing_spacing", number),
    ("process.ironing_speed_mm_s", "ironing_speed", number),
    ("process.bridge_flow", "bridge_flow_ratio", number),
    ("process.bridge_angle_deg", "bridge_angle", number),
    ("process.thick_bridges", "thick_bridges", flag),
    ("process.complete_objects", "complete_objects", flag),
    ("process.skirt_loops", "skirts", whole),
    ("process.skirt_distance_mm", "skirt_distance", number),
    ("process.brim_mm", "brim_width", _brim),
    ("process.brim_gap_mm", "brim_separation", number),
    ("process.raft_layers", "raft_layers", whole),
    ("process.raft_contact_distance_mm", "raft_contact_distance", number),
    ("process.raft_expansion_mm", "raft_expansion", number),
    ("process.raft_first_layer_density", "raft_first_layer_density", share),
    ("process.raft_first_layer_expansion_mm", "raft_first_layer_expansion", _found_by_the_slicer),
    ("process.first_layer_speed_over_raft_mm_s", "first_layer_speed_over_raft", part_of("perimeter_speed", AUTO)),
    ("", "support_material", always(None, "parts that need support have it: process.support is auto")),
    ("process.self_supporting_angle_deg", "support_material_threshold", _steepest),
    ("process.support_style", "support_material_style", one_of(STYLES)),
    ("process.support_on_part", "support_material_buildplate_only", by_flag((False, ""), (True, ""))),
    ("process.support_pattern", "support_material_pattern", one_of(FILLS)),
    ("process.support_density", "support_material_spacing", density("support_material_extrusion_width")),
    ("process.support_interface_layers", "support_material_interface_layers", whole),
    (
        "process.support_bottom_interface_layers",
        "support_material_bottom_interface_layers",
        _same_as_top("support_material_interface_layers", -1.0, whole),
    ),
    ("process.support_interface_density", "support_material_interface_spacing", density("support_material_extrusion_width")),
    ("process.support_gap_mm", "support_material_contact_distance", number),
    (
        "process.support_bottom_gap_mm",
        "support_material_bottom_contact_distance",
        _same_as_top("support_material_contact_distance", 0.0, number),
    ),
    ("process.support_distance_mm", "support_material_xy_spacing", part_of("external_perimeter_extrusion_width")),
    ("process.inner_wall_speed_mm_s", "perimeter_speed", above_zero(AUTO)),
    ("process.outer_wall_speed_mm_s", "external_perimeter_speed", part_of("perimeter_speed", AUTO)),
    ("process.skin_speed_mm_s", "solid_infill_speed", part_of("infill_speed", AUTO)),
    ("process.top_skin_speed_mm_s", "top_solid_infill_speed", part_of("solid_infill_speed", AUTO)),
    ("process.infill_speed_mm_s", "infill_speed", above_zero(AUTO)),
    ("process.gap_speed_mm_s", "gap_fill_speed", above_zero("gaps are not filled there; here they are")),
    ("process.bridge_speed_mm_s", "bridge_speed", above_zero(AUTO)),
    ("process.infill_bridge_speed_mm_s", "bridge_speed", above_zero(AUTO)),
    ("process.support_speed_mm_s", "support_material_speed", above_zero(AUTO)),
    ("process.support_interface_speed_mm_s", "support_material_interface_speed", part_of("support_material_speed", AUTO)),
    ("process.first_layer_speed_mm_s", "first_layer_speed", part_of("perimeter_speed")),
    ("process.first_layer_infill_speed_mm_s", "first_layer_speed", _first_layer_infill_speed),
    ("process.first_layer_infill_speed_mm_s", "initial_layer_infill_speed", above_zero(AUTO)),
    ("process.small_wall_speed_mm_s", "small_perimeter_speed", part_of("perimeter_speed", AUTO)),
    (
        "process.small_wall_mm",
        "small_perimeter_speed",
        SMALL_WALL,
    ),
    ("process.overhang_75_speed_mm_s", "overhang_speed_2", _overhang("from 50 % on plastic")),
    ("process.overhang_50_speed_mm_s", "overhang_speed_1", _overhang("from 25 % on plastic")),
    ("process.overhang_25_speed_mm_s", "overhang_speed_0", _overhang("from nothing on plastic")),
    ("process.overhang_75_speed_mm_s", "overhang_2_4_speed", _overhang("25 to 50 % overhang")),
    ("process.overhang_50_speed_mm_s", "overhang_3_4_speed", _overhang("50 to 75 % overhang")),
    ("process.overhang_25_speed_mm_s", "overhang_4_4_speed", _overhang("from 75 % overhang")),
    ("process.travel_speed_mm_s", "travel_speed", above_zero(AUTO)),
    ("process.lift_speed_mm_s", "travel_speed_z", above_zero("as travels; ours stays")),
    ("process.retract_travel_mm", "retract_before_travel", number),
    ("process.lift_mm", "retract_lift", number),
    ("process.combing", "avoid_crossing_perimeters", by_flag((True, ""), (None, "off: travels here go round by default"))),
    ("process.acceleration_mm_s2", "default_acceleration", above_zero(FIRMWARE)),
    ("process.outer_wall_acceleration_mm_s2", "external_perimeter_acceleration", part_of("default_acceleration", FIRMWARE)),
    ("process.outer_wall_acceleration_mm_s2", "perimeter_acceleration", part_of("default_acceleration", FIRMWARE)),
    ("process.infill_acceleration_mm_s2", "infill_acceleration", part_of("default_acceleration", FIRMWARE)),
    ("process.bridge_acceleration_mm_s2", "bridge_acceleration", part_of("external_perimeter_acceleration", FIRMWARE)),
    ("process.first_layer_acceleration_mm_s2", "first_layer_acceleration", part_of("default_acceleration", FIRMWARE)),
    ("process.travel_acceleration_mm_s2", "travel_acceleration", part_of("default_acceleration", FIRMWARE)),
    ("process.least_layer_time_s", "slowdown_below_layer_time", unless_off("cooling", (0.0, "cooling is off"), number)),
    ("process.least_speed_mm_s", "min_print_speed", above_zero("no slower limit")),
)
MATERIAL_RULES: tuple[Rule, ...] = (
    ("material.diameter_mm", "filament_diameter", number),
    ("material.density_g_cm3", "filament_density", above_zero("not given")),
    ("material.price_per_kg", "filament_cost", above_zero("not given")),
    ("material.nozzle_c", "temperature", number),
    ("material.first_layer_nozzle_c", "first_layer_temperature", number),
    ("material.bed_c", "bed_temperature", number),
    ("material.flow", "extrusion_multiplier", number),
    ("material.fan", "max_fan_speed", _fan_most),
    ("material.fan_least", "min_fan_speed", FAN_LEAST),
    ("material.fan_layer_time_s", "fan_below_layer_time", above_zero("no layer is cooled by its time")),
    ("material.fan_bridge", "bridge_fan_speed", _bridge_fan),
    ("material.fan_off_layers", "disable_fan_first_layers", whole),
    ("material.fan_full_layer", "full_fan_speed_layer", whole),
    ("material.retract_mm", "retract_length", _override("filament_retract_length")),
    ("material.retract_speed_mm_s", "retract_speed", _override("filament_retract_speed", above_zero(FIRMWARE))),
    ("material.retract_prime_extra_mm", "retract_restart_extra", _override("filament_retract_restart_extra")),
    ("material.wipe_mm", "wipe", _wipe),
    ("material.volumetric_limit_mm3_s", "filament_max_volumetric_speed", above_zero("no limit; ours stays")),
    ("material.pressure_advance", "start_filament_gcode", _advance),
    (
        "material.pressure_advance",
        "pressure_advance",
        PRESSURE,
    ),
)
