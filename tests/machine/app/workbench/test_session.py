"""A session whose bench changes while work for it is under way: what lies on it at the end is what was asked for last."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from machine.app.requests import Given
from machine.app.workbench.bench.bench import with_profile
from machine.app.workbench.session.commands import obey
from machine.app.workbench.session.finding import Search
from machine.app.workbench.session.session import Session
from machine.app.workbench.work.cutting import Searched
from machine.app.workbench.work.standing import Standing
from machine.app.workbench.work.worker_pool import WorkerPools
from mdp.decomposition import FrontRow
from mdp.plane import Plane
from mdp.plans.plan_file import PlannedPart
from mdp.search.trial import Trial
from profiles.profile import Profile, load
from tests.machine.app.workbench.models import model

UP = (0.0, 0.0, 1.0)


def when_done(work: Callable[[Session], Coroutine[Any, Any, None]]) -> Session:
    """A session with a model on its bench after some work; its processes answer what the work has them answer."""

    async def run() -> Session:
        session = Session(load(), Given(), WorkerPools())

        async def nothing(task: str, *given: Any, **more: Any) -> Any:
            await asyncio.sleep(0.01)
            return {"try_cuts": Trial(()), "stand": Standing((40.0, 8.0, 40.0), 0.0, "")}.get(task)

        for tasks in (session.quick, session.long, session.hand):
            tasks.run = nothing  # type: ignore[method-assign]
        session.do("open a", replace(session.bench, model=model("a")))
        await work(session)
        while session._tasks:
            await asyncio.gather(*session._tasks, return_exceptions=True)
        return session

    return asyncio.run(asyncio.wait_for(run(), 20.0))


def test_of_edits_that_follow_each_other_quickly_none_is_lost() -> None:
    async def work(session: Session) -> None:
        for offset_mm in (5.0, 10.0):
            obey(session, {"do": "add", "normal": list(UP), "offset_mm": offset_mm, "after": 1})
        obey(session, {"do": "move", "part": 3, "normal": list(UP), "offset_mm": 6.0})

    assert [part.offset_mm for part in when_done(work).bench.cuts or ()] == [10.0, 6.0]


def test_an_edit_whose_bench_is_another_one_meanwhile_is_not_done_and_says_so() -> None:
    async def work(session: Session) -> None:
        obey(session, {"do": "add", "normal": list(UP), "offset_mm": 5.0, "after": 1})
        await asyncio.sleep(0)
        obey(session, {"do": "turn", "axis": "x", "deg": 90})

    session = when_done(work)
    assert session.bench.cuts is None
    assert session.problem == "add a plane: what lies on the workbench has changed meanwhile, so it was not done"


def test_a_model_that_is_read_while_its_scale_is_set_has_that_scale() -> None:
    async def work(session: Session) -> None:
        scales = []

        async def read(task: str, *given: Any, **more: Any) -> Any:
            if task != "read_model":
                return ()
            profile: Profile = given[2]
            scales.append(profile.process.scale)
            if len(scales) == 1:
                doubled = Given(settings=("process.scale=2.0",))
                session.do("set process.scale", with_profile(session.bench, doubled, load(settings=doubled.settings)))
            return model(f"{given[1]} at {profile.process.scale:g}")

        session.quick.run = read  # type: ignore[method-assign]
        await session.open_model(Path("b"), "b")

    read = when_done(work).bench.model
    assert read is not None
    assert read.name == "b at 2"


def test_the_best_of_a_search_that_is_stopped_is_taken_at_once_and_its_price_told_later() -> None:
    best = FrontRow((Plane(np.array(UP), 5.0),), 1.0, 2.0, 3.0)

    async def work(session: Session) -> None:
        async def price(task: str, *given: Any, **more: Any) -> Any:
            return (replace(best, time_s=60.0, chosen=True),) if task == "measure_plan" else await asyncio.sleep(9.0)

        session.long.run = price  # type: ignore[method-assign]
        session.finding.begin()
        await asyncio.sleep(0)
        session.finding.search = Search(session.bench, Searched("", best))
        session.finding.stop()
        assert (session.bench.cuts, session.bench.rows[0].time_s) == ((PlannedPart(UP, 5.0),), None)

    (row,) = when_done(work).bench.rows
    assert (row.seam_mm, row.time_s) == (2.0, 60.0)


def test_a_turn_that_takes_the_planes_names_the_pauses_that_go_with_them() -> None:
    async def work(session: Session) -> None:
        obey(session, {"do": "add", "normal": list(UP), "offset_mm": 5.0, "after": 1})
        await asyncio.sleep(0.05)
        for at in ("1:3", "2:8.4mm"):
            obey(session, {"do": "add_stop", "kind": "pause", "at": at})
        obey(session, {"do": "slice"})
        await asyncio.sleep(0)
        obey(session, {"do": "turn", "axis": "x", "deg": 90})

    session = when_done(work)
    assert [stop.option for stop in session.bench.stops] == ["--pause 1:3"]
    assert session.problem.startswith(
        "turn the model: taken away with part 2: --pause 2:8.4mm (Undo brings it back); slicing has ended"
    )


def test_slices_whose_bench_is_changed_meanwhile_end_and_say_so_and_others_may_begin() -> None:
    async def work(session: Session) -> None:
        obey(session, {"do": "slice"})
        await asyncio.sleep(0)
        obey(session, {"do": "turn", "axis": "x", "deg": 90})
        assert session.problem.startswith("slicing has ended")
        obey(session, {"do": "slice"})
        assert session.slicing.under_way is not None
        assert session.slicing.under_way.bench is session.bench

    session = when_done(work)
    assert session.slicing.done is not None
    assert session.slicing.done.bench is session.bench
