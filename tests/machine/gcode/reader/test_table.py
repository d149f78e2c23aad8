"""The table of rows shares start and end positions where it can, and has capacity for every row."""

import numpy as np

from machine.gcode.reader.parse import parse_gcode
from profiles.machine import Machine
from profiles.profile import load


def machine(name: str) -> Machine:
    return load(machine=name).machine


def test_rows_that_follow_each_other_share_their_places() -> None:
    program = parse_gcode(["G28", "M83", *(f"G1 X{k + 1} E1" for k in range(9))], machine("generic_ac"))
    assert np.shares_memory(program.start, program.end)
    assert np.array_equal(program.start[1:], program.end[:-1])


def test_a_place_that_is_set_begins_the_next_row() -> None:
    program = parse_gcode(["G28", "G1 X1", "G92 X5", "G1 X6"], machine("generic_ac"))
    assert program.start[:, 0].tolist() == [0.0, 5.0]
    assert program.end[:, 0].tolist() == [1.0, 6.0]


def test_places_set_again_and_again_begin_their_rows() -> None:
    lines = ["G28", "M83", *(line for k in range(20) for line in (f"G92 X{k}", f"G1 X{k + 1} E0.1", "M104 S200"))]
    program = parse_gcode(lines, machine("generic_ac"))
    assert program.start[:, 0].tolist() == list(range(20))
    assert program.end[:, 0].tolist() == list(range(1, 21))
    assert [event.row for event in program.events if event.code == "M104"] == list(range(1, 21))


def test_arcs_have_more_rows_than_lines() -> None:
    program = parse_gcode(
        ["G28", "M83", "G1 X10 Y0 F600", *["G2 X10 Y0 I-5 J0 E1"] * 4, "G92 X0", "G1 X1"], machine("generic_ac")
    )
    assert (program.line[1:-1].tolist(), len(program.line)) == ([line for line in (4, 5, 6, 7) for _ in range(71)], 286)
    assert np.array_equal(program.start[1:-1], program.end[:-2])
    assert program.start[-1, 0] == 0.0
