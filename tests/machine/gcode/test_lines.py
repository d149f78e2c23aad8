"""Lines: a text stored as bytes that reads back as the original strings."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.gcode.lines import Lines

ODD = ["G28", "", "; Düse \N{DEGREE SIGN}", "two\nin one", "lone \udc80", "G1 X1"]


@pytest.mark.parametrize("lines", [[], [""], ODD, [f"G1 X{k}" for k in range(10_000)]], ids=["none", "empty", "odd", "many"])
def test_lines_are_those_that_went_in(lines: list[str]) -> None:
    held = Lines.of(iter(lines))
    assert (list(held), [held[k] for k in range(len(held))], held) == (lines, lines, lines)


def test_places_count_as_those_of_a_list() -> None:
    held = Lines.of(ODD)
    assert (held[-1], list(held[1:4]), list(held[::-1])) == ("G1 X1", ODD[1:4], ODD[::-1])
    with pytest.raises(IndexError):
        held[6]


@given(st.lists(st.sampled_from(ODD)), st.slices(8))
def test_slices_and_sums_are_those_of_lists(lines: list[str], some: slice) -> None:
    held = Lines.of(lines)
    assert held[some] == lines[some]
    assert held[some] + held == lines[some] + lines


@pytest.mark.parametrize("pieces", [[], ["a\nb"], ["", "a\n", ""], ["a", "\nb\n"], ["\n", "\n"]])
def test_a_text_in_pieces_has_the_lines_of_the_whole(pieces: list[str]) -> None:
    assert Lines.of_text(pieces) == "".join(pieces).splitlines()


def test_other_lines_are_not_equal() -> None:
    assert Lines.of(["a"]) != ["b"]
    assert Lines.of(["a"]) != ["a", "b"]


@given(
    st.lists(st.sampled_from(["", ";", ";P", ";POSE:A1", ";POSE", "G1 ;POSE:", "é"])), st.sampled_from(["", ";", ";POSE:", "é"])
)
def test_lines_that_begin_with_a_word_are_found(lines: list[str], word: str) -> None:
    assert Lines.of(lines).beginning_with(word) == [k for k, line in enumerate(lines) if line.startswith(word)]
