"""The export command and the picture of one layer."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from machine.cli.cli import main
from machine.cli.commands.export import default_gcode, draw_layer, parse_layer
from machine.pipeline.requests import ModelRequest
from mdp.save import stl
from profiles.errors import OutputError, SliceError
from profiles.profile import load
from tests.machine.cli.test_cli import FAST
from tests.machine.hand import printed
from tests.shapes import box


def test_export_draws_the_layer_that_it_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    gcode, svg = tmp_path / "a.gcode", tmp_path / "a.svg"
    whole = ["--as-is", "--set", "process.scale=0.3", "--set", "process.support=none", "--time-limit", "0"]
    assert main(["export", "demo:bracket", *FAST, *whole, "-o", str(gcode), "--svg", str(svg), "--layer", "1:3"]) == 0
    third = gcode.read_text().split(";LAYER_CHANGE")[3]
    ids = {g.get("id") for g in ET.fromstring(svg.read_text()).iter("{http://www.w3.org/2000/svg}g")} - {None, "travels", "seams"}
    assert ids == set(re.findall(r";TYPE:(.*)", third)) - {"Custom"}
    assert "part 1, layer 3, z 0.9" in svg.read_text()


def test_without_a_layer_option_the_first_layer_is_drawn() -> None:
    assert parse_layer(None, True) == (1, 1)
    assert parse_layer("12:345", True) == (12, 345)


@pytest.mark.parametrize("layer", ["3", "a:b", "1:2:3", "-1:2", "1:", ""])
def test_an_invalid_layer_is_refused(layer: str) -> None:
    with pytest.raises(OutputError, match="PART:LAYER is expected"):
        parse_layer(layer, True)


def test_a_part_or_layer_that_is_not_there_is_named() -> None:
    with pytest.raises(OutputError, match=r"--layer 3:1: there is no part 3, the parts are 1 to 2"):
        draw_layer(printed()[2], 3, 1)
    with pytest.raises(SliceError, match=r"part 2 has no layer 4: its layers are 1 to 3"):
        draw_layer(printed()[2], 2, 4)


def test_an_existing_unreadable_output_file_gives_a_one_line_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("box.gcode").write_text("G28\n")

    def refuse(path: Path, mode: str = "r") -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(OutputError, match=r"^output box.gcode exists and cannot be read: permission denied; -o names"):
        default_gcode("box.stl", ModelRequest("box.stl", load()))


def test_export_without_a_name_leaves_the_g_code_of_another_model_of_that_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for file in ("box.stl", "a/box.stl", "b/box.stl"):
        Path(file).parent.mkdir(exist_ok=True)
        Path(file).write_bytes(stl(box(8, 8, 2)))
    Path("box.obj").write_bytes(Path("box.stl").read_bytes())
    export = ["export", *FAST, "--as-is"]
    assert [main([*export, "a/box.stl"]), main([*export, str(tmp_path / "a" / "box.stl")])] == [0, 0]
    written = Path("box.gcode").read_bytes()
    assert written.endswith(b"; folder = a\n")
    for other in ("b/box.stl", "box.stl", "box.obj"):
        assert main([*export, other]) == 1
        assert "output box.gcode exists and was made of another model: -o names another file" in capsys.readouterr().err
    assert Path("box.gcode").read_bytes() == written
    assert main([*export, "box.stl", "-o", "box.gcode"]) == 0


def test_export_without_a_name_writes_the_model_s_here_and_ends_with_a_verdict(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("box.stl").write_bytes(stl(box(8, 8, 2)))
    for _ in range(2):  # a file that tiltprint wrote is overwritten
        assert main(["export", "box.stl", *FAST, "--as-is"]) == 0
        assert capsys.readouterr().out.endswith("wrote box.gcode: ready to print, 1 warning\n")
    Path("box.gcode").write_text("G28\n")
    assert main(["export", "box.stl", *FAST]) == 1
    assert "output box.gcode exists and was not written by tiltprint: -o names another file" in capsys.readouterr().err
    assert main(["print", "box.stl", *FAST, "--as-is", "--port", "sim"]) == 0
    assert re.search(r"\ndone in \d+s: \d+s before the print, \d+s of printing\n$", capsys.readouterr().out)
