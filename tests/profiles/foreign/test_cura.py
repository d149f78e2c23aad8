"""Cura's settings: the stacks in a project, formulas, and settings enabled by others."""

from pathlib import Path
from zipfile import ZipFile

import pytest

from profiles.foreign.config import Config
from profiles.foreign.cura import of_values
from profiles.foreign.read import read_slicer_settings
from profiles.foreign.rules import base_of

MATERIAL = """<fdmmaterial xmlns="http://www.ultimaker.com/material">
<metadata><name><brand>Acme</brand><material>PETG</material></name></metadata>
<properties><diameter>1.75</diameter><density>1.27</density></properties>
<settings><setting key="print temperature">240</setting>
<machine><setting key="print temperature">250</setting></machine></settings>
</fdmmaterial>"""


def project(path: Path, containers: dict[str, str], stacks: dict[str, tuple[str, list[str]]]) -> Path:
    """A project of Cura. stacks: by the file's name, its metadata and its containers, the topmost first."""
    with ZipFile(path, "w") as archive:
        for name, (metadata, levels) in stacks.items():
            listed = "\n".join(f"{level} = {container}" for level, container in enumerate(levels))
            archive.writestr(f"Cura/{name}.cfg", f"[general]\nversion = 4\n[metadata]\n{metadata}\n[containers]\n{listed}\n")
        for name, values in containers.items():
            archive.writestr(f"Cura/{name}.inst.cfg", f"[values]\n{values}\n")
        archive.writestr("Cura/petg.xml.fdm_material", MATERIAL)
    return path


def config_inside(file: Path) -> Config:
    values, of_values = read_slicer_settings(file)
    return of_values(values)


def test_the_top_of_a_stack_wins_wherever_it_is_in_the_file(tmp_path: Path) -> None:
    containers = {
        "changes": "layer_height = 0.2\nspeed_travel = 150",
        "quality": "layer_height = 0.3\nspeed_travel = 90\nraft_margin = 3",
        "first": "wall_line_count = 3",
        "first_printer": "wall_line_count = 7\nmachine_nozzle_size = 0.6",
        "second": "wall_line_count = 9",
        "user": "layer_height = 0.25",
    }
    stacks = {
        "b.extruder": ("position = 1\nenabled = True", ["second"]),
        "a.global": ("type = machine", ["user", "changes", "quality"]),
        "c.extruder": ("position = 0\nenabled = True", ["first", "empty_intent", "first_printer"]),
    }
    config = config_inside(project(tmp_path / "a.3mf", containers, stacks))
    numbers = [config.number(key) for key in ("layer_height", "travel_speed", "raft_expansion", "perimeters", "nozzle_diameter")]
    assert numbers == [0.25, 150, 3, 3, 0.6]


def test_the_first_extruder_that_is_switched_on_is_read(tmp_path: Path) -> None:
    stacks = {
        "b.extruder": ("position = 0\nenabled = False", ["off"]),
        "c.extruder": ("position = 1\nenabled = True", ["on"]),
    }
    file = project(tmp_path / "a.3mf", {"off": "wall_line_count = 9", "on": "wall_line_count = 3"}, stacks)
    assert config_inside(file).number("perimeters") == 3


def test_a_byte_order_mark_at_the_head_of_a_container_is_no_part_of_it(tmp_path: Path) -> None:
    file = project(tmp_path / "a.3mf", {}, {"b.extruder": ("position = 0", ["own"])})
    with ZipFile(file, "a") as archive:
        archive.writestr("Cura/own.inst.cfg", "\ufeff[values]\nwall_line_count = 3\n")
    assert config_inside(file).number("perimeters") == 3


def test_a_material_gives_kind_and_temperature_below_user_settings(tmp_path: Path) -> None:
    stacks = {"a.extruder": ("position = 0", ["user", "petg_acme_printer_0.4"])}
    config = config_inside(project(tmp_path / "a.3mf", {"user": "material_bed_temperature = 70"}, stacks))
    assert config.text("filament_type") == "PETG"
    assert [config.number(key) for key in ("temperature", "bed_temperature", "filament_density")] == [240, 70, 1.27]


@pytest.mark.parametrize(
    ("kind", "base"), [("PLA", "pla"), ("ApolloX ASA", "abs"), ("PETG-CF", "petg"), ("TPU 95A", "tpu"), ("Wood", "pla")]
)
def test_a_material_inherits_from_the_shipped_one_that_its_kind_names(kind: str, base: str) -> None:
    assert base_of(of_values({"material_type": kind}))[0] == base


@pytest.mark.parametrize(
    ("values", "key", "expected"),
    [
        (
            {"speed_print": "60", "speed_wall": "=speed_print / 2", "speed_wall_0": "=speed_wall - 5"},
            "external_perimeter_speed",
            25,
        ),
        ({"machine_nozzle_size": "0.8"}, "extrusion_width", 0.8),
        ({"wall_thickness": "1.2", "line_width": "0.4"}, "perimeters", 3),
        ({"top_bottom_thickness": "1", "layer_height": "0.3"}, "top_solid_layers", 4),
        ({"top_layers": "=0 if infill_sparse_density == 100 else 5", "infill_sparse_density": "20"}, "top_solid_layers", 5),
        ({"speed_infill": "=resolveOrValue('speed_print')", "speed_print": "50"}, "infill_speed", 50),
        ({"speed_infill": "=speed_print"}, "infill_speed", None),  # nothing defines it
        ({"speed_infill": "=speed_wall_x", "speed_wall_x": "=speed_infill"}, "infill_speed", None),
        ({"speed_infill": "=open('a')"}, "infill_speed", None),
        ({"speed_infill": "=9 / 0"}, "infill_speed", None),
    ],
)
def test_formulas_are_evaluated_if_their_variables_are_known(values: dict[str, str], key: str, expected: float | None) -> None:
    assert of_values(values).number(key) == expected


@pytest.mark.parametrize(
    ("values", "key", "expected"),
    [
        ({"retraction_hop": "0.5", "retraction_hop_enabled": "False"}, "retract_lift", 0),
        ({"retraction_hop": "0.5", "retraction_hop_enabled": "True"}, "retract_lift", 0.5),
        ({"retraction_hop": "0.5"}, "retract_lift", 0.5),
        ({"brim_width": "5", "adhesion_type": "skirt"}, "brim_width", 0),
        ({"brim_width": "5", "adhesion_type": "brim"}, "brim_width", 5),
        ({"acceleration_print": "900", "acceleration_enabled": "False"}, "default_acceleration", None),
    ],
)
def test_a_setting_that_another_switches_off_does_not_hold(values: dict[str, str], key: str, expected: float | None) -> None:
    assert of_values(values).number(key) == expected
