"""Plans that are saved, edited and reused: the same parts and the same G-code without a search."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from machine.cli.cli import main
from mdp.cut import solid_of
from mdp.mesh import Mesh
from mdp.save import stl
from tests import shapes
from tests.mdp.files import painted_ply

FAST = ["--set", "search.directions=60", "--set", "process.layer_height_mm=0.4", "--set", "process.first_layer_height_mm=0.4"]
FAST += ["--set", "process.line_width_mm=0.8", "--set", "process.scale=0.6", "--set", "process.infill_density=0.05"]
# An arm this small, whose stair-stepping and seam cost nearly as much as its support, is still cut.
FAST += ["--set", "search.seam_mm=0.8", "--set", "search.stair_weight=0.01", "--set", "search.least_saving=0"]
FAST += ["--set", "search.cut_mm2=20", "--set", "search.beam_width=2"]
PARTS = ["part-01.stl", "part-02.stl", "decomposition.3mf"]


def _run(*arguments: str) -> None:
    """Run a command that keeps the model's orientation, unless its arguments say otherwise."""
    assert main([arguments[0], "--as-is", *arguments[1:], *FAST]) == 0


def _values(path: str) -> Any:
    values = json.loads(Path(path).read_text())
    return {key: value for key, value in values.items() if key not in ("seconds", "candidates_evaluated", "rounds")}


def test_the_plan_in_the_folder_gives_the_same_parts_and_stays_as_it_is(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    _run("decompose", "tee.stl", "-o", "a 1")
    edited = "# my own remark\n" + Path("a 1/plan.toml").read_text()
    Path("a 1/plan.toml").write_text(edited)
    _run("decompose", "tee.stl", "--plan", "a 1/plan.toml", "-o", "b")
    assert "tiltprint export tee.stl --plan 'a 1/plan.toml' makes the G-code" in capsys.readouterr().out
    assert [Path(f"a 1/{name}").read_bytes() for name in PARTS] == [Path(f"b/{name}").read_bytes() for name in PARTS]
    assert json.loads(Path("b/decomposition.json").read_text())["candidates_evaluated"] == 0
    again = Path("b/plan.toml").read_text()
    _run("decompose", "tee.stl", "--plan", "a 1/plan.toml", "-o", "a 1")
    assert Path("a 1/plan.toml").read_text() == edited
    assert again.split("[[front]]")[0] in edited


def test_a_plan_that_is_not_there_yet_is_written_and_then_used(folder: Path) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    for name in ("first", "second"):
        _run("decompose", "tee.stl", "--plan", "tee.toml", "--json", f"{name}.json")
    first, second = _values("first.json"), _values("second.json")
    assert second["parts"] == first["parts"]
    assert [row["parts"] for row in second["front"]] == [row["parts"] for row in first["front"]]
    assert len(first["parts"]) == 2
    _run("decompose", "tee.stl", "--plan", "tee.toml", "--parts", "3", "--json", "three.json")
    assert len(_values("three.json")["parts"]) == 3


def test_a_search_that_may_find_fewer_parts_than_have_settings_says_so_before_it_begins(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("box.stl").write_bytes(stl(shapes.box()))
    assert main(["export", "box.stl", "-o", "no.gcode", "--part", "9:walls=4", *FAST]) == 1
    said = capsys.readouterr().err
    note = "box.stl: --part 9 is refused after the search if that finds fewer parts: --plan with the plan of an earlier search"
    assert said.index(note) < said.index("--part 9: there is no part 9")


def test_part_settings_are_kept_in_the_plan_and_change_the_output(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("box.stl").write_bytes(stl(shapes.box()))
    Path("box.toml").write_text("version = 1\n[[part]]\n[[part]]\nnormal = [0, 0, 1]\noffset_mm = 6\nprocess = {walls = 1}\n")
    _run("export", "box.stl", "--plan", "box.toml", "-o", "one.gcode")
    assert "part 2 with walls = 1" in capsys.readouterr().out
    _run("export", "box.stl", "--plan", "box.toml", "--part", "2:walls=4", "-o", "four.gcode")
    walls = [Path(f"{name}.gcode").read_text().split(";PART:2")[1].count(";TYPE:Perimeter") for name in ("one", "four")]
    assert (walls[0], walls[1] > 10) == (0, True)  # an outer wall has a type name of its own
    _run("decompose", "box.stl", "--plan", "box.toml", "--part", "1:infill_density=0.5", "-o", "parts")
    assert "process = {infill_density = 0.5}" in Path("parts/plan.toml").read_text()
    assert "process = {walls = 1}" in Path("parts/plan.toml").read_text()
    assert main(["decompose", "box.stl", "--plan", "box.toml", "--part", "3:walls=4", *FAST]) == 1
    assert "--part 3: there is no part 3, the parts are 1 to 2" in capsys.readouterr().err
    for wrong, sentence in (
        (("--part", "9:walls=4", "--parts", "2"), "--part 9: there is no part 9, the parts are 1 to 2 at most"),
        (("--pause", "13:1"), "--pause 13:1: there is no part 13, the parts are 1 to 12 at most"),
        (("--pause", "1:99999", "--plan", "box.toml"), "--pause 1:99999: part 1 is at most "),
    ):
        assert main(["export", "box.stl", "-o", "no.gcode", *wrong, *FAST]) == 1
        assert sentence in capsys.readouterr().err


def test_modifiers_of_a_plan_are_printed_and_kept_in_the_plan(folder: Path) -> None:
    Path("box.stl").write_bytes(stl(shapes.box()))
    Path("insert.stl").write_bytes(stl(shapes.box(8.0, 8.0, 20.0)))
    head = "version = 1\n[[part]]\n[[part]]\nnormal = [0, 0, 1]\noffset_mm = 6\n"
    volumes = "[[modifier]]\nmesh = 'insert.stl'\nprocess = {infill_density = 1}\n"
    volumes += "[[modifier]]\nz_mm = [2, 4]\nprocess = {walls = 5}\n"
    Path("plain.toml").write_text(head)
    Path("box.toml").write_text(head + volumes)
    sparse = "--set", "process.solid_below_mm2=0"
    _run("export", "box.stl", "--plan", "plain.toml", "-o", "plain.gcode", "--json", "plain.json", *sparse)
    _run("export", "box.stl", "--plan", "box.toml", "-o", "box.gcode", "--json", "box.json", *sparse)
    assert _values("box.json")["extruded_mm3"] > _values("plain.json")["extruded_mm3"] + 100.0
    _run("decompose", "box.stl", "--plan", "box.toml", "-o", "parts")
    _run("export", "box.stl", "--plan", "parts/plan.toml", "-o", "again.gcode", *sparse)
    assert 'mesh = "../insert.stl"' in Path("parts/plan.toml").read_text()
    assert Path("again.gcode").read_bytes() == Path("box.gcode").read_bytes()


MODIFIER = "version = 1\n[[part]]\n[[modifier]]\nz_mm = [1, 2]\nprocess = "


@pytest.mark.parametrize(
    ("process", "sentence"),
    [
        ("{layer_height_mm = 0.1}", "modifier 1: process.layer_height_mm holds for a whole part: walls, top_layers,"),
        ("{first_layer_speed_mm_s = 10}", "modifier 1: process.first_layer_speed_mm_s holds for a whole part: walls,"),
        ("{support = 'none'}", "modifier 1: process.support holds for a whole part: walls,"),
        ("{walls = 0}", "modifier 1: process.walls is 0: at least 1 is allowed"),
        ("{infill_density = 3}", "modifier 1: process.infill_density is 3"),
        ("{wals = 3}", "modifier 1: process.wals"),
    ],
)
def test_settings_that_no_modifier_may_have_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], process: str, sentence: str
) -> None:
    Path("box.stl").write_bytes(stl(shapes.box()))
    Path("mine.toml").write_text(MODIFIER + process)
    assert main(["export", "box.stl", "--plan", "mine.toml", "-o", "box.gcode", *FAST]) == 1
    assert f"tiltprint: plan mine.toml: {sentence}" in capsys.readouterr().err


def test_requesting_more_parts_than_possible_gives_all_and_reports_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    _run("decompose", "tee.stl", "--parts", "50", "--json", "many.json")
    count = len(_values("many.json")["parts"])
    assert f"tee.stl: --parts 50: the search found no more than {count}\n" in capsys.readouterr().err


HIGH = "version = 1\n[[part]]\n[[part]]\nnormal = [0, 0, 1]\noffset_mm = 500\n"
OTHER = f"sha256 = 'abc'\nmodel = 'other.stl'\n{HIGH}"
REFUSED = [
    ("--plan", HIGH, "plan mine.toml: part 2 cannot be cut off: its plane misses the model"),
    ("--planes", HIGH, "plan mine.toml: part 2 cannot be cut off: its plane misses the model"),
    ("--plan", OTHER, "plan mine.toml was made for another model: other.stl is not tee.stl as it is read now"),
    ("--planes", OTHER, "plan mine.toml was made for another model: other.stl is not tee.stl as it is read now"),
    ("--planes", "version = 1\n[[part]]\n[[part]]\n", "part 2 has neither normal nor offset_mm"),
]


@pytest.mark.parametrize(("option", "text", "sentence"), REFUSED)
def test_planes_that_cannot_be_cut_end_in_one_sentence(
    folder: Path, capsys: pytest.CaptureFixture[str], option: str, text: str, sentence: str
) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    Path("mine.toml").write_text(text)
    assert main(["decompose", "tee.stl", option, "mine.toml", "-o", "parts", *FAST]) == 1
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("tiltprint: ")
    assert sentence in last
    assert not Path("parts").exists()


@pytest.mark.parametrize("laid", [False, True])
def test_export_by_a_plan_gives_the_g_code_of_the_search_byte_by_byte(folder: Path, laid: bool) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    given = [*FAST, *(["--set", "search.seam_mm=100"] if laid else ["--as-is"])]  # a seam too costly to cut
    assert main(["export", "tee.stl", "-o", "searched.gcode", *given]) == 0
    assert main(["decompose", "tee.stl", "--plan", "tee.toml", *given]) == 0
    assert main(["export", "tee.stl", "-o", "planned.gcode", "--plan", "tee.toml", *given]) == 0
    plan_text = Path("tee.toml").read_text()
    assert (plan_text.count("[[part]]") > 1, "orientation" in plan_text) == (not laid, laid)
    assert Path("planned.gcode").read_bytes() == Path("searched.gcode").read_bytes()


def test_manual_planes_are_saved_in_the_plan_with_their_zones(folder: Path) -> None:
    Path("tee.stl").write_bytes(stl(shapes.tee()))
    zone = "[[keep]]\nmin_mm = [-2.0, -2.0, 10.0]\nmax_mm = [2.0, 2.0, 11.0]\n"
    Path("mine.toml").write_text(f"version = 1\n{zone}")
    _run("decompose", "tee.stl", "--planes", "mine.toml", "--plan", "tee.toml", "--json", "zone.json")
    assert zone in Path("tee.toml").read_text()
    *_, last = _values("zone.json")["parts"][1:]
    base = f"normal = {last['base']['normal']}\noffset_mm = {last['base']['offset_mm']}"
    Path("mine.toml").write_text(f"version = 1\n[[part]]\n[[part]]\n{base}\n")
    _run("decompose", "tee.stl", "--planes", "mine.toml", "--json", "planes.json")
    assert _values("planes.json")["parts"][-1]["base"] == last["base"]


def test_a_planes_file_says_what_the_colours_of_a_model_mean_and_the_plan_keeps_it(folder: Path) -> None:
    tee = shapes.from_manifold(solid_of(shapes.tee()).refine_to_length(5.0))
    most = tee.vertices[tee.faces].mean(axis=1)[:, 2] > 2.0
    Path("tee.ply").write_bytes(painted_ply(Mesh(tee.vertices, tee.faces, np.where(most, 0x00FF00, 0x808080).astype(np.int32))))
    Path("marks.toml").write_text('version = 1\n[[no_seam]]\ncolour = "#00FF00"\n')
    _run("decompose", "tee.ply", "--json", "free.json")
    _run("decompose", "tee.ply", "--planes", "marks.toml", "-o", "a", "--json", "a.json")
    assert len(_values("free.json")["parts"]) > 1
    assert len(_values("a.json")["parts"]) == 1
    assert '[[no_seam]]\ncolour = "#00ff00"\n' in Path("a/plan.toml").read_text()
    _run("decompose", "tee.ply", "--plan", "a/plan.toml", "--json", "again.json")
    assert _values("again.json")["cost_mm2"] == pytest.approx(_values("a.json")["cost_mm2"])
