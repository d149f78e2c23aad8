"""A part on plastic is hotter from its first bead: its temperature is set before the turn and waited for after it."""

import pytest

from machine.dryrun import dry_run
from machine.dryrun.dryrun import Timeline
from tests.machine.dryrun.bent import bent
from tests.machine.dryrun.planted import before_turn


@pytest.mark.parametrize("machine", ["generic_ac", "gen5x", "linuxcnc_xyzac"])
def test_each_turn_sets_the_temperature_before_and_waits_once_after(machine: str) -> None:
    profile, _, lines = bent(machine)
    hot_c = f"{profile.material.nozzle_c + profile.process.interface_temperature_add_c:g}"
    for part in (2, 3):
        begin = next(k for k, line in enumerate(lines) if line.startswith(f";PART:{part} "))
        way = lines[before_turn(list(lines), part - 1) : begin]
        heat = [k for k, line in enumerate(way) if line.startswith(("M104", "M568", "M109"))]
        turn = way.index(";TYPE:Custom")
        assert [way[k].split()[0] for k in heat] == [way[heat[0]].split()[0], "M109"]
        assert heat[0] < turn < heat[1] == len(way) - 1
        assert all(way[k].endswith(hot_c) for k in heat)


def test_the_wait_counts_with_what_the_turn_has_not_covered() -> None:
    """The wait takes the time to heat ten degrees at 1.5 a second, less the turn, and the ten seconds of steady temperature."""
    profile, _, lines = bent("generic_ac")
    run = dry_run(lines, profile)
    assert len(run.waits) == 2
    assert all(10.0 <= seconds < 10.0 + 10.0 / 1.5 for _, seconds in run.waits)
    assert run.time_s == pytest.approx(float(run.times_s.sum()) + sum(seconds for _, seconds in run.waits))
    assert Timeline(run).remaining_s(0) == pytest.approx(run.time_s)
