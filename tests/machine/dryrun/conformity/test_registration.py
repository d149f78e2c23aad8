"""A part that lies beside its model is told by how much and where to, from its outer walls alone."""

import numpy as np
import pytest

from machine.dryrun import dry_run
from machine.dryrun.conformity.agreement import agreement
from machine.dryrun.conformity.registration import shifts
from tests.machine.dryrun.bent import bent
from tests.machine.dryrun.planted import Lines, on, part, word


def untold(lines: Lines) -> Lines:
    """A program that does not tell what its parts come to, as another slicer's does not."""
    return [line for line in lines if not line.startswith(";CONTENTS")]


@pytest.mark.parametrize(("index", "letter", "by_mm"), [(1, "X", 0.5), (1, "Y", -0.2), (2, "X", 0.2), (3, "Y", 0.5)])
def test_a_shifted_part_is_told_and_the_others_lie_where_they_should(index: int, letter: str, by_mm: float) -> None:
    profile, model, lines = bent("generic_ac")
    moved = on(part(index), word(letter, lambda x: x + by_mm))(untold(list(lines)))
    sizes = {shift.part: shift.size_mm for shift in shifts(dry_run(moved, profile), model, profile)}
    assert sizes == pytest.approx({k: abs(by_mm) if k == index else 0.0 for k in (1, 2, 3)}, abs=0.01)


def test_the_finding_names_the_part_and_the_direction_on_the_table() -> None:
    profile, model, lines = bent("generic_ac")
    moved = on(part(1), word("Y", lambda y: y - 0.2))(untold(list(lines)))
    agreed, run = agreement(dry_run(moved, profile), model, profile)
    (shift,) = (finding for finding in run.findings if finding.code == "shift")
    assert (shift.severity, shift.part) == ("error", 1)
    assert shift.message == "part 1 lies 0.20 mm beside the model, by X+0.00 Y-0.20 Z+0.00, 0.1 mm are allowed"
    assert agreed.shift_mm == pytest.approx(0.2, abs=0.005)


@pytest.mark.parametrize("machine", ["generic_ac", "gen5x", "linuxcnc_xyzac"])
def test_an_untouched_part_lies_where_its_model_does(machine: str) -> None:
    profile, model, lines = bent(machine)
    found = shifts(dry_run(lines, profile), model, profile)
    assert np.array([shift.by_mm for shift in found]) == pytest.approx(np.zeros((3, 3)), abs=0.01)
