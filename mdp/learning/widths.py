"""Widths: results of whole searches at several beam widths, plain and learned (Fig. 7 of the 2020 paper).

The searches are rows of the table that tools/campaigns/widths.py writes. Plain is the ranking of the paper. J is the remaining
risky area as a share of the risky area of printing straight up; if seams and stair-stepping have a cost, the share of the cost.
"""

import csv
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from mdp.learning.command import table as markdown
from mdp.mesh import Floats, Ints
from profiles.errors import UserError

NEEDED = ("mesh", "settings", "method", "width", "share", "core_s")
CLASSIC = "classic"
NOTHING_COMMON = "no model in it was searched with every ranker at every width, or none meets --least-removed"
RESAMPLES = 10_000
MORE = 0.01  # share of J by which a model must differ from a plain beam of equal width to count as worse or better
HEADS = (
    *("ranker", "B", "mean J", "of plain B = 1", "95 %", "of the gap from plain 2 to the best plain width", "95 %"),
    *("core time, of the widest plain beam", "worse than plain by > 1 %", "better by > 1 %"),
)

Kind = tuple[str, int]  # ranker and width


@dataclass(frozen=True)
class TimedSearch:
    """One search of the table: its J (share) and its processor time."""

    mesh: str
    settings: str
    method: str
    ranker: str
    width: int
    share: float
    core_s: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """All searches with one method and its settings, over the n models for which the set of searches is complete.

    shares, core_s: (n,) for each ranker and width, plain ones first, by ascending width.
    """

    method: str
    settings: str
    models: tuple[str, ...]
    shares: Mapping[Kind, Floats]
    core_s: Mapping[Kind, Floats]

    @property
    def plain_widths(self) -> list[int]:
        """The beam widths of the plain ranking."""
        return [width for ranker, width in self.shares if ranker == CLASSIC]


def read_searches(table: Path) -> list[TimedSearch]:
    """The searches that did not fail, of models with risky faces; raises UserError for any other file."""
    try:
        with table.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            missing = [name for name in NEEDED if name not in (reader.fieldnames or ())]
            rows = list(reader)
        if missing:
            raise UserError(f"table {table} has no column {', '.join(missing)}; {', '.join(NEEDED)} are needed")
        return [_search(row) for row in rows if not row.get("error") and float(row.get("risky_mm2") or 1.0) > 0.0]
    except (OSError, UnicodeDecodeError, ValueError, TypeError, csv.Error) as error:
        raise UserError(f"table {table} cannot be read ({error})") from None


def _search(row: dict[str, str]) -> TimedSearch:
    if None in row or None in row.values():
        raise ValueError(f"the line of {row['mesh']} has not as many values as there are columns")
    numbers = int(row["width"]), float(row["share"]), float(row["core_s"])
    if not all(map(isfinite, numbers)):
        raise ValueError(f"{row['mesh']}, width {row['width']}: share is {row['share']}, core_s {row['core_s']}")
    ranker = Path(row.get("ranker") or CLASSIC).stem  # files with equal names are one ranker, trained for different folds
    return TimedSearch(row["mesh"], row["settings"], row["method"], ranker, *numbers)


def compare(searches: Sequence[TimedSearch], least_removed: float = 0.0) -> list[Comparison]:
    """A comparison for every method and its settings, in the order of the table.

    A comparison is left out if no model was searched with every ranker at all of its widths.

    least_removed: only models from which the widest plain beam removes at least this share of the risky area; this choice does
    not depend on a learned ranker.
    """
    kinds = dict.fromkeys((search.method, search.settings) for search in searches)
    found = (_comparison(kind, [s for s in searches if (s.method, s.settings) == kind], least_removed) for kind in kinds)
    return [comparison for comparison in found if comparison.models]


def _comparison(method: tuple[str, str], searches: Sequence[TimedSearch], least_removed: float) -> Comparison:
    known = {(search.ranker, search.width, search.mesh): search for search in searches}
    if len(known) < len(searches):
        (ranker, width, mesh), _ = Counter((search.ranker, search.width, search.mesh) for search in searches).most_common(1)[0]
        raise UserError(f"{mesh} was searched twice with {ranker} at width {width}: rankers need files of different names")
    kinds = sorted({(search.ranker, search.width) for search in searches}, key=lambda kind: (kind[0] != CLASSIC, *kind))
    models = [mesh for mesh in sorted({search.mesh for search in searches}) if all((*kind, mesh) in known for kind in kinds)]
    widest = max((width for ranker, width in kinds if ranker == CLASSIC), default=None)
    if widest is not None:
        models = [mesh for mesh in models if known[CLASSIC, widest, mesh].share <= 1.0 - least_removed]
    shares = {kind: np.array([known[*kind, mesh].share for mesh in models]) for kind in kinds}
    core_s = {kind: np.array([known[*kind, mesh].core_s for mesh in models]) for kind in kinds}
    return Comparison(*method, tuple(models), shares, core_s)


def table(comparison: Comparison) -> str:
    """A table in Markdown, one row per ranker and width; intervals by resampling the models."""
    title = f"{comparison.method}, {comparison.settings or 'default settings'}: {len(comparison.models)} models"
    drawn = np.random.default_rng(0).integers(0, len(comparison.models), (RESAMPLES, len(comparison.models)), np.int32)
    kinds = sorted(comparison.shares, key=lambda kind: (kind[1], kind[0]))
    lines = [(ranker, str(width), *_cells(comparison, (ranker, width), drawn)) for ranker, width in kinds]
    return f"{title}\n\n{markdown(HEADS, lines, numbers=True)}"


def _cells(comparison: Comparison, kind: Kind, drawn: Ints) -> list[str]:
    shares, plain = comparison.shares, comparison.plain_widths
    own, equal = shares[kind], shares.get((CLASSIC, kind[1]))
    cells = [f"{own.mean():.4f}", "-", "-", "-", "-", "-", "-", "-"]
    if 1 in plain:
        cells[1:3] = _with_interval(lambda rows: own[rows].mean(axis=-1) / shares[CLASSIC, 1][rows].mean(axis=-1), drawn, ".4f")
    if 2 in plain and best_plain(comparison) != 2:
        two, best = shares[CLASSIC, 2], shares[CLASSIC, best_plain(comparison)]

        def closed(rows: Ints) -> Floats:
            gap: Floats = (two[rows].mean(axis=-1) - own[rows].mean(axis=-1)) / (two[rows] - best[rows]).mean(axis=-1)
            return gap

        cells[3:5] = _with_interval(closed, drawn, ".0%")
    if plain:
        widest_s = comparison.core_s[CLASSIC, plain[-1]].sum()
        cells[5] = f"{comparison.core_s[kind].sum() / widest_s:.2f}" if widest_s > 0.0 else "-"
    if equal is not None and kind[0] != CLASSIC:
        cells[6:] = [f"{(own > (1.0 + MORE) * equal).mean():.1%}", f"{(own < (1.0 - MORE) * equal).mean():.1%}"]
    return cells


def best_plain(comparison: Comparison) -> int:
    """The plain width with the least mean J."""
    return min(comparison.plain_widths, key=lambda width: float(comparison.shares[CLASSIC, width].mean()))


def _with_interval(measure: Callable[[Ints], Floats], drawn: Ints, form: str) -> list[str]:
    """A figure over all models, and its 95 % interval over those draws that give a number; "-" if undefined."""
    with np.errstate(divide="ignore", invalid="ignore"):
        whole, draws = float(measure(np.arange(drawn.shape[1], dtype=np.int32))), measure(drawn)
    known = draws[np.isfinite(draws)]
    if not np.isfinite(whole) or not len(known):
        return ["-", "-"]
    low, high = np.quantile(known, [0.025, 0.975])
    return [f"{whole:{form}}", f"{low:{form}} to {high:{form}}"]
