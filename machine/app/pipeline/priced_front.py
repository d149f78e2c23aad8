"""Priced front: about how long each decomposition of a front prints, and how much filament it takes."""

from dataclasses import replace

from mdp.decomposition import Decomposition, FrontRow
from mdp.plan_file import PlanFile, plan_of
from mdp.search.search import cut_by_plan
from profiles.errors import UserError
from profiles.profile import Profile
from slicer.estimate.estimate import estimate


def price_front(decomposition: Decomposition, profile: Profile) -> Decomposition:
    """The decomposition with estimates in the rows of its front.

    Rows that cost no less than one with fewer parts, which nobody takes, and rows that cannot be cut again have none.
    """
    lifted = profile.model_copy(update={"search": profile.search.model_copy(update={"pedestal_mm": 0.0})})
    plan = plan_of(decomposition)
    rows: list[FrontRow] = []
    for row in decomposition.front:
        pays = row.chosen or all(row.cost_mm2 < fewer.cost_mm2 for fewer in rows)
        rows.append(_price(row, decomposition, plan, lifted) if pays else row)
    return replace(decomposition, front=tuple(rows))


def _price(row: FrontRow, decomposition: Decomposition, plan: PlanFile, profile: Profile) -> FrontRow:
    try:
        parts = decomposition.parts
        if not row.chosen:
            parts = cut_by_plan(decomposition.mesh, decomposition.name, profile, plan, parts=row.parts).parts
        guess = estimate(parts, profile)
    except UserError:  # the other rows have theirs
        return row
    return replace(row, time_s=guess.time_s, filament_mm=guess.filament_mm)
