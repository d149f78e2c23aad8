"""The tour names only what exists: every dotted name of a package in docs/*.md is a module, a function, a class or a field."""

import ast
import re
from pathlib import Path

import pytest

from tools.draw_rooms import modules

ROOT = Path(__file__).resolve().parents[1]
NAME = re.compile(r"`((?:profiles|mdp|slicer|machine)(?:\.[A-Za-z_]\w*)+)([(][^`]*)?`")
SECTION_KEYS = re.compile(
    r"machine\.(?:x|y|z|tilt|turn|table|head|gcode\.(?:start|end|before_part|after_part)|[a-z]+_\w+|uncalibrated|name|dialect)\b"
)


def named(page: str) -> list[str]:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return sorted({found[1] for found in NAME.finditer(text) if not SECTION_KEYS.match(found[1])})


def exists(name: str) -> bool:
    """True for a package, a module, and what a module defines, down to the fields and methods of its classes."""
    steps = name.split(".")
    for count in range(len(steps), 0, -1):
        place = ROOT.joinpath(*steps[:count])
        file = place.with_suffix(".py") if place.with_suffix(".py").is_file() else place / "__init__.py"
        if file.is_file():
            return _defined(ast.parse(file.read_text(encoding="utf-8")).body, steps[count:])
    return False


def _defined(body: list[ast.stmt], steps: list[str]) -> bool:
    if not steps:
        return True
    for node in body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == steps[0]:
            return _defined(node.body if isinstance(node, ast.ClassDef) else [], steps[1:])
        targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        if any(isinstance(target, ast.Name) and target.id == steps[0] for target in targets):
            return len(steps) == 1
    return False


@pytest.mark.parametrize("room", sorted({module.rpartition(".")[0] for module in modules()}))
def test_the_tour_leads_through_every_room(room: str) -> None:
    assert any(name == room or name.startswith(f"{room}.") for name in named("tour.md"))


def test_the_tour_names_something() -> None:
    assert "mdp.search.search.decompose" in named("tour.md")
    assert len(named("tour.md")) > 50


@pytest.mark.parametrize("name", named("tour.md"))
def test_a_name_in_the_tour_exists(name: str) -> None:
    assert exists(name)


def test_the_check_tells_what_exists_from_what_does_not() -> None:
    assert exists("mdp.mesh.Mesh.volume_mm3")
    assert exists("slicer.paths")
    assert exists("machine.link")
    assert not exists("mdp.mesh.Mesh.weight_kg")
    assert not exists("slicer.spiral")


@pytest.mark.parametrize(
    "signature",
    [
        "mdp.read.read_mesh(path, scale, rotate_deg)",
        "mdp.search.search.decompose(mesh, name, profile)",
        "slicer.parts.slice_parts(parts, profile, on_progress, processes)",
        "machine.planning.plan.plan(decomposition, sliced, profile, stops)",
        "machine.gcode.writer.write_gcode(program, profile)",
        "machine.reader.parse.parse_gcode(lines, machine)",
        "machine.dryrun.dryrun.dry_run(lines, profile, known)",
        "profiles.profile.load(machine, material, process, settings)",
    ],
)
def test_the_stages_take_what_the_tour_says(signature: str) -> None:
    module, _, function = signature.partition("(")[0].rpartition(".")
    tree = ast.parse(ROOT.joinpath(*module.split(".")).with_suffix(".py").read_text(encoding="utf-8"))
    found = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == function)
    assert f"{module}.{function}({', '.join(argument.arg for argument in found.args.args)})" == signature
    assert f"`{signature}" in (ROOT / "docs" / "tour.md").read_text(encoding="utf-8")
