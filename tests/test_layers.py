"""Layers form a straight line, rooms are above their imports, and third-party libraries stay in their rooms: read from all
imports."""

import subprocess
import sys
from graphlib import CycleError
from pathlib import Path

import pytest

from tools.docs import draw_rooms
from tools.docs.draw_rooms import LAYERS, PICTURE, draw, floors, import_graph, imports, room_graph, rooms_of

ROOT = Path(__file__).resolve().parents[1]
# Third-party library -> the prefixes of the module paths that may import it.
CONFINED = {
    "trimesh": ("mdp/formats/scene", "mdp/mesh", "mdp/save"),
    "cascadio": ("mdp/formats/cad_library",),
    "manifold3d": (
        "mdp/cut",
        "mdp/cost/footing",
        "mdp/joint",
        "mdp/pedestal",
        "mdp/repair/",
        "mdp/formats/polygons",
        "slicer/geometry/",
        "slicer/interface/",
        "machine/kinematics/collision",
        "machine/pipeline/precompile",
        "machine/setup/coupon/",
    ),
    "numba": ("mdp/kernels/",),
    "llvmlite": ("mdp/kernels/cache.py",),
    "shapely": ("slicer/strokes/order", "machine/dryrun/placement"),
    "onnxruntime": ("mdp/ranking/",),
    "serial": ("machine/link/port.py",),
    "httpx": ("machine/printing/servers/http.py",),
    "segno": ("machine/workbench/access/",),
    "starlette": ("machine/workbench/", "machine/view/serving/"),
    "uvicorn": ("machine/workbench/", "machine/view/serving/"),
    "websockets": (),
    "pydantic": ("profiles/", "machine/pipeline/project_record.py", "machine/workbench/"),
    "rich": ("machine/cli/", "machine/pipeline/", "mdp/batch/"),
    "prompt_toolkit": ("machine/cli/",),
    "PIL": ("machine/pipeline/pictures.py",),
    "tomlkit": ("machine/setup/", "mdp/search/plan_writing.py"),
    "platformdirs": ("profiles/folders.py",),
    "torch": ("mdp/learning/",),
    "xgboost": ("mdp/learning/",),
    "onnx": ("mdp/learning/",),
    "matplotlib": ("mdp/learning/",),
    "dask": ("mdp/batch/",),
    "distributed": ("mdp/batch/",),
    "tests": (),
    "tools": (),
}
FRONT_ENDS = ("machine/cli/", "machine/workbench/")  # they talk to users; no lower module imports them
HEAVY = {
    "numba",
    "rich",
    "PIL",
    "prompt_toolkit",
    "tomlkit",
    "trimesh",
    "cascadio",
    "shapely",
    "manifold3d",
    "serial",
    "httpx",
    "starlette",
    "uvicorn",
    "websockets",
    "onnxruntime",
    "torch",
    "xgboost",
    "onnx",
    "matplotlib",
    "dask",
    "distributed",
}


def offences(path: str, source: str) -> list[str]:
    """Forbidden imports of a module at a path relative to the root, as one sentence for each package."""
    layer = path.split("/")[0]
    wrong: dict[tuple[str, str], str] = {}
    for module in imports(source):
        top = module.split(".")[0]
        if not top:
            wrong["relative", top] = f"{path} imports by a relative name"
        if top in LAYERS and LAYERS.index(top) > LAYERS.index(layer):
            wrong["layer", top] = f"{path} imports {module}, which lies to the right of {layer}"
        if f"{module.replace('.', '/')}/".startswith(FRONT_ENDS) and not path.startswith(FRONT_ENDS):
            wrong["front end", top] = f"{path} imports {module}: only the two front ends know each other"
        if module.startswith("machine.view") and path.startswith("machine/printing/"):
            wrong["view", top] = f"{path} imports {module}: the page that watches a print is handed in"
        if top in CONFINED and not path.startswith(CONFINED[top]):
            wrong["confined", top] = f"{path} imports {module}, which is confined to {CONFINED[top] or 'no package'}"
    return list(wrong.values())


def modules() -> list[str]:
    return sorted(path.relative_to(ROOT).as_posix() for layer in LAYERS for path in (ROOT / layer).rglob("*.py"))


def test_every_package_is_checked() -> None:
    assert {path.split("/")[0] for path in modules()} == set(LAYERS)
    assert "machine/pipeline/pictures.py" in modules()


@pytest.mark.parametrize("path", modules())
def test_a_module_imports_only_from_its_left_and_third_parties_only_where_they_belong(path: str) -> None:
    assert offences(path, (ROOT / path).read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("path", "source", "count"),
    [
        ("mdp/a.py", "import numpy\nfrom profiles.machine import Machine", 0),
        ("mdp/a.py", "import slicer.walls", 1),
        ("mdp/a.py", "def late():\n    from machine import gcode", 1),
        ("profiles/a.py", "import mdp.mesh, pydantic", 1),
        ("slicer/a.py", "import trimesh.repair", 1),
        ("mdp/formats/ply.py", "import trimesh", 1),
        ("mdp/formats/scene.py", "import trimesh", 0),
        ("machine/link/port.py", "import serial", 0),
        ("machine/link/stream.py", "import serial", 1),
        ("machine/cli/a.py", "from tests.shapes import box\nimport torch", 2),
        ("slicer/a.py", "from . import walls", 1),
        ("slicer/walls/a.py", "import numba, shapely, manifold3d", 3),
        ("machine/pipeline/a.py", "from machine.cli.terminal import say", 1),
        ("machine/workbench/a.py", "from machine.cli.terminal import say", 0),
        ("machine/printing/a.py", "from machine.view.page import print_page", 1),
    ],
)
def test_the_check_finds_what_is_forbidden_and_only_that(path: str, source: str, count: int) -> None:
    assert len(offences(path, source)) == count


def test_the_command_line_starts_without_heavy_imports() -> None:
    run = subprocess.run(
        [sys.executable, "-c", "import sys, machine.cli.cli; print(*{name.split('.')[0] for name in sys.modules})"],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert "typer" in run.stdout.split()
    assert HEAVY & set(run.stdout.split()) == set()


def test_no_room_imports_one_above_it_and_the_picture_of_the_house_is_the_code_s() -> None:
    assert PICTURE.read_text(encoding="utf-8") == draw(), "python tools/docs/draw_rooms.py draws it anew"


def test_two_rooms_that_import_each_other_are_found() -> None:
    graph = {"a.one.x": {"a.two.y"}, "a.two.y": {"a.one.x"}}
    with pytest.raises(CycleError):
        floors(room_graph(graph, rooms_of(graph)))


def test_no_file_imports_itself_through_others_even_for_types() -> None:
    sources = {module: source for module, source in draw_rooms.modules().items() if not module.endswith("__init__")}
    floors(import_graph(sources))  # raises CycleError with the files of a cycle


def test_a_cycle_under_type_checking_is_found() -> None:
    late = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from a.one import One"
    with pytest.raises(CycleError):
        floors(import_graph({"a.one": "from a.two import Two", "a.two": late}))


def test_files_at_the_top_of_a_folder_are_values_below_its_rooms_or_stages_above_them() -> None:
    graph = {"a.value": set(), "a.room.x": {"a.value"}, "a.stage": {"a.room.x", "a.value"}}
    rooms = rooms_of(graph)
    assert rooms == {"a.value": "a.value", "a.room.x": "a.room", "a.stage": "a.stage"}
    assert floors(room_graph(graph, rooms)) == {"a.value": 0, "a.room": 1, "a.stage": 2}


def test_a_file_that_is_not_there_is_refused_before_numpy_is_loaded() -> None:
    run = "main(['export', 'none.stl', '-o', 'x.gcode'])"
    program = f"import sys; from machine.cli.cli import main; {run}; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("False\n", "tiltprint: none.stl: there is no such file\n")
