"""By plan: the parts of a model by the planes of a plan, without a search; its front is priced as far as it can be cut again."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from time import perf_counter

from mdp.decomposition import Decomposition, FrontRow, Part
from mdp.joint import is_sound
from mdp.mesh import Mesh
from mdp.pedestal import on_pedestal
from mdp.plans.plan_file import PlanFile, PlannedRow, planned_row
from mdp.search.by_hand import check_model, check_zones, cut_by_hand
from mdp.search.front import BY_PLAN, Pricing, front_row, pays, price_rows
from mdp.search.parts import Outcome, Taken, made_of, make_parts
from mdp.search.problem import Problem
from mdp.search.search import check_part_count, fewer_parts
from profiles.errors import PlanError
from profiles.profile import Profile


def cut_by_plan(
    mesh: Mesh,
    name: str,
    profile: Profile,
    plan: PlanFile,
    *,
    ranker: str = "classic",
    parts: int | None = None,
    price: Pricing | None = None,
) -> Decomposition:
    """The parts of a closed mesh by the planes of a plan; parts: the most parts of the row that is taken.

    The rows of the front are those of the plan, its own parts in place of the row of their number, the one that is cut measured
    anew; price: as for a search. Raises PlanError for a plan of another model and for a plane that cannot be cut.
    """
    began = perf_counter()
    own = plan
    if parts is not None:
        check_part_count(parts)
        plan = replace(plan, parts=plan.row(parts))
    for number, part in enumerate(plan.parts, start=2):
        if part.plane is None:
            missing = "normal" if part.normal is None else "offset_mm"
            raise PlanError(f"plan {plan.name}: part {number} has no {missing}: decompose --planes {plan.name} has it found")
    mesh = on_pedestal(mesh, profile.search.pedestal_mm)
    check_model(plan, mesh, name)
    check_zones(plan, mesh, name)
    problem = Problem(mesh, profile, plan.zones)
    node = cut_by_hand(problem, plan)
    if own.parts != plan.parts:
        plan = replace(plan, front=_with_own_row(problem, own))
    rows = {len(row.parts): _front_row(row) for row in plan.front}
    rows[len(node.cuts)] = replace(front_row(node), chosen=True, reason=BY_PLAN)
    cut_parts, front = make_parts(problem, node), [rows[count] for count in sorted(rows)]
    if price is not None:
        front = _priced(problem, plan, front, cut_parts, price, profile)
    notes = fewer_parts(parts, len(plan.parts) + 1, f"the plan {plan.name} holds")
    outcome = Outcome(name, ranker, 0, problem.evaluated, perf_counter() - began, notes)
    return made_of(problem, Taken(cut_parts, tuple(front)), outcome)


def _with_own_row(problem: Problem, plan: PlanFile) -> tuple[PlannedRow, ...]:
    """The front of a plan with its own parts, which a person may have changed, measured as the row of their number where they can
    be cut."""
    rows = {len(row.parts): row for row in plan.front}
    known = rows.get(len(plan.parts))
    if all(part.plane is not None for part in plan.parts) and (known is None or known.parts != plan.parts):
        with suppress(PlanError):
            rows[len(plan.parts)] = planned_row(plan.parts, front_row(cut_by_hand(problem, plan)))
    return tuple(rows.values())


def _front_row(row: PlannedRow) -> FrontRow:
    return FrontRow(row.planes, row.support_area_mm2, row.seam_mm, row.cost_mm2, stairs_mm2=row.stairs_mm2)


def _priced(
    problem: Problem,
    plan: PlanFile,
    rows: Sequence[FrontRow],
    chosen_parts: tuple[Part, ...],
    price: Pricing,
    profile: Profile,
) -> list[FrontRow]:
    """The rows of a plan's front with their prices, those that cannot be cut again or are not sound as they are."""
    planned = {len(row.parts) + 1: row.parts for row in plan.front}
    parts: dict[int, Sequence[Part]] = {}
    for place, (row, good) in enumerate(zip(rows, pays(rows), strict=True)):
        with suppress(PlanError):
            if row.chosen:
                parts[place] = chosen_parts
            elif good:
                parts[place] = make_parts(problem, cut_by_hand(problem, replace(plan, parts=planned[row.parts])))
    sound = {place for place, of_row in parts.items() if is_sound(problem.mesh, of_row, profile)}
    rows = [replace(row, sound=place in sound or place not in parts) for place, row in enumerate(rows)]
    return price_rows(rows, {place: parts[place] for place in parts if place in sound or rows[place].chosen}, price)
