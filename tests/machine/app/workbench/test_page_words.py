"""Page words: what a terminal is told by options and keys, a page is told by its own fields and labels."""

import re

import pytest

from machine.app.workbench.bench.page_words import in_page_words, page_words, with_page_words

PAIRS = [
    ("--copies is 0: 1 to 1000 is allowed", "Copies is 0: 1 to 1000 is allowed"),
    (
        "--copies 3: tee is cut into 2 parts, copies are printed in one piece each: --parts 1",
        "3 copies: tee is cut into 2 parts, copies are printed in one piece each: take 1 under In how many parts",
    ),
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
        "what remains would not stand on the platform (criterion II)",
        "what remains would not stand on the platform",
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
