"""The table of commands: the state of the bench that each needs, and the same names in the page's scripts."""

import re
from collections.abc import Iterator
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from machine.workbench.bench.bench import Bench
from machine.workbench.bench.changes import MARKINGS
from machine.workbench.bench.values import read_command
from machine.workbench.printing.commands import COMMANDS as OF_PRINTS
from machine.workbench.session.commands import COMMANDS, obey, perform
from machine.workbench.web.line import DEVICE_COMMANDS as OF_DEVICES
from profiles.errors import PlanError
from profiles.profile import load
from tests.machine.workbench.models import model

ANYTHING = {
    "part": 2,
    "to": 2,
    "number": 1,
    "count": 1,
    "parts": 1,
    "plate": 1,
    "key": "",
    "at": "",
    "faces": "0",
    "axis": "x",
    "deg": 0,
    "offset_mm": 0,
    "normal": [0, 0, 1],
    "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "kind": "pause",
    "min_mm": [0, 0, 0],
    "max_mm": [1, 1, 1],
}
WITHOUT_A_MODEL = {"close_gcode", "demo", "undo", "redo", "set", "reset", "profile", "stop", "dismiss", "unit"}
UNSLICED = "what is on the workbench is not sliced yet: slice it first"
DOCS = Path(__file__).parents[3] / "docs" / "workbench-protocol.md"
PAGE = resources.files("machine.workbench.web").joinpath("page")


def bare(bench: Bench) -> Any:
    """A session on whose bench nothing is sliced, and without any functions."""
    return SimpleNamespace(bench=bench, note="", forget_problem=lambda: None, slicing=SimpleNamespace(lacking=lambda: UNSLICED))


@pytest.mark.parametrize("name", sorted({*COMMANDS} - WITHOUT_A_MODEL))
def test_all_that_is_done_to_a_model_is_refused_without_one(name: str) -> None:
    kind = {"kind": "keep"} if name in MARKINGS else {}
    with pytest.raises(PlanError, match="there is no model on the workbench yet: choose a file first"):
        perform(bare(Bench(load())), *read_command({"do": name, **ANYTHING, **kind}, COMMANDS))


def test_only_what_is_sliced_is_compared() -> None:
    with pytest.raises(PlanError, match=UNSLICED):
        perform(bare(Bench(load(), model())), *read_command({"do": "compare"}, COMMANDS))


@pytest.mark.parametrize("name", ["dance", ["turn"], None, "refuse"])
def test_an_unknown_command_is_refused(name: Any) -> None:
    with pytest.raises(PlanError, match=r"no(t a)? command: docs/workbench-protocol.md lists them"):
        obey(bare(Bench(load(), model())), {"do": name})


def test_the_page_uses_exactly_the_names_of_the_server() -> None:
    page = "".join(file.read_text("utf-8") for file in PAGE.rglob("*") if file.name.endswith((".js", ".html")))
    said = {
        word
        for pattern in (r'\bdo: "(\w+)"', r'command\("(\w+)"', r'data-(?:do|print)="(\w+)"')
        for word in re.findall(pattern, page)
    }
    never_said_so = {"resume", "feed", "flow"}  # sent through variables
    assert {*COMMANDS, *OF_PRINTS, *OF_DEVICES} - said <= never_said_so
    assert said <= {*COMMANDS, *OF_PRINTS, *OF_DEVICES}


def said_with(script: str) -> Iterator[tuple[str, set[str]]]:
    """Each command that a script writes out, `{ do: "NAME", key: value, ... }`, with its keys."""
    for match in re.finditer(r'\{ do: "(\w+)"', script):
        keys, depth, at = set[str](), 1, match.end()
        while depth:
            if depth == 1 and (key := re.match(r", (\w+)(?=[:, ])", script[at:])):
                keys.add(key[1])
            depth += (script[at] in "{[(") - (script[at] in "}])")
            at += 1
        yield match[1], keys


def test_the_page_sends_with_a_command_what_it_has_and_all_that_it_needs() -> None:
    scripts = "".join(file.read_text("utf-8") for file in PAGE.rglob("*.js"))
    known = {**OF_DEVICES, **OF_PRINTS, **COMMANDS}
    sent = [(known[name].model_fields, keys) for name, keys in said_with(scripts)]
    assert len(sent) > 40
    assert [(fields, keys) for fields, keys in sent if not keys <= {*fields}] == []
    needed = [({name for name, field in fields.items() if field.is_required()}, keys) for fields, keys in sent]
    spread = [(missing, keys) for required, keys in needed if (missing := required - keys)]
    assert len(spread) <= 6  # they receive theirs through `...plane`, or as the number of their print


def test_the_documentation_lists_every_command_and_no_other() -> None:
    rows = re.findall(r"^\| (`[^|]*) \|", DOCS.read_text("utf-8").partition("## Routes")[0], re.MULTILINE)
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == {*COMMANDS, *OF_PRINTS}
