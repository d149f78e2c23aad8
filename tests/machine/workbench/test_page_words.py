"""Page words: a page names options and keys by its own fields and labels."""

import ast
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import machine.pipeline.requests
from machine.pipeline.requests import FORCE_GOES_ON, Given
from machine.printing import ports
from machine.workbench.bench.bench import Bench, History, Step
from machine.workbench.bench.page_words import OPTIONS, PHRASES, in_page_words, page_words
from machine.workbench.session.session import Session
from machine.workbench.web.snapshot import snapshot
from machine.workbench.work.worker_pool import WorkerPools
from mdp.ranking.candidates import REASONS, Reason
from profiles.errors import PlanError, ProfileError
from profiles.messages import advice, key_name, option, phrase, terminal_words
from profiles.part_settings import parse_part_settings
from profiles.profile import load
from tests.machine.workbench.models import model

PAIRS = [
    (f"{option('copies')} is 0: 1 to 1000 is allowed", "Copies is 0: 1 to 1000 is allowed"),
    (f"{option('copies', 3)}: a.gcode is G-code", "3 copies: a.gcode is G-code"),
    (f"{option('ranker', 'x')}: classic, learned or the name", "Search ranking x: classic, learned or the name"),
    (f"{advice('filament-change', '1:x')}: PART:LAYER or", "1:x under Copies and pauses: PART:LAYER or"),
    (f"give them up, {advice('set', 'process.scale=25.4', 'give')}", "give them up, set Scale of the model to 2540 %"),
    (f"{option('set', 'process.walls=4')} and", "Walls = 4 and"),
    (f"X (lists all, {FORCE_GOES_ON})", "X (lists all, tick Continue anyway to print it)"),
    (f"{key_name('machine.tilt.limits_deg')} is [5, 3]", "Tilt axis: Range is [5, 3]"),
    (f"a guess: {key_name('machine.table')}", "a guess: Table"),
    (f"{key_name('machine.gcode.end')}: placeholder {{nozzle_c}}", "G-code blocks: End G-code: placeholder {nozzle_c}"),
    (f"at most 0.9 of {key_name('process.line_width_mm', 'line_width_mm')}", "at most 0.9 of Line width"),
    (f"{option('parts', 9)}: the search found no more than 3", "the number of parts 9: the search found no more than 3"),
    (f"would save 3 mm²: {advice('parts', 4)}", "would save 3 mm²: choose 4 parts"),
    (f"a sliver{phrase('', ' ([[keep]])')}", "a sliver"),
    (f"{option('certificate', 'a.pem')} cannot be read", "--certificate a.pem cannot be read"),
]


@pytest.mark.parametrize(("message", "page"), PAIRS)
def test_a_message_names_what_the_page_has(message: str, page: str) -> None:
    assert page_words(message) == page


def test_a_terminal_has_the_options_and_the_keys() -> None:
    sentence = (
        f"{key_name('process.walls')} is 0: {option('parts', 4)}, {advice('set', 'process.walls=2', 'give')} ({FORCE_GOES_ON})"
    )
    assert terminal_words(sentence) == "process.walls is 0: --parts 4, give --set process.walls=2 (--force continues)"


def test_an_error_keeps_its_marks_where_another_message_holds_it() -> None:
    error = PlanError(f"{option('parts')} is 0")
    assert str(error) == "--parts is 0"
    assert page_words(f"a.stl: {error}") == "a.stl: the number of parts is 0"
    assert str(PlanError(f"a.stl: {error}")) == "a.stl: --parts is 0"


@pytest.mark.parametrize(("settings", "page"), [
    (["process.walls=-3"], "Walls is -3: it must be a whole number from 0 to 50"),
    (["process.layer_height_mm=0.5"], "Layer height is 0.5 mm: at most 0.9 of Line width"),
    (["machine.tilt.limits_deg=[5, 3]"], "Tilt axis: Range is [5.0, 3.0]"),
    (["process.infill_pattern=infill_density"], 'Infill pattern is "infill_density"'),
    (["process.infill_density=200%"], "Infill density is 200 %: it must be a percentage from 0 to 100"),
    (["process.infil_density=1"], "did you mean Infill density?"),
    (["material.nozzle_c=900"], "Nozzle"),
])  # fmt: skip
def test_an_invalid_profile_is_reported_by_labels(settings: list[str], page: str) -> None:
    with pytest.raises(ProfileError) as refused:
        load(settings=settings)
    assert page in page_words(f"{refused.value}")


def test_sentences_of_the_program_name_no_option_on_the_page() -> None:
    with pytest.raises(ProfileError) as refused:
        parse_part_settings("2")
    sentences = [*REASONS.values(), *(text for _, *texts in ports.NO_PRINTERS.values() for text in texts), f"{refused.value}"]
    for sentence in sentences:
        assert re.search(r"(^|\s)--\w|\bsearch\.", page_words(sentence)) is None
    assert page_words(REASONS[Reason.PLATFORM]) == "it would cut into the build plate"


def test_unmarked_text_stays_even_if_it_looks_like_a_key() -> None:
    for text in ("demo:tree", "process.walls.toml", "--copies is 3.stl", "infill_density 2.stl: part 1, tilt 30°", "a \ufdd0 b"):
        assert page_words(text) == text.replace("\ufdd0", r"\ufdd0")
    assert page_words(f"{option('plan', '--copies 3.toml')} exists") == "the plan --copies 3.toml exists"


def test_texts_in_lists_and_tables_are_converted_and_numbers_stay() -> None:
    state = {"problem": f"{option('copies')} is 0", "n": 3, "rows": [{"a": [f"{key_name('process.walls')}"]}, 2, None]}
    assert in_page_words(state) == {"problem": "Copies is 0", "n": 3, "rows": [{"a": ["Walls"]}, 2, None]}


def test_a_page_gets_the_names_of_its_bench_as_they_are() -> None:
    profile = load(settings=["machine.name=line_width_mm"])
    session = Session(profile, Given(), WorkerPools())
    sent = session.received.new_file("walls --copies 3 infill_density.stl")
    session.history = History(Step("", Bench(profile, replace(model(), name="infill_density", path=sent))))
    session.busy = "reading infill_density on line_width_mm"
    session.problems = {"": f"walls --copies 3 infill_density.stl is empty; {key_name('process.walls')} is -3"}
    state = in_page_words(snapshot(session))
    assert state["busy"] == "reading infill_density on line_width_mm"
    assert state["problems"] == {"": "walls --copies 3 infill_density.stl is empty; Walls is -3"}
    session.received.remove()


ROOT = Path(machine.pipeline.requests.__file__).parents[2]
# Files whose options do not appear in messages, or only in messages on a terminal.
UNMARKED = {
    "machine/cli": "messages of commands, which no page shows",
    "machine/notices.py": "what the terminal's front end adds to a forced error",
    "machine/view/parts.py": "a command to copy",
    "machine/view/report.py": "notes in a file, which name the options of the command that wrote it",
    "machine/workbench/bench/page_words.py": "the names of marks",
    "machine/workbench/bench/settings.py": "a command to copy",
    "mdp/learning": "tools of their own, whose options these are",
    "mdp/search/plan_writing.py": "the head of a plan file",
    "profiles/messages.py": "the marks themselves",
    "profiles/search.py": "the description of a key, which --help and the page show alike",
}


def _texts(file: Path) -> Iterator[str]:
    """The texts of a file that are neither docstrings nor arguments of a mark."""
    tree = ast.parse(file.read_text())
    left_out = set[int]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            left_out.add(id(node.value))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "phrase":
            left_out |= {id(inner) for inner in ast.walk(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in left_out:
            yield node.value


def test_no_message_has_an_option_that_is_not_marked() -> None:
    bare = [
        f"{file.relative_to(ROOT)}: {text}"
        for package in ("profiles", "mdp", "slicer", "machine")
        for file in sorted((ROOT / package).rglob("*.py"))
        if not file.relative_to(ROOT).as_posix().startswith(tuple(UNMARKED))
        for text in _texts(file)
        if re.search(r"(?<![\w-])--[a-z]", text)
    ]
    assert bare == []


def test_every_phrase_of_the_program_is_known_to_the_page() -> None:
    used = set[str]()
    for package in ("profiles", "mdp", "slicer", "machine"):
        for file in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text())):
                if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "phrase":
                    assert isinstance(node.args[0], ast.Constant)
                    used.add(str(node.args[0].value))
    assert used == set(PHRASES)
    assert all(bare or with_value for bare, with_value in OPTIONS.values())
