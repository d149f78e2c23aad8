"""The pages name only existing objects: every dotted name of a package is a module, function, class, field or a machine's key."""

import ast
import re
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic import BaseModel

from profiles.machine import Machine
from tools.docs.draw_rooms import modules

ROOT = Path(__file__).resolve().parents[1]
TOUR = "docs/tour.md"
PAGES = sorted(str(page.relative_to(ROOT)) for page in (*ROOT.glob("docs/*.md"), *ROOT.glob("tools/**/*.md"), *ROOT.glob("*.md")))
NAME = re.compile(r"`((?:profiles|mdp|slicer|machine)(?:\.[A-Za-z_]\w*)+)([(][^`]*)?`")


def named(page: str) -> list[str]:
    text = (ROOT / page).read_text(encoding="utf-8")
    return sorted({match[1] for match in NAME.finditer(text) if not is_key(match[1])})


def is_key(name: str) -> bool:
    """Whether a name is a key of a machine's profile: `machine.turn.zero_deg` is not a module."""
    section, *steps = name.split(".")[1:]
    return name == "machine.sources" or _is_field(Machine, [section, *steps])


def _is_field(model: Any, steps: list[str]) -> bool:
    fields = [kind.model_fields for kind in (model, *get_args(model)) if isinstance(kind, type) and issubclass(kind, BaseModel)]
    return not steps or any(steps[0] in names and _is_field(names[steps[0]].annotation, steps[1:]) for names in fields)


def exists(name: str) -> bool:
    """Whether a name is a package, a module, or an object that a module defines, down to the fields and methods of its
    classes."""
    steps = name.split(".")
    for count in range(len(steps), 0, -1):
        path = ROOT.joinpath(*steps[:count])
        file = path.with_suffix(".py") if path.with_suffix(".py").is_file() else path / "__init__.py"
        if file.is_file():
            return _defined(ast.parse(file.read_text(encoding="utf-8")).body, steps[count:])
    return False


def _defined(body: list[ast.stmt], steps: list[str]) -> bool:
    if not steps:
        return True
    for node in body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.name == steps[0]:
            return _defined(node.body if isinstance(node, ast.ClassDef) else [], steps[1:])
        targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        if any(isinstance(target, ast.Name) and target.id == steps[0] for target in targets):
            return len(steps) == 1
    return False


@pytest.mark.parametrize("room", sorted({module.rpartition(".")[0] for module in modules()}))
def test_the_tour_leads_through_every_room(room: str) -> None:
    assert any(name == room or name.startswith(f"{room}.") for name in named(TOUR))


def test_the_tour_names_something() -> None:
    assert "mdp.search.search.decompose" in named(TOUR)
    assert len(named(TOUR)) > 50


def test_the_tour_is_read_in_ten_minutes() -> None:
    assert len((ROOT / TOUR).read_text(encoding="utf-8").split()) <= 1500


@pytest.mark.parametrize("page", PAGES)
def test_every_name_on_a_page_exists(page: str) -> None:
    assert [name for name in named(page) if not exists(name)] == []


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub generates them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES)
def test_the_links_of_a_page_lead_to_files_and_headings_that_exist(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    for file, anchor in re.findall(r"\]\(([^)#\s:]*)(?:#([^)\s]+))?\)", text):
        target = (ROOT / page).parent / file if file else ROOT / page
        assert target.exists(), file
        assert not anchor or target.suffix != ".md" or anchor in anchors(target), f"{file}#{anchor}"


def test_the_check_distinguishes_existing_names_from_others() -> None:
    assert exists("mdp.mesh.Mesh.volume_mm3")
    assert exists("slicer.paths")
    assert exists("machine.link")
    assert not exists("mdp.mesh.Mesh.weight_kg")
    assert not exists("slicer.spiral")


@pytest.mark.parametrize(
    "signature",
    [
        "mdp.read.read_mesh(path, scale, rotate_deg)",
        "mdp.search.search.decompose(mesh, name, profile, request)",
        "slicer.slice.slice_parts(parts, profile, on_progress)",
        "machine.planning.plan.plan(decomposition, sliced, profile, stops)",
        "machine.gcode.writer.write_gcode(program, profile)",
        "machine.gcode.reader.parse.parse_gcode(lines, machine)",
        "machine.dryrun.dryrun.dry_run(lines, profile, known)",
        "profiles.profile.load(machine, material, process, settings)",
    ],
)
def test_the_stages_take_what_the_tour_says(signature: str) -> None:
    module, _, function = signature.partition("(")[0].rpartition(".")
    tree = ast.parse(ROOT.joinpath(*module.split(".")).with_suffix(".py").read_text(encoding="utf-8"))
    definition = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == function)
    assert f"{module}.{function}({', '.join(argument.arg for argument in definition.args.args)})" == signature
    assert f"`{signature}" in (ROOT / TOUR).read_text(encoding="utf-8")
