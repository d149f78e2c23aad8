"""Import of another slicer's settings as user profiles, compared with the G-code of that slicer."""

import json
import re
import shutil
import subprocess
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.cli.commands.profiles.importing import import_profiles
from machine.cli.terminal.requests import ImportRequest
from mdp.save import stl
from profiles.errors import OutputError
from profiles.profile import load_one
from tests.shapes import box

CONFIG = """
layer_height = 0.25
first_layer_height = 0.25
external_perimeter_extrusion_width = 180%
perimeter_extrusion_width = 0.48
infill_extrusion_width = 0.55
first_layer_extrusion_width = 0.6
perimeter_speed = 72
external_perimeter_speed = 50%
infill_speed = 90
solid_infill_speed = 60%
first_layer_speed = 22
perimeters = 2
fill_density = 20%
fill_pattern = grid
temperature = 207
first_layer_temperature = 212
bed_temperature = 62
first_layer_bed_temperature = 62
nozzle_diameter = 0.4
perimeter_generator = classic
cooling = 0
slowdown_below_layer_time = 5
"""
KINDS = ("Perimeter", "External perimeter", "Internal infill")


def request(folder: Path, **given: object) -> ImportRequest:
    file = folder / "config.ini"
    file.write_text(CONFIG)
    return ImportRequest(file, name="theirs", out=folder, **given)  # type: ignore[arg-type]


def test_material_and_process_are_written_and_read_back(tmp_path: Path) -> None:
    assert import_profiles(request(tmp_path)) == 0
    process = load_one(str(tmp_path / "theirs-process.toml"))["process"]
    material = load_one(str(tmp_path / "theirs-material.toml"))["material"]
    assert (process.outer_wall_line_width_mm, process.outer_wall_speed_mm_s) == (0.45, 36.0)  # type: ignore[attr-defined]
    assert material.nozzle_c == 207.0  # type: ignore[attr-defined]


def test_an_unnamed_profile_is_named_after_its_file(tmp_path: Path) -> None:
    import_profiles(replace(request(tmp_path), name=""))
    assert sorted(file.name for file in tmp_path.glob("*.toml")) == ["config-material.toml", "config-process.toml"]


def test_the_outcome_of_every_setting_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import_profiles(request(tmp_path, json=True))
    told = json.loads(capsys.readouterr().out)
    settings = {row["theirs"] for profile in told["profiles"] for row in profile["settings"]}
    lines = {line.partition(" =")[0] for line in CONFIG.split("\n") if line}
    assert settings | set(told["unused"]) >= lines - {"nozzle_diameter", "cooling"}


def test_a_profile_that_is_there_is_not_written_over(tmp_path: Path) -> None:
    import_profiles(request(tmp_path))
    with pytest.raises(OutputError, match="--replace"):
        import_profiles(request(tmp_path))
    assert import_profiles(request(tmp_path, replace=True)) == 0


def test_a_file_that_is_not_there_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["profiles", "import", "nowhere.ini"]) == 1
    assert "profile nowhere.ini cannot be read (no such file or directory)" in capsys.readouterr().err


def test_settings_with_unusable_values_are_not_reported_as_unknown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "odd.ini").write_text("perimeters = many\nlayer_height = none\n")
    assert main(["profiles", "import", str(tmp_path / "odd.ini")]) == 1
    said = capsys.readouterr().err
    assert "2 of its 2 settings have an equivalent here, but no value of theirs can be taken, the first: layer_height" in said


@pytest.mark.parametrize(("options", "sentence"), [
    (("-o", "config.ini"), "output config.ini is a file: a folder is expected"),
    (("--process-preset", "FINE"), "--process-preset FINE: odd.ini is not a bundle with presets to choose from"),
])  # fmt: skip
def test_an_invalid_option_is_reported_before_unusable_settings(
    options: tuple[str, ...], sentence: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("config.ini").write_text(CONFIG)
    Path("odd.ini").write_text("perimeters = many\n")
    assert main(["profiles", "import", "odd.ini", *options]) == 1
    assert sentence in capsys.readouterr().err


@pytest.mark.skipif(shutil.which("prusa-slicer") is None, reason="PrusaSlicer is not installed")
def test_a_piece_has_the_widths_heights_speeds_and_temperatures_that_prusaslicer_gives_it(tmp_path: Path) -> None:
    import_profiles(request(tmp_path))
    (tmp_path / "box.stl").write_bytes(stl(box(20, 20, 5)))
    theirs = ["prusa-slicer", "-g", "--load", "config.ini", "--output", "theirs.gcode", "box.stl"]
    subprocess.run(theirs, cwd=tmp_path, check=True, capture_output=True)
    ours = ["export", str(tmp_path / "box.stl"), "--machine", "three_axis", "-o", str(tmp_path / "ours.gcode")]
    profiles = [f"--{kind}={tmp_path / f'theirs-{kind}.toml'}" for kind in ("process", "material")]
    assert main([*ours, *profiles]) == 0
    one, other = (look((tmp_path / name).read_text()) for name in ("theirs.gcode", "ours.gcode"))
    assert {kind: one[kind] for kind in KINDS} == {kind: other[kind] for kind in KINDS}
    assert one["External perimeter"] == (0.45, 0.25, 36.0)
    assert one["nozzle"] == other["nozzle"] == {212, 207}


def look(text: str) -> dict[str, object]:
    """Width, height and speed of most strokes of each kind, and the nozzle's temperatures."""
    strokes: dict[str, Counter[tuple[float, float, float]]] = {kind: Counter() for kind in KINDS}
    kind, said, speed = "", {"WIDTH": 0.0, "HEIGHT": 0.0}, 0.0
    for line in text.splitlines():
        comment, move = re.fullmatch(r";(TYPE|WIDTH|HEIGHT):(.+)", line), re.match(r"G1 .*X", line)
        if comment and comment[1] == "TYPE":
            kind = comment[2]
        elif comment:
            said[comment[1]] = round(float(comment[2]), 2)
        if found := re.search(r"^G[01].* F([0-9.]+)", line):
            speed = round(float(found[1]) / 60.0, 1)
        if move and " E" in line and kind in strokes:
            strokes[kind][said["WIDTH"], said["HEIGHT"], speed] += 1
    warm = {int(found) for found in re.findall(r"^M10[49] S(\d+)", text, re.MULTILINE)} - {0, 150}
    return {**{name: count.most_common(1)[0][0] for name, count in strokes.items()}, "nozzle": warm}
