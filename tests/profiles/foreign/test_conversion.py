"""The meaning of other slicers' numbers in our settings."""

from collections.abc import Callable, Mapping

import pytest

from profiles.errors import ProfileError
from profiles.foreign import cura, orcaslicer, prusaslicer
from profiles.foreign.config import Config
from profiles.foreign.imported import KINDS, Row, imported, unchanged_keys, unused
from profiles.foreign.rules import PROCESS_RULES
from profiles.profile import load_one


def config(**values: str) -> Config:
    return Config("PrusaSlicer", {key: (key, text) for key, text in values.items()})


def taken(kind: str = "process", **values: str) -> dict[str, str]:
    rows = imported(config(**values), kind).rows
    return {row.key.split(".")[1]: row.value for row in rows if row.taken}


@pytest.mark.parametrize(
    ("values", "key", "value"),
    [
        ({"external_perimeter_extrusion_width": "180%", "layer_height": "0.25"}, "outer_wall_line_width_mm", "0.45"),
        ({"perimeter_extrusion_width": "0", "extrusion_width": "0.5"}, "line_width_mm", "0.5"),
        ({"perimeter_extrusion_width": "0", "extrusion_width": "0", "nozzle_diameter": "0.4"}, "line_width_mm", "0.45"),
        ({"top_infill_extrusion_width": "0", "nozzle_diameter": "0.4"}, "top_skin_line_width_mm", "0.4"),
        ({"first_layer_extrusion_width": "200%", "first_layer_height": "0.3"}, "first_layer_line_width_mm", "0.6"),
        ({"external_perimeter_speed": "50%", "perimeter_speed": "72"}, "outer_wall_speed_mm_s", "36.0"),
        ({"top_solid_infill_speed": "50%", "solid_infill_speed": "60%", "infill_speed": "90"}, "top_skin_speed_mm_s", "27.0"),
        ({"support_material_threshold": "30"}, "self_supporting_angle_deg", "60.0"),
        ({"xy_size_compensation": "-0.1"}, "hole_compensation_mm", "0.1"),
        (
            {"support_material_contact_distance": "0.15", "support_material_bottom_contact_distance": "0"},
            "support_bottom_gap_mm",
            "0.15",
        ),
        ({"overhang_speed_0": "40%", "external_perimeter_speed": "50"}, "overhang_25_speed_mm_s", "20.0"),
        ({"perimeters": "2"}, "walls", "2"),
        ({"gap_fill_enabled": "0"}, "gap_least_mm", "1000.0"),
        ({"fuzzy_skin": "all"}, "fuzzy_skin", '"all"'),
        ({"fuzzy_skin_point_dist": "0.6"}, "fuzzy_skin_point_distance_mm", "0.6"),
        ({"bridge_angle": "45"}, "bridge_angle_deg", "45.0"),
        ({"thick_bridges": "1"}, "thick_bridges", "true"),
        ({"top_fill_pattern": "monotoniclines"}, "top_skin_pattern", '"monotonic"'),
        ({"bottom_fill_pattern": "concentric"}, "bottom_skin_pattern", '"concentric"'),
        ({"solid_infill_direction": "30"}, "skin_angle_deg", "30.0"),
        ({"top_one_perimeter_type": "topmost"}, "only_one_wall_top", "true"),
        ({"only_one_perimeter_first_layer": "1"}, "only_one_wall_first_layer", "true"),
        ({"raft_layers": "3"}, "raft_layers", "3"),
        ({"raft_contact_distance": "0.25"}, "raft_contact_distance_mm", "0.25"),
        ({"raft_expansion": "2"}, "raft_expansion_mm", "2.0"),
        ({"raft_first_layer_density": "80%"}, "raft_first_layer_density", "0.8"),
        ({"raft_first_layer_expansion": "2"}, "raft_first_layer_expansion_mm", "2.0"),
        ({"first_layer_speed_over_raft": "50%", "perimeter_speed": "60"}, "first_layer_speed_over_raft_mm_s", "30.0"),
        ({"cooling": "0", "slowdown_below_layer_time": "15"}, "least_layer_time_s", "0.0"),
    ],
)
def test_a_print_setting_becomes_ours(values: dict[str, str], key: str, value: str) -> None:
    assert taken(**values)[key] == value


def test_an_expansion_that_the_slicer_works_out_is_left() -> None:
    assert "raft_first_layer_expansion_mm" not in taken(raft_first_layer_expansion="-1", perimeters="2")


@pytest.mark.parametrize(
    ("values", "key", "value"),
    [
        ({"max_fan_speed": "80"}, "fan", "0.8"),
        ({"min_fan_speed": "35", "fan_always_on": "0"}, "fan_least", "0.0"),
        ({"retract_length": "2", "filament_retract_length": "0.6"}, "retract_mm", "0.6"),
        ({"retract_length": "2", "filament_retract_length": "nil"}, "retract_mm", "2.0"),
        ({"temperature": "215,220"}, "nozzle_c", "215.0"),
        ({"start_filament_gcode": r'"M900 K0.05 ; PLA\nG92 E0"'}, "pressure_advance", "0.05"),
        ({"wipe": "0"}, "wipe_mm", "0.0"),
        ({"filament_cost": "24.9"}, "price_per_kg", "24.9"),
    ],
)
def test_a_filament_setting_becomes_ours(values: dict[str, str], key: str, value: str) -> None:
    assert taken("material", **values)[key] == value


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({"perimeter_speed": "0"}, "as fast as the plastic melts"),
        ({"default_acceleration": "0"}, "the firmware's own"),
        ({"fill_pattern": "hilbertcurve"}, "has no equivalent here"),
        ({"external_perimeter_speed": "50%"}, "perimeter_speed, which the file does not state"),
        ({"layer_height": "9"}, "a number from"),
        ({"layer_height": "thin"}, "is not a number"),
        ({"perimeters": "1e999"}, "is not a number"),
        (
            {"support_material_spacing": "-0.4", "support_material_extrusion_width": "0.4", "layer_height": "1e-9"},
            "needs a width",
        ),
    ],
)
def test_settings_without_an_equivalent_are_listed_with_the_reason(values: dict[str, str], why: str) -> None:
    (row,) = (row for row in imported(config(**values), "process").rows if row.name == next(iter(values)))
    assert not row.taken
    assert why in row.how


def test_a_fan_over_bridges_that_is_as_elsewhere_is_left() -> None:
    (row,) = (row for row in imported(config(bridge_fan_speed="-1"), "material").rows if row.name == "bridge_fan_speed")
    assert (row.taken, row.how) == (False, "below 0: as elsewhere")


def test_conditional_pressure_advance_is_left_to_the_user() -> None:
    block = '"{if nozzle_diameter[0]==0.4}M900 K0.05{endif}"'
    (row,) = imported(config(start_filament_gcode=block), "material").rows
    assert "on a condition" in row.how


def test_pressure_advance_that_is_no_number_is_left() -> None:
    (row,) = imported(config(start_filament_gcode='"M900 K0.05.1"'), "material").rows
    assert not row.taken


@pytest.mark.parametrize(
    ("made", "values", "key"),
    [
        (orcaslicer.of_values, {"line_width": "thick%", "nozzle_diameter": "0.4"}, "extrusion_width"),
        (orcaslicer.of_values, {"line_width": "110%", "nozzle_diameter": "fine"}, "extrusion_width"),
        (
            prusaslicer.of_gcode,
            {"extrusion_spacing": "", "perimeter_extrusion_spacing": "", "bridge_flow_ratio": "%"},
            "bridge_flow_ratio",
        ),
    ],
)
def test_a_percentage_without_a_number_says_no_number(
    made: Callable[[Mapping[str, str]], Config], values: dict[str, str], key: str
) -> None:
    assert not made(values).number(key)


def test_a_filament_s_kind_chooses_the_material_below_it() -> None:
    bases = {
        kind: imported(config(filament_type=kind, temperature="240"), "material").base for kind in ("PETG", "ASA", "TPU", "WOOD")
    }
    assert bases == {"PETG": "petg", "ASA": "abs", "TPU": "tpu", "WOOD": "pla"}


def test_every_key_that_a_rule_fills_is_one_of_ours() -> None:
    ours = {f"process.{name}" for name in type(load_one("standard")["process"]).model_fields}
    assert {key for key, _, _ in PROCESS_RULES if key} <= ours


def test_every_foreign_setting_and_every_own_key_is_accounted_for() -> None:
    theirs = config(layer_height="0.2", wipe_tower="1")
    profile = imported(theirs, "process")
    assert unused(theirs) == ["wipe_tower"]
    assert "process.layer_height_mm" not in unchanged_keys(profile)
    assert "process.walls" in unchanged_keys(profile)


def test_a_width_that_does_not_go_with_its_layers_is_left_with_the_reason() -> None:
    theirs = config(
        layer_height="0.35", first_layer_height="0.3", perimeter_extrusion_width="0.45", support_material_extrusion_width="0.37"
    )
    (row,) = (row for row in imported(theirs, "process").rows if row.name == "support_material_extrusion_width")
    assert not row.taken
    assert row.how == "process.layer_height_mm is 0.35 mm: at most 0.9 of support_line_width_mm (0.333 mm) is allowed"


def test_layers_that_are_too_high_for_all_lines_are_refused() -> None:
    with pytest.raises(ProfileError, match=r"process 'imported': .*at most 0.9 of line_width_mm"):
        imported(config(layer_height="0.4", perimeter_extrusion_width="0.4"), "process")


def reported(theirs: Config, name: str) -> Row:
    """The only row of a report on a setting, by its name in the other slicer."""
    (row,) = (row for kind in KINDS for row in imported(theirs, kind).rows if row.name == name)
    return row


@pytest.mark.parametrize(
    ("made", "values", "row"),
    [
        (orcaslicer.of_values, {"seam_position": "back"}, ("seam_position", "back", '"rear"', "")),
        (
            orcaslicer.of_values,
            {"inner_wall_line_width": "110%", "nozzle_diameter": "0.4"},
            ("inner_wall_line_width", "110%", "0.44", "110 % of nozzle_diameter (0.4)"),
        ),
        (
            prusaslicer.of_gcode,
            {"extrusion_spacing": "", "bridge_flow_ratio": "85%"},
            ("bridge_flow_ratio", "85%", "0.85", "percent as a share"),
        ),
        (cura.of_values, {"infill_sparse_density": "45"}, ("infill_sparse_density", "45", "0.45", "")),
        (cura.of_values, {"z_seam_type": "shortest"}, ("z_seam_type", "shortest", '"nearest"', "")),
        (cura.of_values, {"material_flow": "96"}, ("material_flow", "96", "0.96", "")),
        (cura.of_values, {"support_angle": "55"}, ("support_angle", "55", "55.0", "from the vertical, as here")),
        (
            cura.of_values,
            {"brim_width": "5", "adhesion_type": "none"},
            ("brim_width", "5", "0.0", "adhesion_type is none"),
        ),
        (cura.of_values, {"adhesion_type": "raft"}, ("adhesion_type", "raft", "4", "1 + 1 + 2 layers")),
        (
            cura.of_values,
            {"raft_airgap": "0.3", "layer_0_z_overlap": "0.1"},
            ("raft_airgap", "0.3", "0.2", "0.3 less 0.1 (layer_0_z_overlap)"),
        ),
        (cura.of_values, {"speed_travel": "=100 + 20"}, ("speed_travel", "=100 + 20", "120.0", "that is 120")),
        (
            cura.of_values,
            {"machine_nozzle_size": "0.5"},
            ("wall_line_width_x", "0.5", "0.5", "Cura's own formula: wall_line_width"),
        ),
    ],
)
def test_a_report_has_the_words_of_the_file_and_what_was_made_of_them(
    made: Callable[[Mapping[str, str]], Config], values: dict[str, str], row: tuple[str, str, str, str]
) -> None:
    found = reported(made(values), row[0])
    assert (found.text, found.value, found.how) == row[1:]


OF_NOZZLE = "a percentage of the nozzle, which the file does not state"


@pytest.mark.parametrize(
    ("made", "values", "name", "text", "why"),
    [
        (
            orcaslicer.of_values,
            {"outer_wall_line_width": "110%", "line_width": "0.5"},
            "outer_wall_line_width",
            "110%",
            OF_NOZZLE,
        ),
        (orcaslicer.of_values, {"initial_layer_line_width": "120%"}, "initial_layer_line_width", "120%", OF_NOZZLE),
        (
            orcaslicer.of_values,
            {"inner_wall_line_width": "0", "line_width": "110%"},
            "inner_wall_line_width",
            "0",
            f"0 is extrusion_width, {OF_NOZZLE}",
        ),
        (
            prusaslicer.of_gcode,
            {"extrusion_spacing": "", "max_layer_height": "75%,75%"},
            "max_layer_height",
            "75%,75%",
            OF_NOZZLE,
        ),
        (
            prusaslicer.of_gcode,
            {"external_perimeter_extrusion_width": "180%", "extrusion_width": "0.5"},
            "external_perimeter_extrusion_width",
            "180%",
            "a percentage of layer_height, which the file does not state",
        ),
    ],
)
def test_a_width_in_percent_of_an_unknown_value_is_listed_with_the_reason(
    made: Callable[[Mapping[str, str]], Config], values: dict[str, str], name: str, text: str, why: str
) -> None:
    row = reported(made(values), name)
    assert (row.text, row.taken, row.how) == (text, False, why)


@pytest.mark.parametrize(
    ("made", "values", "rest"),
    [
        (orcaslicer.of_values, {"hot_plate_temp": "60", "cool_plate_temp": "35"}, ["cool_plate_temp"]),
        (cura.of_values, {"support_angle": "55", "raft_airgap": "0.3", "prime_tower_size": "20"}, ["prime_tower_size"]),
        (cura.of_values, {"retraction_hop": "0.2", "retraction_hop_enabled": "True"}, []),
        (cura.of_values, {"cool_fan_speed": "50", "cool_fan_enabled": "False"}, []),
        (cura.of_values, {"speed_print": "80"}, []),  # it sets four speeds
        (cura.of_values, {"wall_thickness": "1.2", "line_width": "0.4"}, []),
    ],
)
def test_a_converted_setting_is_not_listed_as_unused(
    made: Callable[[Mapping[str, str]], Config], values: dict[str, str], rest: list[str]
) -> None:
    assert unused(made(values)) == rest


@pytest.mark.parametrize(
    ("values", "rest"),
    [
        (
            {"acceleration_print": "500", "acceleration_enabled": "False"},
            ["acceleration_print (acceleration_enabled is False)"],
        ),
        (
            {"bridge_skin_speed": "20", "bridge_settings_enabled": "False"},
            ["bridge_skin_speed (bridge_settings_enabled is False)"],
        ),
        ({"retraction_hop": "=foo", "retraction_hop_enabled": "True"}, ["retraction_hop (a formula)", "retraction_hop_enabled"]),
    ],
)
def test_an_inactive_setting_of_cura_is_listed_with_the_reason(values: dict[str, str], rest: list[str]) -> None:
    assert unused(cura.of_values(values)) == rest


def test_a_converted_text_is_shown_when_it_is_not_used() -> None:
    row = reported(cura.of_values({"support_angle": "90"}), "support_angle")
    assert (row.text, row.taken, row.how) == ("90", False, "is 0 here; 0: found by the slicer")


def test_a_width_below_zero_is_left_with_the_reason() -> None:
    row = reported(orcaslicer.of_values({"outer_wall_line_width": "-10%", "nozzle_diameter": "0.4"}), "outer_wall_line_width")
    assert (row.text, row.taken, row.how) == ("-10%", False, "is -0.04 here; is less than 0")


def test_the_second_of_two_settings_for_one_key_keeps_its_own_reason() -> None:
    row = reported(cura.of_values({"outer_inset_first": "=True", "inset_direction": "outside_in"}), "inset_direction")
    assert (row.text, row.how) == ("outside_in", "")
