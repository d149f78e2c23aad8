"""Session: the bench of one run of the workbench, the work under way for it, and the pages that look at it."""

import asyncio
import itertools
import re
import sys
import tempfile
from collections.abc import Coroutine, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from machine.app.crash import log_bug
from machine.app.pipeline.given_plan import with_plan_settings
from machine.app.requests import Given
from machine.app.workbench.bench import (
    Bench,
    History,
    Model,
    Step,
    parts_of,
    with_cuts,
    with_front,
    with_model,
    with_plan,
    with_profile,
)
from machine.app.workbench.commands import obey
from machine.app.workbench.lane import Lane
from machine.app.workbench.planes import EDITS, Cuts, edited
from machine.app.workbench.settings import profile_as_given, with_name, with_setting
from machine.app.workbench.tasks import Files, Resting, Searched, Sliced
from mdp.decomposition import FrontRow
from mdp.plans.plan_file import PlanFile
from mdp.plans.reading import read_plan
from mdp.read import locate
from mdp.search.trial import Trial
from profiles.errors import PlanError, UserError
from profiles.profile import Profile

UNSAFE = re.compile(r"[^\w .()+-]")
LONGEST_NAME = 100


@dataclass(frozen=True, eq=False)
class Search:
    """A search under way: the bench that it began with, and how far it is."""

    bench: Bench
    searched: Searched


class Session:
    """All from the event loop; the pages wait for `changed`. A context: leaving it ends the work and the temporary files."""

    def __init__(self, profile: Profile, given: Given) -> None:
        self.history = History(Step("", Bench(profile, given=given)))
        self.problem = ""  # what could not be done last
        self.notes: tuple[str, ...] = ()  # of the last search
        self.busy = ""  # what the page waits for
        self.search: Search | None = None
        self.slicing: Search | None = None
        self.sliced: tuple[Bench, Sliced] | None = None
        self.resting: tuple[Model, tuple[Resting, ...]] | None = None
        self.trial: tuple[Bench, Cuts, Trial] | None = None  # of planes on this bench
        self.version = 0
        self._changed = asyncio.Event()
        self._quick, self._long, self._hand = Lane(), Lane(), Lane()
        self._hands = asyncio.Lock()
        self._wanted: Cuts | None = None  # tried next, whatever else was wanted meanwhile
        self._known: tuple[object, ...] = ()  # what the numbered bench of the trials is made of
        self._known_number = 0
        self._folder = tempfile.TemporaryDirectory(prefix="tiltprint-")
        self._numbers = itertools.count(1)
        self._tasks: set[asyncio.Task[None]] = set()
        self._searching: asyncio.Task[None] | None = None
        self._slicing: asyncio.Task[None] | None = None

    @property
    def bench(self) -> Bench:
        """What lies on the workbench now."""
        return self.history.now.bench

    def close(self) -> None:
        """End all work; its files go."""
        for task in self._tasks:
            task.cancel()
        for lane in (self._quick, self._long, self._hand):
            lane.stop()
        self._folder.cleanup()

    def tell(self) -> None:
        """Let the pages know that something has changed."""
        self.version += 1
        self._changed.set()
        self._changed = asyncio.Event()

    async def changed(self, seen: int) -> None:
        """Return when there is something newer than the version that was seen."""
        while self.version == seen:
            await self._changed.wait()

    def start(self, work: Coroutine[Any, Any, None]) -> "asyncio.Task[None]":
        """Have work done beside the pages; what it is refused becomes the sentence that they show."""

        async def attempt() -> None:
            try:
                await work
            except Exception as error:  # noqa: BLE001 - a bug becomes a sentence too, and the workbench goes on
                self.refuse(error)
            finally:
                self.tell()

        task = asyncio.create_task(attempt())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    def new_file(self, name: str) -> Path:
        """A place in the session's own folder for a file that a page sends."""
        folder = Path(self._folder.name) / str(next(self._numbers))
        folder.mkdir()
        return folder / (UNSAFE.sub("_", name)[-LONGEST_NAME:].strip(". ") or "model")

    def warm(self) -> None:
        """Load the program's heavy parts while nobody waits."""
        self.start(self._quick.warm())
        self.start(self._long.warm())

    async def open_model(self, path: Path, name: str) -> None:
        """Put the model of a file on the bench. Raises UserError as the command line tells it."""
        with self._waiting(f"reading {name}"):
            model = await self._quick.run("read_model", path, name, self.bench.profile.of_all_parts)
            self._do(f"open {name}", with_model(self.bench, model))
        self.start(self._rank(model))

    async def open_demo(self, name: str) -> None:
        """Put a model that ships with the program on the bench. Raises UserError for an unknown one."""
        if not name.startswith("demo:"):
            raise PlanError(f"{name}: only the models that ship with the program are opened by name; choose or drop a file")
        await self.open_model(locate(name), name)

    async def open_plan(self, path: Path) -> None:
        """Cut the model on the bench by a plan. Raises UserError for one that cannot be read, or of another model."""
        try:
            plan = read_plan(path)
        except PlanError as error:
            raise PlanError(str(error).replace(str(path), path.name)) from None
        await self.take_plan(plan)

    async def take_plan(self, plan: PlanFile) -> None:
        """The same for a plan that is read already."""
        if self.bench.model is None:
            raise PlanError(
                f"plan {plan.name}: there is no model on the workbench to cut by it: open {plan.model or 'its model'} first"
            )
        with self._waiting(f"cutting by {plan.name}"):
            bench = self.bench
            profile = with_plan_settings(bench.profile.of_all_parts, plan)
            rows = await self._quick.run("measure_plan", bench, plan)
            self._do(f"open {plan.name}", with_plan(bench, plan, rows, profile))

    def command(self, asked: dict[str, Any]) -> None:
        """Do what a page asks for. Raises UserError for what cannot be done."""
        self.problem = ""
        match asked.get("do"):
            case "search":
                self._search()
            case "stop":
                self._stop()
                self._stop_slicing()
            case "slice":
                self._slice()
            case "set":
                value = asked.get("value")
                key = str(asked.get("key"))
                self._take_given(f"set {key}", with_setting(self.bench.given, key, None if value is None else str(value)))
            case "profile":
                name = str(asked.get("name"))
                self._take_given(f"take {name}", with_name(self.bench.given, str(asked.get("kind")), name))
            case "try":
                self._try(edited(self.bench, {**asked, "do": "move"})[1])
            case name if name in EDITS:
                self.start(self._edit(*edited(self.bench, asked)))
            case "demo":
                self.start(self.open_demo(str(asked.get("name"))))
            case _:
                self._become(obey(self.history, asked))
        self.tell()

    async def files(self) -> Files:
        """What can be saved of the parts on the bench. Raises UserError where they cannot be cut."""
        if self.bench.model is None or self.bench.cuts is None:
            raise PlanError("there are no parts to save yet: find them first")
        with self._waiting("cutting the parts"):
            files: Files = await self._quick.run("make_files", self.bench)
        return files

    def refuse(self, error: Exception) -> str:
        """Tell the pages what could not be done, a bug with the log that it got; the sentence."""
        if isinstance(error, UserError):
            self.problem = str(error)
        else:
            self.problem = f"a bug in tiltprint: {type(error).__name__}: {error}; the details are in {log_bug(error, sys.argv)}"
        self.tell()
        return self.problem

    def _search(self) -> None:
        if self.bench.model is None:
            raise PlanError("there is no model on the workbench yet: choose a file first")
        if self.search is None:
            self.search = Search(self.bench, Searched("beginning"))
            self._searching = self.start(self._find(self.bench))

    async def _find(self, bench: Bench) -> None:
        def follow(searched: Searched) -> None:
            if self.search is not None and self.search.bench is bench:
                self.search = Search(bench, searched)
                self.tell()

        try:
            rows, self.notes = await self._long.run("find_parts", bench, tell=follow)
            self._do("find parts", with_front(bench, rows))
        finally:
            if self.search is not None and self.search.bench is bench:
                self.search = None

    def _stop(self) -> None:
        """End the search; the best that it has met so far is taken."""
        search, self.search = self.search, None
        if search is None or self._searching is None:
            return
        self._searching.cancel()
        self.start(self._long.warm())
        if search.searched.planes:
            self.start(self._take_best(search))

    async def _take_best(self, search: Search) -> None:
        planes = FrontRow(search.searched.planes, 0.0, 0.0, 0.0)
        orientation = None if search.bench.turned is None else search.bench.rotation
        plan = PlanFile("the search", "", "", orientation, parts_of(planes), search.bench.zones)
        with self._waiting("cutting the best so far"):
            rows = await self._quick.run("measure_plan", search.bench, plan)
            self._do("stop the search", with_front(search.bench, rows))

    def shown_slices(self) -> Sliced | None:
        """The slices of what lies on the bench now; None where they are of something else."""
        if self.sliced is None or _printed(self.sliced[0]) != _printed(self.bench):
            return None
        return self.sliced[1]

    def _slice(self) -> None:
        if self.bench.model is None:
            raise PlanError("there is no model on the workbench yet: choose a file first")
        if self.slicing is None:
            self.slicing = Search(self.bench, Searched("cutting the parts"))
            self._slicing = self.start(self._make_slices(self.bench))

    async def _make_slices(self, bench: Bench) -> None:
        def follow(searched: Searched) -> None:
            self.slicing = Search(bench, searched)
            self.tell()

        try:
            self.sliced = bench, await self._long.run("slice_bench", bench, tell=follow)
        finally:
            self.slicing = None

    def _stop_slicing(self) -> None:
        if self._slicing is not None:
            self._slicing.cancel()

    def _try(self, cuts: Cuts) -> None:
        """Have planes tried, the newest ones as soon as the ones before are done."""
        waiting, self._wanted = self._wanted is not None, cuts
        if not waiting:
            self.start(self._try_newest())

    async def _try_newest(self) -> None:
        async with self._hands:
            cuts, self._wanted = self._wanted, None
            if cuts is not None and self.bench.model is not None:
                bench = self.bench
                self.trial = bench, cuts, await self._attempt(bench, cuts)

    async def _attempt(self, bench: Bench, cuts: Cuts) -> Trial:
        """The figures of planes; the bench goes to the process once, not with every move of a hand."""
        made_of = (bench.model, bench.rotation, bench.profile, bench.zones)
        if any(one is not other for one, other in zip(made_of, self._known or (None,) * 4, strict=True)):
            self._known, self._known_number = made_of, self._known_number + 1
        trial: Trial | None = await self._hand.run("try_cuts", self._known_number, None, cuts)
        if trial is None:
            trial = await self._hand.run("try_cuts", self._known_number, bench, cuts)
        assert trial is not None
        return trial

    async def _edit(self, word: str, cuts: Cuts) -> None:
        """Take planes that can be cut. Raises PlanError with the reason for those that cannot be."""
        bench = self.bench
        async with self._hands:
            trial = await self._attempt(bench, cuts)
        if trial.refused:
            raise PlanError(f"part {trial.refused_part} cannot be cut off: {trial.refused}")
        if self.bench is bench:
            self.trial = bench, cuts, trial
            self._do(word, with_cuts(bench, cuts))

    def _take_given(self, word: str, given: Given) -> None:
        profile = profile_as_given(given, self.bench.profile)
        self.start(self._change_profile(word, with_profile(self.bench, given, profile)))

    async def _change_profile(self, word: str, bench: Bench) -> None:
        """Take another profile; planes that it forbids go, and a model that it scales or turns otherwise is read again."""
        refused, before, model = "", self.bench, self.bench.model
        new, old = bench.profile.process, before.profile.process
        if model is not None and (new.scale, new.rotate_deg) != (old.scale, old.rotate_deg):
            with self._waiting(f"reading {model.name}"):
                model = await self._quick.run("read_model", model.path, model.name, bench.profile.of_all_parts)
            bench = replace(with_model(bench, model), rotation=bench.rotation)
            self.start(self._rank(model))
        elif bench.cuts is not None:
            async with self._hands:
                trial = await self._attempt(bench, bench.cuts)
            if trial.refused:
                refused = f"{word}: the planes were taken away, for part {trial.refused_part} cannot be cut off: {trial.refused}"
                bench = replace(bench, cuts=None, locked=frozenset())
        self._do(word, bench)
        self.problem = refused

    async def _rank(self, model: Model) -> None:
        resting = await self._quick.run("rank_resting", model.mesh, self.bench.profile.of_all_parts)
        self.resting = model, resting

    def _do(self, word: str, bench: Bench) -> None:
        self.problem = ""
        self._become(self.history.do(word, bench))

    def _become(self, history: History) -> None:
        """Go on with another history; a search for a model that is not there any more, or lies otherwise, ends."""
        self.history = history
        if self.bench.cuts is not None and (self.trial is None or self.trial[1] != self.bench.cuts):
            self._try(self.bench.cuts)
        search = self.search
        if search is not None and (search.bench.model, search.bench.rotation) != (self.bench.model, self.bench.rotation):
            self.search = None
            if self._searching is not None:
                self._searching.cancel()
        if self.slicing is not None and _printed(self.slicing.bench) != _printed(self.bench):
            self._stop_slicing()
        self.tell()

    @contextmanager
    def _waiting(self, words: str) -> Iterator[None]:
        """While it is open, the pages show what they wait for."""
        self.busy = words
        self.tell()
        try:
            yield
        finally:
            self.busy = ""
            self.tell()


def _printed(bench: Bench) -> tuple[object, ...]:
    """What of a bench decides what is printed."""
    return bench.model, bench.rotation, bench.cuts, bench.profile
