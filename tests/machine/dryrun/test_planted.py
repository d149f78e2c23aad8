"""Every fault planted into a valid program of three parts is found with its line, part and layer."""

import pytest

from machine.dryrun import dry_run
from profiles.errors import GcodeError
from tests.machine.dryrun.bent import bent
from tests.machine.dryrun.planted import FAULTS, REFUSED, Fault


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_planted_fault_is_found_at_its_place(fault: Fault) -> None:
    profile, _, lines = bent("generic_ac")
    found = [f for f in dry_run(fault.edit(list(lines)), profile).findings if f.code == fault.code]
    assert (fault.severity, fault.part, True) in {(f.severity, f.part, fault.layer in (0, f.layer) and f.line > 0) for f in found}


@pytest.mark.parametrize("machine", ["gen5x", "linuxcnc_xyzac"])
@pytest.mark.parametrize("name", [
    "a part shifted by 0.2 mm", "a layer missing", "four layers missing", "a mirrored part", "a layer printed twice",
    "two layers in the wrong order", "no lift before a turn", "no fans", "no waiting for heat", "a part missing",
    "cut off amid the last part", "no homing"])  # fmt: skip
def test_other_firmwares_and_other_axes_hide_no_fault(name: str, machine: str) -> None:
    profile, _, lines = bent(machine)
    fault = next(fault for fault in FAULTS if fault.name == name)
    found = {f.code for f in dry_run(fault.edit(list(lines)), profile).errors}
    assert fault.code in found or (name == "no homing" and machine == "linuxcnc_xyzac")  # LinuxCNC homes before a program


@pytest.mark.parametrize("name", REFUSED)
def test_invalid_gcode_is_refused_with_its_line_number(name: str) -> None:
    profile, _, lines = bent("generic_ac")
    edit, sentence = REFUSED[name]
    with pytest.raises(GcodeError, match=rf"line \d+.*{sentence}"):
        dry_run(edit(list(lines)), profile)


@pytest.mark.parametrize("machine", ["generic_ac", "gen5x", "linuxcnc_xyzac"])
def test_the_program_without_a_fault_has_no_finding(machine: str) -> None:
    profile, _, lines = bent(machine)
    assert {f.code for f in dry_run(lines, profile).findings} <= {"uncalibrated"}
