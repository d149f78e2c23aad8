"""Project files: a project prints like its source, other slicers read it as a model, and damaged files are refused."""

import io
import json
import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from machine.cli.cli import main
from machine.cli.commands.export import save
from machine.pipeline.project import INSIDE, STANDING, Project, close_projects, is_project, open_project, project_bytes, unpack
from machine.pipeline.project_record import RECORD
from machine.pipeline.requests import Given, ModelRequest
from mdp.cut import mesh_of
from mdp.read import read_mesh
from mdp.save import MODEL_PART, stl
from mdp.search.plan_file import PlanFile
from profiles.profile import load
from tests.shapes import box, tee

FAST = ("--set", "search.directions=20", "--set", "process.layer_height_mm=0.4", "--set", "machine.thumbnails_px=[]")
FAST += ("--set", "process.infill_density=0.05", "--set", "process.first_layer_height_mm=0.4")

PLAN = """
version = 1
[[part]]
[[part]]
normal = [0.0, 0.0, 1.0]
offset_mm = 12.0
process = {infill_density = 0.4}
[[no_seam]]
min_mm = [-30.0, -30.0, 5.0]
max_mm = [30.0, 0.0, 9.0]
[[modifier]]
mesh = "insert.stl"
process = {walls = 4}
"""
MINE = """
inherits = "standard"
[process]
name = "mine"
walls = 3
"""


GIVEN: dict[str, object] = {"machine": "generic_ac", "material": "pla", "process": "standard", "settings": []}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("tee.stl").write_bytes(stl(tee()))
    Path("insert.stl").write_bytes(stl(mesh_of(Manifold.cube((6.0, 6.0, 6.0)).translate((0.0, 0.0, 2.0)))))
    Path("plan.toml").write_text(PLAN)
    Path("mine.toml").write_text(MINE)
    return tmp_path


def run(*words: str) -> None:
    assert main(words) == 0


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A project of one part in its given orientation."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("saved"))
        Path("tee.stl").write_bytes(stl(tee()))
        run("save", "tee.stl", *FAST, "--parts", "1", "--as-is", "-o", "tee.3mf")
        return Path("tee.3mf").read_bytes()


@pytest.fixture
def project(folder: Path, saved: bytes) -> Path:
    """The project is saved beside the other files of the folder."""
    Path("tee.3mf").write_bytes(saved)
    return folder


def test_a_project_of_several_models_has_the_copies_of_each(folder: Path) -> None:
    (folder / "box.stl").write_bytes(stl(box(8.0, 8.0, 2.0)))
    names: tuple[None, ...] = (None, None, None)
    plate = ModelRequest("tee.stl", load(), profile_names=names, parts=1, orient=False, copies=2, beside=3 * ("box.stl",))
    assert save(plate, folder / "plate.3mf") == 0
    (folder / "open").mkdir()
    project = unpack(folder / "plate.3mf", folder / "open")
    assert (project.copies, [(other.name, other.copies) for other in project.beside]) == (2, [("box.stl", 6)])


@pytest.mark.parametrize(
    "options",
    [
        ("--parts", "1", "--as-is", "--part", "1:walls=4", "--pause", "1:3", "--filament-change", "1:2.5mm"),
        ("--plan", "plan.toml", "--process", "mine.toml", "--machine", "fractal5pro"),
        ("--parts", "1", "--as-is", "--copies", "2", "--set", "process.scale=0.5"),
        ("--parts", "1", "--orient"),
    ],
)
def test_a_moved_project_prints_the_same_as_the_model_it_was_saved_from(folder: Path, options: tuple[str, ...]) -> None:
    run("export", "tee.stl", *FAST, *options, "-o", "before.gcode")
    run("save", "tee.stl", *FAST, *options, "-o", "tee.3mf")
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    shutil.move("tee.3mf", elsewhere)
    before = Path("before.gcode").read_bytes()
    for file in folder.glob("*.*"):
        file.unlink()
    run("export", "elsewhere/tee.3mf", "-o", "after.gcode")
    assert Path("after.gcode").read_bytes() == before
    run("save", "elsewhere/tee.3mf", "-o", "again.3mf")
    assert Path("again.3mf").read_bytes() == (elsewhere / "tee.3mf").read_bytes()


@pytest.mark.usefixtures("folder")
def test_options_on_the_command_line_hold_over_those_of_the_project() -> None:
    run("save", "tee.stl", *FAST, "--parts", "1", "--as-is", "--set", "process.walls=3", "--pause", "1:3", "-o", "tee.3mf")
    run("export", "tee.3mf", "--set", "process.walls=4", "--pause", "1:5", "-o", "over.gcode")
    run("export", "tee.stl", *FAST, "--parts", "1", "--as-is", "--set", "process.walls=4", "--pause", "1:5", "-o", "own.gcode")
    assert Path("over.gcode").read_bytes() == Path("own.gcode").read_bytes()


@pytest.mark.usefixtures("folder")
def test_other_programs_read_the_oriented_model_and_its_thumbnail() -> None:
    run("save", "tee.stl", *FAST, "--parts", "1", "--as-is", "--set", "process.rotate_deg=[90,0,0]", "-o", "tee.3mf")
    scene = trimesh.load("tee.3mf")
    laid, _ = read_mesh(Path("tee.stl"), 1.0, (90.0, 0.0, 0.0))
    assert scene.bounds == pytest.approx(laid.bounds_mm, abs=1e-6)
    assert scene.volume == pytest.approx(laid.volume_mm3, rel=1e-6)
    with zipfile.ZipFile("tee.3mf") as archive:
        assert archive.read("Metadata/thumbnail.png")[:8] == b"\x89PNG\r\n\x1a\n"
        assert b"Metadata/thumbnail.png" in archive.read("_rels/.rels")


@pytest.mark.usefixtures("folder")
def test_a_project_of_the_workbench_that_is_saved_again_still_says_that_its_plan_has_all_marks() -> None:
    project = Project("tee.stl", Path("tee.stl"), Given(), parts=1, marks_in_plan=True)
    plan = PlanFile("tee.stl", orientation=STANDING)
    Path("bench.3mf").write_bytes(project_bytes(project, [plan], tee(), b""))
    run("save", "bench.3mf", "-o", "again.3mf")
    project_again = open_project("again.3mf")
    assert project_again is not None
    assert project_again.marks_in_plan


@pytest.mark.usefixtures("folder")
def test_a_mark_s_mesh_with_a_long_name_is_read_again_from_the_project() -> None:
    name = 100 * "ü" + ".stl"
    shutil.copy("insert.stl", name)
    Path("plan.toml").write_text(PLAN.replace("insert.stl", name))
    run("save", "tee.stl", *FAST, "--plan", "plan.toml", "-o", "long.3mf")
    run("decompose", "long.3mf", "-o", "parts")


@pytest.mark.usefixtures("project")
@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--orient",), "--orient: the project tee.3mf says how its model lies; decompose the model itself to change that"),
        (("--record", "r"), "--record r: the project tee.3mf has its parts, so nothing is searched that could be recorded"),
    ],
)
def test_options_that_a_project_leaves_no_room_for_are_refused_by_its_name(
    options: tuple[str, ...], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(["decompose", "tee.3mf", *options]) == 1
    assert capsys.readouterr().err.strip().endswith(sentence)


def changed(path: Path, name: str, content: bytes | None) -> None:
    """Write a project again with other content of one of its files; None: without that file."""
    with zipfile.ZipFile(path) as archive:
        files = {entry: archive.read(entry) for entry in archive.namelist()}
    files[name] = content if content is not None else b""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for entry, text in files.items():
            if entry != name or content is not None:
                archive.writestr(entry, text)
    path.write_bytes(buffer.getvalue())


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        (MODEL_PART, b"<model/>", "another program has changed the model in this project"),
        (MODEL_PART, None, "this project is damaged"),
        (INSIDE + RECORD, b'{"version": 1, "na', "this project is damaged: work.json is not JSON"),
        (INSIDE + RECORD, None, "this project is damaged: Metadata/tiltprint/work.json is missing"),
        (INSIDE + "plan.toml", None, "this project is damaged: its file plan.toml is missing"),
        (INSIDE + RECORD, b'{"version": 99}', "was saved by a newer tiltprint, which can open it"),
        (INSIDE + "..", b"x", "this project is damaged"),
        (INSIDE + 300 * "a", b"x", "this project is damaged"),
        (INSIDE + "plan.toml", b"version = ", "this project is damaged"),
    ],
)
@pytest.mark.usefixtures("project")
def test_a_damaged_project_is_refused_in_one_sentence(
    name: str, content: bytes | None, sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    changed(Path("tee.3mf"), name, content)
    capsys.readouterr()
    assert main(["export", "tee.3mf", "-o", "after.gcode"]) == 1
    said = capsys.readouterr().err
    assert sentence in said
    assert "Traceback" not in said
    assert not Path("after.gcode").exists()


@pytest.mark.parametrize("name", ["", "..", "a/b.stl", "a\0b.stl", 400 * "a", "\ud800.stl"])
@pytest.mark.usefixtures("project")
def test_a_model_s_name_that_no_file_can_have_is_damage(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with zipfile.ZipFile("tee.3mf") as archive:
        record = json.loads(archive.read(INSIDE + RECORD))
    changed(Path("tee.3mf"), INSIDE + RECORD, json.dumps(record | {"name": name}).encode())
    assert main(["export", "tee.3mf", "-o", "after.gcode"]) == 1
    assert "this project is damaged" in capsys.readouterr().err


@pytest.mark.usefixtures("project")
def test_a_project_with_files_outside_its_folder_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    changed(Path("tee.3mf"), INSIDE + "../../outside.txt", b"x")
    assert main(["export", "tee.3mf", "-o", "after.gcode"]) == 1
    assert "this project is damaged" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words", [("save", "-o", "tee.3mf"), ("export", "-o", "tee.3mf"), ("export", "-o", "a.gcode", "--json", "tee.3mf")]
)
@pytest.mark.usefixtures("project")
def test_a_project_that_is_read_is_never_written_over(words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    before = Path("tee.3mf").read_bytes()
    assert main([words[0], "tee.3mf", *words[1:]]) == 1
    assert "the same file as the project, which is read" in capsys.readouterr().err
    assert Path("tee.3mf").read_bytes() == before


@pytest.mark.usefixtures("folder")
def test_a_model_name_with_unusual_characters_is_kept() -> None:
    name = "my\u00a0t\u00e9e \u732b '1'.stl"
    Path("tee.stl").rename(name)
    run("save", name, *FAST, "--parts", "1", "--as-is", "-o", "tee.3mf")
    run("decompose", "tee.3mf", "-o", "parts")
    assert json.loads(Path("parts/decomposition.json").read_text())["model"] == name


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        (
            "rotation",
            [[1, 0, 0], [0, 1, 0]],
            "rotation is [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]: it must be three rows",
        ),
        ("rotation", [[2, 0, 0], [0, 1, 0], [0, 0, 1]], "it must be three rows of a rotation"),
        ("rotation", [[-1, 0, 0], [0, 1, 0], [0, 0, 1]], "it must be three rows of a rotation"),
        ("rotation", [[1, 0, 0], [0, 0, -1], [0, 1, 0]], "which is not the orientation of plan.toml"),
        ("copies", -4, "work.json: copies is -4: it must be a whole number from 1 to 1000"),
        ("copies", True, "work.json: copies is true: it must be a whole number from 1 to 1000"),
        ("parts", float("inf"), "work.json: parts is inf: it must be a whole number"),
        ("parts", -3.5, "parts is -3.5: it must be a whole number from 0 to"),
        ("parts", 2, "work.json: parts is 2: plan.toml has 1"),
        ("locked", [1], "locked is [1]: it must be places of the 0 planes, from 0"),
        ("pauses", ["0:3"], "pauses and changes: 0:3: PART:LAYER or PART:HEIGHTmm is expected"),
        ("figures", {"time_s": "1"}, "work.json: figures.time_s is 1: it must be a valid number"),
        ("changes", ["a"], "pauses and changes: a: PART:LAYER or PART:HEIGHTmm is expected"),
        ("model", None, "model is null: it must be a text"),
        ("model", "", "work.json: model is missing"),
        ("beside", [["box.stl", "", 1]], "work.json: model is missing"),
        ("beside", [["box.stl", "box.stl", 1]], "work.json: model is 'box.stl': a file model-... of the project is expected"),
        ("beside", [["tee.stl", "", 1]], "beside names tee.stl next to tee.stl: each model must occur once"),
        ("beside", [["demo:tree", "", 0]], "work.json: beside.0.copies is 0: it must be"),
        ("beside", [["../box.stl", "", 1]], "name is '../box.stl': it must be the name of a file"),
        ("plan", False, "work.json: plan is false: a project has one"),
        ("marks_in_plan", 3, "marks_in_plan is 3: it must be true or false"),
        ("given", GIVEN | {"machine": "/etc/passwd"}, "machine is '/etc/passwd'"),
        ("given", GIVEN | {"machine": 3}, "given.machine is 3: it must be a text"),
    ],
)
@pytest.mark.usefixtures("project")
def test_a_record_that_no_project_has_is_damage(
    key: str, value: object, sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with zipfile.ZipFile("tee.3mf") as archive:
        record = json.loads(archive.read(INSIDE + RECORD))
    changed(Path("tee.3mf"), INSIDE + RECORD, json.dumps(record | {key: value}).encode())
    assert main(["export", "tee.3mf", "-o", "after.gcode"]) == 1
    said = capsys.readouterr().err
    assert said.startswith("tiltprint: tee.3mf: this project is damaged: ")
    assert sentence in said


@pytest.mark.usefixtures("project")
def test_a_project_archive_with_folder_entries_opens() -> None:
    changed(Path("tee.3mf"), INSIDE, b"")
    run("decompose", "tee.3mf", "-o", "parts")


@pytest.mark.usefixtures("folder")
def test_a_pause_before_a_part_that_does_not_exist_is_not_saved(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["save", "tee.stl", *FAST, "--parts", "1", "--as-is", "--pause", "2:5", "-o", "tee.3mf"]) == 1
    assert "--pause 2:5: there is no part 2, there is only part 1" in capsys.readouterr().err
    assert not Path("tee.3mf").exists()


@pytest.mark.usefixtures("project")
def test_a_project_with_a_replaced_model_is_damaged(capsys: pytest.CaptureFixture[str]) -> None:
    with zipfile.ZipFile("tee.3mf") as archive:
        (model,) = (name for name in archive.namelist() if name.startswith(INSIDE + "model-"))
    changed(Path("tee.3mf"), model, Path("insert.stl").read_bytes())
    assert main(["export", "tee.3mf", "-o", "after.gcode"]) == 1
    assert f"this project is damaged: its file {model.removeprefix(INSIDE)} is not as it was saved" in capsys.readouterr().err


@pytest.mark.usefixtures("project")
def test_a_machine_that_is_not_known_is_named_with_the_project_that_asks_for_it(capsys: pytest.CaptureFixture[str]) -> None:
    with zipfile.ZipFile("tee.3mf") as archive:
        record = json.loads(archive.read(INSIDE + RECORD))
    changed(Path("tee.3mf"), INSIDE + RECORD, json.dumps(record | {"given": GIVEN | {"machine": "nosuch"}}).encode())
    capsys.readouterr()
    assert main(["export", "tee.3mf", "-o", "after.gcode"]) == 1
    assert capsys.readouterr().err.startswith("tiltprint: tee.3mf: machine profile 'nosuch' is not known")


@pytest.mark.usefixtures("folder")
def test_a_batch_has_its_options_over_a_project_as_export_has() -> None:
    lying = ("--parts", "1", "--as-is")
    Path("models").mkdir()
    run("save", "tee.stl", *FAST, *lying, "--set", "process.walls=3", "-o", "models/tee.3mf")
    run("batch", "models", "-o", "out", "--process", "draft", "--workers", "1")
    run("export", "models/tee.3mf", "--process", "draft", "-o", "one.gcode")
    assert Path("out/tee.gcode").read_bytes() == Path("one.gcode").read_bytes()


@pytest.mark.parametrize("models", [("tee.3mf", "tee.stl"), ("tee.stl", "tee.3mf"), ("tee.3mf:2",)])
@pytest.mark.usefixtures("project")
def test_a_project_cannot_share_a_plate_with_other_models(models: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", *models, "-o", "after.gcode"]) == 1
    assert "is a project, which is a plate of its own" in capsys.readouterr().err


@pytest.mark.usefixtures("folder")
def test_another_process_replaces_the_project_s_settings_but_keeps_the_model_s_orientation() -> None:
    lying = ("--parts", "1", "--as-is", "--set", "process.scale=0.5")
    run("save", "tee.stl", *lying, "--set", "process.layer_height_mm=0.3", "-o", "tee.3mf")
    run("export", "tee.3mf", "--process", "draft", "-o", "after.gcode")
    run("export", "tee.stl", *lying, "--process", "draft", "-o", "before.gcode")
    assert Path("after.gcode").read_bytes() == Path("before.gcode").read_bytes()


def test_a_plan_of_a_project_s_parts_cuts_when_the_project_is_gone(folder: Path) -> None:
    Path("plan.toml").write_text(PLAN + '[[no_support]]\nmesh = "insert.stl"\n')
    run("save", "tee.stl", *FAST, "--plan", "plan.toml", "-o", "tee.3mf")
    Path("insert.stl").unlink()
    run("export", "tee.3mf", "-o", "before.gcode")
    run("decompose", "tee.3mf", "-o", "parts")
    close_projects()
    Path("tee.3mf").unlink()
    run("export", "tee.stl", *FAST, "--plan", "parts/plan.toml", "-o", "after.gcode")
    assert Path("after.gcode").read_bytes() == Path("before.gcode").read_bytes()


@pytest.mark.usefixtures("folder")
def test_a_gltf_that_needs_other_files_is_not_saved(capsys: pytest.CaptureFixture[str]) -> None:
    for name, content in trimesh.Scene(trimesh.creation.box((20, 20, 20))).export(file_type="gltf").items():
        Path(name).write_bytes(content)
    assert main(["save", "model.gltf", *FAST, "--parts", "1", "--as-is", "--set", "process.scale=1", "-o", "box.3mf"]) == 1
    assert "a project holds one model file: save it as .glb first" in capsys.readouterr().err
    assert not Path("box.3mf").exists()


@pytest.mark.usefixtures("folder")
def test_a_plain_3mf_is_no_project(capsys: pytest.CaptureFixture[str]) -> None:
    trimesh.Trimesh(*(np.array(a) for a in (tee().vertices, tee().faces))).export("plain.3mf")
    assert not is_project(Path("plain.3mf"))
    assert main(["save", "plain.3mf", "-o", "plain.3mf"]) == 1
    assert "the same file as the model, which is read" in capsys.readouterr().err
    assert main(["save", "tee.stl", "-o", "tee.stl"]) == 1
    assert "a name that ends in .3mf is expected" in capsys.readouterr().err
