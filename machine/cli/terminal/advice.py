"""Advice: the ways to print a model side by side, and in a line the one to take, and how it was laid down."""

from collections.abc import Sequence

import numpy as np

from machine.cli.terminal.report import estimates, table
from machine.quantities import minutes
from mdp.cost.footing import BuildPlate
from mdp.decomposition import Decomposition, FrontRow
from mdp.directions.orientation import in_words, side_in_words
from mdp.mesh import Mesh
from mdp.search.front import ASKED, BY_PLAN, Weights, choose
from mdp.search.orient import Oriented
from profiles.profile import Profile

HARDLY_HELD = "its base may be too small to hold it: think of a wide brim (process.brim_mm) or another side (process.rotate_deg)"


def advice(decomposition: Decomposition, profile: Profile) -> str:
    """In one piece, in the parts that were made and in those that were not asked for but cost less: what each takes; then a line
    with the best of them."""
    advised = _advised(decomposition, profile)
    rows = [row for row in decomposition.front if row.parts == 1 or row.chosen or row is advised] or _without_front(decomposition)
    ways = [(in_parts(row.parts), row) for row in rows]
    best = f"print it {in_parts(advised.parts if advised else len(decomposition.parts))}"
    if advised is not None and not advised.chosen:
        best += f": --parts {advised.parts}"
    return _ways_table(ways) + f"advice: {best}\n"


def orientation_in_words(oriented: Oriented, otherwise: str) -> tuple[str, ...]:
    """How a model was laid down, what that is better by, and how to change it; nothing where it stays. Then a warning where the
    plate hardly holds it."""
    orientation, standing, laid = oriented.orientation, oriented.standing, oriented.decomposition.chosen
    warning = () if oriented.held else (HARDLY_HELD,)
    if orientation is None:
        return warning
    side, turns = side_in_words(orientation), in_words(orientation, held=True)
    where, better = f"{side} ({turns})" if side else turns, ""
    if laid is not None:
        was = f"{oriented.upright.risky_mm2:.0f} mm2 hang over" if standing is None else _with_scars(standing)
        better = f": {_with_scars(laid)}, as it stands {was if oriented.upright_held else 'the plate would hardly hold it'}"
    return (f"it is laid down {where}{better}; {otherwise}", *warning)


def standing_in_words(mesh: Mesh, profile: Profile) -> tuple[str, ...]:
    """A warning where the plate hardly holds a model as it stands."""
    return () if BuildPlate.under(mesh, profile).footing(np.eye(3)).held(of_file=True) else (HARDLY_HELD,)


def _with_scars(row: FrontRow) -> str:
    taking = "" if row.time_s is None else f" in {minutes(row.time_s)}"
    return f"{in_parts(row.parts)} with {row.cost_mm2:.0f} mm2 of scars{taking}"


def in_parts(count: int) -> str:
    """A number of parts in words."""
    return "in one piece" if count == 1 else f"in {count} parts"


def _advised(decomposition: Decomposition, profile: Profile) -> FrontRow | None:
    """The row that was chosen, or the cheapest one where a person chose; None where there is no front."""
    chosen, front = decomposition.chosen, decomposition.front
    if chosen is None or chosen.reason not in (ASKED, BY_PLAN):
        return chosen
    search = profile.search
    return front[choose(front, Weights.of(profile), search.least_saving).place]


def _without_front(decomposition: Decomposition) -> list[FrontRow]:
    """The rows of parts that come from no search."""
    whole = FrontRow((), decomposition.risky_area_mm2, 0.0, decomposition.risky_area_mm2)
    planes = tuple(part.base for part in decomposition.parts[1:])
    parts = FrontRow(planes, decomposition.residual_area_mm2, 0.0, decomposition.residual_area_mm2)
    return [whole, parts] if planes else [whole]


def _ways_table(ways: Sequence[tuple[str, FrontRow]]) -> str:
    """Each way with what needs support then, how much less that is than in the first one, its seams, time and filament."""
    first_mm2 = ways[0][1].support_area_mm2
    rows = [["print it", "support mm2", "less", "seams mm", "stairs mm2", "about", "filament m"]]
    for number, (name, row) in enumerate(ways):
        less = 1.0 - row.support_area_mm2 / first_mm2 if first_mm2 > 0.0 else 0.0
        share = f"{round(100 * less, 1) + 0.0:.1f} %" if number else ""
        rows.append(
            [name, f"{max(row.support_area_mm2, 0.0):.1f}", share, f"{row.seam_mm:.0f}", f"{row.stairs_mm2:.0f}", *estimates(row)]
        )
    return table(rows)
