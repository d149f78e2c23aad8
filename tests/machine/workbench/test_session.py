"""A session whose bench changes while its work is in progress: the bench ends in the state requested last."""

import asyncio
from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.pipeline.requests import Given
from machine.workbench.bench.bench import Bench, with_cuts, with_front, with_profile
from machine.workbench.session.base import hear_from
from machine.workbench.session.commands import obey, redo, undo
from machine.workbench.session.session import Session, Workbench
from machine.workbench.web.snapshot import snapshot
from machine.workbench.work.cutting import Found, Searched
from machine.workbench.work.models import Standing
from machine.workbench.work.plate import Plated
from machine.workbench.work.worker_pool import TaskQueue, WorkerPools
from mdp.decomposition import FrontRow
from mdp.plane import Plane
from mdp.search.plan_file import PlannedPart
from mdp.search.trial import Trial
from profiles.errors import CutError, PlanError, UserError
from profiles.messages import advice, option
from profiles.profile import Profile, load
from tests.machine.workbench.models import model

UP = (0.0, 0.0, 1.0)
EDIT = st.fixed_dictionaries({
    "do": st.sampled_from(["add", "move", "remove", "reorder"]), "part": st.integers(1, 5), "to": st.integers(2, 5),
    "after": st.integers(1, 5), "normal": st.just([*UP]), "offset_mm": st.integers(1, 30),
})  # fmt: skip


@pytest.fixture(autouse=True)
def _nobody_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.workbench.session.planes.CHANGING_S", 0.0)
    monkeypatch.setattr("machine.workbench.session.planes.REST_S", 0.0)
    monkeypatch.setattr("machine.workbench.session.long_work.REST_S", 0.0)


def when_done(work: Callable[[Session], Coroutine[Any, Any, None]]) -> Session:
    """A session with a model on its bench after some work; its processes give fixed answers unless the work replaces them."""

    async def run() -> Session:
        session = Session(load(), Given(), WorkerPools())

        async def nothing(task: Any, *given: Any, **more: Any) -> Any:
            await asyncio.sleep(0)
            return {"try_cuts": Trial(()), "stand": Standing((40.0, 8.0, 40.0), 0.0, "")}.get(task.__name__)

        for tasks in (session.quick, session.long, session.hand):
            tasks.run = nothing  # type: ignore[method-assign]
        session.do("open a", replace(session.bench, model=model("a")))
        await work(session)
        await settled(session)
        return session

    return asyncio.run(asyncio.wait_for(run(), 20.0))


def is_seeking(session: Session) -> bool:
    """Whether a session has a search under way."""
    return isinstance(session.finding.progress, Searched)


async def settled(session: Session) -> None:
    """Return when no work is in progress."""
    while session._tasks:
        await asyncio.gather(*session._tasks, return_exceptions=True)


def edited(offsets_mm: list[float], edit: dict[str, Any]) -> None:
    """Edit a list of plane offsets as the user does; an edit of a missing part changes nothing."""
    parts, at = range(2, len(offsets_mm) + 2), edit["part"] - 2
    if edit["do"] == "add" and edit["after"] <= len(parts) + 1:
        offsets_mm.insert(edit["after"] - 1, edit["offset_mm"])
    elif edit["do"] == "move" and edit["part"] in parts:
        offsets_mm[at] = edit["offset_mm"]
    elif edit["do"] == "remove" and edit["part"] in parts:
        del offsets_mm[at]
    elif edit["do"] == "reorder" and edit["part"] in parts and edit["to"] in parts:
        offsets_mm.insert(edit["to"] - 2, offsets_mm.pop(at))


@settings(max_examples=50)
@given(st.lists(st.tuples(EDIT, st.integers(0, 3)), max_size=12))
def test_edits_that_follow_each_other_quickly_leave_what_they_leave_one_by_one(edits: list[tuple[dict[str, Any], int]]) -> None:
    async def work(session: Session) -> None:
        for edit, turns in edits:
            obey(session, edit)
            for _ in range(turns):  # meanwhile the work of the earlier edits gets this far
                await asyncio.sleep(0)

    offsets_mm: list[float] = []
    for edit, _ in edits:
        edited(offsets_mm, edit)
    assert [part.offset_mm for part in when_done(work).bench.cuts or ()] == offsets_mm


def test_figures_follow_a_drag_at_once_and_other_parts_are_checked_when_it_pauses() -> None:
    """The stem of the tee is a square of 10 mm: a cut has a rim of 40 mm at any height."""
    tried: list[tuple[tuple[float, ...], int, float | None]] = []

    async def work(session: Session) -> None:
        async def really(task: Any, *asked: Any, **more: Any) -> Any:
            return task(lambda told: None, *asked)

        def listen() -> None:
            if session.trials.trial is not None:
                _, cuts, trial = session.trials.trial
                seen = tuple(part.offset_mm or 0.0 for part in cuts), trial.unchecked, trial.seam_mm
                tried.extend([seen] if tried[-1:] != [seen] else [])

        session.hand.run = really  # type: ignore[method-assign]
        for after, offset_mm in ((1, 12.0), (2, 24.0)):
            obey(session, {"do": "add", "normal": list(UP), "offset_mm": offset_mm, "after": after})
        await settled(session)
        session.listeners.append(listen)
        for step in range(20):
            obey(session, {"do": "try", "part": 3, "normal": list(UP), "offset_mm": 23.0 - 0.1 * step})

    when_done(work)
    held, newest = (12.0, 24.0), (12.0, 23.0 - 0.1 * 19)
    assert tried == [(held, 0, 80.0), (newest, 1, 80.0), (newest, 0, 80.0)]


def test_one_command_undoes_or_redoes_several_steps_as_far_as_there_are_some() -> None:
    async def work(session: Session) -> None:
        for deg in (10, 20, 30):
            obey(session, {"do": "turn", "axis": "x", "deg": deg})
        obey(session, {"do": "undo", "count": 2})

    session = when_done(work)
    assert snapshot(session)["steps"] == {"undo": ["turn the model", "open a"], "redo": ["turn the model", "turn the model"]}
    assert len(session.history.redo(2).before) == 4
    assert session.history.undo(10**9).undo(1).before == ()
    assert session.history.undo(0) is session.history.redo(-1) is session.history


def test_a_turn_requested_while_an_edit_is_tried_follows_it() -> None:
    async def work(session: Session) -> None:
        obey(session, {"do": "add", "normal": list(UP), "offset_mm": 5.0, "after": 1})
        await asyncio.sleep(0)
        obey(session, {"do": "turn", "axis": "x", "deg": 90})

    session = when_done(work)
    assert session.bench.cuts is None
    assert [step.word for step in (*session.history.before, session.history.now)][-2:] == ["add a plane", "turn the model"]
    assert session.problem == ""


@pytest.mark.parametrize("turns", range(4))  # of the loop between the two commands
def test_a_plane_that_is_locked_while_it_is_moved_is_locked_at_its_new_position(turns: int) -> None:
    async def work(session: Session) -> None:
        obey(session, {"do": "add", "normal": [*UP], "offset_mm": 5, "after": 1})
        await settled(session)
        obey(session, {"do": "move", "part": 2, "normal": [*UP], "offset_mm": 9})
        for _ in range(turns):
            await asyncio.sleep(0)
        obey(session, {"do": "lock", "part": 2, "locked": True})

    session = when_done(work)
    assert session.bench.locked == {PlannedPart(UP, 9.0)}
    assert session.problem == ""


def test_a_model_that_is_read_while_its_scale_is_set_has_that_scale() -> None:
    async def work(session: Session) -> None:
        scales = []

        async def read(task: Any, *given: Any, **more: Any) -> Any:
            if task.__name__ != "read_model":
                return ()
            profile: Profile = given[2]
            scales.append(profile.process.scale)
            if len(scales) == 1:
                obey(session, {"do": "set", "key": "process.scale", "value": "2.0"})
            return model(f"{given[1]} at {profile.process.scale:g}")

        session.quick.run = read  # type: ignore[method-assign]
        session.command(lambda: session.open_model(Path("b"), "b"))
        await settled(session)

    read = when_done(work).bench.model
    assert read is not None
    assert read.name.endswith(" at 2")


SET_FOR_ONE = Given(
    settings=("process.walls=4", "process.scale=25.4", "process.rotate_deg=[90,0,0]", "process.place_mm=[20.0, 0.0]")
)


@pytest.mark.parametrize("name", ["b", "a"])  # of another file, or of the same one opened again
def test_a_model_opens_without_the_scale_rotation_and_place_of_the_previous_one(name: str) -> None:
    async def work(session: Session) -> None:
        async def read(task: Any, *given: Any, **more: Any) -> Any:
            return model(f"{given[1]} at {given[2].process.scale:g}") if task.__name__ == "read_model" else ()

        session.quick.run = read  # type: ignore[method-assign]
        session.do("set", with_profile(session.bench, SET_FOR_ONE, load(settings=SET_FOR_ONE.settings)))
        await session.open_model(Path(name), name)
        undo(session)
        assert session.bench.profile.process.scale == 25.4
        redo(session)

    bench = when_done(work).bench
    assert bench.model is not None
    assert bench.model.name == f"{name} at 1"
    assert (bench.given.settings, bench.profile.process.walls) == (("process.walls=4",), 4)
    process = bench.profile.process
    assert (process.scale, process.rotate_deg, process.place_mm) == (1.0, (0, 0, 0), (0.0, 0.0))


def test_a_further_bench_has_the_settings_of_another_one_but_not_the_scale_of_its_model() -> None:
    async def opened() -> Given:
        workbench = Workbench(lambda pools: Session(load(), Given(), pools))
        first = workbench.sessions[workbench.open()]
        first.do("open a", Bench(load(settings=SET_FOR_ONE.settings), model("a"), given=SET_FOR_ONE))
        given = workbench.sessions[workbench.open(first)].bench.given
        await workbench.close_all()
        return given

    assert asyncio.run(opened()).settings == ("process.walls=4",)


def test_the_best_result_of_a_stopped_search_is_used_at_once_and_priced_later() -> None:
    best = FrontRow((Plane(np.array(UP), 5.0),), 1.0, 2.0, 3.0)

    async def work(session: Session) -> None:
        async def price(task: Any, *given: Any, **more: Any) -> Any:
            return replace(best, time_s=60.0) if task.__name__ == "price_row" else await asyncio.sleep(9.0)

        session.long.run = price  # type: ignore[method-assign]
        session.finding.search()
        await asyncio.sleep(0)
        session.finding.progress = Searched("", best)
        session.stop()()
        assert (session.bench.cuts, session.bench.rows[0].time_s) == ((PlannedPart(UP, 5.0),), None)

    (row,) = when_done(work).bench.rows
    assert (row.seam_mm, row.time_s) == (2.0, 60.0)


def test_a_turn_that_takes_the_planes_names_the_pauses_that_go_with_them() -> None:
    async def work(session: Session) -> None:
        obey(session, {"do": "add", "normal": list(UP), "offset_mm": 5.0, "after": 1})
        await settled(session)
        for at in ("1:3", "2:8.4mm"):
            obey(session, {"do": "add_stop", "kind": "pause", "at": at})
        obey(session, {"do": "slice"})
        await asyncio.sleep(0)
        obey(session, {"do": "turn", "axis": "x", "deg": 90})
        await asyncio.sleep(0)

    session = when_done(work)
    assert [stop.at for stop in session.bench.stops] == ["1:3"]
    assert session.note.startswith(
        f"turn the model: removed with part 2: {option('pause', '2:8.4mm')} (Undo brings it back); slicing was stopped"
    )


def test_advice_to_choose_a_number_of_parts_disappears_once_it_is_followed() -> None:
    rows = (FrontRow((), 9.0, 0.0, 9.0, chosen=True), FrontRow((Plane(np.array(UP), 5.0),), 1.0, 2.0, 3.0))
    advised: list[list[dict[str, Any]]] = []

    async def work(session: Session) -> None:
        session.do("find", with_front(session.bench, rows, ("no face hangs", f"2 parts would be better: {advice('parts', 2)}")))
        for parts in (1, 2):
            obey(session, {"do": "take", "parts": parts})
            await settled(session)
            advised.append(snapshot(session)["notes"])

    when_done(work)
    hangs = {"text": "no face hangs", "parts": 0}
    assert advised == [[hangs, {"text": "2 parts would be better", "parts": 2}], [hangs]]


def test_slicing_ends_with_a_note_when_the_bench_changes_and_can_begin_again() -> None:
    async def work(session: Session) -> None:
        obey(session, {"do": "slice"})
        await asyncio.sleep(0)
        obey(session, {"do": "turn", "axis": "x", "deg": 90})
        await asyncio.sleep(0)
        assert session.note.startswith("slicing was stopped")
        obey(session, {"do": "slice"})
        await asyncio.sleep(0)
        assert session.slicing.progress is not None
        assert session.slicing.bench is session.bench

    session = when_done(work)
    assert session.slicing.done is not None
    assert session.slicing.done.bench is session.bench


def test_slicing_waits_for_settings_requested_before_it() -> None:
    async def work(session: Session) -> None:
        async def read(task: Any, *given: Any, **more: Any) -> Any:
            for _ in range(5):
                await asyncio.sleep(0)
            return model("a") if task.__name__ == "read_model" else ()

        session.quick.run = read  # type: ignore[method-assign]
        obey(session, {"do": "set", "key": "process.scale", "value": "2"})
        await asyncio.sleep(0)
        obey(session, {"do": "slice"})
        assert session.slicing.progress is None

    session = when_done(work)
    assert session.slicing.done is not None
    assert session.slicing.done.bench.profile.process.scale == 2.0
    assert session.problem == ""


def test_a_refusal_is_shown_only_to_its_own_page_until_its_next_command() -> None:
    told = []

    async def work(session: Session) -> None:
        for page, part in (("mine", 7), ("yours", 8)):
            hear_from(page)
            obey(session, {"do": "move", "part": part, "normal": [*UP], "offset_mm": 1})
            await settled(session)
        told.append(dict(session.problems))
        hear_from("mine")
        obey(session, {"do": "dismiss"})
        told.append(dict(session.problems))
        hear_from("yours")
        obey(session, {"do": "add", "normal": [*UP], "offset_mm": 20})
        await settled(session)
        told.append(dict(session.problems))

    when_done(work)
    mine, yours = (f"part is {part}: there is none yet" for part in (7, 8))
    assert told == [{"mine": mine, "yours": yours}, {"yours": yours}, {}]


def test_a_refused_plane_is_placed_at_the_nearest_valid_position_on_request() -> None:
    def bounded(session: Session) -> None:
        async def answer(task: Any, *given: Any, **more: Any) -> Any:
            if task.__name__ == "nearest":
                (cuts, part), *_ = given[2]
                return (*cuts[: part - 2], PlannedPart(UP, 30.0), *cuts[part - 1 :])
            high = task.__name__ == "try_cuts" and any(cut.offset_mm > 30.0 for cut in given[2])
            return Trial((), 2, "too high") if high else Trial(()) if task.__name__ == "try_cuts" else None

        session.hand.run = answer  # type: ignore[method-assign]

    async def work(session: Session) -> None:
        bounded(session)
        obey(session, {"do": "add", "normal": [*UP], "offset_mm": 33})
        await settled(session)
        assert session.problem == "part 2 cannot be cut off: too high"
        assert session.trials.refused is not None
        assert session.trials.refused.near == {"do": "add", "normal": [*UP], "offset_mm": 33, "near": True}
        obey(session, session.trials.refused.near)
        await settled(session)

    session = when_done(work)
    assert (session.bench.cuts, session.problem) == ((PlannedPart(UP, 30.0),), "")


def test_at_another_place_planes_that_the_machine_does_not_reach_stay_as_invalid_ones_and_slicing_is_refused() -> None:
    low, high = (Plane(np.array(UP), offset_mm) for offset_mm in (5.0, 25.0))
    rows = (FrontRow((), 9.0, 0.0, 9.0), FrontRow((low,), 1.0, 2.0, 3.0), FrontRow((low, high), 1.0, 1.0, 2.0, chosen=True))

    async def work(session: Session) -> None:
        async def answer(task: Any, *given: Any, **more: Any) -> Any:
            if task.__name__ != "try_cuts":
                return Standing((40.0, 8.0, 40.0), 0.0, "") if task.__name__ == "stand" else None
            aside = given[4] if len(given) > 4 else ()
            far = [part for part, cut in enumerate(given[2], start=2) if cut.offset_mm > 20.0 and cut not in aside]
            is_there = given[1].profile.process.place_mm[0] > 50.0 and far
            return Trial((), far[0], "Z would go too far") if is_there else Trial(())

        async def price(task: Any, bench: Bench, row: int, **more: Any) -> Any:
            return bench.rows[row]

        session.hand.run, session.long.run = answer, price  # type: ignore[method-assign, assignment]
        session.do("find", with_front(session.bench, rows))
        for x in (30, 60):
            obey(session, {"do": "set", "key": "process.place_mm", "value": f"[{x}, 0]"})
            await settled(session)
            cut.append((session.bench.parts, len(session.bench.rows), session.note))
        obey(session, {"do": "slice"})
        await settled(session)
        cut.append((session.bench.parts, session.slicing.number, session.problem))
        obey(session, {"do": "undo"})

    cut: list[tuple[int, int, str]] = []
    session = when_done(work)
    why = "part 2 cannot be cut off: Z would go too far"
    assert cut == [(3, 3, ""), (3, 2, why), (3, 0, f"{why}: move or remove its plane, or find parts again")]
    assert session.trials.invalid == {}
    assert (session.bench.parts, session.bench.profile.process.place_mm) == (3, (30.0, 0.0))


def test_an_invalid_plane_is_removed_even_if_another_one_is_invalid_without_it() -> None:
    low, high = PlannedPart(UP, 5.0), PlannedPart(UP, 25.0)

    async def work(session: Session) -> None:
        async def answer(task: Any, *given: Any, **more: Any) -> Any:
            if task.__name__ != "try_cuts":
                return Standing((40.0, 8.0, 40.0), 0.0, "") if task.__name__ == "stand" else None
            cuts, aside = given[2], given[4]
            if high in cuts:
                return Trial(()) if high in aside else Trial((), 3, "it is marked")
            return Trial(()) if low in aside else Trial((), 2, "a sliver stays")

        session.hand.run = answer  # type: ignore[method-assign]
        session.do("cut", replace(session.bench, cuts=(low, high)))
        await settled(session)
        assert session.trials.invalid == {high: "it is marked"}
        obey(session, {"do": "remove", "part": 3})
        await settled(session)

    session = when_done(work)
    assert (session.bench.cuts, session.problem) == ((low,), "")
    assert session.note == "part 2 cannot be cut off: a sliver stays"


def forbidding(*reasons: tuple[PlannedPart, str]) -> Callable[..., Coroutine[Any, Any, Any]]:
    """Answers of processes that reject these planes; of the other tasks only `stand` has a result."""

    async def answer(task: Any, *given: Any, **more: Any) -> Any:
        if task.__name__ != "try_cuts":
            return Standing((40.0, 8.0, 40.0), 0.0, "") if task.__name__ == "stand" else None
        cuts, most_cuts, aside = given[2:5]
        if most_cuts == 0:
            await asyncio.sleep(0.1)  # the figures come later than the command
        rejected = {plane: reason for plane, reason in reasons if plane in cuts and plane not in aside}
        return next((Trial((), cuts.index(plane) + 2, reason) for plane, reason in rejected.items()), Trial(()))

    return answer


def test_an_invalid_plane_that_is_put_into_an_impossible_order_is_reported() -> None:
    low, high = PlannedPart(UP, 5.0), PlannedPart(UP, 25.0)

    async def work(session: Session) -> None:
        session.hand.run = forbidding((high, "it is marked"))  # type: ignore[assignment, method-assign]
        session.do("cut", replace(session.bench, cuts=(low, high)))
        await settled(session)
        session.hand.run = forbidding((high, "nothing is left above"))  # type: ignore[assignment, method-assign]
        obey(session, {"do": "reorder", "part": 3, "to": 2})

    session = when_done(work)
    assert (session.bench.cuts, session.note) == ((high, low), "part 2 cannot be cut off: nothing is left above")


def test_a_plane_can_be_moved_while_it_is_unknown_that_another_one_is_invalid() -> None:
    low, high, lower = (PlannedPart(UP, offset_mm) for offset_mm in (5.0, 25.0, 4.0))

    async def work(session: Session) -> None:
        session.hand.run = forbidding((high, "it is marked"))  # type: ignore[assignment, method-assign]
        session.do("cut", replace(session.bench, cuts=(low, high)))
        obey(session, {"do": "move", "part": 2, "normal": [*UP], "offset_mm": 4.0})

    session = when_done(work)
    assert (session.bench.cuts, session.problem) == ((lower, high), "")
    assert session.note == "part 3 cannot be cut off: it is marked"


@pytest.mark.parametrize(
    ("error", "told"), [(CutError("part 2 cannot be cut off: it is marked"), ""), (UserError("a bug"), "a bug")]
)
def test_parts_that_cannot_be_drawn_report_why_unless_a_plane_is_invalid(error: UserError, told: str) -> None:
    async def work(session: Session) -> None:
        async def draw(task: Any, *given: Any, **more: Any) -> Any:
            if task.__name__ == "draw_pieces":
                raise error
            return ()

        session.quick.run = draw  # type: ignore[method-assign]
        session.do("cut", replace(session.bench, cuts=(PlannedPart(UP, 5.0),)))
        with suppress(UserError):
            assert (await session.pieces.get()).read_bytes() == b""
        refused.append(session.problem)

    refused: list[str] = []
    when_done(work)
    assert refused == [told]


def test_a_search_that_is_stopped_says_what_became_of_it_until_something_else_is_done() -> None:
    told = []

    async def work(session: Session) -> None:
        session.long.warm = partial(asyncio.sleep, 0)  # type: ignore[method-assign]
        for best in (None, FrontRow((Plane(np.array(UP), 20.0),), 0.0, 0.0, 0.0)):
            obey(session, {"do": "search"})
            await asyncio.sleep(0)
            session.finding.progress = Searched("stage 1", best)
            obey(session, {"do": "stop"})
            await asyncio.sleep(0)
            told.append(session.note)
            await settled(session)
        obey(session, {"do": "dismiss"})
        told.append(session.note)

    when_done(work)
    assert told == [
        "The search was stopped before it had cut anything: all is as it was.",
        "The search was stopped; the best so far is used: 2 parts.",
        "",
    ]


def test_a_search_that_replaces_planes_made_by_hand_says_how_to_get_them_back() -> None:
    found = FrontRow((Plane(np.array(UP), 20.0),), 0.0, 0.0, 0.0, chosen=True)
    notes: list[str] = []

    async def work(session: Session) -> None:
        async def find(task: Any, *given: Any, **more: Any) -> Any:
            return Found((found,), ())

        session.long.run = find  # type: ignore[method-assign]
        session.do("add", with_cuts(session.bench, (PlannedPart(UP, 9.0),)))
        for _ in range(2):
            obey(session, {"do": "search"})
            await session.finding.wait()
            await asyncio.sleep(0)
            await session.finding.wait()
            notes.append(session.note)

    when_done(work)
    assert notes == ["your planes were replaced: Undo brings them back", ""]


@pytest.mark.parametrize(("offset_mm", "end"), [(9.0, "; your planes were replaced: Undo brings them back."), (20.0, ".")])
def test_a_search_that_is_stopped_says_whether_it_has_replaced_planes_made_by_hand(offset_mm: float, end: str) -> None:
    sentences: list[str] = []

    async def work(session: Session) -> None:
        session.do("add", with_cuts(session.bench, (PlannedPart(UP, offset_mm),)))
        best = FrontRow((Plane(np.array(UP), 20.0),), 0.0, 0.0, 0.0)
        sentences.append(session.finding.take_best(session.bench, Searched("stage 1", best)))

    when_done(work)
    assert sentences == [f"The search was stopped; the best so far is used: 2 parts{end}"]


def test_a_search_that_begins_while_another_one_is_being_stopped_continues() -> None:
    found = FrontRow((Plane(np.array(UP), 20.0),), 0.0, 0.0, 0.0, chosen=True)

    async def work(session: Session) -> None:
        async def find(task: Any, *given: Any, **more: Any) -> Any:
            for _ in range(5):
                await asyncio.sleep(0)
            return Found((found,), ())

        session.long.run = find  # type: ignore[method-assign]
        session.long.warm = partial(asyncio.sleep, 0)  # type: ignore[method-assign]
        obey(session, {"do": "search"})
        await asyncio.sleep(0)
        obey(session, {"do": "stop"})
        obey(session, {"do": "search"})
        for _ in range(3):  # meanwhile the stopped search reports its end
            await asyncio.sleep(0)
        assert is_seeking(session)

    session = when_done(work)
    assert (session.bench.parts, session.finding.progress) == (2, None)


def test_a_stop_ends_the_search_at_once_though_a_command_before_it_is_still_executed() -> None:
    async def work(session: Session) -> None:
        session.long.warm = partial(asyncio.sleep, 0)  # type: ignore[method-assign]
        obey(session, {"do": "search"})
        await asyncio.sleep(0)
        assert is_seeking(session)
        async with session.turn:
            obey(session, {"do": "stop"})
            assert (is_seeking(session), session.note) == (False, "")

    assert when_done(work).note == "The search was stopped before it had cut anything: all is as it was."


def test_a_stop_reaches_work_that_still_waits_for_its_turn() -> None:
    async def work(session: Session) -> None:
        async with session.turn:
            for name in ("search", "slice", "stop"):
                obey(session, {"do": name})
        await settled(session)
        assert (is_seeking(session), session.slicing.progress, session.slicing.number) == (False, None, 0)
        stopped.append(session.note)
        obey(session, {"do": "slice"})

    stopped: list[str] = []
    session = when_done(work)
    assert session.slicing.number == 1
    assert stopped == [
        "The search was stopped before it had cut anything: all is as it was. Slicing was stopped: there are no slices."
    ]


def test_a_stop_ends_a_comparison_that_still_waits_for_its_turn() -> None:
    async def work(session: Session) -> None:
        async with session.turn:
            for name in ("compare", "stop"):
                obey(session, {"do": name})
        await settled(session)

    session = when_done(work)
    assert (session.note, session.problem) == ("The comparison was stopped: nothing of it is kept.", "")


@pytest.mark.parametrize("given", [{}, {"ranker": ""}, {"ranker": "  "}, {"ranker": " classic "}])
def test_a_search_without_the_name_of_a_ranker_is_a_classic_one(given: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    rankers: list[str] = []

    async def work(session: Session) -> None:
        monkeypatch.setattr(session.finding, "search", lambda orient, ranker: rankers.append(ranker))
        obey(session, {"do": "search", **given})
        await settled(session)

    when_done(work)
    assert rankers == ["classic"]


def test_pricing_continues_through_unrelated_changes_and_a_new_front_has_its_own_prices() -> None:
    rows = (FrontRow((), 9.0, 0.0, 9.0), FrontRow((Plane(np.array(UP), 5.0),), 1.0, 2.0, 3.0, chosen=True))
    priced: list[int] = []

    async def work(session: Session) -> None:
        async def price(task: Any, bench: Bench, row: int, **more: Any) -> Any:
            priced.append(row)
            for _ in range(5):
                await asyncio.sleep(0)
            return replace(bench.rows[row], time_s=60.0)

        session.long.run = price  # type: ignore[assignment, method-assign]
        session.do("find", replace(with_front(session.bench, rows), priced=False))
        for count in (2, 3):
            await asyncio.sleep(0)
            obey(session, {"do": "copies", "count": count})

    bench = when_done(work).bench
    assert (priced, bench.priced, bench.copies) == ([0, 1], True, 3)
    assert with_front(replace(bench, priced=False), rows).priced


def reading_plates(session: Session) -> None:
    """Make a session read files of two plates, without measuring a plan."""

    async def read(task: Any, *given: Any, **more: Any) -> Any:
        if task.__name__ != "read_model":
            return ()
        path, name, _, _, plate = given
        return replace(model(name), path=path, plates={1: "", 2: ""}, plate=plate)

    session.quick.run = read  # type: ignore[method-assign]


def test_the_first_plate_of_a_file_can_be_added_after_another_one_was_opened() -> None:
    offered: list[str] = []

    async def work(session: Session) -> None:
        reading_plates(session)
        await session.open_model(Path("b.3mf"), "b.3mf")
        for plate in (2, 1):
            await session.open_plate(plate=plate)
            offered.append(session.addable)
            if not session.addable:
                with pytest.raises(PlanError, match=r"plate 2 of b\.3mf is open: only the first plate"):
                    await session.add_opened()
        await session.add_opened()

    bench = when_done(work).bench
    assert offered == ["", "b.3mf"]
    assert bench.model is not None
    assert (bench.model.name, [other.model and other.model.name for other in bench.beside]) == ("a", ["b.3mf"])


def test_opening_a_demo_with_a_plan_says_that_the_previous_work_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))

    async def work(session: Session) -> None:
        reading_plates(session)
        (tmp_path / "a.stl").write_bytes(b"solid")
        session.do("copies", replace(session.bench, model=replace(model("a"), path=tmp_path / "a.stl"), copies=2))
        await session.open_demo(name="demo:calibration")

    session = when_done(work)
    assert (session.bench.parts > 1, session.note) == (True, "a is kept under Earlier work (Undo brings it back)")


@pytest.mark.parametrize(("task", "priced"), [("price_cuts", True), ("price_row", False)])
def test_slices_do_not_wait_for_prices_of_planes_or_settings_that_have_changed_since(
    task: str, priced: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[str] = []

    async def work(session: Session) -> None:
        async def ask(do: Any, task: Any, *given: Any, tell: Any) -> Any:
            begun.append(task.__name__)
            await asyncio.sleep(60.0 if task.__name__.startswith("price") else 0.0)
            return None, ""

        session.long._ask, session.long.run = ask, partial(TaskQueue.run, session.long)  # type: ignore[assignment, method-assign]
        for offset_mm in (6.0, 7.0):
            row = FrontRow((Plane(np.array(UP), offset_mm + 3.0),), 1.0, 2.0, 3.0, chosen=True)
            found = replace(with_front(session.bench, (row,)), priced=priced)
            session.do("move a plane", with_cuts(found, (PlannedPart(UP, offset_mm),)) if priced else found)
            for _ in range(5):
                await asyncio.sleep(0)
            monkeypatch.setattr("machine.workbench.session.long_work.REST_S", 60.0)  # the second pricing has not begun
        obey(session, {"do": "slice"})
        for _ in range(5):
            await asyncio.sleep(0)
        assert begun == [task, "slice_bench"]
        session.by_hand.stop()
        session._prices.stop()

    when_done(work)


def test_the_size_is_known_at_once_while_places_for_copies_of_cut_models_are_still_looked_for() -> None:
    known: list[bool] = []

    async def work(session: Session) -> None:
        async def put(task: Any, *given: Any) -> Plated:
            await asyncio.sleep(60.0)
            return Plated()

        session.aside.run = put  # type: ignore[assignment, method-assign]
        session.do("copies", replace(session.bench, copies=2, cuts=(PlannedPart((0.0, 0.0, 1.0), 5.0),)))
        await session.standing.wait()
        state = snapshot(session)
        known.append(state["standing"] is not None and state["copies_mm"] is None)
        known.append(state["copies_told"] == "Looking for places for all 2 on the plate …")
        session.plated.stop()

    when_done(work)
    assert known == [True, True]


def test_a_trial_on_another_bench_does_not_have_the_present_one_prepared_again() -> None:
    async def work(session: Session) -> None:
        await settled(session)
        before = session.readiness.number
        await session.trials.attempt(replace(session.bench, model=model("b")), ())
        session.do("copies", replace(session.bench, copies=2))
        await settled(session)
        prepared.append(session.readiness.number - before)

    prepared: list[int] = []
    when_done(work)
    assert prepared == [0]


def test_a_model_chosen_in_one_piece_stays_so_when_a_setting_changes() -> None:
    rows = (FrontRow((), 9.0, 0.0, 9.0), FrontRow((Plane(np.array(UP), 5.0),), 1.0, 2.0, 3.0, chosen=True))

    async def work(session: Session) -> None:
        session.do("find", with_front(session.bench, rows))
        obey(session, {"do": "take", "parts": 1})
        obey(session, {"do": "set", "key": "process.place_mm", "value": "[20, 0]"})

    bench = when_done(work).bench
    assert (bench.cuts, bench.profile.process.place_mm) == ((), (20.0, 0.0))


@pytest.mark.parametrize("key", ["", "=:", "walls"])
def test_an_unknown_key_is_not_set(key: str) -> None:
    async def work(session: Session) -> None:
        obey(session, {"do": "set", "key": key, "value": ":"})

    assert when_done(work).problem == f"{key!r} is not a key of a profile"
