"""The page as a file: it fetches nothing, no name can inject code, and it is written whole; and the commands that write it."""

import base64
import re
import shutil
import subprocess
from graphlib import CycleError
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from machine.cli.cli import main
from machine.kinematics.table import workpiece_path
from machine.pipeline.pipeline import build
from machine.view.contents import of_parts
from machine.view.page import EXPORT, IMPORT, TEMPLATE, bundle, page, print_page
from machine.workbench.web.server import OWN
from mdp.model_file import locate
from mdp.read import read_mesh
from mdp.save import stl
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, cut_by_plan
from profiles.profile import load
from tests.machine import hand
from tests.machine.pages import opened
from tests.shapes import tee

NASTY = '<img src=x onerror=alert(1)></title><script>alert(2)</script>/*SCRIPT*/<!--DATA-->".stl'
COARSE = ["--set", "search.directions=60", "--set", "process.layer_height_mm=0.4", "--set", "process.first_layer_height_mm=0.4"]
SCRIPTS = sorted([*TEMPLATE.rglob("*.js"), *OWN.rglob("*.js")])
NODE = shutil.which("node")


COARSE += ["--set", "process.line_width_mm=0.8", "--set", "process.scale=0.6", "--as-is"]


class Elements(HTMLParser):
    """Elements with their attributes, and the texts of scripts, styles and the title."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, str] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, text: str) -> None:
        last, attributes = self.tags[-1] if self.tags else ("", {})
        if last in ("script", "style", "title"):
            self.texts.setdefault(last + str(attributes.get("id", "")), text)


def shown(name: str = NASTY, live: bool = False) -> tuple[bytes, Elements]:
    """The page of parts without G-code, under a name."""
    profile, decomposition, _, _ = hand.printed()
    content = page(name, of_parts(decomposition, profile), live)
    return content, Elements(content.decode())


def policy(elements: Elements) -> dict[str, str]:
    """The directives of the content security policy."""
    (attributes,) = [a for tag, a in elements.tags if tag == "meta" and a.get("http-equiv") == "Content-Security-Policy"]
    return {name: values for name, _, values in (rule.strip().partition(" ") for rule in str(attributes["content"]).split(";"))}


def test_a_name_is_text_and_nothing_else() -> None:
    plain, nasty = (Elements(shown(name)[0].decode()) for name in ("plain.stl", NASTY))
    assert [tag for tag, _ in plain.tags] == [tag for tag, _ in nasty.tags]
    assert nasty.texts["title"].startswith("<img src=x onerror=alert(1)></title>")
    assert nasty.texts["script"] == plain.texts["script"]


def test_the_policy_allows_this_script_and_this_style_alone() -> None:
    _, elements = shown()
    policy_words = policy(elements)
    for directive, element in (("script-src", "script"), ("style-src", "style")):
        digest = sha256(elements.texts[element].encode()).digest()
        assert policy_words[directive] == f"'sha256-{base64.b64encode(digest).decode()}'"
    assert policy_words["default-src"] == "'none'"
    assert "connect-src" not in policy_words


def test_only_a_served_page_may_ask_its_server() -> None:
    assert policy(shown(live=True)[1])["connect-src"] == "'self'"


def test_nothing_is_fetched_and_no_script_is_in_attributes() -> None:
    content, elements = shown()
    for tag, attrs in elements.tags:
        assert not [name for name in attrs if name.startswith("on") or name in ("src", "srcset", "style", "action", "formaction")]
        assert tag not in ("base", "iframe", "object", "embed", "img")
        assert str(attrs.get("href", "data:")).startswith("data:")
    assert set(re.findall(rb"https?://[\w./]+", content)) <= {b"http://www.w3.org/2000/svg"}


def test_the_data_say_what_they_are_called() -> None:
    content, _ = shown()
    header, arrays = opened(content)
    assert header["title"] == "post and arm"
    assert len(arrays["faces"]) > 0


def test_a_name_of_broken_letters_is_shown_with_marks() -> None:
    assert b"?.stl" in shown("\udcff.stl")[0]


MOVES = "G28\nM109 S200\nG1 Z0.2 F600\n;TYPE:Perimeter\nG1 X10 E1\nG1 Y10 E2\nM104 S0\nM140 S0\n"


def test_view_names_the_page_after_the_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("moves.gcode").write_text(MOVES)
    assert main(["view", "moves.gcode"]) == 0
    output = capsys.readouterr().out
    assert output.startswith("wrote moves.html: 0.2 MB, 3 moves")
    header, arrays = opened(Path("moves.html").read_bytes())
    assert (header["source"], header["machine"]["known"]) == ("foreign", False)
    assert arrays["end"][-1].tolist() == [10.0, 10.0, 0.2, 0.0, 0.0]


def test_a_machine_that_is_named_is_known(folder: Path) -> None:
    Path("moves.gcode").write_text(MOVES)
    assert main(["simulate", "moves.gcode", "--machine", "three_axis", "--html", "a.html"]) in (0, 1)
    assert opened(Path("a.html").read_bytes())[0]["machine"]["known"] is True


def test_view_does_not_overwrite_a_page_of_another_program(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("moves.gcode").write_text(MOVES)
    Path("moves.html").write_text("<p>my notes")
    assert main(["view", "moves.gcode"]) == 1
    assert "moves.html" in capsys.readouterr().err
    assert Path("moves.html").read_text() == "<p>my notes"
    assert [main(["view", "moves.gcode", "-o", "other.html"]) for _ in range(2)] == [0, 0]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("empty.gcode", "", "is empty"),
        ("rubbish.gcode", "\x00\x01%%&", "is not text"),
        ("still.gcode", "M105\n; nothing\n", "contains no move"),
        ("model.stl", "solid nothing", "model.stl"),
    ],
)
def test_a_file_that_cannot_be_shown_is_refused_in_one_sentence(
    folder: Path, capsys: pytest.CaptureFixture[str], name: str, text: str, said: str
) -> None:
    Path(name).write_text(text)
    assert main(["view", name]) == 1
    lines = [line for line in capsys.readouterr().err.splitlines() if "compil" not in line]
    assert len(lines) == 1
    assert said in lines[0]
    assert [file.name for file in folder.iterdir()] == [name]


def test_g_code_is_not_compared_with_itself(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("moves.gcode").write_text(MOVES)
    assert main(["view", "moves.gcode", "--compare"]) == 1
    assert "--compare goes with a model" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["view", "-o"], ["simulate", "--html"], ["decompose", "--html"]])
def test_a_page_that_could_not_be_written_is_refused_before_any_work(
    folder: Path, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    assert main([command[0], "demo:tree", command[1], "nowhere/page.html"]) == 1
    assert "the folder nowhere does not exist" in capsys.readouterr().err


def test_open_shows_the_page_in_the_browser(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: asked.append(address) or True)
    Path("moves.gcode").write_text(MOVES)
    assert main(["view", "moves.gcode", "--open"]) == 0
    assert asked == [(folder / "moves.html").resolve().as_uri()]


def test_a_model_name_with_markup_is_escaped_everywhere(folder: Path) -> None:
    name = "<img onerror=alert(1)>.stl"
    Path(name).write_bytes(stl(tee()))
    assert main(["decompose", name, *COARSE, "--html", "a.html"]) == 0
    content = Path("a.html").read_bytes()
    assert b"<title>&lt;img onerror=alert(1)&gt;.stl" in content
    assert opened(content)[0]["title"] == name


def test_export_writes_an_html_view_of_the_exported_file(folder: Path) -> None:
    Path("tee.stl").write_bytes(stl(tee()))
    assert main(["export", "tee.stl", *COARSE, "-o", "a.gcode", "--html", "a.html"]) == 0
    header, arrays = opened(Path("a.html").read_bytes())
    lines = Path("a.gcode").read_text().splitlines()
    assert (header["source"], header["live"]) == ("model", False)
    assert [lines[int(line) - 1][0] for line in arrays["line"][::100]] == ["G"] * len(arrays["line"][::100])


def test_the_packed_report_lists_changed_settings_first(folder: Path) -> None:
    Path("tee.stl").write_bytes(stl(tee()))
    assert main(["decompose", "tee.stl", *COARSE, "--html", "a.html"]) == 0
    report = opened(Path("a.html").read_bytes())[0]["report"]
    tables = {table["title"]: table for table in report["tables"]}
    changed = {row[0]: row[1:] for row in tables["Settings changed"]["rows"]}
    assert changed["Layer height"] == ["0.4", "0.2"]
    keys = {row[0]: row[3] for row in tables["All settings"]["rows"]}
    assert {keys[label] for label in changed} == {word.partition("=")[0] for word in COARSE if "=" in word}
    assert (tables["All settings"]["folded"], tables["Parts"]["folded"]) == (True, False)


def test_another_machine_is_compared_with_its_shipped_values() -> None:
    from machine.view.report import settings_tables

    profile = load(machine="fractal5pro", settings=["machine.clearance_mm=3"])
    assert [row[0] for row in settings_tables(profile)[0]["rows"]] == ["Clearance between head and table"]


@pytest.mark.slow
def test_a_page_takes_a_third_of_what_it_may_and_holds_the_path_to_a_hundredth() -> None:
    profile = load(settings=["search.fragile_mm=0", "search.nozzle_load_n=0"])
    by_hand = PlanFile("plan.toml", parts=(PlannedPart((0.6, 0.0, 0.8), 21.2),))
    figure = read_mesh(locate("demo:figure"), 0.45)[0]
    program = build(cut_by_plan(figure, "demo:figure", profile, SearchRequest(plan=by_hand)), profile)
    content = print_page("demo:figure", program, profile)
    header, arrays = opened(content)
    moves = len(program.run.program.line)
    assert len(content) < 8e6 / 3 * moves / 300_000 + 0.3e6
    on_work = workpiece_path(profile.machine, arrays["end"])
    assert np.linalg.norm(on_work - workpiece_path(profile.machine, program.run.program.end), axis=1).max() < 0.01
    assert header["time_s"] == pytest.approx(arrays["time"][-1], abs=0.001)


def written(folder: Path, **texts: str) -> Path:
    for name, text in texts.items():
        (folder / f"{name}.js").write_text(text)
    return folder / "main.js"


@pytest.mark.skipif(NODE is None, reason="Node is not installed")
def test_modules_of_the_same_names_inside_see_only_what_they_import(tmp_path: Path) -> None:
    main = written(
        tmp_path,
        base="const own = 1;\nexport const $ = () => own;\n",
        other='import { $ } from "./base.js";\n\nconst own = 10;\nexport async function twice() { return 2 * $() + own; }\n',
        main='import { $ } from "./base.js";\nimport { twice } from "./other.js";\n\n'
        "twice().then((x) => console.log(x, $(), typeof own));\n",
    )
    assert NODE is not None
    run = subprocess.run([NODE, "-"], input=bundle(main), capture_output=True, text=True, check=True)
    assert run.stdout == "12 1 undefined\n"


def test_modules_that_need_each_other_are_refused(tmp_path: Path) -> None:
    main = written(tmp_path, main='import { a } from "./a.js";\n', a='import { b } from "./main.js";\nexport const a = 1;\n')
    with pytest.raises(CycleError):
        bundle(main)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_a_script_imports_what_the_others_export_and_uses_it(script: Path) -> None:
    text = script.read_text("utf-8")
    assert sum(line.startswith("import ") for line in text.splitlines()) == len(IMPORT.findall(text))
    body = IMPORT.sub("", text)
    for names, path in IMPORT.findall(text):
        exported = {name for _, name in EXPORT.findall((script.parent / path).read_text("utf-8"))}
        assert set(names.split(", ")) <= exported
        assert [name for name in names.split(", ") if name not in body] == []


def test_every_script_has_a_unique_name_and_is_part_of_a_page() -> None:
    assert len({(file.parent.name, file.stem) for file in SCRIPTS}) == len(SCRIPTS)
    pages = bundle(TEMPLATE / "main.js") + bundle(OWN / "main.js")
    assert [file for file in SCRIPTS if f'modules["{file.parent.name}/{file.stem}"] = ' not in pages] == []
