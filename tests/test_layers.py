"""The layers are a straight line and third parties stay where they belong: read from the imports of every module."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LAYERS = ("profiles", "mdp", "slicer", "machine")
# Third party -> the beginnings of the module paths that may import it; nowhere else in the packages.
CONFINED = {
    "trimesh": ("mdp/read", "mdp/formats/", "mdp/repair", "mdp/threemf"),
    "onnxruntime": ("mdp/ranker",),
    "serial": ("machine/link/port.py",),
    "pydantic": ("profiles/",),
    "rich": ("machine/app/",),
    "torch": (),
    "tests": (),
    "tools": (),
}
HEAVY = {"numba", "rich", "trimesh", "shapely", "manifold3d", "serial", "onnxruntime", "torch"}


def imported(source: str) -> Iterator[str]:
    """Every module that a source imports anywhere, inside functions too."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")


def offences(path: str, source: str) -> list[str]:
    """What a module at a path relative to the root imports although it must not."""
    layer = path.split("/")[0]
    found = []
    for module in imported(source):
        top = module.split(".")[0]
        if module.startswith("."):
            found.append(f"{path} imports {module} by a relative name")
        if top in LAYERS and LAYERS.index(top) > LAYERS.index(layer):
            found.append(f"{path} imports {module}, which lies to the right of {layer}")
        if top in CONFINED and not path.startswith(CONFINED[top]):
            found.append(f"{path} imports {module}, which is confined to {CONFINED[top] or 'no package'}")
    return found


def modules() -> list[str]:
    return sorted(path.relative_to(ROOT).as_posix() for layer in LAYERS for path in (ROOT / layer).rglob("*.py"))


def test_every_package_is_looked_at() -> None:
    assert {path.split("/")[0] for path in modules()} == set(LAYERS)
    assert "machine/app/picture.py" in modules()


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
        ("mdp/read.py", "import trimesh", 0),
        ("machine/link/port.py", "import serial", 0),
        ("machine/link/stream.py", "import serial", 1),
        ("machine/app/a.py", "from tests.shapes import box\nimport torch", 2),
        ("slicer/a.py", "from . import walls", 1),
    ],
)
def test_the_check_finds_what_is_forbidden_and_only_that(path: str, source: str, count: int) -> None:
    assert len(offences(path, source)) == count


def test_the_command_line_starts_without_heavy_imports() -> None:
    run = subprocess.run(
        [sys.executable, "-c", "import sys, machine.app.cli; print(*{name.split('.')[0] for name in sys.modules})"],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert "typer" in run.stdout.split()
    assert HEAVY & set(run.stdout.split()) == set()
