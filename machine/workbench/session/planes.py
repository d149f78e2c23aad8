"""Planes: how the model on a bench stands and rests, and planes on it: prepared as soon as a model lies there, tried while they
are in a person's hand, taken when they can be cut."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from itertools import count
from math import hypot, inf
from typing import Any

from machine.workbench.bench.bench import Bench, with_cuts, with_zones
from machine.workbench.bench.changes import Cuts, Edit, check_unlocked, snap
from machine.workbench.bench.values import Asked, vector_of
from machine.workbench.session.base import Derived, SessionBase, Value, asking
from machine.workbench.work.cutting import load_kernels, make_ready, near_neck, nearest, try_cuts
from machine.workbench.work.models import Resting, Standing, mark, rank_resting, stand
from mdp.read import MANY_FACES
from mdp.search.neck import REACH_DEG, REACH_SHARE
from mdp.search.plan_file import PlannedPart
from mdp.search.trial import Obstacle, Trial
from mdp.zone import Zones
from profiles.effect import effect_of_change
from profiles.errors import MeshError, PlanError
from profiles.frozen import Effect

REST_S = 0.1  # how long a hand must rest before what it holds is tried more closely
CHANGING_S = 0.2  # of a bench, until it is made ready as it is
_numbers = count(1)  # of the benches of all sessions, whose processes may be the same


class Readiness(Derived[None]):
    """What planes on the bench need, prepared in a process of its own, which knows by the bench's number what it has worked out
    already; very large models wait for the first plane."""

    def __init__(self, session: SessionBase) -> None:
        self._number = 0
        self._solid: tuple[object, ...] = (None, None, None)  # what is cut on the bench of that number
        self._profile = session.bench.profile
        self._model = ""  # key of that of the bench that was made ready last
        super().__init__(
            session,
            lambda bench: None if bench.model is None or bench.model.faces > MANY_FACES else self._number_of(bench),
            self._prepare,
        )

    def load(self) -> None:
        """Load what all planes need, while the first model is read."""
        if not self._number:
            self._session.start(self._session.hand.run(load_kernels))

    async def ask(self, task: Callable[..., Value], bench: Bench, *given: Any) -> Value:
        """What a task says of a bench by its number."""
        return await self._session.hand.run(task, self._number_of(bench), bench, *given)

    def _number_of(self, bench: Bench) -> int:
        """The number of a bench, that of the last one where what was made ready for that serves this one, too: planes read of a
        profile what a search does."""
        solid, profile = (bench.model and bench.model.key, bench.rotation, bench.zones), bench.profile
        is_another = any(new is not old for new, old in zip(solid, self._solid, strict=True))
        if is_another or effect_of_change(self._profile, profile) >= Effect.REACH:
            self._number = next(_numbers)
        self._solid, self._profile = solid, profile
        return self._number

    async def _prepare(self, bench: Bench) -> None:
        """Make a bench ready, unless it changes at once again."""
        assert bench.model is not None
        if bench.model.key == self._model and not await self.rests(CHANGING_S):
            return
        self._model = bench.model.key
        self.tell(True)
        await self._session.hand.run(make_ready, self._number_of(bench), bench)


def standing_of(session: SessionBase) -> Derived[Standing]:
    """How the model on the bench stands."""

    async def find(bench: Bench) -> Standing:
        standing = await session.hand.run(stand, bench)
        if standing.refusal:
            session.refuse(MeshError(standing.refusal))
        return standing

    return Derived(session, _stands_by, find)


def _stands_by(bench: Bench) -> tuple[object, ...] | None:
    """What decides how it stands and what is told of that; None: there is no model."""
    if bench.model is None:
        return None
    process = bench.profile.of_part(1).process
    decides = process.self_supporting_angle_deg, process.line_width_mm, process.place_mm, bench.profile.machine
    copies = (bench.copies, bench.cuts, bench.zones, bench.profile) if bench.copies > 1 else ()
    return bench.model, bench.rotation, bench.profile.search.pedestal_mm, *decides, copies


def pedestal_key(bench: Bench, standing: Standing | None) -> str:
    """What tells the pedestal from others: the page asks for its triangles by it; "": there is none."""
    if standing is None or not standing.pedestal or bench.model is None:
        return ""
    return sha256(repr((bench.model.key, bench.rotation, bench.profile.search.pedestal_mm)).encode()).hexdigest()[:16]


def resting_of(session: SessionBase, readiness: Readiness) -> Derived[tuple[Resting, ...]]:
    """The ways in which the model on the bench rests, ranked when its planes are made ready: a person waits for those more."""

    async def rank(bench: Bench) -> tuple[Resting, ...]:
        await readiness.wait()
        return await session.quick.run(rank_resting, bench.model, session.bench.profile.of_all_parts)

    return Derived(session, lambda bench: bench.model, rank)


@dataclass(frozen=True)
class Refused:
    """Planes that could not be cut: the page that wanted them, what is in the way where, and the command that puts the one that
    was moved at the nearest place; None: it was none that is put somewhere, or there is none."""

    page: str
    obstacle: Obstacle | None
    near: Asked | None = None


class PlaneTrials:
    """trial: of the planes that were tried last, and the bench that they were tried on. refused: those that were refused last."""

    def __init__(self, session: SessionBase, readiness: Readiness) -> None:
        self.trial: tuple[Bench, Cuts, Trial] | None = None
        self.refused: Refused | None = None
        self._session, self._readiness = session, readiness
        self._held: Cuts | None = None  # by a person's hand
        self._figures = Derived(session, self._to_try, self._try)
        session.followers.append(self.settle)

    def hold(self, cuts: Cuts) -> None:
        """Have planes tried, the newest ones as soon as the ones before are done."""
        self._held = cuts
        self._figures.follow()

    def settle(self) -> None:
        """Have the planes on the bench tried anew where others were tried last: no hand holds those any more."""
        self._held = None
        self._figures.follow()

    async def take(self, edit: Edit, nearer: Asked | None = None) -> None:
        """Take planes that can be cut. nearer: the command that puts the plane at the nearest place. Raises PlanError for those
        that cannot be cut."""
        bench, cuts, self.refused = self._session.bench, edit.cuts, None
        trial = await self.attempt(bench, cuts)
        if trial.rejected and edit.near:
            with self._session.waiting("looking for the nearest place that can be cut"):
                nearby = await self._readiness.ask(nearest, bench, edit.orders)
            if nearby is not None:
                cuts, trial = nearby, await self.attempt(bench, nearby)
        if trial.rejected:
            self.settle()
            self.refused = Refused(asking.get(), trial.obstacle, None if edit.near else nearer)
            nowhere = "; shifted along its normal it cannot be cut either" if edit.near else ""
            raise PlanError(f"{edit.reason}part {trial.rejected_part} cannot be cut off: {trial.rejected}{nowhere}")
        self.trial = bench, cuts, trial
        self._session.do(edit.word, with_cuts(bench, cuts))

    async def take_neck(self, part: int) -> None:
        """Take the neck near the plane of a part. Raises PlanError where there is none, or it cannot be cut."""
        bench = self._session.bench
        check_unlocked(bench, part)
        assert bench.model is not None
        reach_mm = REACH_SHARE * hypot(*bench.model.size_mm)
        with self._session.waiting(f"looking for a neck near the plane of part {part}"):
            neck = await self._readiness.ask(near_neck, bench, bench.cuts, part, reach_mm)
        if neck is None:
            where = f"within {reach_mm:.0f} mm and {REACH_DEG:g} degrees no section is narrower than its surroundings"
            raise PlanError(f"there is no neck near the plane of part {part}: {where}")
        normal, offset_mm = vector_of(neck.normal), float(neck.offset_mm)
        nearer = {"do": "move", "part": part, "normal": list(normal), "offset_mm": offset_mm, "near": True}
        await self.take(snap(bench, part, PlannedPart(normal, offset_mm)), nearer)

    async def attempt(self, bench: Bench, cuts: Cuts, most_cuts: float = inf) -> Trial:
        """The figures of planes, every one of them looked at; most_cuts: see mdp.search.trial."""
        trial: Trial = await self._readiness.ask(try_cuts, bench, cuts, most_cuts)
        return trial

    def _wanted(self, bench: Bench) -> Cuts | None:
        return bench.cuts if self._held is None else self._held

    def _to_try(self, bench: Bench) -> tuple[object, ...] | None:
        """The planes and what decides their figures; None where these are known."""
        cuts, tried = self._wanted(bench), self.trial
        if cuts is None or bench.model is None:
            return None
        known = tried is not None and tried[1] == cuts and tried[0].sought == bench.sought and not tried[2].unchecked
        return None if known else (cuts, bench.sought)

    async def _try(self, bench: Bench) -> None:
        """Figures at once; where parts are not looked at yet, one after the other as soon as the hand rests."""
        cuts = self._wanted(bench)
        if cuts is None:
            return
        self.trial = tried = bench, cuts, await self.attempt(bench, cuts, 0)
        while tried[2].unchecked:
            self._session.notify()
            if not await self._figures.rests(REST_S):
                return
            trial = await self.attempt(bench, cuts, 1)
            if self.trial is not tried:
                return
            self.trial = tried = bench, cuts, trial

    async def mark(self, word: str, marking: Callable[[Bench], Zones]) -> None:
        """Take other zones; planes that they forbid go, and the reason is told. word: for the step in the history. Raises
        PlanError for what makes no sense, and where a plane that would go is locked."""
        before, removed = self._session.bench, list[str]()
        bench = with_zones(before, await self._session.quick.run(mark, before, marking))
        while bench.cuts:
            trial = await self.attempt(bench, bench.cuts)
            if not trial.rejected:
                break
            part = bench.cuts[trial.rejected_part - 2]
            if part in bench.locked:
                raise PlanError(f"the plane of part {trial.rejected_part} is locked and would be in the way: {trial.rejected}")
            removed.append(trial.rejected)
            bench = with_cuts(bench, tuple(cut for cut in bench.cuts if cut is not part))
        self._session.do(word, bench, _removed_in_words(word, removed))


def _removed_in_words(word: str, reasons: Sequence[str]) -> str:
    if not reasons:
        return ""
    planes = "a plane was" if len(reasons) == 1 else f"{len(reasons)} planes were"
    return f"{word}: {planes} removed: {'; '.join(dict.fromkeys(reasons))}"
