"""Session: one bench with its running tasks; Workbench: the sessions of one run of the program."""

import asyncio
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from weakref import finalize

from machine.pipeline.embedded_profile import settings_inside
from machine.pipeline.given_plan import with_plan_settings
from machine.pipeline.project import Project, unpack
from machine.pipeline.requests import PLACING, Given, ModelRequest
from machine.workbench.bench.bench import (
    Bench,
    History,
    Step,
    check_first_plate,
    emptied,
    with_beside,
    with_model,
    with_model_turned_as_read,
    with_other_in_work,
    with_plan,
    with_prices,
    with_profile,
    with_rotation,
    with_scaled_model,
)
from machine.workbench.bench.model import Model
from machine.workbench.bench.settings import check_block, key_of, profile_as_given, with_allowed, with_given, with_typed
from machine.workbench.bench.values import with_value
from machine.workbench.session.base import Derived, SessionBase, Value, asking
from machine.workbench.session.keeping import Keeping
from machine.workbench.session.long_work import Comparing, Finding, Slicing, price_by_hand, prices_of
from machine.workbench.session.planes import PlaneTrials, Readiness, invalid_in_words, plated_of, resting_of, standing_of
from machine.workbench.work.cutting import draw_pieces, measure_plan
from machine.workbench.work.folders import files_in, new_folder
from machine.workbench.work.models import Unscaled, read_model
from machine.workbench.work.slices import Sliced, open_gcode
from machine.workbench.work.worker_pool import WorkerPools
from mdp.decomposition import FrontRow
from mdp.model_file import locate, plan_beside
from mdp.pose import turned_by
from mdp.read import MANY_FACES
from mdp.search.plan_file import PlanFile, planned_parts
from mdp.search.plan_reading import read_plan
from mdp.zone import NO_ZONES
from profiles.effect import effect_of_change
from profiles.errors import CutError, MeshError, PlanError
from profiles.frozen import Effect
from profiles.process import Process
from profiles.profile import Profile

MOST_SESSIONS = 20


@dataclass(frozen=True)
class OfUnknownUnit:
    """A model whose unit is unknown: the page that opened it, its file and name, and the possible units with their scales."""

    page: str
    path: Path
    name: str
    units: dict[str, float]


class Session(SessionBase):
    """A bench with its tasks. benches: number, model's name, number of parts (0: not cut) and current work of all open benches,
    for the pages; unscaled: the model whose unit is unknown; settings_note: key of a model, and the note on settings taken from
    its file."""

    def __init__(self, profile: Profile, given: Given, pools: WorkerPools) -> None:
        super().__init__(Bench(profile, given=given), pools)
        self.slicing, self.readiness = Slicing(self), Readiness(self)
        self.standing, self.resting = standing_of(self), resting_of(self, self.readiness)
        self.plated = plated_of(self)
        self.trials = PlaneTrials(self, self.readiness)
        self.finding, self._prices, self.by_hand = Finding(self), prices_of(self), price_by_hand(self)
        self.comparing = Comparing(self, self.slicing)
        self.pieces = Derived(self, lambda bench: bench.shaped, self._draw_pieces, by_itself=False)
        self.keeping = Keeping(self)
        self.benches: list[dict[str, Any]] = []
        self.unscaled: OfUnknownUnit | None = None
        self._opened: tuple[Bench, Bench] | None = None  # before and after a model was opened over another one
        self.followers.append(self._forget_opened)
        self.gcode: Sliced | None = None  # a file that a page has sent
        self.settings_note = ("", "")
        self._to_begin: dict[object, str] = {}  # names of queued commands that begin long work

    def described(self) -> dict[str, Any]:
        """The bench's entry in the list of benches."""
        model = self.bench.model
        work = self.busy or ("finding parts" if self.finding.progress else "slicing" if self.slicing.progress else "")
        return {"name": "" if model is None else model.name, "parts": self.bench.parts, "work": work}

    async def close(self) -> str:
        """End all work, notify the pages, and save the last change, then delete the files of its pages. If saving fails they
        stay, and the returned sentence says why and where; else ""."""
        self.closed = True
        for task in self._tasks:
            task.cancel()
        for tasks in (self.quick, self.long, self.hand, self.aside):
            tasks.close()
        self.notify()
        trouble = await self.keeping.finish()
        if not trouble or not files_in(self.received.path):
            self.received.remove()
            return f"the work on a bench could not be kept: {trouble}" if trouble else ""
        self.received.leave()
        return f"the work on a bench could not be kept: {trouble}; the files of its pages stay in {self.received.path} for a day"

    def unsliceable(self) -> str:
        """Why what is on the bench cannot be sliced, as far as it is known; "" if it can."""
        bench, standing, plated = self.bench, self.standing.result, self.plated.result
        known = self.trials.unsliceable() or ("" if plated is None else plated.problem)
        return known or ("" if bench.cuts or standing is None else standing.problem)

    def warm(self) -> None:
        """Load heavy modules in the worker processes ahead of use."""
        for tasks in (self.quick, self.hand, self.long):
            self.start(tasks.warm())

    async def open_model(self, path: Path, name: str, anew: bool = True, plate: int | None = None) -> None:
        """Put the model of a file on the bench. `anew`: drop the scale, rotation and place set for a previous model; plate: of a
        slicer file. Raises UserError with the command line's message; if the size suggests a wrong unit, it requests the unit.
        """
        self.readiness.load()
        if self.bench.model is not None and self.bench.model.faces > MANY_FACES:
            self.resting.stop()  # the new model would wait for it
        before = self.bench
        self.close_gcode()
        with self.waiting(f"reading {name}"):
            bench = for_another_model(before) if anew else before
            model = await self._read(path, name, bench.profile, plate, asks=True)
        await self._replace(f"open {name}", with_model(bench, model))
        self._opened = (before, self.bench) if before.model is not None else None

    def _forget_opened(self) -> None:
        """Forget which model was opened over another one as soon as the bench is changed."""
        if self._opened is not None and self._opened[1] is not self.bench:
            self._opened = None

    @property
    def addable(self) -> str:
        """Name of the model that has just been opened over another one, beside which it can be put; "" if there is none."""
        model = None if self._opened is None else self.bench.model
        return "" if model is None or model.plate is not None else model.name

    async def add_opened(self) -> None:
        """Put the model that has just been opened beside the previous one, and that on the bench again. Raises UserError."""
        model = self.bench.model
        if self._opened is None or model is None:
            raise PlanError("no model has just been opened over another one, so none can be put beside that")
        check_first_plate(model)
        await self.add_model(model.path, model.name, self._opened[0])

    async def add_model(self, path: Path, name: str, bench: Bench | None = None) -> None:
        """Put the model of a file on the plate, beside that on the bench, None: the present one. Raises UserError."""
        bench = bench or self.bench
        with self.waiting(f"reading {name}"):
            model = await self._read(path, name, bench.profile)
        self.do(f"add {name} to the plate", with_beside(bench, (*bench.beside, with_model(bench, model))))

    async def _replace(self, word: str, bench: Bench, note: str = "") -> None:
        """Take other work onto the bench, after what lies there is kept. note: a sentence about that work."""
        self.do(word, bench, "; ".join(filter(None, (await self.keeping.put_away(), note))))

    async def open_gcode(self, path: Path, name: str) -> None:
        """Dry-run a G-code file for display and printing, independent of the bench. Raises UserError."""
        request = ModelRequest(str(path), self.bench.profile.of_all_parts)
        with self.waiting(f"reading {name}"):
            opened = await self.quick.run(open_gcode, request, self.new_file(), self.new_file())
        self.close_gcode()
        self.gcode = opened

    def close_gcode(self) -> None:
        """Forget the G-code file that is open, if one is."""
        if self.gcode is not None:
            _remove_files(self.gcode.page, self.gcode.gcode)
        self.gcode = None
        self.notify()

    async def open_in_unit(self, *, unit: str) -> None:
        """Open the model whose unit was unknown, scaled by the chosen unit. Raises UserError."""
        waits = self.unscaled
        if waits is None or unit not in waits.units:
            expected = f"one of {', '.join(waits.units)} is expected" if waits else "no model waits for its unit"
            raise PlanError(f"unit is {unit!r}: {expected}")
        unscaled = for_another_model(self.bench)
        given = with_typed(unscaled.given, "process.scale", f"{waits.units[unit]:g}", unscaled.profile)
        scaled = with_profile(unscaled, given, profile_as_given(given, unscaled.profile))
        with self.waiting(f"reading {waits.name}"):
            model = await self._read(waits.path, waits.name, scaled.profile)
        self.unscaled = None
        await self._replace(f"open {waits.name} in {unit}", with_model(scaled, model))

    async def open_plate(self, *, plate: int) -> None:
        """Open another plate of the slicer file. Raises UserError."""
        model = self.bench.model
        if model is None or plate not in model.plates:
            numbers = [] if model is None else [*map(str, model.plates)]
            allowed = f"one of {', '.join(numbers)} is expected" if numbers else "the model has no plates"
            raise PlanError(f"plate is {plate}: {allowed}")
        opened = self._opened
        first = next(iter(model.plates))
        await self.open_model(model.path, model.name, anew=False, plate=None if plate == first else plate)
        self._opened = None if opened is None else (opened[0], self.bench)

    async def take_settings_inside(self) -> None:
        """Use the settings inside the slicer file on the bench; earlier changes stay where it has no value.

        Raises UserError.
        """
        model = self.bench.model
        assert model is not None
        inside, note = await asyncio.to_thread(settings_inside, model.path, model.name)
        await self.take_given(f"take the settings of {model.name}", lambda given: with_given(given, inside))
        self.settings_note = model.key, note

    async def open_demo(self, *, name: str, add: bool = False) -> None:
        """Open a model that ships with the program; add: put it beside that on the bench. Raises UserError for an unknown one."""
        if not name.startswith("demo:"):
            raise PlanError(f"{name}: only the models that ship with the program are opened by name; choose or drop a file")
        before, file = self.bench, await self._copy_of(name, None)
        if add and before.model is not None:
            await self.add_model(file, name)
            return
        await self.open_model(file, name)
        if (plan := plan_beside(name)) is not None:
            opened = self.note
            await self.open_plan(plan)
            self.add_note(opened)
        self._opened = (before, self.bench) if before.model is not None else None

    async def open_project(
        self, path: Path, name: str, taken_over: Callable[[Project], Project] = lambda project: project
    ) -> None:
        """Open a project file. taken_over: adapts the project to the bench. Raises UserError."""
        folder = new_folder()
        try:
            project = await asyncio.to_thread(unpack, path, folder)
            await self.open_folder(folder, taken_over(project), f"open {name}")
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise

    async def open_folder(self, folder: Path, project: Project, word: str) -> None:
        """Open the project in a folder, and continue saving it there.

        Raises UserError; the folder is then unchanged.
        """
        async with self.keeping.opening(folder):
            await self._replace(word, await self._bench_of(project))

    async def _bench_of(self, project: Project) -> Bench:
        """A bench for a project. Raises UserError."""
        self.readiness.load()
        profile = profile_as_given(project.given, self.bench.profile.of_all_parts)
        check_block(profile, "")
        with self.waiting(f"reading {project.name}"):
            first, *others = [await self._bench_of_model(each, profile) for each in (project, *project.beside)]
        bench = with_beside(replace(first, stops=project.stops), tuple(others))
        return with_other_in_work(bench, project.worked_on - 1) if project.worked_on else bench

    async def _bench_of_model(self, project: Project, profile: Profile) -> Bench:
        """A bench for one of the models of a project. Raises UserError."""
        plan = None if project.plan is None else replace(_read_plan(project.plan), name="")
        model = await self._read(await self._copy_of(project.name, project.model), project.name, profile, project.plate)
        uncut = with_model(Bench(profile, given=project.given), model)
        bench = with_rotation(uncut, project.rotation)
        if plan is not None:
            marks = NO_ZONES if project.marks_in_plan else bench.zones
            rows, _ = await self._measured(uncut, plan, profile, project.recommended)
            bench = with_rotation(with_plan(uncut, plan, rows, with_plan_settings(profile, plan)), project.rotation)
            bench = replace(bench, zones=marks.beside(bench.zones)) if marks != NO_ZONES else bench
        bench = bench if project.parts else replace(bench, cuts=None)
        locked = frozenset(part for k, part in enumerate(bench.cuts or ()) if k in project.locked)
        bench = replace(bench, locked=locked, copies=project.copies)
        return with_prices(replace(bench, recommended=project.recommended), {}) if bench.rows else bench

    async def _copy_of(self, name: str, model: Path | None) -> Path:
        """A copy of a project's model file, or that of a demo, for this opening alone: work is saved by its model's file."""
        source = locate(name) if model is None else model
        path = self.received.new_file(name if model is not None else source.name)
        await asyncio.to_thread(shutil.copyfile, source, path)
        return path

    async def open_plan(self, path: Path) -> None:
        """Cut the model on the bench by a plan file. Raises UserError if it cannot be read, or is for another model."""
        await self.take_plan(_read_plan(path))

    async def take_plan(self, plan: PlanFile) -> None:
        """Cut the model on the bench by a plan. Raises UserError."""
        bench = self.bench
        if bench.model is None:
            wanted = plan.model or "its model"
            raise PlanError(f"plan {plan.name}: there is no model on the workbench to cut by it: open {wanted} first")
        with self.waiting(f"cutting by {plan.name}"):
            profile = with_plan_settings(bench.profile.of_all_parts, plan)
            rows, invalid = await self._measured(bench, plan, profile)
        await self._replace(f"open {plan.name}", with_plan(bench, plan, rows, profile), invalid)

    async def _measured(
        self, bench: Bench, plan: PlanFile, profile: Profile, recommended: int = 0
    ) -> tuple[tuple[FrontRow, ...], str]:
        """The front of a plan, and a sentence about planes that cannot be cut, which may have been invalid when it was saved;
        there is then no front. recommended: see `measure_plan`. Raises UserError."""
        try:
            return await self.quick.run(measure_plan, bench, plan, recommended), ""
        except CutError:
            cut = with_plan(bench, plan, (), profile)
            if not (invalid := await self.trials.find_invalid(cut)):
                raise
            return (), invalid_in_words(cut, invalid)

    async def make(self, word: str, task: Callable[..., Value], *given: Any) -> Value:
        """Run a task on the parts of the bench. Raises UserError if they cannot be cut."""
        with self.waiting(word):
            return await self.quick.run(task, self.bench, *given)

    async def _draw_pieces(self, bench: Bench) -> Path:
        """The parts as separate bodies, packed by `work.pieces`; an empty file if they cannot be cut, as the trials report."""
        out, before = self.new_file(), self.pieces.done
        out.touch()
        with suppress(CutError):
            await self.quick.run(draw_pieces, bench, out)
        if before is not None and not self.pieces.stale:
            before.unlink(missing_ok=True)
        return out

    async def take_given(self, word: str, change: Callable[[Given], Given], key: str = "", lost: str = "") -> None:
        """Change profile names and settings. key: the one that is set; lost: see `do`. Raises UserError."""
        before = self.bench
        given = change(before.given)
        check_block(profile_as_given(given, before.profile), key)
        bench, invalid = await self._with_profile(before, given)
        if given != before.given:
            self.do(word, bench, "; ".join(filter(None, (invalid, lost))))

    async def take_profile(self, word: str, kind: str, name: str) -> None:
        """Choose another machine, material or process with the settings that it allows. Raises UserError."""
        given, lost = with_allowed(with_value(self.bench.given, kind, name), self.bench.profile)
        await self.take_given(word, lambda _: given, lost=lost)

    def unless_stopped(self, name: str, begin: Callable[[], object]) -> Callable[[], None]:
        """Wrap a command that begins long work; the result does nothing if work is stopped while it waits for its turn."""
        ticket = object()
        self._to_begin[ticket] = name

        def act() -> None:
            if self._to_begin.pop(ticket, None) is not None:
                begin()

        return act

    def stop(self) -> Callable[[], None]:
        """End all work at once, including queued commands. Returns a function, to be called in a turn, that applies the best
        result of the search and reports what happened."""
        waiting, search, bench = {*self._to_begin.values()}, self.finding.progress, self.finding.bench
        self._to_begin.clear()
        words = []
        if self.slicing.progress is not None or "slice" in waiting:
            left = "the slices from before stay" if self.slicing.latest() else "there are no slices"
            words.append(f"Slicing was stopped: {left}.")
        if self.comparing.progress is not None or "compare" in waiting:
            words.append("The comparison was stopped: nothing of it is kept.")
        for work in (self.finding, self.slicing, self.comparing):
            work.stop()
        if search is not None:
            self.start(self.long.warm())

        def tell() -> None:
            found = [self.finding.take_best(bench, search)] if search is not None or "search" in waiting else []
            self.add_note(" ".join([*found, *words]))

        return tell

    async def _with_profile(self, before: Bench, given: Given) -> tuple[Bench, str]:
        """A bench with another profile, and a sentence about planes that cannot be cut with it. Rows of the front go that cannot
        be cut at another place on the plate, and a model that it scales or turns otherwise is read again."""
        bench, model = with_profile(before, given, profile_as_given(given, before.profile)), before.model
        new, old = bench.profile.process, before.profile.process
        if model is not None and (new.scale, new.rotate_deg) != (old.scale, old.rotate_deg):
            with self.waiting(f"reading {model.name}"):
                others = [await self._read_again(other, old) for other in bench.beside]
                bench = replace(await self._read_again(bench, old), beside=tuple(others))
            if new.rotate_deg != old.rotate_deg:
                return bench, ""
        effect = effect_of_change(before.profile, bench.profile)
        if effect == Effect.REACH and bench.rows:
            rows = [row for row in bench.rows if not (await self.trials.attempt(bench, planned_parts(row))).rejected]
            bench = replace(bench, rows=tuple(rows), recommended=bench.recommended if rows else 0)
        if bench.cuts is None or effect < Effect.REACH:
            return bench, ""
        return bench, await self.trials.recheck(bench)

    async def _read_again(self, bench: Bench, before: Process) -> Bench:
        """The bench with its model scaled and turned as its profile says. before: how it was read. Raises UserError."""
        assert bench.model is not None
        process = bench.profile.process
        model = await self._read(bench.model.path, bench.model.name, bench.profile, bench.model.plate)
        if process.rotate_deg == before.rotate_deg:
            return with_scaled_model(bench, model, process.scale / before.scale)
        turn = turned_by(process.rotate_deg) @ turned_by(before.rotate_deg).T
        return with_model_turned_as_read(bench, model, turn, process.scale / before.scale)

    async def _read(self, path: Path, name: str, profile: Profile, plate: int | None = None, asks: bool = False) -> Model:
        """The model of a file, whose mesh file exists as long as the model. asks: ask the page for the unit if the size suggests
        a wrong one."""
        model = await self.quick.run(read_model, path, name, profile.of_all_parts, self.new_file(), plate)
        if isinstance(model, Unscaled):
            if asks:
                self.unscaled = OfUnknownUnit(asking.get(), path, name, model.units)
            raise MeshError(model.question if asks and asking.get() else model.sentence)
        finalize(model, _remove_files, model.mesh_file, model.shapes_file)
        return model


def for_another_model(bench: Bench) -> Bench:
    """The bench without what was set for the model that lies on it alone."""
    settings = tuple(setting for setting in bench.given.settings if key_of(setting) not in PLACING)
    if bench.model is None or settings == bench.given.settings:
        return bench
    given = replace(bench.given, settings=settings)
    return with_profile(bench, given, profile_as_given(given, bench.profile))


def _remove_files(*files: Path | None) -> None:
    """Delete the files of an unused model."""
    for file in filter(None, files):
        file.unlink(missing_ok=True)


def _read_plan(path: Path) -> PlanFile:
    """The plan in a file. Raises PlanError, which contains the file's name without folders."""
    try:
        return read_plan(path)
    except PlanError as error:
        raise PlanError(f"{error}".replace(str(path), path.name)) from None


class Workbench:
    """sessions: by number, from 1, never reused; each has the list of all. pools: the processes that they share."""

    def __init__(self, make: Callable[[WorkerPools], Session]) -> None:
        self.sessions: dict[int, Session] = {}
        self.pools = WorkerPools()
        self._make = make
        self._benches: list[dict[str, Any]] = []
        self._closing: dict[int, asyncio.Task[str]] = {}
        self._last = 0

    def open(self, like: Session | None = None) -> int:
        """Open a session with an empty bench and the machine and settings of another, and return its number. Raises PlanError if
        there are too many."""
        if len(self.sessions) >= MOST_SESSIONS:
            raise PlanError(f"{MOST_SESSIONS} benches are open, which is the most: close one first")
        self._last += 1
        self.sessions[self._last] = session = self._make(self.pools)
        session.benches = self._benches
        if like is not None:
            session.history = History(Step("", emptied(for_another_model(like.bench))))
        session.listeners.append(self._list_again)
        session.warm()
        self._list_again()
        return self._last

    async def close(self, number: int) -> str:
        """End a session and its work; returns a sentence if its last change could not be saved, else "". Cancelling the wait does
        not cancel the save."""
        self._begin_to_close(number)
        return await asyncio.shield(self._closing[number]) if number in self._closing else ""

    async def close_all(self) -> list[str]:
        """End all sessions and processes; returns a sentence for each whose last change could not be saved."""
        for number in list(self.sessions):
            self._begin_to_close(number)
        await asyncio.sleep(0)  # let all of them end their work
        self.pools.end()
        return [trouble for trouble in await asyncio.gather(*self._closing.values()) if trouble]

    def _begin_to_close(self, number: int) -> None:
        session = self.sessions.pop(number, None)
        if session is not None:
            self._closing[number] = closing = asyncio.create_task(session.close())
            closing.add_done_callback(lambda _: self._closing.pop(number))
            self._list_again()

    def _list_again(self) -> None:
        benches = [{"number": number, **session.described()} for number, session in self.sessions.items()]
        if benches != self._benches:
            self._benches[:] = benches
            for session in self.sessions.values():
                session.notify()
