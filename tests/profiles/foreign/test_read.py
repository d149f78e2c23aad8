"""Files of other slicers, told by what is in them."""

import json
from pathlib import Path
from zipfile import ZipFile

import pytest

from profiles.errors import ProfileError
from profiles.foreign.read import read_config

BUNDLE = """
[print:*common*]
perimeters = 3
layer_height = 0.2
[print:fine]
inherits = *common*
layer_height = 0.1
[print:strong]
inherits = *common*; fine
perimeters = 6
[filament:my PLA]
temperature = 205
[printer:mine]
nozzle_diameter = 0.6
"""


def written(folder: Path, name: str, text: str) -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def test_a_config_ini_is_read_line_by_line(tmp_path: Path) -> None:
    config = read_config(written(tmp_path, "config.ini", "# by hand\nlayer_height = 0.15\nfilament_settings_id = ours\n"))
    assert (config.number("layer_height"), config.material) == (0.15, "ours")


def test_a_preset_of_a_bundle_has_what_it_inherits(tmp_path: Path) -> None:
    config = read_config(written(tmp_path, "bundle.ini", BUNDLE), {"process": "strong"})
    assert [config.number(key) for key in ("layer_height", "perimeters", "temperature", "nozzle_diameter")] == [0.1, 6, 205, 0.6]
    assert (config.process, config.material) == ("strong", "my PLA")


def test_a_bundle_of_several_asks_which_one(tmp_path: Path) -> None:
    with pytest.raises(ProfileError, match="--process-preset is missing: the file has 2; among them 'fine', 'strong'"):
        read_config(written(tmp_path, "bundle.ini", BUNDLE))


def test_the_active_preset_of_a_bundle_needs_no_asking(tmp_path: Path) -> None:
    config = read_config(written(tmp_path, "bundle.ini", BUNDLE + "[presets]\nprint = fine\n"))
    assert (config.process, config.number("perimeters")) == ("fine", 3)


def test_a_preset_that_inherits_itself_is_refused(tmp_path: Path) -> None:
    bundle = "[print:a]\ninherits = b\nlayer_height = 0.2\n[print:b]\ninherits = a\n"
    with pytest.raises(ProfileError, match="preset 'a' inherits itself"):
        read_config(written(tmp_path, "bundle.ini", bundle), {"process": "a"})


def test_the_settings_at_the_end_of_gcode_are_read(tmp_path: Path) -> None:
    text = (
        "G1 X1 E1\n" * 400_000
        + "; prusaslicer_config = begin\n; perimeters = 4\n; temperature = 211\n; prusaslicer_config = end\n"
    )
    config = read_config(written(tmp_path, "print.gcode", text))
    assert (config.number("perimeters"), config.number("temperature")) == (4, 211)


def test_a_preset_of_orcaslicer_has_what_the_files_beside_it_say(tmp_path: Path) -> None:
    parent = {"type": "process", "name": "base", "wall_loops": "2", "line_width": "110%", "nozzle_diameter": ["0.4"]}
    written(tmp_path, "base.json", json.dumps(parent))
    child = {"type": "process", "name": "0.16 mine", "inherits": "base", "layer_height": "0.16", "seam_position": "back"}
    config = read_config(written(tmp_path, "0.16 mine.json", json.dumps(child)))
    assert [config.text(key) for key in ("perimeters", "extrusion_width", "layer_height", "seam_position")] == [
        "2",
        "0.44",
        "0.16",
        "rear",
    ]
    assert config.process == "0.16 mine"


def test_a_parent_that_is_nowhere_beside_it_is_told(tmp_path: Path) -> None:
    child = {"type": "filament", "name": "PLA", "inherits": "Generic PLA @System", "nozzle_temperature": ["215"]}
    config = read_config(written(tmp_path, "PLA.json", json.dumps(child)))
    assert config.unknown == ("inherits Generic PLA @System",)
    assert config.number("temperature") == 215


def test_orcaslicer_heats_the_bed_of_the_plate_that_lies_on_it(tmp_path: Path) -> None:
    text = "; nozzle_temperature = 220\n; curr_bed_type = Textured PEI Plate\n; hot_plate_temp = 60\n; textured_plate_temp = 65\n"
    assert read_config(written(tmp_path, "orca.gcode", text)).number("bed_temperature") == 65


def test_a_profile_of_cura_is_read_without_its_formulas(tmp_path: Path) -> None:
    file = tmp_path / "mine.curaprofile"
    with ZipFile(file, "w") as archive:
        archive.writestr("mine", "[general]\nversion = 4\nname = mine\n[values]\nlayer_height = 0.15\nsupport_angle = 60\n")
        extruder = "[metadata]\nposition = 0\n[values]\ninfill_sparse_density=20\nspeed_wall_0 = =speed_print/2\n"
        archive.writestr("mine_extruder", extruder)
    config = read_config(file)
    assert (config.number("layer_height"), config.share("fill_density"), config.number("support_material_threshold")) == (
        0.15,
        0.2,
        30,
    )
    assert config.unknown == ("speed_wall_0 (a formula)",)


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("notes.txt", b"hello", "holds no settings"),
        ("preset.json", b"{broken", "is no JSON"),
        ("list.json", b"[1]", "holds no settings"),
        ("empty.ini", b"", "holds no settings"),
        ("noise.gcode", bytes(range(256)) * 40, "holds no settings"),
    ],
)
def test_what_is_no_configuration_is_refused_in_one_sentence(tmp_path: Path, name: str, content: bytes, sentence: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ProfileError, match=sentence):
        read_config(tmp_path / name)


def test_a_zip_of_something_else_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "x.curaprofile"
    with ZipFile(file, "w") as archive:
        archive.writestr("x", "no ini at all")
    with pytest.raises(ProfileError, match="is no profile of Cura"):
        read_config(file)
