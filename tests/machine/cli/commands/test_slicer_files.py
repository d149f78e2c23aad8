"""Projects of other slicers on the command line: their painted marks, plates and embedded settings."""

import json
from pathlib import Path

import manifold3d as m3
import numpy as np
import pytest

from machine.cli.cli import main
from profiles.foreign.read import read_config
from tests.mdp import files
from tests.mdp.files import stl
from tests.mdp.slicer_files import AT_ORIGIN, Made, Object, Placed, bambu, prusaslicer
from tests.shapes import from_manifold

FAST = ["--parts", "1", "--as-is", "--set", "process.layer_height_mm=0.4", "--set", "process.first_layer_height_mm=0.3"]
POST = m3.Manifold.cube((8.0, 10.0, 12.0), True).translate((0.0, 0.0, 6.0))
TEE = POST + m3.Manifold.cube((32.0, 10.0, 4.0), True).translate((0.0, 0.0, 14.0))
RIGHT = m3.Manifold.cube((20.0, 20.0, 30.0), True).translate((15.0, 0.0, 8.0))  # around the right arm
INSERT = m3.Manifold.cube((20.0, 6.0, 3.0), True).translate((0.0, 0.0, 14.0))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def export(model: str, *options: str) -> dict[str, float]:
    assert main(["export", model, "-o", "out.gcode", "--json", "out.json", *FAST, *options]) == 0
    values: dict[str, float] = json.loads(Path("out.json").read_text())
    return values


def test_marks_of_a_project_print_what_the_same_marks_of_a_plan_do() -> None:
    turned = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    volumes = [Made(TEE), Made(RIGHT, "no_support"), Made(INSERT, "modifier", {"fill_density": "100%"})]
    prusaslicer(Path("tee.3mf"), [Object(volumes, [Placed(np.vstack([turned, [100.0, 80.0, 0.0]]))])])
    Path("tee.stl").write_bytes(stl(from_manifold(TEE.rotate((0.0, 0.0, 90.0)))))
    Path("tee.toml").write_text(
        "version = 1\n[[part]]\n[[no_support]]\nmin_mm = [-10, 5, -7]\nmax_mm = [10, 25, 23]\n"
        "[[modifier]]\nmin_mm = [-3, -10, 12.5]\nmax_mm = [3, 10, 15.5]\nprocess = {infill_density = 1.0}\n"
    )
    of_project = export("tee.3mf")
    assert export("tee.stl", "--plan", "tee.toml")["extruded_mm3"] == pytest.approx(of_project["extruded_mm3"], rel=1e-6)
    assert export("tee.stl")["extruded_mm3"] > of_project["extruded_mm3"] + 50.0


def test_marks_of_a_project_stay_with_a_model_that_its_plan_lays_down() -> None:
    """A tee on its side needs no support at its arms: the modifier inside must turn with them."""
    side = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    standing = prusaslicer(Path("up.3mf"), [Object([Made(TEE), Made(INSERT, "modifier", {"fill_density": "100%"})], [AT_ORIGIN])])
    lying = Placed(np.vstack([side, [0.0, 0.0, 20.0]]))
    prusaslicer(Path("down.3mf"), [Object([Made(TEE), Made(INSERT, "modifier", {"fill_density": "100%"})], [lying])])
    Path("plan.toml").write_text("version = 1\norientation = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]\n[[part]]\n")
    options = [option for option in FAST if option != "--as-is"]
    amounts = []
    for name, further in ((standing.name, ["--plan", "plan.toml"]), ("down.3mf", ["--as-is"])):
        assert main(["export", name, "-o", "out.gcode", "--json", "out.json", *options, *further]) == 0
        amounts.append(json.loads(Path("out.json").read_text())["extruded_mm3"])
    assert amounts[0] == pytest.approx(amounts[1], rel=1e-6)


def beside(x_mm: float, plate: int) -> Placed:
    return Placed(np.vstack([np.eye(3), [x_mm, 0.0, 0.0]]), plate)


def test_the_requested_plate_is_printed() -> None:
    objects = [Object([Made(POST)], [beside(0.0, 1)]), Object([Made(TEE)], [beside(300.0, 2)])]
    bambu(Path("two.3mf"), objects, np.random.default_rng(0))
    first, second = export("two.3mf"), export("two.3mf", "--plate", "2")
    assert np.ptp(np.array(first["bounds_mm"])[:, 0]) < 30.0 < np.ptp(np.array(second["bounds_mm"])[:, 0])
    assert main(["export", "two.3mf", "-o", "no.gcode", *FAST, "--plate", "3"]) == 1


def test_a_saved_project_prints_its_plate_and_the_settings_inside_again() -> None:
    objects = [
        Object([Made(POST)], [beside(0.0, 1)]),
        Object([Made(TEE), Made(INSERT, "modifier", {"wall_loops": "3"})], [beside(300.0, 2)]),
    ]
    bambu(Path("two.3mf"), objects, np.random.default_rng(0), settings_of("OrcaSlicer"))
    asked = ("--plate", "2", "--settings-of-file")
    first = export("two.3mf", *asked)
    assert main(["save", "two.3mf", "-o", "kept.3mf", *FAST, *asked]) == 0
    assert export("kept.3mf") == first


def settings_of(kind: str) -> dict[str, str]:
    """The file in a project that holds its settings."""
    if kind == "PrusaSlicer":
        return {
            "Metadata/Slic3r_PE.config": "; perimeters = 4\n; fill_density = 33%\n; filament_type = PETG\n; temperature = 231\n"
        }
    if kind == "OrcaSlicer":
        values = {
            "wall_loops": "4",
            "sparse_infill_density": "33%",
            "filament_type": ["PETG"],
            "nozzle_temperature": ["231", "9"],
        }
        return {"Metadata/project_settings.config": json.dumps(values)}
    values = {
        "print_changes": "wall_line_count = 2",
        "print_user": "wall_line_count = 4",
        "first_changes": "infill_sparse_density = 33",
        "first_user": "material_print_temperature = 231",
    }
    return {
        "Cura/a.global.cfg": "[metadata]\ntype = machine\n[containers]\n0 = print_user\n1 = print_changes\n",
        "Cura/b.extruder.cfg": "[metadata]\nposition = 0\n[containers]\n0 = first_user\n1 = first_changes\n",
        **{f"Cura/{name}.inst.cfg": f"[values]\n{text}\n" for name, text in values.items()},
        "Cura/Version.txt": "no ini",
    }


def test_a_profile_named_by_an_option_replaces_the_one_inside_the_file(capsys: pytest.CaptureFixture[str]) -> None:
    mesh = {1: files.threemf_mesh(from_manifold(POST))}
    files.threemf(Path("a.3mf"), mesh, '<item objectid="1"/>', parts=settings_of("PrusaSlicer"))
    export("a.3mf", "--settings-of-file", "--process", "draft")
    note = capsys.readouterr().err
    assert "of the material" in note
    assert "of the process" not in note
    named = ["--settings-of-file", "--process", "draft", "--material", "pla"]
    assert main(["export", "a.3mf", "-o", "out.gcode", *named]) == 1
    assert "name both profiles, so none of its settings would be used" in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["PrusaSlicer", "OrcaSlicer", "Cura"])
def test_a_project_is_printed_with_its_own_settings_on_request(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    files.threemf(Path("a.3mf"), {1: files.threemf_mesh(from_manifold(POST))}, '<item objectid="1"/>', parts=settings_of(kind))
    config = read_config(Path("a.3mf"))
    assert (config.program, config.number("perimeters"), config.number("temperature")) == (kind, 4.0, 231.0)
    export("a.3mf")
    assert "; process.walls = 4" not in Path("out.gcode").read_text()
    capsys.readouterr()
    export("a.3mf", "--settings-of-file", "--set", "process.infill_density=0.2")
    text = Path("out.gcode").read_text()
    assert "; process.walls = 4\n" in text
    assert "; process.infill_density = 0.2\n" in text  # --set has priority over the project's settings
    assert "S231" in text
    assert f"a.3mf: uses the settings of {kind} inside: " in capsys.readouterr().err


def test_a_file_without_settings_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    prusaslicer(Path("a.3mf"), [Object([Made(POST)], [AT_ORIGIN])])
    damaged = prusaslicer(Path("b.3mf"), [Object([Made(POST)], [AT_ORIGIN])], {"Metadata/project_settings.config": "{"})
    Path("a.stl").write_bytes(stl(from_manifold(POST)))
    for models, sentence in (
        (["a.3mf"], "a.3mf holds no print settings"),
        ([damaged.name], "profile b.3mf: the settings inside it are damaged"),
        (["a.stl"], "--settings-of-file: a.stl is not a .3mf in which a slicer has saved"),
        (["a.3mf", "a.stl"], "--settings-of-file goes with one model, and several are given: a.3mf, a.stl"),
    ):
        assert main(["export", *models, "-o", "out.gcode", "--settings-of-file", *FAST]) == 1
        assert sentence in capsys.readouterr().err
