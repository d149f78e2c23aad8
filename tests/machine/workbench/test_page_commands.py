"""Messages of the page to its server: every command of a script or a button exists on the server, with the fields sent."""

import re

import pytest

from machine.workbench.printing import commands as of_prints
from machine.workbench.printing.at_page import HandDoes
from machine.workbench.session import commands as of_bench
from machine.workbench.web.line import DEVICE_COMMANDS
from machine.workbench.web.server import OWN

SAID = re.compile(r'\{ do: "(\w+)"')
ADDED = {"page", "ask", "near"}  # added by send(), by ask(), and for the nearest place
SCRIPTS = {file: file.read_text("utf-8") for file in sorted(OWN.rglob("*.js"))}
PAGE = (OWN / "page.html").read_text("utf-8")
TO_PRINTS = {"print-panel", "print-shown"}  # scripts that send their commands over the line to the prints
BENCH, PRINTS = set(of_bench.COMMANDS), set(of_prints.COMMANDS)


def said(where: set[str] | None = None) -> list[tuple[str, set[str]]]:
    """Name and fields of every command in the scripts that send to the prints, or in the others."""
    texts = [text for file, text in SCRIPTS.items() if (file.stem in TO_PRINTS) == (where is PRINTS)]
    return [(match[1], fields_of(text[match.end() :])) for text in texts for match in SAID.finditer(text)]


def fields_of(rest: str) -> set[str]:
    """The keys of an object literal, from behind its first one; keys inserted by `...` are not known."""
    depth, pieces = 0, [""]
    for letter in rest:
        depth += (letter in "([{") - (letter in ")]}")
        if depth < 0:
            break
        if letter == "," and depth == 0:
            pieces.append("")
        else:
            pieces[-1] += letter
    keys = (piece.split(":")[0].strip() for piece in pieces)
    return {key for key in keys if key and not key.startswith("...")}


def test_every_command_of_a_script_is_one_of_the_benchs_with_fields_that_it_has() -> None:
    found = [(name, fields) for name, fields in said() if name not in DEVICE_COMMANDS and name != "emergency"]
    assert len(found) > 30
    for name, fields in found:
        assert name in BENCH
        assert fields <= set(of_bench.COMMANDS[name].model_fields) | ADDED, name


def test_every_command_to_the_prints_is_one_of_theirs() -> None:
    names = {name for name, _ in said(PRINTS)}
    assert names >= {"check", "hand", "follow", "go_on", "by_hand", "emergency"}
    assert names <= PRINTS


@pytest.mark.parametrize(("data", "known"), [("do", BENCH), ("print", PRINTS), ("hand", {does.value for does in HandDoes})])
def test_every_button_that_gives_a_command_by_its_name_gives_one_that_there_is(data: str, known: set[str]) -> None:
    names = set(re.findall(rf'data-{data}="(\w+)"', PAGE))
    assert names
    assert names <= known


def test_the_page_gives_every_command_that_the_bench_has() -> None:
    named = {name for name, _ in said()} | set(re.findall(r'data-do="(\w+)"', PAGE))
    words = "\n".join(SCRIPTS.values())
    unsaid = {name for name in BENCH - named if f'"{name}"' not in words}
    assert unsaid == set()
