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
    kinds = dict.fromkeys((one.method, one.settings) for one in searches)
    made = [_comparison(kind, [one for one in searches if (one.method, one.settings) == kind]) for kind in kinds]
    return [one for one in made if one.models > 0]


def _comparison(kind: tuple[str, str], searches: Sequence[Search]) -> Comparison:
    known = {(one.ranker, one.width, one.mesh): one for one in searches}
    wanted = sorted({(one.ranker, one.width) for one in searches}, key=lambda each: (each[0] != CLASSIC, *each))
    meshes = [mesh for mesh in sorted({one.mesh for one in searches}) if all((*each, mesh) in known for each in wanted)]
    series = []
    for ranker in dict.fromkeys(ranker for ranker, _ in wanted) if meshes else ():
        widths = tuple(width for each, width in wanted if each == ranker)
        of_width = [[known[ranker, width, mesh] for mesh in meshes] for width in widths]
        share = tuple(float(np.mean([one.share for one in each])) for each in of_width)
        series.append(Series(ranker, widths, share, tuple(float(np.mean([one.core_s for one in each])) for each in of_width)))
    return Comparison(*kind, len(meshes), tuple(series))
