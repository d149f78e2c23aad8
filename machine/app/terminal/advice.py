"""Advice: the ways to print a model side by side, and in a line the one to take, and how it is best laid down."""

from collections.abc import Sequence

from machine.app.terminal.report import estimates, table
from machine.quantities import minutes
from mdp.decomposition import Decomposition, FrontRow
from mdp.directions.orientation import Orientation, in_words, side_in_words
from mdp.search.front import ASKED, BY_PLAN, choose, price_of_second_mm2
from mdp.search.laying import OtherWay
from profiles.profile import Profile


def advice(decomposition: Decomposition, better: OtherWay | None, profile: Profile) -> str:
    """In one piece, in the parts that were made, in those that were not asked for but cost less, and lying otherwise: what each
    takes; then a line with the best of them."""
    advised = _advised(decomposition, profile)
    rows = [row for row in decomposition.front if row.parts == 1 or row.chosen or row is advised] or _without_front(decomposition)
    ways = [(in_parts(row.parts), row) for row in rows]
    best = f"print it {in_parts(advised.parts if advised else len(decomposition.parts))}"
    if advised is not None and not advised.chosen:
        best += f": --parts {advised.parts}"
    if better is not None:
        ways.append((side_in_words(better.orientation) or in_words(better.orientation), better.row))
        best = f"lay it {_lying(better)} and print it in one piece: --orient"
    return _ways_table(ways) + f"advice: {best}\n"


def laid_in_words(chosen: Orientation | None) -> str:
    """What has become of a model that was to be laid down; None: it stays."""
    return "the model is best printed as it stands" if chosen is None else f"the model is {in_words(chosen)}"


def better_in_words(decomposition: Decomposition, better: OtherWay | None) -> str:
    """What costs much less than these parts, and how much; "" where nothing does."""
    chosen = decomposition.chosen
    if better is None or chosen is None:
        return ""
    figures = [f"leaves {better.row.cost_mm2:.0f} mm2 of scars instead of {chosen.cost_mm2:.0f}"]
    if better.row.time_s is not None and chosen.time_s is not None:
        figures.append(f"takes {minutes(better.row.time_s)} instead of {minutes(chosen.time_s)}")
    return f"{_lying(better)} in one piece it {' and '.join(figures)}"


def in_parts(count: int) -> str:
    """So many parts in words."""
    return "in one piece" if count == 1 else f"in {count} parts"


def _advised(decomposition: Decomposition, profile: Profile) -> FrontRow | None:
    """The row that was chosen, where a person chose it the one that costs least; None where there is no front."""
    chosen, front = decomposition.chosen, decomposition.front
    if chosen is None or chosen.reason not in (ASKED, BY_PLAN):
        return chosen
    return front[choose(front, price_of_second_mm2(profile), profile.search.most_longer).place]


def _without_front(decomposition: Decomposition) -> list[FrontRow]:
    """The rows of parts that come from no search."""
    whole = FrontRow((), decomposition.risky_area_mm2, 0.0, decomposition.risky_area_mm2)
    planes = tuple(part.base for part in decomposition.parts[1:])
    parts = FrontRow(planes, decomposition.residual_area_mm2, 0.0, decomposition.residual_area_mm2)
    return [whole, parts] if planes else [whole]


def _lying(way: OtherWay) -> str:
    side, turns = side_in_words(way.orientation), in_words(way.orientation)
    return f"{side} ({turns})" if side else turns


def _ways_table(ways: Sequence[tuple[str, FrontRow]]) -> str:
    """Each way with what needs support then, how much less that is than in the first one, its seams, time and filament."""
    first_mm2 = ways[0][1].support_area_mm2
    rows = [["print it", "support mm2", "less", "seams mm", "about", "filament m"]]
    for number, (name, row) in enumerate(ways):
        less = 1.0 - row.support_area_mm2 / first_mm2 if first_mm2 > 0.0 else 0.0
        share = f"{round(100 * less, 1) + 0.0:.1f} %" if number else ""
        rows.append([name, f"{max(row.support_area_mm2, 0.0):.1f}", share, f"{row.seam_mm:.0f}", *estimates(row)])
    return table(rows)
