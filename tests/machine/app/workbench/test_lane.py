"""The processes of the workbench: one that nobody has asked for a while goes, and the next task starts another."""

import asyncio

import pytest

from machine.app.workbench.work import lane as lanes
from machine.app.workbench.work.lane import Lane
from profiles.errors import UserError
from profiles.profile import load
from tests.machine.workbench import is_there
from tests.shapes import tee


def test_a_process_that_rests_goes_and_the_next_task_starts_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lanes, "REST_AFTER_S", 0.05)
    before, between, after = asyncio.run(rested())
    assert before == after
    assert before == pytest.approx(10.0)
    assert not is_there(between)


def test_what_waits_for_a_process_that_has_gone_for_good_starts_no_other() -> None:
    lane = Lane()
    lane.close()
    with pytest.raises(UserError, match="this bench is closed"):
        asyncio.run(lane.run("rank_resting", tee(), load()))
    assert lane._process is None


async def rested() -> tuple[float, int, float]:
    """The height of a model's best orientation, its process's number when it has rested, and the height told by another one."""
    lane = Lane()
    before = await lane.run("rank_resting", tee(), load())
    process = lane._process
    assert process is not None
    await asyncio.wait_for(process.wait(), 30.0)
    after = await lane.run("rank_resting", tee(), load())
    assert lane._process is not None
    await asyncio.wait_for(lane._process.wait(), 30.0)
    return before[0].height_mm, process.pid, after[0].height_mm
