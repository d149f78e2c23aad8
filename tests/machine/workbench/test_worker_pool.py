"""The processes shared by all benches: their number, the order of tasks, stopping, and the benches that use them."""

import asyncio
from collections.abc import Coroutine
from contextlib import AsyncExitStack
from typing import Any

import pytest

from machine.pipeline.requests import Given
from machine.workbench.bench.bench import Bench, History, Step, with_model
from machine.workbench.session.session import Session
from machine.workbench.work import worker_pool
from machine.workbench.work.cutting import find_parts, try_cuts
from machine.workbench.work.models import rank_resting
from machine.workbench.work.worker_pool import TaskQueue, WorkerPool, WorkerPools
from mdp.kernels.workers import Worker
from mdp.model_file import locate
from mdp.plane import Plane
from mdp.read import read_mesh
from mdp.search.plan_file import PlannedPart
from mdp.search.trial import Trials
from profiles.errors import UserError
from profiles.profile import load
from tests.machine.running_workbench import is_there
from tests.machine.workbench.models import model
from tests.shapes import box, tee

PROFILE = load()
LEVEL = PlannedPart((0.0, 0.0, 1.0), 12.0)


class Started:
    """The processes that a pool starts, in order."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.processes: list[Worker] = []
        monkeypatch.setattr(worker_pool, "Worker", self._start)

    def _start(self, **given: float) -> Worker:
        self.processes.append(Worker(**given))  # type: ignore[arg-type]
        return self.processes[-1]

    async def gone(self, place: int) -> None:
        """Wait until a process has ended."""
        await asyncio.to_thread(self.processes[place].process.wait, 30.0)


def run(work: Coroutine[Any, Any, Any], *pools: WorkerPool) -> Any:
    """The result of `work`; afterwards the processes of the pools are ended."""

    async def whole() -> Any:
        try:
            return await asyncio.wait_for(work, 120.0)
        finally:
            for pool in pools:
                pool.end()

    return asyncio.run(whole())


async def rank(tasks: TaskQueue) -> float:
    """The height of the best orientation of a tee: 10 mm, lying on its face."""
    resting = await tasks.run(rank_resting, model(), PROFILE)
    height_mm: float = resting[1].height_mm
    return height_mm


def test_many_benches_share_a_bounded_number_of_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    started, pool = Started(monkeypatch), WorkerPool(2)

    async def work() -> list[float]:
        return await asyncio.gather(*(rank(TaskQueue(pool)) for _ in range(6)))

    assert run(work(), pool) == pytest.approx([10.0] * 6)
    assert len(started.processes) == 2


def test_one_bench_with_much_to_do_does_not_keep_another_one_waiting_for_all_of_it() -> None:
    pool, done = WorkerPool(1), list[str]()

    async def note(name: str, tasks: TaskQueue) -> None:
        await rank(tasks)
        done.append(name)

    async def work() -> None:
        busy, idle = TaskQueue(pool), TaskQueue(pool)
        waiting = [asyncio.create_task(note(f"busy {k}", busy)) for k in range(3)]
        await asyncio.sleep(0)
        await asyncio.gather(*waiting, asyncio.create_task(note("idle", idle)))

    run(work(), pool)
    assert done == ["busy 0", "idle", "busy 1", "busy 2"]


def test_a_cancelled_task_ends_only_its_own_process_and_a_waiting_one_ends_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    started, pool = Started(monkeypatch), WorkerPool(2)
    tree = with_model(Bench(PROFILE), model("tree", read_mesh(locate("demo:tree"))[0]))

    async def work() -> float:
        begun = asyncio.Event()
        search = TaskQueue(pool).run(find_parts, tree, tell=lambda report: begun.set())
        searching = asyncio.create_task(search)
        await begun.wait()
        ranking = asyncio.create_task(rank(TaskQueue(pool)))
        while len(started.processes) < 2:
            await asyncio.sleep(0.01)
        waiting = asyncio.create_task(rank(TaskQueue(pool)))
        await asyncio.sleep(0)
        waiting.cancel()
        searching.cancel()
        await asyncio.wait((searching, waiting))
        await started.gone(0)
        return await ranking

    assert run(work(), pool) == pytest.approx(10.0)
    assert len(started.processes) == 2


def test_a_task_that_is_cancelled_in_any_of_its_first_moments_leaves_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    started, pool = Started(monkeypatch), WorkerPool(1)

    async def work() -> None:
        for moment in range(8):
            ranking = asyncio.create_task(rank(TaskQueue(pool)))
            for _ in range(moment):
                await asyncio.sleep(0)
            ranking.cancel()
            await asyncio.wait([ranking])

    asyncio.run(work())
    assert len(started.processes) > 4
    assert not any(is_there(process.process.pid) for process in started.processes)


def test_an_idle_process_ends_and_the_next_task_starts_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker_pool, "REST_AFTER_S", 0.05)
    started, pool = Started(monkeypatch), WorkerPool(1)

    async def work() -> None:
        tasks = TaskQueue(pool)
        for _ in range(2):
            assert await rank(tasks) == pytest.approx(10.0)
            await started.gone(-1)

    run(work(), pool)
    assert not any(is_there(process.process.pid) for process in started.processes)
    assert len(started.processes) == 2


def test_a_bench_gets_the_process_that_it_had_and_its_end_is_that_of_this_process_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    started, pool = Started(monkeypatch), WorkerPool(2)

    async def work() -> None:
        first, second = TaskQueue(pool), TaskQueue(pool)
        await rank(first)
        await rank(second)
        assert len(started.processes) == 2
        for tasks in (second, first):
            async with pool.worker(tasks) as process:
                assert process is started.processes[[first, second].index(tasks)]
        first.close()
        await started.gone(0)
        assert await rank(second) == pytest.approx(10.0)
        with pytest.raises(UserError, match="this bench is closed: nothing is computed for it any longer"):
            await rank(first)

    run(work(), pool)
    assert len(started.processes) == 2


def test_a_search_that_waits_for_other_benches_reports_that() -> None:
    pools = WorkerPools()
    pools.long = WorkerPool(1)

    async def work() -> tuple[str, str]:
        session = Session(PROFILE, Given(), pools)
        session.history = History(Step("", with_model(Bench(PROFILE), model())))
        texts = []
        for others in (0, 1):
            async with AsyncExitStack() as stack:
                if others:
                    await stack.enter_async_context(pools.long.worker(TaskQueue(pools.long)))
                session.finding.search()
                texts.append(session.finding.progress.text)
                await asyncio.sleep(0)
                session.finding.stop()
        await asyncio.sleep(0)
        await session.close()
        await asyncio.gather(*session._tasks, return_exceptions=True)
        return texts[0], texts[1]

    assert run(work(), pools.long) == ("beginning", "waiting until the work of other benches is done")


def test_planes_are_tried_on_their_own_bench_when_processes_are_shared() -> None:
    pools = WorkerPools()
    pools.hand = WorkerPool(1)

    def bench(mesh: Any) -> Bench:
        return with_model(Bench(PROFILE), model(mesh=mesh))

    async def work() -> list[Any]:
        sessions = Session(PROFILE, Given(), pools), Session(PROFILE, Given(), pools)
        benches = bench(tee()), bench(box(20.0, 20.0, 20.0))
        tried = [await sessions[k].readiness.ask(try_cuts, benches[k], (LEVEL,), 0) for k in (0, 1, 0)]
        for session in sessions:
            await session.close()
        return tried

    first, of_box, again = run(work(), pools.hand)
    assert first == again == Trials(tee(), PROFILE).attempt([_plane(LEVEL)], 0)
    assert of_box.seam_mm == pytest.approx(80.0, rel=0.01)  # around the box


def _plane(part: PlannedPart) -> Plane:
    assert part.plane is not None
    return part.plane
