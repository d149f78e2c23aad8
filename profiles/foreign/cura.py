"""Cura's .curaprofile: a zip of ini files, one of the print and one an extruder, with what differs from a printer's definition.

What the user has not changed stands in Cura's own definitions, not in the file; values that are formulas (`=...`) are Cura's to
work out (Cura, plugins/CuraProfileReader). Names: Cura, resources/definitions/fdmprinter.def.json.
"""

import configparser
import re
from collections.abc import Mapping
from pathlib import Path
from zipfile import ZipFile, ZipInfo

from profiles.errors import ProfileError, first_line, reason
from profiles.files import DAMAGED_ZIP
from profiles.foreign.config import Config, Entry, finite

PROGRAM = "Cura"
SLICER_FILE = re.compile(r"Cura/.*\.inst\.cfg$")  # members of a .3mf that have a person's settings
DAMAGED: tuple[type[Exception], ...] = (*DAMAGED_ZIP, configparser.Error)
MOST_BYTES = 4 << 20  # of a member: a profile has a few kB
PERCENT = frozenset({"fill_density", "ironing_flowrate"})  # without the sign in Cura
KEYS = {
    "layer_height_0": "first_layer_height",
    "line_width": "extrusion_width",
    "wall_line_width_x": "perimeter_extrusion_width",
    "wall_line_width_0": "external_perimeter_extrusion_width",
    "infill_line_width": "infill_extrusion_width",
    "skin_line_width": "solid_infill_extrusion_width",
    "roofing_line_width": "top_infill_extrusion_width",
    "support_line_width": "support_material_extrusion_width",
    "wall_line_count": "perimeters",
    "top_layers": "top_solid_layers",
    "bottom_layers": "bottom_solid_layers",
    "top_thickness": "top_solid_min_thickness",
    "bottom_thickness": "bottom_solid_min_thickness",
    "infill_sparse_density": "fill_density",
    "infill_pattern": "fill_pattern",
    "min_infill_area": "solid_infill_below_area",
    "z_seam_type": "seam_position",
    "inset_direction": "external_perimeters_first",
    "outer_inset_first": "external_perimeters_first",
    "magic_spiralize": "spiral_vase",
    "print_sequence": "complete_objects",
    "ironing_enabled": "ironing",
    "ironing_line_spacing": "ironing_spacing",
    "speed_ironing": "ironing_speed",
    "speed_wall_x": "perimeter_speed",
    "speed_wall_0": "external_perimeter_speed",
    "speed_topbottom": "solid_infill_speed",
    "speed_roofing": "top_solid_infill_speed",
    "speed_infill": "infill_speed",
    "speed_support": "support_material_speed",
    "speed_support_interface": "support_material_interface_speed",
    "speed_layer_0": "first_layer_speed",
    "speed_travel": "travel_speed",
    "bridge_skin_speed": "bridge_speed",
    "acceleration_print": "default_acceleration",
    "acceleration_wall_0": "external_perimeter_acceleration",
    "acceleration_infill": "infill_acceleration",
    "acceleration_travel": "travel_acceleration",
    "acceleration_layer_0": "first_layer_acceleration",
    "support_top_distance": "support_material_contact_distance",
    "support_bottom_distance": "support_material_bottom_contact_distance",
    "support_xy_distance": "support_material_xy_spacing",
    "support_structure": "support_material_style",
    "support_enable": "support_material",
    "support_type": "support_material_buildplate_only",
    "brim_gap": "brim_separation",
    "raft_margin": "raft_expansion",
    "raft_surface_margin": "raft_expansion",
    "skirt_line_count": "skirts",
    "skirt_gap": "skirt_distance",
    "material_print_temperature": "temperature",
    "material_print_temperature_layer_0": "first_layer_temperature",
    "material_bed_temperature": "bed_temperature",
    "material_flow": "extrusion_multiplier",
    "cool_fan_speed_max": "max_fan_speed",
    "cool_fan_speed_min": "min_fan_speed",
    "cool_min_layer_time_fan_speed_max": "fan_below_layer_time",
    "cool_min_layer_time": "slowdown_below_layer_time",
    "cool_min_speed": "min_print_speed",
    "cool_fan_full_layer": "full_fan_speed_layer",
    "retraction_amount": "retract_length",
    "retraction_speed": "retract_speed",
    "retraction_min_travel": "retract_before_travel",
    "retraction_hop": "retract_lift",
    "xy_offset": "xy_contour_compensation",
    "hole_xy_offset": "xy_hole_compensation",
    "machine_nozzle_size": "nozzle_diameter",
}
RAFT_LAYERS = {"raft_base_layers": 1, "raft_interface_layers": 1, "raft_surface_layers": 2}  # with Cura's own numbers
WORDS = {
    "fill_pattern": {
        "lines": "rectilinear",
        "zigzag": "rectilinear",
        "trihexagon": "stars",
        "cubicsubdiv": "adaptivecubic",
    },
    "complete_objects": {"all_at_once": "0", "one_at_a_time": "1"},
    "seam_position": {"back": "rear", "shortest": "nearest", "sharpest_corner": "aligned"},
    "external_perimeters_first": {"outside_in": "1", "inside_out": "0"},
    "support_material_style": {"normal": "grid", "tree": "organic"},
    "support_material_buildplate_only": {"buildplate": "1", "everywhere": "0"},
}


def read_profile(file: Path) -> Config:
    """What a .curaprofile says. Raises ProfileError."""
    return of_values(*read_values(file))


def of_values(values: Mapping[str, str], name: str = "") -> Config:
    """Settings under Cura's names."""
    entries, formulas = dict[str, Entry](), list[str]()
    for own, text in values.items():
        if text.startswith("="):
            formulas.append(own)
        elif own not in (*RAFT_LAYERS, "layer_0_z_overlap"):  # read beside others (_raft)
            key = KEYS.get(own, own)
            entries[key] = Entry(own, _said(key, text))
    if (angle_deg := finite(values.get("support_angle", ""))) is not None:  # Cura's is from the vertical
        entries["support_material_threshold"] = Entry("support_angle", f"{90.0 - angle_deg:g}")
    entries |= _raft(values)
    if "min_fan_speed" in entries:
        entries["fan_always_on"] = Entry(entries["min_fan_speed"].name, "1")
    return Config(PROGRAM, entries, tuple(f"{own} (a formula)" for own in formulas), name, name)


def _raft(values: Mapping[str, str]) -> dict[str, Entry]:
    """The number of raft layers and the gap above the raft, less what the first layer sinks into it.

    A value that the file does not give as a number is Cura's default: the sinking is half of the gap.
    """
    entries = dict[str, Entry]()
    if (kind := values.get("adhesion_type", "")) and not kind.startswith("="):
        layers = sum(_number(values.get(own, ""), usual) for own, usual in RAFT_LAYERS.items())
        entries["raft_layers"] = Entry("adhesion_type", f"{layers:g}" if kind == "raft" else "0")
    if (gap_mm := finite(values.get("raft_airgap", ""))) is not None:
        into_mm = _number(values.get("layer_0_z_overlap", ""), 0.5 * gap_mm)
        entries["raft_contact_distance"] = Entry("raft_airgap", f"{max(gap_mm - into_mm, 0.0):g}")
    return entries


def _number(text: str, usual: float) -> float:
    number = finite(text)
    return usual if number is None else number


def read_values(file: Path) -> tuple[Mapping[str, str], str]:
    """The settings of all ini files of a profile, or of those in a .3mf of Cura, an extruder's over the print's and a person's
    own over all others, and its name. Raises ProfileError."""
    values, name = dict[str, str](), file.stem
    try:
        with ZipFile(file) as archive:
            members = [
                member for member in archive.infolist() if file.suffix.lower() != ".3mf" or SLICER_FILE.match(member.filename)
            ]
            for member in sorted(members, key=_precedence):
                if member.file_size > MOST_BYTES:
                    raise ProfileError(
                        f"profile {file}: {member.filename} has {member.file_size} bytes, {MOST_BYTES} are allowed"
                    )
                parser = configparser.ConfigParser(interpolation=None)
                parser.read_string(archive.read(member).decode("utf-8-sig"))
                name = parser.get("general", "name", fallback=name)
                own = dict(parser["values"]) if parser.has_section("values") else {}
                first = parser.get("metadata", "position", fallback="0") in ("", "0")
                values |= own if first else {}
    except OSError as error:
        raise ProfileError(f"profile {file}: cannot be read ({reason(error)})") from None
    except DAMAGED as error:
        raise ProfileError(f"profile {file}: is no profile of Cura ({first_line(error)})") from None
    return values, name


def _precedence(member: ZipInfo) -> tuple[bool, bool]:
    """Later ones hold over earlier ones."""
    return "_user." in member.filename, "extruder" in member.filename


def _said(key: str, text: str) -> str:
    """A value as PrusaSlicer would say it."""
    if key in PERCENT and not text.endswith("%"):
        return f"{text}%"
    if key == "extrusion_multiplier" and (percent := finite(text)) is not None:
        return f"{percent / 100.0:g}"
    return WORDS.get(key, {}).get(text, text)
