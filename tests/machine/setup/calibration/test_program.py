"""The calibration program avoids collisions on every machine that tilts."""

import pytest

from machine.dryrun.dryrun import dry_run
from machine.setup.calibration.program import calibration_lines, plan_touches
from profiles.errors import MoveError
from profiles.machine import TableBox
from profiles.profile import load, shipped
from tests.machine.setup.calibration.touches import machine_of


@pytest.mark.parametrize("name", [name for name in shipped("machine") if machine_of(name).tilts])
def test_the_program_of_every_machine_is_clear_and_inside_its_limits(name: str) -> None:
    profile = load(name)
    touches = plan_touches(profile.machine, 30.0)
    lines = list(calibration_lines(profile, touches))
    table = profile.model_copy(update={"machine": profile.machine.model_copy(update={"coordinates": "table"})})
    errors = [f for f in dry_run(lines, table).findings if f.severity == "error"]
    assert errors == []
    assert not any(line.startswith(("M104 S2", "M109", "M140", "M190")) for line in lines)
    assert len(touches.poses) == 12


@pytest.mark.parametrize(("name", "tilts_deg"), [
    ("generic_ac", {-60.0, 0.0, 60.0}), ("fractal5pro", {0.0, 30.0, 60.0}), ("linuxcnc_xyzac", {-60.0, 0.0, 45.0}),
])  # fmt: skip
def test_the_tilts_are_the_steepest_to_both_sides_or_two_to_one(name: str, tilts_deg: set[float]) -> None:
    assert {pose.tilt_deg for pose in plan_touches(machine_of(name), 20.0).poses} == tilts_deg


def test_a_machine_with_three_axes_has_nothing_to_calibrate() -> None:
    with pytest.raises(MoveError, match="there is no rotary axis"):
        plan_touches(machine_of("three_axis"), 20.0)


def test_the_table_turns_under_a_tip_that_is_over_its_clips_too() -> None:
    machine = load().machine
    clip = TableBox(name="clip", min_mm=(70.0, -5.0, 0.0), max_mm=(90.0, 5.0, 200.0))
    clipped = machine.model_copy(update={"table": machine.table.model_copy(update={"clips": [clip]})})
    assert plan_touches(clipped, 20.0).safe_z_mm > plan_touches(machine, 20.0).safe_z_mm
    assert plan_touches(clipped, 20.0).safe_z_mm > 200.0
