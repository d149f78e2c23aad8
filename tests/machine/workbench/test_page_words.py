"""Page words: what a terminal is told by options and keys, a page is told by its own fields and labels."""

import re
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from machine.pipeline.requests import Given
from machine.workbench.bench.bench import Bench, History, Step
from machine.workbench.bench.page_words import LABELS, RULES, in_page_words, page_words, with_page_words
from machine.workbench.session.session import Session
from machine.workbench.web.snapshot import snapshot
from machine.workbench.work.worker_pool import WorkerPools
from profiles.profile import load
from tests.machine.workbench.models import model

PAIRS = [
    ("--copies is 0: 1 to 1000 is allowed", "Copies is 0: 1 to 1000 is allowed"),
    ("--ranker x: classic, learned or the name", "Ranked as x: classic, learned or the name"),
    (
        "cut: taken away with part 3: --pause 3:15, --part 3:ironing=true (Undo brings them back)",
        "cut: taken away with part 3: the pause at 3:15, its own ironing=true (Undo brings them back)",
    ),
    ("--filament-change 1:x: PART:LAYER or", "1:x under Copies and pauses: PART:LAYER or"),
    (
        "part 2: process.scale holds for the whole print: --set process.scale=... sets it",
        "part 2: Scale of the model holds for the whole print: set it for all parts",
    ),
    (
        "if its coordinates are inches, give --set process.scale=25.4",
        "if its coordinates are inches, set Scale of the model to 25.4",
    ),
    (
        "the dry run found 1 error, the first: X (simulate lists all, --force goes on)",
        "the dry run found 1 error, the first: X (tick Go on all the same to print it nevertheless)",
    ),
    (
        "the remainder would not stand on the build plate (criterion II)",
        "the remainder would not stand on the build plate",
    ),
    ("a sliver 3.8e-07 mm thin: 0.3 mm is the least", "a sliver less than 0.001 mm thin: 0.3 mm is the least"),
    ("machine.tilt.limits_deg is [5, 3]", "Tilt axis: Range is [5, 3]"),
    ("machine.gcode.end: placeholder {nozzle_c} is not known", "G-code blocks: End G-code: placeholder {nozzle_c} is not known"),
    ("layer_height_mm is 0.5 mm: at most 0.9 of line_width_mm", "Layer height is 0.5 mm: at most 0.9 of Line width"),
    ("--parts 9: the search found no more than 3", "9 parts were asked for: the search found no more than 3"),
    (
        "wait until that is done; send without --start hands a file over meanwhile",
        "wait until that is done; tick Only hand the file over meanwhile",
    ),
    ("rubbish at 9600 baud, and nothing at the usual other rates: --baud N tries another", None),
    (
        "the model lies between 0.00 and 116.36 mm, offset_mm is -50",
        "the model lies between 0.00 and 116.36 mm, the offset is -50 mm",
    ),
    (
        "along its normal offset_mm must be at least 0.60, it is 0.2",
        "along its normal the offset must be at least 0.60 mm, it is 0.2 mm",
    ),
    ("the printer has halted; nozzle 240 deg C, bed 80 deg C", "the printer has halted; nozzle 240 °C, bed 80 °C"),
    ("and name that profile with --machine", "and name that profile under Homed as in"),
]


@pytest.mark.parametrize(("sentence", "said"), PAIRS)
def test_a_sentence_names_what_the_page_has(sentence: str, said: str | None) -> None:
    words = page_words(sentence)
    assert said is None or words == said
    assert re.search(r"(^|\s)--\w", words) is None


def test_what_is_no_key_and_no_option_stays() -> None:
    for text in ("demo:tree", "my process.stl", "/home/me/process.walls.toml", "a--b.stl", "2.5 mm", "part 1, tilt 30°"):
        assert page_words(text) == text


def test_sentences_in_lists_and_tables_are_said_so_and_numbers_and_other_keys_stay() -> None:
    state = {"problem": "--copies is 0", "name": "--copies is 0", "given": {"settings": ["process.walls=4"]}, "n": 3}
    assert with_page_words(state, ("problem", "lacking")) == {**state, "problem": "Copies is 0"}
    assert in_page_words([{"a": ["--copies is 0"]}, 2, None]) == [{"a": ["Copies is 0"]}, 2, None]


KEYS = sorted({word for key in LABELS for word in (key, key.rpartition(".")[2])})
OPTIONS = sorted({word for pattern, _ in RULES for word in re.findall(r"--[a-z-]+", pattern)})
PHRASES = ("(criterion II)", "compiling the kernels", "deg C", "mm2", "offset_mm is 3", "(--force)", "= 3", "1", ":", "goes on")
NAMES = st.builds(
    lambda words, between, suffix: between.join(words) + suffix,
    st.lists(st.sampled_from([*KEYS, *OPTIONS, *PHRASES]), min_size=1, max_size=4),
    st.sampled_from([" ", "_", "-", ""]),
    st.sampled_from([".stl", ".toml", ".gcode", ""]),
)
SAID = (
    "reading {}",
    "{}: has more than the 1 MiB that a page may send",
    "plan tee.toml: there is no model on the workbench to cut by it: open {} first",
    "uploading {}: 1.0 of 2.0 MB",
    "{} goes on printing on octoprint:printer: this page follows it no more",
    "{}: process.walls is -3: it must be a whole number from 0 to 50 (--force goes on)",
)


@given(NAMES, st.sampled_from(SAID))
def test_a_name_that_a_person_gave_is_never_rewritten_and_all_around_it_is(name: str, said: str) -> None:
    assert name in page_words(said.format(name), [name])
    assume(not any(own in said for own in (name, name.rpartition(".")[0]) if own))  # else the message's own words stay, too
    assert page_words(said.format(name), [name]) == page_words(said).replace("{}", name)


@pytest.mark.parametrize(("sentence", "own"), [
    ("process.infill_pattern is 'infill_density': 'grid' is allowed", "'infill_density'"),
    ('the printer says "machine.tilt.limits_deg --force goes on"', '"machine.tilt.limits_deg --force goes on"'),
    ("--ranker infill_density: no such ranker", "infill_density"),
    ("--set machine.name=infill_density", "infill_density"),
    ("open infill_density.stl first", "infill_density.stl"),
])  # fmt: skip
def test_what_is_quoted_or_given_as_a_value_or_is_a_file_stays(sentence: str, own: str) -> None:
    assert own in page_words(sentence)


def test_a_page_is_told_the_names_of_its_bench_as_they_are() -> None:
    profile = load(settings=["machine.name=line_width_mm"])
    session = Session(profile, Given(), WorkerPools())
    sent = session.received.new_file("walls --copies 3 infill_density.stl")
    session.history = History(Step("", Bench(profile, replace(model(), name="infill_density", path=sent))))
    session.busy = "reading infill_density on line_width_mm"
    session.problems = {"": "walls --copies 3 infill_density.stl is empty; process.walls is -3"}
    state = snapshot(session)
    assert state["busy"] == "reading infill_density on line_width_mm"
    assert state["problems"] == {"": "walls --copies 3 infill_density.stl is empty; Walls is -3"}
    session.received.remove()
