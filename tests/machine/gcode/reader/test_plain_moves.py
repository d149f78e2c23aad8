"""Plain moves that are read in bulk equal those that the reader parses one by one."""

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.gcode.reader.parse import parse_gcode
from machine.gcode.reader.parsed import ParsedProgram, Remarks
from profiles.errors import GcodeError
from profiles.profile import load

MACHINE = load().machine
NUMBERS = st.one_of(
    st.integers(-(10**6), 10**6).map(lambda k: f"{k / 1000:.3f}"),
    st.floats(-400, 400).map(lambda x: f"{x:.17f}"),
    st.sampled_from(["0", "-0", "+5", ".25", "7.", "-.5", "000012.50", "0.1", "123456789012"]),
)
WORDS = st.tuples(st.sampled_from("XYZACE"), NUMBERS).map("".join)
FEEDS = st.one_of(st.just([]), st.sampled_from([["F1200"], ["F0.5"], ["F90000"]]))
MOVES = st.tuples(st.sampled_from(["G0", "G1"]), st.lists(WORDS, min_size=1, max_size=6, unique_by=lambda w: w[0]), FEEDS).map(
    lambda move: " ".join([move[0], *move[1], *move[2]])
)
OTHERS = st.sampled_from(
    ["G90", "G91", "M82", "M83", "G20", "G21", "G92 X3 E0", "M220 S50", "M221 S90", "M221 S100", "M204 P900 T300",
     ";TYPE:Skirt", ";TYPE:Fill", ";TYPE: Skirt", ";TYPE:", ";WIDTH:0.5", ";WIDTH:1", ";WIDTH:.5", ";WIDTH:5.", ";WIDTH:0.12 ",
     ";WIDTH:0.1234567890123456", ";WIDTH:x", ";LAYER_CHANGE", "G1 F600", "g1 x4 y5", "G01 X1",
     "G1 X1.5Y2", "G1 X1 \t", "M106 S255", ";HEIGHT:0.2", "; HEIGHT:0.3", ";HEIGHT: 1", ";Z:1", ";", "", "; any words",
    ";LAYER:3", ";LAYER_CHANGED", ";LAYER_CHANGE \t", ";PART:2 of 3", ";\u00a0WIDTH:2", ";WIDTH:2\u3000", ";WIDTHS:2", "G92 X7"]
)  # fmt: skip


def in_turn(lines: list[str]) -> list[str]:
    """The lines in a form that is not plain: with trailing comments and command words."""
    return [f" {line}" if line.startswith(";") else f"{line} ;" for line in lines]


def assert_same(first: ParsedProgram, second: ParsedProgram) -> None:
    for field in fields(ParsedProgram):
        a, b = getattr(first, field.name), getattr(second, field.name)
        assert np.array_equal(a, b) if isinstance(a, np.ndarray | Remarks) else a == b, field.name


@given(st.lists(st.one_of(MOVES, MOVES, MOVES, OTHERS), max_size=30))
def test_a_run_of_plain_moves_gives_the_rows_of_its_lines_one_by_one(lines: list[str]) -> None:
    assert_same(parse_gcode(lines, MACHINE), parse_gcode(in_turn(lines), MACHINE))


@pytest.mark.parametrize("machine", ["generic_ac", "trident_5axis", "linuxcnc_xyzac", "three_axis"])
def test_every_dialect_reads_g0_as_fast_as_it_does(machine: str) -> None:
    lines = ["G1 X1 Y2 F600", "G0 X5", "G0 Z3 F300", "G1 X1"]
    assert_same(parse_gcode(lines, load(machine=machine).machine), parse_gcode(in_turn(lines), load(machine=machine).machine))


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("G1 X1 F0", "line 3: F is 0: a feed must be above 0"),
        ("G1 X1 F-5", "line 3: F is -5: a feed must be above 0"),
        ("G1 X1 Q2", "line 3: word Q2 of a move is not known: this machine has X Y Z A C E F"),
        ("G1 X1.2.3", "line 3: 'G1 X1.2.3' cannot be read as G-code"),
        ("G1 X1234567890123", "line 3: 'G1 X1234567890123' cannot be read as G-code"),
        ("G1 X1 Y2 X3", "line 3: 'G1 X1 Y2 X3' has the word X twice: firmwares do not agree which one counts"),
        ("G1 X--1", "line 3: 'G1 X--1' cannot be read as G-code"),
    ],
)
def test_an_invalid_line_among_plain_moves_is_reported_with_its_line_number(line: str, sentence: str) -> None:
    with pytest.raises(GcodeError) as error:
        parse_gcode(["G1 X1 F600", "G1 X2", line, "G1 X3"], MACHINE)
    assert str(error.value) == sentence


def test_lines_with_line_endings_and_non_ascii_letters_are_read_the_same() -> None:
    lines = ["G1 X1 F600", "; größer", "G1 X2.5 E0.1", "M117 é", "G1 Y1"]
    assert_same(parse_gcode(lines, MACHINE), parse_gcode([f"{line}\r\n" for line in lines], MACHINE))


def test_a_long_run_has_a_row_a_line() -> None:
    program = parse_gcode([f"G1 X{k % 7}.{k % 10}" for k in range(10000)], MACHINE)
    assert len(program.line) == 10000
    assert program.line[-1] == 10000
    assert program.end[-1, 0] == 9999 % 7 + 0.9


def test_more_line_types_than_one_batch_holds_are_read_the_same() -> None:
    lines = [line for k in (*range(100), *range(100)) for line in (f";TYPE:kind {k}", f"G1 X{k} E1")]
    program = parse_gcode(lines, MACHINE)
    assert [program.types[kind] for kind in program.type] == [f"kind {k}" for k in (*range(100), *range(100))]
    assert_same(program, parse_gcode(in_turn(lines), MACHINE))


def test_more_comments_than_the_buffer_holds_are_read_the_same() -> None:
    lines = [line for k in range(3000) for line in (f";WIDTH:{k / 1000}", f"G1 X{k} E1")]
    program = parse_gcode(lines, MACHINE)
    assert program.width_mm.tolist() == [k / 1000 for k in range(3000)]
    assert_same(program, parse_gcode(in_turn(lines), MACHINE))
