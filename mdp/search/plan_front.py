"""Plan front: the rows of a plan's front, measured and priced anew as far as they can be cut again."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

from mdp.decomposition import FrontRow, Part
from mdp.plans.plan_file import PlanFile, PlannedRow
from mdp.search.by_hand import cut_by_hand
from mdp.search.front import Pricing, front_row, pays, price_row
from mdp.search.parts import make_parts
from mdp.search.problem import Problem
from profiles.errors import PlanError
from profiles.profile import Profile


def with_own_row(problem: Problem, plan: PlanFile) -> tuple[PlannedRow, ...]:
    """The front of a plan with its own parts, which a person may have changed, measured as the row of their number where they can
    be cut."""
    rows = {len(row.parts): row for row in plan.front}
    known = rows.get(len(plan.parts))
    if all(part.plane is not None for part in plan.parts) and (known is None or known.parts != plan.parts):
        with suppress(PlanError):
            row = front_row(cut_by_hand(problem, plan), problem.terms)
            rows[len(plan.parts)] = PlannedRow(plan.parts, row.support_area_mm2, row.seam_mm, row.cost_mm2)
    return tuple(rows.values())


def price_plan(
    problem: Problem, plan: PlanFile, rows: Sequence[FrontRow], made: tuple[Part, ...], profile: Profile, price: Pricing
) -> list[FrontRow]:
    """The rows of a plan's front with their prices, those that cannot be cut again as they are; made: the chosen row's parts."""
    planned = {len(row.parts) + 1: row.parts for row in plan.front}
    priced = []
    for row, good in zip(rows, pays(rows), strict=True):
        with suppress(PlanError):
            if row.chosen:
                row = price_row(row, made, price)
            elif good:
                node = cut_by_hand(problem, replace(plan, parts=planned[row.parts]))
                row = price_row(row, make_parts(node, problem.machine, profile), price)
        priced.append(row)
    return priced
