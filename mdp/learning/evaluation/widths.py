"""Widths: what beams of several widths end with, with and without a learned ranker, from the table of tools/compare_widths.py."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from profiles.errors import LearningError

NEEDED = ("mesh", "settings", "method", "width", "share", "core_s")
CLASSIC = "classic"


@dataclass(frozen=True)
class Search:
    """One search of the table: the share of the model's risky area that it left, and its processor time."""

    mesh: str
    settings: str
    method: str
    ranker: str
    width: int
    share: float
    core_s: float


@dataclass(frozen=True)
class Series:
    """A ranker's means over models by rising width: J as share of the risky area, and processor time."""

    ranker: str
    widths: tuple[int, ...]
    share: tuple[float, ...]
    core_s: tuple[float, ...]


@dataclass(frozen=True)
class Comparison:
    """The series of one method and its settings, over the models for which every search of it was made."""

    method: str
    settings: str
    models: int
    series: tuple[Series, ...]


def read_searches(table: Path) -> list[Search]:
    """The searches that did not fail, of models with a risky face; LearningError for a file that is no such table.

    A table without the column `ranker` is of the classic one.
    """
    try:
        with table.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        missing = [name for name in NEEDED if not rows or name not in rows[0]]
        if missing:
            raise LearningError(f"table {table}: has no column {', '.join(missing)}; {', '.join(NEEDED)} are needed")
        return [_search(row) for row in rows if not row.get("error") and float(row.get("risky_mm2") or 1.0) > 0.0]
    except (OSError, UnicodeDecodeError, ValueError, TypeError, csv.Error) as error:
        raise LearningError(f"table {table}: cannot be read ({error})") from None


def _search(row: dict[str, str]) -> Search:
    numbers = int(row["width"]), float(row["share"]), float(row["core_s"])
    return Search(row["mesh"], row["settings"], row["method"], row.get("ranker") or CLASSIC, *numbers)


def compare(searches: Sequence[Search]) -> list[Comparison]:
    """A comparison for every method and its settings, in the order they come; none where no model was searched at all widths."""
    kinds = dict.fromkeys((search.method, search.settings) for search in searches)
    of_kinds = [(kind, [search for search in searches if (search.method, search.settings) == kind]) for kind in kinds]
    comparisons = [_comparison(kind, of_kind) for kind, of_kind in of_kinds]
    return [comparison for comparison in comparisons if comparison.models > 0]


def _comparison(kind: tuple[str, str], searches: Sequence[Search]) -> Comparison:
    known = {(search.ranker, search.width, search.mesh): search for search in searches}
    wanted = sorted({(search.ranker, search.width) for search in searches}, key=lambda pair: (pair[0] != CLASSIC, *pair))
    meshes = [mesh for mesh in sorted({search.mesh for search in searches}) if all((*pair, mesh) in known for pair in wanted)]
    series = []
    for ranker in dict.fromkeys(ranker for ranker, _ in wanted) if meshes else ():
        widths = tuple(width for name, width in wanted if name == ranker)
        of_width = [[known[ranker, width, mesh] for mesh in meshes] for width in widths]
        share = tuple(float(np.mean([search.share for search in searched])) for searched in of_width)
        core_s = tuple(float(np.mean([search.core_s for search in searched])) for searched in of_width)
        series.append(Series(ranker, widths, share, core_s))
    return Comparison(*kind, len(meshes), tuple(series))
