"""Bench: what lies on the workbench, as one value. Every command gives a new one, so undo and redo are values too."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan2

import numpy as np

from machine.pipeline.project import STANDING
from machine.pipeline.requests import Given
from machine.planning.stops import Stop
from machine.workbench.bench.model import Model, Placing, moved_part, moved_zones
from machine.workbench.bench.part_settings import gone_in_words, number_after, renumbered, renumbered_stops, values_in_words
from machine.workbench.bench.values import vector_of
from mdp.decomposition import FrontRow
from mdp.mesh import Floats
from mdp.overhang import UP
from mdp.pose import about
from mdp.search.front import Weights, choose, pareto_optimal
from mdp.search.plan_file import PlanFile, PlannedPart, planned_parts
from mdp.zone import NO_ZONES, Zones
from profiles.effect import effect_of_change
from profiles.frozen import Effect, Vector
from profiles.messages import option
from profiles.part_settings import PartSettings
from profiles.profile import Profile

USUAL = Given()
MOST_STEPS = 200  # that can be undone
MOST_KEPT_FACES = 5_000_000  # of the models of these steps together, some 25 bytes each: every other scale is a model of its own


@dataclass(frozen=True, eq=False)
class Bench:
    """A model, how it is turned, and how it is cut.

    rotation: rows of what turns the model as it is read. cuts: the base planes of the parts from the second on, in print order;
    None: nobody has cut it yet. rows: the front that the cuts were chosen from, ever more parts; recommended: how many parts the
    search would take, 0: no search has been; priced: times and plastic of the rows are for this profile, as far as there are any.
    locked: those of the cuts that a search begins with and nobody moves. stops: where the print waits for a person, each with its
    part wherever that goes; copies: how many of the model on the plate; both stay until another model is opened.
    """

    profile: Profile
    model: Model | None = None
    rotation: tuple[Vector, ...] = STANDING
    cuts: tuple[PlannedPart, ...] | None = None
    zones: Zones = NO_ZONES
    rows: tuple[FrontRow, ...] = ()
    recommended: int = 0
    locked: frozenset[PlannedPart] = frozenset()
    given: Given = USUAL
    priced: bool = True
    stops: tuple[Stop, ...] = ()
    copies: int = 1

    @property
    def parts(self) -> int:
        """How many parts the cuts make; 0: it is not cut yet."""
        return 0 if self.cuts is None else len(self.cuts) + 1

    @property
    def planned(self) -> bool:
        """Whether there is anything on it that only a plan's file says: how it is cut, or what is marked."""
        return self.cuts is not None or self.zones != NO_ZONES

    @property
    def turned(self) -> Floats | None:
        """(3, 3) how the model is turned; None: it stands as it is read, so a plan needs not say it."""
        return None if self.rotation == STANDING else np.array(self.rotation)

    @property
    def sought(self) -> tuple[object, ...]:
        """Everything that decides what a search finds, except the locked planes."""
        return self.model, self.rotation, self.profile, self.zones

    @property
    def shaped(self) -> tuple[object, ...]:
        """Everything that decides the parts."""
        return self.model, self.rotation, self.cuts, self.profile, self.zones

    @property
    def printed(self) -> tuple[object, ...]:
        """Everything that decides what is printed."""
        return *self.shaped, self.stops, self.copies


@dataclass(frozen=True, eq=False)
class Step:
    """A command's word, the bench after it, and a sentence for what it has taken away beside what it was for."""

    word: str
    bench: Bench
    lost: str = ""


@dataclass(frozen=True, eq=False)
class History:
    """The bench with all that came before it and all that was undone; the last of each is the nearest."""

    now: Step
    before: tuple[Step, ...] = ()
    undone: tuple[Step, ...] = ()

    def do(self, word: str, bench: Bench) -> "History":
        """Take a further step, none if the bench has not changed. Pauses of parts that are gone are dropped, as is what was
        undone."""
        if bench is self.now.bench:
            return self
        before = self.now.bench if _have_one_model(self.now.bench, bench) else bench
        stops, gone = renumbered_stops(bench.stops, before.cuts or (), bench.cuts or ())
        after = bench if stops == bench.stops else replace(bench, stops=stops)
        lost = [(stop.part, option(stop.option, stop.at)) for stop in gone] + [
            (own.part, f"its own {values_in_words(own)}") for own in _gone(self.now.bench, bench)
        ]
        return History(Step(word, after, gone_in_words(word, lost)), _nearest_steps((*self.before, self.now)[-MOST_STEPS:]))

    def undo(self, count: int = 1) -> "History":
        """Steps back, as far as there are some."""
        if not self.before or count < 1:
            return self
        return History(self.before[-1], self.before[:-1], (*self.undone, self.now)).undo(count - 1)

    def redo(self, count: int = 1) -> "History":
        """Steps forward again, as far as there are some."""
        if not self.undone or count < 1:
            return self
        return History(self.undone[-1], (*self.before, self.now), self.undone[:-1]).redo(count - 1)


def _nearest_steps(steps: tuple[Step, ...]) -> tuple[Step, ...]:
    """The nearest steps whose models are not too much for the memory; the nearest of all whatever it is."""
    models, faces = set[Model](), 0
    for back, step in enumerate(reversed(steps)):
        model = step.bench.model
        if model is not None and model not in models:
            models.add(model)
            faces += model.faces
        if faces > MOST_KEPT_FACES and back:
            return steps[-back:]
    return steps


def _have_one_model(before: Bench, after: Bench) -> bool:
    return before.model is not None and after.model is not None and before.model.path == after.model.path


def _gone(before: Bench, after: Bench) -> list[PartSettings]:
    """The settings of single parts that are not there any more where the same model is turned or cut otherwise."""
    if not _have_one_model(before, after):
        return []
    if (before.cuts, before.rotation) == (after.cuts, after.rotation):
        return []  # a person has taken them back
    left = {own.part for own in after.profile.parts}
    return [own for own in before.profile.parts if number_after(before.cuts or (), after.cuts or (), own.part) not in left]


def emptied(bench: Bench) -> Bench:
    """The bench without its model."""
    return Bench(bench.profile.of_all_parts, given=bench.given)


def with_model(bench: Bench, model: Model) -> Bench:
    """Another model on the bench, as it is read and uncut, with what its file marks."""
    lift_mm = np.array([0.0, 0.0, bench.profile.search.pedestal_mm])
    return replace(emptied(bench), model=model, zones=model.zones.transform(np.eye(3), lift_mm))


def with_model_anew(bench: Bench, model: Model | None) -> Bench:
    """The same model read, turned or cut anew: pauses and copies stay, and what part 1 has of its own."""
    profile = renumbered(bench.profile, bench.cuts or (), ())
    return replace(emptied(bench), model=model, profile=profile, stops=bench.stops, copies=bench.copies)


def with_scaled_model(bench: Bench, model: Model, factor: float) -> Bench:
    """The same model scaled by a factor, its planes and zones in proportion; its front was for the size before."""
    bare = replace(with_model_anew(bench, model), profile=bench.profile, rotation=bench.rotation)
    return _with_places_of(bare, bench, factor)


def with_model_turned_as_read(bench: Bench, model: Model, turn: Floats, factor: float = 1.0) -> Bench:
    """The same model turned otherwise, (3, 3), and scaled as it is read, with its zones; its cuts were for the way before."""
    anew = replace(with_model_anew(bench, model), rotation=bench.rotation)
    return _with_places_of(anew, _uncut(bench), factor, turn)


def with_rotation(bench: Bench, rotation: Sequence[Sequence[float]]) -> Bench:
    """The model turned otherwise, with its zones; its cuts were for the way that it stood before."""
    rows = tuple(vector_of(row) for row in rotation)
    if rows == bench.rotation:
        return bench
    turned = replace(with_model_anew(bench, bench.model), rotation=rows)
    return _with_places_of(turned, _uncut(bench))


def _uncut(bench: Bench) -> Bench:
    return replace(bench, cuts=None, locked=frozenset())


def _with_places_of(bench: Bench, before: Bench, factor: float = 1.0, turn: Floats | None = None) -> Bench:
    """The planes and zones of a bench before at the same places of its model, which is now scaled by `factor` and turned by
    `turn` as it is read. Raises PlanError where a box would leave what a plan may have."""
    if before.model is None or bench.model is None:
        return bench
    if not before.cuts and before.zones == NO_ZONES:
        return replace(bench, cuts=before.cuts)
    start = _placing(before)
    if turn is not None:
        start = start.after(Placing.of(before.model, turn, 0.0))
    move = _placing(bench, factor).after(start)
    planes = {part: moved_part(part, move) for part in before.cuts or ()}
    cuts = None if before.cuts is None else tuple(planes[part] for part in before.cuts)
    locked = frozenset(planes[part] for part in before.locked)
    return replace(bench, cuts=cuts, locked=locked, zones=moved_zones(before.zones, move))


def _placing(bench: Bench, factor: float = 1.0) -> Placing:
    """How the model on a bench stands on the platform."""
    assert bench.model is not None
    return Placing.of(bench.model, bench.turned, bench.profile.search.pedestal_mm, factor)


def with_front(bench: Bench, rows: Sequence[FrontRow]) -> Bench:
    """The front of a search with its prices, cut by the row that it has chosen. A limb may be named by another point there than
    it was before."""
    chosen = next(row for row in rows if row.chosen)
    parts = planned_parts(chosen)
    names = {before: _same_cut(before, parts) for before in bench.cuts or ()}
    cuts, locked = (tuple(names.get(part, part) for part in several) for several in (bench.cuts or (), bench.locked))
    named = replace(bench, rows=tuple(rows), recommended=chosen.parts, cuts=cuts, locked=frozenset(locked), priced=True)
    return with_cuts(named, parts)


def _same_cut(part: PlannedPart, parts: Sequence[PlannedPart]) -> PlannedPart:
    """The part that has the plane of another and as many limbs above it, named by the nearest points; else that other."""
    plane = part.normal, part.offset_mm, len(part.limbs_mm)
    same = [other for other in parts if (other.normal, other.offset_mm, len(other.limbs_mm)) == plane]
    limbs_mm = np.array(part.limbs_mm)
    return min(same, key=lambda other: float(np.linalg.norm(np.array(other.limbs_mm) - limbs_mm)), default=part)


def with_cuts(bench: Bench, cuts: tuple[PlannedPart, ...]) -> Bench:
    """Other planes; what is locked of them stays so, and settings of single parts go with their planes."""
    profile = renumbered(bench.profile, bench.cuts or (), cuts)
    return replace(bench, cuts=cuts, locked=bench.locked & frozenset(cuts), profile=profile)


def with_zones(bench: Bench, zones: Zones) -> Bench:
    """Other zones: the figures of the front were for those before."""
    return replace(bench, zones=zones, rows=(), recommended=0)


def with_profile(bench: Bench, given: Given, profile: Profile) -> Bench:
    """Another profile. The front goes where a search may find another one now, its times and plastic where they may be others;
    the planes may serve all the same. On another pedestal planes and zones stay with the model."""
    changed = replace(bench, given=given, profile=profile)
    if profile.search.pedestal_mm != bench.profile.search.pedestal_mm:
        changed = _with_places_of(changed, bench)
    effect = effect_of_change(bench.profile, profile)
    if effect == Effect.NONE or not bench.rows:
        return changed
    if effect == Effect.FRONT:
        return replace(changed, rows=(), recommended=0, priced=True)
    return replace(changed, rows=tuple(replace(row, time_s=None, filament_mm=None) for row in bench.rows), priced=False)


def with_rows(bench: Bench, rows: Sequence[FrontRow]) -> Bench:
    """Fewer rows of the front; which of them is recommended is seen when they are priced."""
    return replace(bench, rows=tuple(rows), recommended=bench.recommended if rows else 0)


def rows_to_price(bench: Bench) -> list[int]:
    """Places of the rows of the front whose time and plastic are shown."""
    return [row for row, good in enumerate(pareto_optimal(bench.rows)) if good]


def with_prices(bench: Bench, prices: Mapping[int, FrontRow]) -> Bench:
    """The front with times and plastic of the rows that were measured, by their places, and what is recommended by them."""
    rows = [
        replace(row, time_s=prices[number].time_s, filament_mm=prices[number].filament_mm) if number in prices else row
        for number, row in enumerate(bench.rows)
    ]
    if not bench.recommended:
        return replace(bench, rows=tuple(rows), priced=True)
    search = bench.profile.search
    choice = choose(rows, Weights.of(bench.profile), search.least_saving)
    marked = [
        replace(row, chosen=number == choice.place, reason=choice.reason if number == choice.place else "")
        for number, row in enumerate(rows)
    ]
    return replace(bench, rows=tuple(marked), recommended=rows[choice.place].parts, priced=True)


def with_plan(bench: Bench, plan: PlanFile, rows: Sequence[FrontRow], profile: Profile) -> Bench:
    """The planes of a plan. rows: its front, measured; profile: with the plan's settings of single parts."""
    rotation = STANDING if plan.orientation is None else plan.orientation
    bare = with_model_anew(bench, bench.model)
    return replace(bare, profile=profile, rotation=rotation, cuts=plan.parts, zones=plan.zones, rows=tuple(rows))


def plan_of_bench(bench: Bench, name: str) -> PlanFile:
    """What is to be cut, as a plan's file says it. The model is the one on the bench, so it needs no sha256."""
    orientation = None if bench.rotation == STANDING else bench.rotation
    model = "" if bench.model is None else bench.model.name
    return PlanFile(name, model, "", orientation, bench.cuts or (), bench.zones, bench.rows, tuple(bench.profile.parts))


def locked_plan(bench: Bench) -> PlanFile:
    """What a search begins with: the locked planes, cut first, and the zones."""
    parts = tuple(part for part in bench.cuts or () if part in bench.locked)
    return PlanFile("the locked planes", parts=parts, zones=bench.zones)


def laid_down(bench: Bench, normal: Floats) -> Floats:
    """(3, 3) the rotation that lays a face of this outward normal, of the model as it is read, on the platform the short way."""
    now = np.array(bench.rotation)
    across = np.cross(now @ normal, -UP)
    length = float(np.linalg.norm(across))
    axis = across / length if length > 0.0 else np.eye(3)[0]  # half a turn about any axis across, or none
    return np.asarray(about(axis, atan2(length, float(now @ normal @ -UP))) @ now)
