"""Values derived from a bench: computed for the newest key, late results dropped, changes one at a time."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from machine.workbench.bench.bench import Bench, Step
from machine.workbench.session.base import Derived, SessionBase
from machine.workbench.session.planes import plated_of
from machine.workbench.work.plate import Plated
from machine.workbench.work.worker_pool import WorkerPools
from profiles.errors import PlanError, UserError
from profiles.profile import load
from tests.machine.workbench.models import model

PROFILE = load()


class Copies:
    """A session whose bench is changed by its number of copies, from which the value is derived; its task waits for `go_on`."""

    def __init__(self, **how: Any) -> None:
        self.session = SessionBase(Bench(PROFILE), WorkerPools())
        self.begun: list[int] = []
        self.cancelled: list[int] = []
        self.go_on = asyncio.Event()
        self.derived: Derived[int] = Derived(
            self.session, lambda bench: bench.copies if bench.copies > 1 else None, self.work, **how
        )

    async def work(self, bench: Bench) -> int:
        self.begun.append(bench.copies)
        try:
            await self.go_on.wait()
        except asyncio.CancelledError:
            self.cancelled.append(bench.copies)
            raise
        if bench.copies == 13:
            raise PlanError("thirteen")
        return 10 * bench.copies

    async def become(self, *copies: int) -> None:
        """Change the bench, once or several times without a pause, and let the loop run."""
        for count in copies:
            self.session.do("copies", replace(self.session.bench, copies=count))
        for _ in range(5):
            await asyncio.sleep(0)

    async def settle(self) -> None:
        self.go_on.set()
        await self.derived.wait()


def run(work: Callable[[], Coroutine[Any, Any, None]]) -> None:
    asyncio.run(asyncio.wait_for(work(), 20.0))


@pytest.mark.parametrize("interrupts", [False, True])
def test_the_newest_key_is_computed_and_tasks_for_others_are_dropped(interrupts: bool) -> None:
    async def work() -> None:
        copies = Copies(interrupts=interrupts)
        await copies.become(2)
        await copies.become(3, 4, 5)
        assert copies.derived.stale != interrupts
        assert copies.derived.result is None
        await copies.settle()
        assert (copies.derived.result, copies.derived.progress) == (50, None)
        assert copies.begun == [2, 5]
        assert copies.cancelled == ([2] if interrupts else [])

    run(work)


def test_nothing_is_computed_without_a_key_and_no_other_bench_is_held() -> None:
    async def work() -> None:
        copies = Copies()
        await copies.become(2)
        await copies.settle()
        await copies.become(1)
        assert (copies.derived.result, copies.derived.done, copies.begun) == (None, None, [2])
        await copies.become(3, 1)  # before the task has begun
        assert (copies.derived.progress, copies.begun) == (None, [2])

    run(work)


def test_a_failure_is_reported_and_repeated_only_for_another_key() -> None:
    async def work() -> None:
        copies = Copies()
        await copies.become(13)
        await copies.settle()
        assert copies.session.problem == "thirteen"
        copies.session.become(copies.session.history)
        await copies.become()
        assert copies.begun == [13]
        await copies.become(2)
        assert copies.derived.result == 20

    run(work)


def test_a_value_on_demand_is_computed_once_for_all_callers_and_raises_its_error() -> None:
    async def work() -> None:
        copies = Copies(by_itself=False)
        await copies.become(2)
        assert copies.begun == []
        copies.go_on.set()
        assert await asyncio.gather(copies.derived.get(), copies.derived.get(), copies.derived.get()) == [20, 20, 20]
        assert (await copies.derived.get(), copies.begun) == (20, [2])
        await copies.become(13)
        with pytest.raises(PlanError, match="thirteen"):
            await copies.derived.get()

    run(work)


def test_progress_of_a_task_that_was_stopped_is_not_heard() -> None:
    async def work() -> None:
        copies = Copies(by_itself=False, interrupts=True)
        await copies.become(2)
        copies.derived.begin("first")
        tell = copies.derived.teller()
        copies.derived.stop()
        tell("late")
        assert copies.derived.progress is None
        copies.derived.begin("second")
        tell("late")
        assert copies.derived.progress == "second"
        await copies.settle()

    run(work)


def test_an_answer_changes_the_bench_in_its_turn_and_not_at_all_where_a_command_before_it_has_changed_the_key() -> None:
    async def attempt(other: int) -> Bench:
        def accept(answer: int) -> None:
            copies.session.do("cut", replace(copies.session.bench, cuts=()))

        copies = Copies(by_itself=False, interrupts=True, accept=accept)
        await copies.become(2)
        copies.derived.begin()
        async with copies.session.turn:
            copies.go_on.set()
            await copies.become()
            assert copies.session.bench.cuts is None
            await copies.become(other)
        await copies.derived.wait()
        return copies.session.bench

    async def work() -> None:
        assert (await attempt(2)).cuts == ()
        assert (await attempt(3)).cuts is None

    run(work)


def test_commands_are_executed_one_at_a_time_in_the_order_in_which_they_come_also_after_one_that_fails() -> None:
    async def work() -> None:
        session, log = SessionBase(Bench(PROFILE), WorkerPools()), list[str]()

        def command(name: str, waits: int) -> Callable[[], Coroutine[Any, Any, None]]:
            async def act() -> None:
                log.append(f"{name} begins")
                for _ in range(waits):
                    await asyncio.sleep(0)
                log.append(f"{name} ends")
                if name == "b":
                    raise PlanError("b cannot be done")

            return act

        for name, waits in (("a", 5), ("b", 2), ("c", 0)):
            session.command(command(name, waits), name)
        while session._tasks:
            await asyncio.gather(*session._tasks)
        assert log == [f"{name} {what}" for name in "abc" for what in ("begins", "ends")]
        assert session.answers == {"a": "", "b": "b cannot be done", "c": ""}

    run(work)


def test_a_caller_waiting_for_a_value_is_refused_when_the_bench_is_closed() -> None:
    async def close_meanwhile() -> None:
        copies = Copies(by_itself=False)
        copies.session.history = replace(
            copies.session.history, now=replace(copies.session.history.now, bench=replace(copies.session.bench, copies=2))
        )
        waiting = asyncio.create_task(copies.derived.get())
        await asyncio.sleep(0.01)
        copies.session.closed = True
        for task in list(copies.session._tasks):
            task.cancel()
        with pytest.raises(UserError, match="this bench is closed"):
            await asyncio.wait_for(waiting, 5.0)

    asyncio.run(close_meanwhile())


@pytest.mark.parametrize("setting", ["process.raft_layers=3", "process.complete_objects=true", "process.skirt_loops=3"])
def test_places_of_copies_are_computed_again_for_changes_that_affect_them(setting: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.workbench.session.planes.REST_S", 0.0)

    async def change_setting() -> list[Bench]:
        bench, stood = Bench(PROFILE, model=model(), copies=3), list[Bench]()
        session = SessionBase(bench, WorkerPools())

        async def run(task: Any, standing: Bench, *files: Path) -> Plated:
            stood.append(standing)
            return Plated()

        session.aside.run = run  # type: ignore[assignment, method-assign]
        plated_of(session)
        for changed in (bench, replace(bench, profile=load(settings=[setting]))):
            session.become(replace(session.history, now=Step("", changed)))
            await asyncio.sleep(0.01)
        return stood

    assert len(asyncio.run(change_setting())) == 2
