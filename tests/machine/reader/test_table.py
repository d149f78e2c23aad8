"""Rows become columns a few at a time, and are the same as if all were read at once."""

from dataclasses import fields

import numpy as np
import pytest

from machine.reader import table
from machine.reader.parse import parse_gcode
from machine.reader.parsed import ParsedProgram, Remarks
from profiles.machine import Machine
from profiles.profile import load
from tests.machine.dryrun.bent import bent

JUMPS = ["G28", "M83", *(line for k in range(20) for line in (f"G92 X{k}", f"G1 X{k + 1} E0.1", "M104 S200"))]
ARCS = ["G28", "M83", "G1 X10 Y0 F600", *["G2 X10 Y0 I-5 J0 E1"] * 4]
TURNS = ["G28", "M83", "G1 X20 Y5 Z5 F600", "G43.4", *(f"G1 A{k} C{2 * k} E{k % 3 // 2}" for k in range(12)), "G49"]


def same(a: ParsedProgram, b: ParsedProgram) -> bool:
    columns = [field.name for field in fields(a) if isinstance(getattr(a, field.name), np.ndarray | Remarks)]
    return a.events == b.events and all(
        len(a.line) == len(b.line) and np.allclose(getattr(a, name), getattr(b, name), rtol=0.0, atol=1e-9) for name in columns
    )


def machine(name: str) -> Machine:
    return load(machine=name).machine


@pytest.mark.parametrize(("name", "lines"), [
    ("generic_ac", JUMPS), ("generic_ac", ARCS), ("generic_ac", TURNS),
    ("generic_ac", None), ("linuxcnc_xyzac", None)],
    ids=["jumps", "arcs", "turns that are followed", "a print", "a print that is followed"])  # fmt: skip
def test_rows_taken_one_by_one_are_those_taken_at_once(
    name: str, lines: list[str] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = lines or list(bent(name)[2])
    at_once = parse_gcode(lines, machine(name))
    monkeypatch.setattr(table, "AT_ONCE", 1)
    assert same(parse_gcode(lines, machine(name)), at_once)


def test_rows_that_follow_each_other_share_their_places() -> None:
    program = parse_gcode(["G28", "M83", *(f"G1 X{k + 1} E1" for k in range(9))], machine("generic_ac"))
    assert np.shares_memory(program.start, program.end)
    assert np.array_equal(program.start[1:], program.end[:-1])


def test_a_place_that_is_set_begins_the_next_row() -> None:
    program = parse_gcode(["G28", "G1 X1", "G92 X5", "G1 X6"], machine("generic_ac"))
    assert program.start[:, 0].tolist() == [0.0, 5.0]
    assert program.end[:, 0].tolist() == [1.0, 6.0]
