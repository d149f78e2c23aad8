"""Advice: the ways to print a model side by side, and in a line the one to take, and how it was laid down."""

from collections.abc import Sequence

from machine.cli.terminal.report import estimates, table
from machine.pipeline.orientation import in_parts
from mdp.decomposition import Decomposition, FrontRow
from mdp.search.front import ASKED, BY_PLAN, Weights, choose
from profiles.profile import Profile


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
    rows = [["print it", "support mm²", "less", "seams mm", "stairs mm²", "about", "filament m"]]
    for number, (name, row) in enumerate(ways):
        less = 1.0 - row.support_area_mm2 / first_mm2 if first_mm2 > 0.0 else 0.0
        share = f"{round(100 * less, 1) + 0.0:.1f} %" if number else ""
        rows.append(
            [name, f"{max(row.support_area_mm2, 0.0):.1f}", share, f"{row.seam_mm:.0f}", f"{row.stairs_mm2:.0f}", *estimates(row)]
        )
    return table(rows)
