"""Process rules: what of another slicer's print settings becomes which key of a process."""

from math import pi

from profiles.foreign.config import Config
from profiles.foreign.conversion import (
    AUTO_NARROW,
    Convert,
    Converted,
    Left,
    Value,
    above_zero,
    density,
    flag,
    left,
    number,
    one_of,
    part_of,
    share,
    whole,
    width,
)

FIRMWARE = "the firmware's own"
AUTO = "as fast as the plastic melts; ours stays"
SMALL_RADIUS_MM = 6.5  # of the walls that PrusaSlicer calls small
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
SEAMS = {"aligned": "aligned", "rear": "rear", "nearest": "nearest", "random": "random"}
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


def _first_layer_infill_speed(config: Config, key: str) -> Converted:
    """Only where the first layer's speed is a percentage do its skins have one of their own."""
    if config.share(key) is None:
        return Left("one speed for all lines")
    return part_of("solid_infill_speed")(config, key)


def _first_layer_width(config: Config, key: str) -> Converted:
    """0 is as elsewhere, by kind of line."""
    if config.number(key) == 0.0:
        return Left("0: as elsewhere")
    return part_of("first_layer_height")(config, key)


def _steepest(config: Config, key: str) -> Converted:
    """From the printing direction, where the others count from the horizontal."""
    threshold = config.number(key)
    if threshold is None:
        return Left("is no number")
    return Left("0: found by the slicer") if threshold == 0.0 else Value(90.0 - threshold, f"90 less {threshold:g}")


def _found_by_the_slicer(config: Config, key: str) -> Converted:
    """A number, below 0 where the slicer works it out."""
    converted = number(config, key)
    below = isinstance(converted, Value) and isinstance(converted.value, float) and converted.value < 0.0
    return Left("below 0: worked out by the slicer; ours stays") if below else converted


def _support_density(config: Config, key: str) -> Converted:
    filled = density(key, "support_material_extrusion_width")(config)
    return Left("needs a width and a layer height") if filled is None else Value(filled, "lines that far apart")


def _same_as_top(key_above: str, same: float) -> Convert:
    """A number where one value of it means: as above."""

    def convert(config: Config, key: str) -> Converted:
        value = config.number(key)
        above = config.number(key_above)
        if value == same and above is not None:
            return Value(round(above) if float(above).is_integer() and "layers" in key else above, f"as {key_above}")
        return number(config, key) if "layers" not in key else whole(config, key)

    return convert


def _on_part(config: Config, key: str) -> Converted:
    return Value(not config.flag(key))


def _wall_order(config: Config, key: str) -> Converted:
    return Value("outer-first" if config.flag(key) else "inner-first", "" if config.flag(key) is not None else "off")


def _one_wall_top(config: Config, key: str) -> Converted:
    wanted = config.text(key)
    return Value(wanted != "none", "on all tops" if wanted == "topmost" else "")


def _gap_fill(config: Config, key: str) -> Converted:
    return Left("on: as here") if config.flag(key) else Value(1000.0, "off: no gap is so long")


def _brim(config: Config, key: str) -> Converted:
    if config.text("brim_type") == "no_brim":
        return Value(0.0, "brim_type is no_brim")
    return number(config, key)


def _ironing(config: Config, key: str) -> Converted:
    if config.text("ironing_type") == "no ironing":
        return Value(False)
    return Value(bool(config.flag(key)) or key == "ironing_type")


def _holes_of_all(config: Config, key: str) -> Converted:
    grown = config.number(key)
    return Left("is no number") if grown is None else Value(-grown or 0.0, "what grows outside closes holes")


def _only_on(why: str) -> Convert:
    return lambda config, key: Value(True) if config.flag(key) else Left(why)


def _small_wall(config: Config, key: str) -> Converted:
    del config, key
    return Value(round(2.0 * pi * SMALL_RADIUS_MM, 2), f"a radius of {SMALL_RADIUS_MM:g} mm")


def _overhang(percent_on_plastic: str) -> Convert:
    """PrusaSlicer's speeds by what is on plastic hold at one share, ours from there to the next; 0 is off."""

    def convert(config: Config, key: str) -> Converted:
        if config.flag("enable_dynamic_overhang_speeds") is False or config.flag("enable_overhang_speed") is False:
            return Left("overhangs are not slowed down there; ours stays")
        converted = part_of("external_perimeter_speed", "not slowed down there; ours stays")(config, key)
        return Value(converted.value, converted.how or percent_on_plastic) if isinstance(converted, Value) else converted

    return convert


def _layer_time(config: Config, key: str) -> Converted:
    if config.flag("cooling") is False:
        return Value(0.0, "cooling is off")
    return number(config, key)


RULES: tuple[tuple[str, str, Convert], ...] = (
    ("process.layer_height_mm", "layer_height", number),
    ("", "before_layer_gcode", left("is the machine's here: machine.gcode.before_layer")),
    ("", "layer_gcode", left("is the machine's here: machine.gcode.before_layer")),
    ("process.first_layer_height_mm", "first_layer_height", part_of("layer_height")),
    ("process.least_layer_height_mm", "min_layer_height", above_zero("by the nozzle")),
    ("process.most_layer_height_mm", "max_layer_height", above_zero("by the nozzle")),
    ("process.line_width_mm", "perimeter_extrusion_width", width()),
    ("process.outer_wall_line_width_mm", "external_perimeter_extrusion_width", width()),
    ("process.top_skin_line_width_mm", "top_infill_extrusion_width", width(auto=AUTO_NARROW)),
    ("process.infill_line_width_mm", "infill_extrusion_width", width()),
    ("process.support_line_width_mm", "support_material_extrusion_width", width(auto=AUTO_NARROW)),
    ("process.first_layer_line_width_mm", "first_layer_extrusion_width", _first_layer_width),
    ("", "solid_infill_extrusion_width", left("skins are as wide as process.line_width_mm")),
    ("process.walls", "perimeters", whole),
    ("process.top_layers", "top_solid_layers", whole),
    ("process.bottom_layers", "bottom_solid_layers", whole),
    ("process.top_thickness_mm", "top_solid_min_thickness", number),
    ("process.bottom_thickness_mm", "bottom_solid_min_thickness", number),
    ("process.only_one_wall_top", "top_one_perimeter_type", _one_wall_top),
    ("process.only_one_wall_top", "only_one_wall_top", flag),
    ("process.only_one_wall_first_layer", "only_one_perimeter_first_layer", flag),
    ("process.gap_least_mm", "gap_fill_enabled", _gap_fill),
    ("process.gap_least_mm", "filter_out_gap_fill", number),
    ("process.fuzzy_skin", "fuzzy_skin", one_of({name: name for name in ("none", "external", "all", "allwalls")})),
    ("process.fuzzy_skin_thickness_mm", "fuzzy_skin_thickness", number),
    ("process.fuzzy_skin_point_distance_mm", "fuzzy_skin_point_dist", number),
    ("process.wall_order", "external_perimeters_first", _wall_order),
    ("process.seam", "seam_position", one_of(SEAMS)),
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
    ("", "infill_overlap", left("is counted from another edge there; ours stays")),
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
    ("", "support_material", left("parts that need support have it: process.support is auto")),
    ("process.self_supporting_angle_deg", "support_material_threshold", _steepest),
    ("process.support_style", "support_material_style", one_of(STYLES)),
    ("process.support_on_part", "support_material_buildplate_only", _on_part),
    ("process.support_pattern", "support_material_pattern", one_of(FILLS)),
    ("process.support_density", "support_material_spacing", _support_density),
    ("process.support_interface_layers", "support_material_interface_layers", whole),
    (
        "process.support_bottom_interface_layers",
        "support_material_bottom_interface_layers",
        _same_as_top("support_material_interface_layers", -1.0),
    ),
    ("process.support_interface_density", "support_material_interface_spacing", _support_density),
    ("process.support_gap_mm", "support_material_contact_distance", number),
    (
        "process.support_bottom_gap_mm",
        "support_material_bottom_contact_distance",
        _same_as_top("support_material_contact_distance", 0.0),
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
    ("process.small_wall_mm", "small_perimeter_speed", _small_wall),
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
    ("process.combing", "avoid_crossing_perimeters", _only_on("off: travels here go round by default")),
    ("process.acceleration_mm_s2", "default_acceleration", above_zero(FIRMWARE)),
    ("process.outer_wall_acceleration_mm_s2", "external_perimeter_acceleration", part_of("default_acceleration", FIRMWARE)),
    ("process.outer_wall_acceleration_mm_s2", "perimeter_acceleration", part_of("default_acceleration", FIRMWARE)),
    ("process.infill_acceleration_mm_s2", "infill_acceleration", part_of("default_acceleration", FIRMWARE)),
    ("process.bridge_acceleration_mm_s2", "bridge_acceleration", part_of("external_perimeter_acceleration", FIRMWARE)),
    ("process.first_layer_acceleration_mm_s2", "first_layer_acceleration", part_of("default_acceleration", FIRMWARE)),
    ("process.travel_acceleration_mm_s2", "travel_acceleration", part_of("default_acceleration", FIRMWARE)),
    ("process.least_layer_time_s", "slowdown_below_layer_time", _layer_time),
    ("process.least_speed_mm_s", "min_print_speed", above_zero("no slower limit")),
)
