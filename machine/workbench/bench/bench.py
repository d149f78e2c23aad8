"""Bench: the state of the workbench as one immutable value. Every command returns a new one, so undo and redo are values, too."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan2

import numpy as np

from machine.pipeline.project import STANDING
from machine.pipeline.requests import MOST_COPIES, Given
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
from profiles.errors import PlanError
from profiles.frozen import Effect, Vector
from profiles.messages import option
from profiles.part_settings import PartSettings
from profiles.profile import Profile, with_part_settings

USUAL = Given()
MOST_STEPS = 200  # undo steps
MOST_KEPT_FACES = 5_000_000  # faces in the models of all steps, some 25 bytes each: every scale makes a model of its own


@dataclass(frozen=True, eq=False)
class Bench:
    """A model, its orientation, and its cuts.

    rotation: rows of the matrix that turns the model as read. cuts: base planes of parts 2, 3, ... in print order; None: not cut
    yet. rows: the front from which the cuts were chosen, with increasing numbers of parts; recommended: number of parts that the
    search prefers, 0: no search yet; priced: times and filament of the rows are those for this profile. locked: cuts that a
    search keeps and that cannot be moved. stops: pauses, each of which follows its part; copies: of the model on the plate;
    beside: the other models there, with the same settings, except those of single parts; number: of models before this one on
    the plate. These four remain until another model is opened. notes: those of the search that found the rows.
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
    beside: "tuple[Bench, ...]" = ()
    number: int = 0
    notes: tuple[str, ...] = ()

    @property
    def parts(self) -> int:
        """Number of parts; 0: not cut yet."""
        return 0 if self.cuts is None else len(self.cuts) + 1

    @property
    def plate(self) -> "tuple[Bench, ...]":
        """All models on the plate in their order, this one included."""
        alone = replace(self, stops=(), beside=(), number=0) if self.beside else self
        return *self.beside[: self.number], alone, *self.beside[self.number :]

    @property
    def planned(self) -> bool:
        """Whether it has cuts or zones, which only a plan file can store, or other models beside it, which options of a single
        model do not go with."""
        return self.cuts is not None or self.zones != NO_ZONES or bool(self.beside)

    @property
    def worked_on(self) -> bool:
        """Whether anybody has cut, marked or turned its model, or prepared its print."""
        prepared = self.stops, self.copies, self.profile.parts
        return self.model is not None and (self.planned or self.turned is not None or prepared != ((), 1, []))

    @property
    def turned(self) -> Floats | None:
        """(3, 3) rotation of the model; None: as read, which a plan need not contain."""
        return None if self.rotation == STANDING else np.array(self.rotation)

    @property
    def sought(self) -> tuple[object, ...]:
        """Everything that determines the result of a search, except the locked planes."""
        return self.model, self.rotation, self.profile, self.zones

    @property
    def shaped(self) -> tuple[object, ...]:
        """Everything that determines the parts."""
        return self.model, self.rotation, self.cuts, self.profile, self.zones

    @property
    def printed(self) -> tuple[object, ...]:
        """Everything that determines the print."""
        return tuple((*each.shaped, each.copies) for each in self.plate), self.stops


@dataclass(frozen=True, eq=False)
class Step:
    """A command's name, the bench after it, and a sentence about what else it removed."""

    word: str
    bench: Bench
    lost: str = ""


@dataclass(frozen=True, eq=False)
class History:
    """The current step, previous steps and undone steps; the last of each tuple is the nearest."""

    now: Step
    before: tuple[Step, ...] = ()
    undone: tuple[Step, ...] = ()

    def do(self, word: str, bench: Bench) -> "History":
        """Add a step, unless the bench is unchanged. Drops the undone steps, and pauses of parts that no longer exist."""
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
    """The nearest steps whose models fit into memory; always includes the nearest one."""
    models, faces = set[Model](), 0
    for back, step in enumerate(reversed(steps)):
        for model in (each.model for each in step.bench.plate):
            if model is not None and model not in models:
                models.add(model)
                faces += model.faces
        if faces > MOST_KEPT_FACES and back:
            return steps[-back:]
    return steps


def _have_one_model(before: Bench, after: Bench) -> bool:
    return before.model is not None and after.model is not None and before.model.path == after.model.path


def _gone(before: Bench, after: Bench) -> list[PartSettings]:
    """Settings of single parts that were lost because the same model was turned or cut differently."""
    if not _have_one_model(before, after):
        return []
    if (before.cuts, before.rotation) == (after.cuts, after.rotation):
        return []  # the user has reset them
    left = {own.part for own in after.profile.parts}
    return [own for own in before.profile.parts if number_after(before.cuts or (), after.cuts or (), own.part) not in left]


def emptied(bench: Bench) -> Bench:
    """The bench without its model."""
    return Bench(bench.profile.of_all_parts, given=bench.given)


def with_model(bench: Bench, model: Model) -> Bench:
    """The bench with another model, as read and uncut, with the zones of its file."""
    lift_mm = np.array([0.0, 0.0, bench.profile.search.pedestal_mm])
    return replace(emptied(bench), model=model, zones=model.zones.transform(np.eye(3), lift_mm))


def with_model_anew(bench: Bench, model: Model | None) -> Bench:
    """The bench with the same model read, turned or cut again: keeps pauses, the rest of the plate and the settings of part 1."""
    profile = renumbered(bench.profile, bench.cuts or (), ())
    kept = replace(emptied(bench), stops=bench.stops, copies=bench.copies, beside=bench.beside, number=bench.number)
    return replace(kept, model=model, profile=profile)


def with_beside(bench: Bench, beside: tuple[Bench, ...]) -> Bench:
    """Replace the other models on the plate. Raises PlanError for a name that occurs twice, because messages and the command
    line identify models by their names, and for more models than a plate may have."""
    assert bench.model is not None
    names = {bench.model.name}
    for other in beside:
        assert other.model is not None
        if other.model.name in names:
            raise PlanError(f"{other.model.name} is on the plate already: set its number of copies to print more")
        names.add(other.model.name)
    if beside:
        check_first_plate(bench.model)
    if (count := bench.copies + sum(other.copies for other in beside)) > MOST_COPIES:
        raise PlanError(f"{count} models are to stand on the plate: {MOST_COPIES} at most are allowed")
    return replace(bench, beside=beside)


def with_other_in_work(bench: Bench, index: int) -> Bench:
    """The bench to work on one of the other models, which changes neither the plate nor its print."""
    plate, number = bench.plate, index + (index >= bench.number)
    others = (*plate[:number], *plate[number + 1 :])
    return replace(plate[number], stops=bench.stops, beside=others, number=number)


def check_first_plate(model: Model) -> None:
    """Raise PlanError for another plate than the first of its file, which goes beside no model."""
    if model.plate is not None:
        raise PlanError(f"plate {model.plate} of {model.name} is open: only the first plate of a file goes beside other models")


def with_scaled_model(bench: Bench, model: Model, factor: float) -> Bench:
    """Scale the model by a factor, with planes and zones in proportion; drops the front, which was for the old size."""
    bare = replace(with_model_anew(bench, model), profile=bench.profile, rotation=bench.rotation)
    return _with_places_of(bare, bench, factor)


def with_model_turned_as_read(bench: Bench, model: Model, turn: Floats, factor: float = 1.0) -> Bench:
    """Turn the model, (3, 3), and scale it as read, with its zones; drops its cuts."""
    anew = replace(with_model_anew(bench, model), rotation=bench.rotation)
    return _with_places_of(anew, _uncut(bench), factor, turn)


def with_rotation(bench: Bench, rotation: Sequence[Sequence[float]]) -> Bench:
    """Turn the model to this rotation, with its zones; drops its cuts, which were for the previous orientation."""
    rows = tuple(vector_of(row) for row in rotation)
    if rows == bench.rotation:
        return bench
    turned = replace(with_model_anew(bench, bench.model), rotation=rows)
    return _with_places_of(turned, _uncut(bench))


def _uncut(bench: Bench) -> Bench:
    return replace(bench, cuts=None, locked=frozenset())


def _with_places_of(bench: Bench, before: Bench, factor: float = 1.0, turn: Floats | None = None) -> Bench:
    """Move planes and zones of the bench `before` with the model, which is now scaled by `factor` and turned as read by `turn`.
    Raises PlanError if a box would exceed the limits of a plan."""
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
    """Placement of the model on the build plate."""
    assert bench.model is not None
    return Placing.of(bench.model, bench.turned, bench.profile.search.pedestal_mm, factor)


def with_front(bench: Bench, rows: Sequence[FrontRow], notes: tuple[str, ...] = ()) -> Bench:
    """The front of a search with its prices and notes, cut by the row that it has chosen. A limb may be named by another point
    there than it was before."""
    chosen = next(row for row in rows if row.chosen)
    parts = planned_parts(chosen)
    names = {before: _same_cut(before, parts) for before in bench.cuts or ()}
    cuts, locked = (tuple(names.get(part, part) for part in several) for several in (bench.cuts or (), bench.locked))
    named = replace(bench, rows=tuple(rows), recommended=chosen.parts, cuts=cuts, locked=frozenset(locked), priced=True)
    return with_cuts(replace(named, notes=notes), parts)


def _same_cut(part: PlannedPart, parts: Sequence[PlannedPart]) -> PlannedPart:
    """The part with the same plane and number of limbs whose limb points are nearest; the given part if there is none."""
    plane = part.normal, part.offset_mm, len(part.limbs_mm)
    same = [other for other in parts if (other.normal, other.offset_mm, len(other.limbs_mm)) == plane]
    limbs_mm = np.array(part.limbs_mm)
    return min(same, key=lambda other: float(np.linalg.norm(np.array(other.limbs_mm) - limbs_mm)), default=part)


def with_cuts(bench: Bench, cuts: tuple[PlannedPart, ...]) -> Bench:
    """Replace the planes; locked ones stay locked, and settings of single parts follow their planes."""
    profile = renumbered(bench.profile, bench.cuts or (), cuts)
    return replace(bench, cuts=cuts, locked=bench.locked & frozenset(cuts), profile=profile)


def with_zones(bench: Bench, zones: Zones) -> Bench:
    """Replace the zones; drops the front, whose figures were for the previous zones."""
    return replace(bench, zones=zones, rows=(), recommended=0)


def with_profile(bench: Bench, given: Given, profile: Profile) -> Bench:
    """Replace the profile, also that of the other models. Drops the front if a search might find another one, or its times and
    filament if they might change. The planes stay; if the pedestal changes, planes and zones move with the model. Raises
    ProfileError if the settings of a part of another model do not go with it."""
    others = tuple(
        with_profile(other, given, with_part_settings(profile.of_all_parts, other.profile.parts)) for other in bench.beside
    )
    changed = replace(bench, given=given, profile=profile, beside=others)
    if profile.search.pedestal_mm != bench.profile.search.pedestal_mm:
        changed = _with_places_of(changed, bench)
    effect = effect_of_change(bench.profile, profile)
    if effect == Effect.NONE or not bench.rows:
        return changed
    if effect == Effect.FRONT:
        return replace(changed, rows=(), recommended=0, priced=True)
    return replace(changed, rows=tuple(replace(row, time_s=None, filament_mm=None) for row in bench.rows), priced=False)


def rows_to_price(bench: Bench) -> list[int]:
    """Indices of the rows of the front whose time and filament are shown."""
    return [row for row, good in enumerate(pareto_optimal(bench.rows)) if good]


def with_prices(bench: Bench, prices: Mapping[int, FrontRow]) -> Bench:
    """Set time and filament of the measured rows of the front, by index, and the recommendation that follows."""
    rows = [
        replace(row, time_s=prices[number].time_s, filament_mm=prices[number].filament_mm) if number in prices else row
        for number, row in enumerate(bench.rows)
    ]
    if not bench.recommended:
        return replace(bench, rows=tuple(rows), priced=True)
    search = bench.profile.search
    choice = choose(rows, Weights.of(bench.profile), search.least_saving)
    return replace(bench, rows=tuple(choice.marked(rows)), recommended=rows[choice.place].parts, priced=True)


def with_plan(bench: Bench, plan: PlanFile, rows: Sequence[FrontRow], profile: Profile) -> Bench:
    """Apply the planes of a plan. rows: its measured front; profile: includes the plan's settings of single parts."""
    rotation = STANDING if plan.orientation is None else plan.orientation
    bare = with_model_anew(bench, bench.model)
    return replace(bare, profile=profile, rotation=rotation, cuts=plan.parts, zones=plan.zones, rows=tuple(rows))


def plan_of_bench(bench: Bench, name: str = "") -> PlanFile:
    """The cuts and zones as a plan. Its model is the one on the bench, so it needs no hash. name: of its file."""
    orientation = None if bench.rotation == STANDING else bench.rotation
    model = "" if bench.model is None else bench.model.name
    return PlanFile(name, model, "", orientation, bench.cuts or (), bench.zones, bench.rows, tuple(bench.profile.parts))


def locked_plan(bench: Bench) -> PlanFile:
    """Plan with the locked planes, which a search keeps as its first cuts, and the zones."""
    parts = tuple(part for part in bench.cuts or () if part in bench.locked)
    return PlanFile("", parts=parts, zones=bench.zones)


def locked_in_words(part: int, reason: str) -> str:
    """Why a search cannot keep the locked plane of a part."""
    remedy = "unlock it or take the mark back, or the setting that forbids it"
    return f"part {part} is locked and cannot be cut off: {reason}: {remedy}"


def laid_down(bench: Bench, normal: Floats) -> Floats:
    """(3, 3) rotation that turns a face with this outward normal, of the model as read, down by the smallest angle."""
    now = np.array(bench.rotation)
    across = np.cross(now @ normal, -UP)
    length = float(np.linalg.norm(across))
    axis = across / length if length > 0.0 else np.eye(3)[0]  # half a turn about any horizontal axis, or none
    return np.asarray(about(axis, atan2(length, float(now @ normal @ -UP))) @ now)
