"""The text of the G-code in the page: identical after decoding by the format in CONTRIBUTING.md."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.view import text
from machine.view.encoding import Column
from tests.machine.pages import text_of
from tests.machine.view.test_view import example, read, shown

FOREIGN = """; a slicer that counts its filament from the last G92 on
M82
G28
G92 E0
G1 Z.3 F600
G1 X10.5 Y-0.25 E.4 F1200 ; E0.40000
G1 X100 Y0.125 E12.5
G2 X90 Y10 I-5 J5 E13.01
G92 E1.5
G1 X0.1 E1.75
G1 E-.5
G1 X20 Y20 F6000
M83
G1 X25 E0.25
"""


@pytest.mark.parametrize("machine", ["generic_ac", "trident_5axis", "linuxcnc_xyzac"])
def test_the_page_contains_the_g_code_of_our_own_programs(machine: str) -> None:
    assert tuple(text_of(*shown(machine))) == example(machine)[1].lines


def test_the_text_of_another_slicer_is_in_the_page_and_its_numbers_are_not() -> None:
    header, columns = read(FOREIGN)
    assert text_of(header, columns) == FOREIGN.split("\n")
    assert header["text"]["patterns"][6:8] == ["G1 X\x02 Y\x01 E\x05", "G2 X\x02 Y\x02 I-5 J5 E\x05"]
    assert header["text"]["zeros"] == [[9, 1151000]]


def test_a_text_whose_lines_are_all_different_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text, "MOST_LETTERS", 40)
    header, columns = read(FOREIGN)
    assert (header["text"], header["lines"], len(columns["text"])) == (None, 15, 0)
    assert read("G28\n;\x01 a letter that stands for a number\nG1 X1 F600\n")[0]["text"] is None


@given(st.lists(st.tuples(st.sampled_from("XYZE"), st.from_regex(r"-?0?[0-9]{0,3}\.?[0-9]{0,6}", fullmatch=True)), max_size=6))
def test_any_line_is_read_back_exactly(words: list[tuple[str, str]]) -> None:
    line = " ".join(letter + number for letter, number in words)
    rows = {"line": Column(np.array([2]), "i32"), "end": Column(np.array([[1.5, 0.0, -0.25]]), "i32", 0.001)}
    packed_text, columns = text.line_patterns(("G92 E1", f"G1 {line}"), rows | {"filament": Column(np.array([0.5]), "f64", 1e-5)})
    arrays = {name: np.asarray(column.values) for name, column in (rows | columns).items()}
    assert text_of({"text": packed_text}, arrays | {"filament": np.array([0.5])}) == ["G92 E1", f"G1 {line}"]
