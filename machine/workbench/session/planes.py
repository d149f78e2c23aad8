"""Planes on a bench: preparation as soon as there is a model, trials while the user drags them, and their application."""

import asyncio
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from hashlib import sha256
from itertools import count
from math import acos, degrees, hypot, inf
from typing import Any
from weakref import finalize

from machine.workbench.bench.bench import Bench, with_cuts, with_zones
from machine.workbench.bench.changes import Cuts, Edit, check_unlocked, snap
from machine.workbench.bench.values import Asked, vector_of
from machine.workbench.session.base import Derived, SessionBase, Value, asking
from machine.workbench.work.cutting import load_kernels, make_ready, near_neck, nearest, support_uncut, try_cuts
from machine.workbench.work.models import Resting, Standing, mark, rank_resting, stand
from machine.workbench.work.plate import Plated, put_on_plate
from mdp.read import MANY_FACES
from mdp.search.neck import REACH_DEG, REACH_SHARE
from mdp.search.plan_file import PlannedPart
from mdp.search.trial import Obstacle, Trial
from mdp.zone import Zones
from profiles.effect import effect_of_change
from profiles.errors import MeshError, PlanError
from profiles.frozen import Effect
from profiles.profile import Profile

ALIKE_MM, ALIKE_DEG = 0.01, 0.05  # differences between planes that are not reported
REST_S = 0.1  # pause in dragging after which the planes are tried more closely
CHANGING_S = 0.2  # pause in changes of a bench after which it is prepared
MOST_NUMBERED = 8  # benches whose numbers are known
Invalid = dict[PlannedPart, str]  # planes that cannot be cut, with the reasons
_numbers = count(1)  # numbers for the benches of all sessions, which may share processes


class Readiness(Derived[None]):
    """Preparation of a bench for planes in a worker process, which caches its results by the bench's number; very large models
    wait for the first plane."""

    def __init__(self, session: SessionBase) -> None:
        # numbers of the newest benches, each with what determines its cuts, the newest last
        self._numbered: deque[tuple[tuple[object, ...], Profile, int]] = deque(maxlen=MOST_NUMBERED)
        self._model = ""  # key of the model prepared last
        super().__init__(
            session,
            lambda bench: None if bench.model is None or bench.model.faces > MANY_FACES else self._number_of(bench),
            self._prepare,
        )

    def load(self) -> None:
        """Load the kernels for planes while the first model is read."""
        if not self._numbered:
            self._session.start(self._session.hand.run(load_kernels))

    async def ask(self, task: Callable[..., Value], bench: Bench, *given: Any) -> Value:
        """Run a task for a bench, identified by its number."""
        return await self._session.hand.run(task, self._number_of(bench), bench, *given)

    def _number_of(self, bench: Bench) -> int:
        """The number of a bench; that of an earlier one whose preparation is valid for this bench, too, because planes read the
        same part of a profile as a search."""
        solid = bench.model and bench.model.key, bench.rotation, bench.zones
        for known, profile, number in self._numbered:
            same = all(new is old for new, old in zip(solid, known, strict=True))
            if same and effect_of_change(profile, bench.profile) < Effect.REACH:
                return number
        self._numbered.append((solid, bench.profile, next(_numbers)))
        return self._numbered[-1][2]

    async def _prepare(self, bench: Bench) -> None:
        """Prepare a bench, unless it changes again at once."""
        assert bench.model is not None
        if bench.model.key == self._model and not await self.rests(CHANGING_S):
            return
        self._model = bench.model.key
        self.tell(True)
        await self._session.hand.run(make_ready, self._number_of(bench), bench)


def standing_of(session: SessionBase) -> Derived[Standing]:
    """The placement of the model on the bench."""

    async def find(bench: Bench) -> Standing:
        standing = await session.hand.run(stand, bench)
        if standing.refusal:
            session.refuse(MeshError(standing.refusal))
        return standing

    return Derived(session, _stands_by, find)


def _stands_by(bench: Bench) -> tuple[object, ...] | None:
    """Everything that determines the placement and its report; None without a model."""
    if bench.model is None:
        return None
    process = bench.profile.of_part(1).process
    decides = process.self_supporting_angle_deg, process.line_width_mm, process.place_mm, bench.profile.machine
    return bench.model, bench.rotation, bench.profile.search.pedestal_mm, *decides


def plated_of(session: SessionBase) -> Derived[Plated]:
    """The places of all models on the plate, which take seconds where they are cut; nothing else waits for them."""

    def decides(bench: Bench) -> tuple[object, ...] | None:
        if bench.model is None or (bench.copies == 1 and not bench.beside):
            return None
        return bench.printed[0], bench.number

    async def find(bench: Bench) -> Plated:
        await asyncio.sleep(REST_S)
        drawn = session.new_file()
        plated = await session.aside.run(put_on_plate, bench, drawn)
        finalize(plated, drawn.unlink, missing_ok=True)
        return plated

    return Derived(session, decides, find, interrupts=True)


def pedestal_key(bench: Bench, standing: Standing | None) -> str:
    """Key of the pedestal, by which the page requests its triangles; "" without a pedestal."""
    if standing is None or not standing.pedestal or bench.model is None:
        return ""
    return sha256(repr((bench.model.key, bench.rotation, bench.profile.search.pedestal_mm)).encode()).hexdigest()[:16]


def resting_of(session: SessionBase, readiness: Readiness) -> Derived[tuple[Resting, ...]]:
    """The stable orientations of the model on the bench, ranked after its planes are prepared, which are needed sooner."""

    async def rank(bench: Bench) -> tuple[Resting, ...]:
        await readiness.wait()
        return await session.quick.run(rank_resting, bench.model, session.bench.profile.of_all_parts)

    return Derived(session, lambda bench: bench.model, rank)


@dataclass(frozen=True)
class Refused:
    """Planes that could not be cut: the page that wanted them, the obstacle, and the command that places the moved plane at the
    nearest valid position, None: there is none."""

    page: str
    obstacle: Obstacle | None
    near: Asked | None = None


class PlaneTrials:
    """trial: of the planes that were tried last, and the bench that they were tried on. refused: those that were refused last.
    uncut: the area that needs support in one piece, mm2.

    A change of marks or of the machine leaves the planes on the bench. Those that can no longer be cut are invalid: they are
    set aside in trials of the other planes, and nothing is sliced until they are moved or removed."""

    def __init__(self, session: SessionBase, readiness: Readiness) -> None:
        self.trial: tuple[Bench, Cuts, Trial] | None = None
        self.refused: Refused | None = None
        self._session, self._readiness = session, readiness
        self._held: Cuts | None = None  # planes that the user drags
        self._invalid: tuple[Bench, Invalid] = session.bench, {}
        self._figures = Derived(session, self._to_try, self._try)
        self.uncut = Derived(session, self._uncut, self._try_uncut)
        session.followers.append(self.settle)

    def hold(self, cuts: Cuts) -> None:
        """Try planes; the newest ones follow as soon as the current trial is done."""
        self._held = cuts
        self._figures.follow()

    def settle(self) -> None:
        """Return to the planes on the bench, because dragging has ended."""
        self._held = None
        self._figures.follow()

    async def take(self, edit: Edit, nearer: Asked | None = None) -> None:
        """Apply planes if they can be cut. nearer: command that places the plane at the nearest position. Raises PlanError
        otherwise."""
        bench, cuts, self.refused = self._session.bench, edit.cuts, None
        if len(cuts) + 1 < bench.parts and not self.invalid.keys() <= set(cuts):  # an invalid plane goes even if others need it
            after = with_cuts(bench, cuts)
            self._session.do(edit.word, after, await self.recheck(after))
            return
        aside: Invalid = {}
        trial = await self.attempt(bench, cuts)
        if trial.rejected:
            invalid = self.invalid or await self.find_invalid(bench)
            aside = {cut: reason for cut, reason in invalid.items() if cut != edit.placed}
            trial = await self.attempt(bench, cuts, aside=aside) if aside else trial
        if trial.rejected and edit.near:
            with self._session.waiting("looking for the nearest place that can be cut"):
                nearby = await self._readiness.ask(nearest, bench, edit.orders, tuple(aside))
            if nearby is not None:
                cuts, trial = nearby, await self.attempt(bench, nearby, aside=aside)
        if trial.rejected:
            self.settle()
            self.refused = Refused(asking.get(), trial.obstacle, None if edit.near else nearer)
            nowhere = "; shifted along its normal it cannot be cut either" if edit.near else ""
            raise PlanError(f"{edit.reason}part {trial.rejected_part} cannot be cut off: {trial.rejected}{nowhere}")
        self.trial = None if aside else (bench, cuts, trial)  # others may be valid without what was moved or removed
        after = with_cuts(bench, cuts)
        self._session.do(edit.word, after, await self.recheck(after) if aside else "")
        (wanted, number), moved = edit.orders[0], [plane for plane in cuts if plane not in edit.cuts]
        if moved:
            self._session.add_note(_moved_in_words(wanted[number - 2], moved[0]))

    async def take_neck(self, part: int) -> None:
        """Move the plane of a part to the neck near it. Raises PlanError if there is none, or it cannot be cut."""
        bench = self._session.bench
        check_unlocked(bench, part)
        assert bench.model is not None
        reach_mm = REACH_SHARE * hypot(*bench.model.size_mm)
        with self._session.waiting(f"looking for the narrowest section near the plane of part {part}"):
            neck = await self._readiness.ask(near_neck, bench, bench.cuts, part, reach_mm, tuple(self.invalid))
        if neck is None:
            where = f"within {reach_mm:.0f} mm and {REACH_DEG:g} degrees no section is narrower than its surroundings"
            raise PlanError(f"there is no narrower section near the plane of part {part}: {where}")
        normal, offset_mm = vector_of(neck.normal), float(neck.offset_mm)
        nearer = {"do": "move", "part": part, "normal": list(normal), "offset_mm": offset_mm, "near": True}
        await self.take(snap(bench, part, PlannedPart(normal, offset_mm)), nearer)

    async def attempt(self, bench: Bench, cuts: Cuts, most_cuts: float = inf, aside: Iterable[PlannedPart] = ()) -> Trial:
        """The figures of planes; most_cuts, aside: see work.cutting.try_cuts."""
        trial: Trial = await self._readiness.ask(try_cuts, bench, cuts, most_cuts, tuple(aside))
        return trial

    @property
    def invalid(self) -> Invalid:
        """The planes on the bench that cannot be cut, as far as they have been tried."""
        (tried, invalid), bench = self._invalid, self._session.bench
        return dict(invalid) if (tried.cuts, tried.sought) == (bench.cuts, bench.sought) else {}

    async def find_invalid(self, bench: Bench) -> Invalid:
        """The planes of a bench that cannot be cut, with the reasons."""
        invalid: Invalid = {}
        await self._attempt_valid(bench, bench.cuts or (), inf, invalid)
        return invalid

    async def _attempt_valid(self, bench: Bench, cuts: Cuts, most_cuts: float, invalid: Invalid) -> Trial:
        """The figures of planes, after those that are rejected are added to the invalid ones."""
        trial = await self.attempt(bench, cuts, most_cuts, invalid)
        for _ in cuts:
            if not trial.rejected:
                break
            invalid[cuts[trial.rejected_part - 2]] = trial.rejected
            trial = await self.attempt(bench, cuts, most_cuts, invalid)
        return trial

    async def recheck(self, bench: Bench) -> str:
        """Find the invalid planes of a bench that comes next; returns a sentence about them, "" without any."""
        self._invalid = bench, await self.find_invalid(bench)
        return invalid_in_words(*self._invalid)

    def unsliceable(self) -> str:
        """Sentence on why planes on the bench keep it from being sliced; "" if they do not."""
        words, count = invalid_in_words(self._session.bench, self.invalid), len(self.invalid)
        if words.endswith("cannot cut this model"):  # at no tilt
            return f"{words}: remove its plane, or choose another machine under Settings"
        return words and f"{words}: move or remove {'its plane' if count == 1 else 'their planes'}, or find parts again"

    def _wanted(self, bench: Bench) -> Cuts | None:
        return bench.cuts if self._held is None else self._held

    def _to_try(self, bench: Bench) -> tuple[object, ...] | None:
        """The planes and what determines their figures; None if these are known."""
        cuts, tried = self._wanted(bench), self.trial
        if cuts is None or bench.model is None:
            return None
        known = tried is not None and tried[1] == cuts and tried[0].sought == bench.sought and not tried[2].unchecked
        return None if known else (cuts, bench.sought)

    async def _try(self, bench: Bench) -> None:
        """Compute the figures at once; check the remaining parts one by one when dragging pauses."""
        cuts, dragged = self._wanted(bench), self._held is not None
        if cuts is None:
            return
        aside: Invalid = self.invalid if dragged else {}
        attempt = self.attempt if dragged else self._attempt_valid
        trial = await attempt(bench, cuts, 0, aside)
        while True:
            self.trial = tried = bench, cuts, trial
            if not dragged:
                self._invalid = bench, aside
            if not trial.unchecked:
                return
            self._session.notify()
            if not await self._figures.rests(REST_S):
                return
            trial = await attempt(bench, cuts, 1, aside)
            if self.trial is not tried:
                return

    def _uncut(self, bench: Bench) -> tuple[object, ...] | None:
        """The state that determines the area that needs support in one piece; None if it is not computed automatically."""
        return None if bench.model is None or bench.model.faces > MANY_FACES else bench.sought

    async def _try_uncut(self, bench: Bench) -> float:
        await self._readiness.wait()
        return await self._readiness.ask(support_uncut, bench)

    async def mark(self, word: str, marking: Callable[[Bench], Zones]) -> None:
        """Apply other zones; planes that they forbid stay, as invalid ones. word: name of the history step. Raises PlanError for
        invalid zones."""
        before = self._session.bench
        bench = with_zones(before, await self._session.quick.run(mark, before, marking))
        self._session.do(word, bench, await self.recheck(bench))


def invalid_in_words(bench: Bench, invalid: Invalid) -> str:
    """Which parts of a bench cannot be cut off, as the beginning of a sentence, one part with its reason; "" for none."""
    reasons = [(part, invalid[cut]) for part, cut in enumerate(bench.cuts or (), start=2) if cut in invalid]
    if len(reasons) == 1:
        return f"part {reasons[0][0]} cannot be cut off: {reasons[0][1]}"
    numbers = [f"{part}" for part, _ in reasons]
    return f"parts {', '.join(numbers[:-1])} and {numbers[-1]} cannot be cut off" if numbers else ""


def _moved_in_words(wanted: PlannedPart, there: PlannedPart) -> str:
    """How far from its wanted position a plane has been placed; "" for too small a distance."""
    assert wanted.plane is not None
    assert there.plane is not None
    leans_deg = degrees(acos(min(float(wanted.plane.normal @ there.plane.normal), 1.0)))
    up_mm = there.plane.offset_mm - wanted.plane.offset_mm
    if leans_deg > ALIKE_DEG:
        return f"The plane leans by {leans_deg:.0f}°: nowhere along its own direction can it be cut."
    side = "above" if up_mm > 0.0 else "below"
    nearest_place = f"The plane stands {abs(up_mm):.2f} mm {side} the wanted position, at the nearest one that can be cut."
    return nearest_place if abs(up_mm) >= ALIKE_MM else ""
