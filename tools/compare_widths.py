"""Search many models at several beam widths and compare them (the paper's Fig. 7).

    python tools/compare_widths.py FOLDER --out FILE.csv [--widths 1,2,10] [--methods best,published] [--paper-terms]
                                   [--set KEY=VALUE ...] [--every N] [--limit FACES] [--only TEXT]
    python tools/compare_widths.py --out FILE.csv --summary

FOLDER holds models as npz (vertices in mm and faces). One line of FILE.csv is one search, written as soon as it is done; lines
that are there already are not searched again, so an interrupted run goes on where it stopped, and runs with other settings
(told apart by the column `settings`) may share the file. --summary prints the tables and searches nothing. --paper-terms:
seams cost nothing, faces on the platform count as risky, head and axes do not limit (`search.objective=risky`,
`search.count_platform_faces=true`, `search.clearance=false`).
J(1) in the tables is J at the least width there is.
"""

import argparse
import csv
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from mdp.learning.collection.models import read_model
from mdp.learning.collection.task import PAPER_TERMS
from mdp.mesh import Floats, Mesh
from mdp.search.search import decompose
from profiles.errors import MeshError
from profiles.profile import Profile, load

EQUAL = 1e-6  # shares of the risky area that differ less are a tie
RESAMPLES = 10_000


@dataclass(frozen=True)
class Row:
    """One search: J and its share of what printing straight up leaves risky, or what went wrong. core_s: processor time."""

    mesh: str
    settings: str
    method: str
    width: int
    faces: int
    risky_mm2: float
    residual_mm2: float
    share: float
    parts: int
    core_s: float
    wall_s: float
    candidates: int
    error: str

    @property
    def key(self) -> tuple[str, str, str, int]:
        """What tells the searches of a file apart."""
        return self.mesh, self.settings, self.method, self.width


def main(arguments: Sequence[str] | None = None) -> None:
    """Search what is missing in the file, or print its tables."""
    parser = argparse.ArgumentParser(description="compare beam widths over many models")
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--summary", action="store_true")
    parser.add_argument("--widths", default="1,2,10")
    parser.add_argument("--methods", default="best")
    parser.add_argument("--paper-terms", action="store_true")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--every", type=int, default=1, help="every N-th model by name")
    parser.add_argument("--limit", type=int, default=None, help="only models of at most so many faces")
    parser.add_argument("--only", default="", help="only models whose name has this in it")
    options = parser.parse_args(arguments)
    if not options.summary:
        if options.folder is None or not options.folder.is_dir():
            parser.error(f"FOLDER is {options.folder}: a folder of npz files is needed")
        _run(options)
    print("\n\n".join(summary(read(options.out))))


def _run(options: argparse.Namespace) -> None:
    settings = [*(PAPER_TERMS if options.paper_terms else ()), *options.set]
    done = {row.key for row in read(options.out)}
    with options.out.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
        if file.tell() == 0:
            writer.writeheader()
        for path in sorted(options.folder.glob("*.npz"))[:: options.every]:
            if options.only not in path.stem:
                continue
            for row in rows(path, settings, options.methods.split(","), _widths(options.widths), options.limit, done):
                writer.writerow(asdict(row))
                file.flush()
                print(row.mesh, row.method, row.width, f"{row.share:.4f} {row.core_s:.1f} s", row.error, file=sys.stderr)


def _widths(text: str) -> list[int]:
    return sorted(int(width) for width in text.split(","))


def rows(
    path: Path,
    settings: Sequence[str],
    methods: Sequence[str],
    widths: Sequence[int],
    limit: int | None,
    done: set[tuple[str, str, str, int]],
) -> Iterator[Row]:
    """The searches of one model that are not done."""
    named = " ".join(settings)
    missing = [(m, w) for m in methods for w in widths if (path.stem, named, m, w) not in done]
    if not missing:
        return
    try:
        mesh = read_model(path)
    except MeshError as error:
        for method, width in missing:
            yield Row(path.stem, named, method, width, 0, 0.0, 0.0, 0.0, 0, 0.0, 0.0, 0, f"MeshError: {error}")
        return
    if limit is not None and len(mesh.faces) > limit:
        return
    for method, width in missing:
        profile = load(settings=(*settings, f"search.method={method}", f"search.beam_width={width}"))
        yield searched(path.stem, named, mesh, profile)


def searched(name: str, settings: str, mesh: Mesh, profile: Profile) -> Row:
    """One search, its failure included."""
    core, wall = time.process_time(), time.perf_counter()
    search = (name, settings, profile.search.method, profile.search.beam_width, len(mesh.faces))
    try:
        found = decompose(mesh, name, profile)
    except Exception as error:  # noqa: BLE001 - whatever fails is what the table counts
        spent = (time.process_time() - core, time.perf_counter() - wall)
        return Row(*search, 0.0, 0.0, 1.0, 0, *spent, 0, f"{type(error).__name__}: {error}")
    spent = (time.process_time() - core, time.perf_counter() - wall)
    areas = (found.risky_area_mm2, found.residual_area_mm2, 1.0 - found.reduction if found.risky_area_mm2 > 0 else 0.0)
    return Row(*search, *areas, len(found.parts), *spent, found.candidates_evaluated, "")


def read(path: Path) -> list[Row]:
    """The lines of a file; none when there is no such file."""
    if not path.exists():
        return []
    kinds: dict[str, Callable[[str], Any]] = get_type_hints(Row)
    with path.open(newline="", encoding="utf-8") as file:
        return [Row(**{key: kinds[key](value) for key, value in line.items()}) for line in csv.DictReader(file)]


def summary(found: Sequence[Row]) -> Iterator[str]:
    """A table in Markdown for each of the settings, then what failed."""
    for settings in dict.fromkeys(row.settings for row in found):
        yield table([row for row in found if row.settings == settings], settings)
    failed = [f"- {row.mesh}, {row.method}, width {row.width}: {row.error}" for row in found if row.error]
    yield "\n".join([f"{len(failed)} of {len(found)} searches failed", *failed])


HEADS = (
    "method | B | models | mean J, share | mean J, mm2 | J(B) / J(1), mean of models | 95 % | J(B) / J(1) of the mean J"
    " | better, equal, worse than the next narrower | worse | mean J / published | better, equal, worse than published"
    " | parts | core s | wall s"
)


def table(found: Sequence[Row], settings: str) -> str:
    """One row a method and width, over the models with a risky face for which all of them were searched without failure."""
    shares = _by_search(found)
    models = sorted(set.intersection(*(set(each) for each in shares.values()))) if shares else []
    count = HEADS.count("|") + 1
    lines = [f"{settings or 'default settings'}, {len(models)} models", "", f"| {HEADS} |", "|" + "---|" * count]
    for method, width in sorted(shares):
        here = [shares[method, width][name] for name in models]
        narrower = [w for m, w in shares if m == method and w < width]
        before = [shares[method, max(narrower)][name] for name in models] if narrower else None
        first = [shares[method, min((*narrower, width))][name] for name in models]
        rival = [shares["published", width][name] for name in models] if ("published", width) in shares else None
        lines.append(f"| {method} | {width} | {len(models)} | {' | '.join(_cells(here, first, before, rival))} |")
    return "\n".join(lines)


def _by_search(found: Sequence[Row]) -> dict[tuple[str, int], dict[str, Row]]:
    searches: dict[tuple[str, int], dict[str, Row]] = {}
    for row in found:
        each = searches.setdefault((row.method, row.width), {})
        if not row.error and row.risky_mm2 > 0:
            each[row.mesh] = row
    return searches


def _cells(here: list[Row], first: list[Row], before: list[Row] | None, rival: list[Row] | None) -> list[str]:
    if not here:
        return ["-"] * (HEADS.count("|") - 2)
    share, mm2 = _column(here, "share"), _column(here, "residual_mm2")
    ratio = ratios(share, _column(first, "share"))
    low, high = interval(ratio)
    cells = [f"{share.mean():.4f}", f"{mm2.mean():.1f}", f"{ratio.mean():.4f}", f"{low:.4f} to {high:.4f}"]
    cells.append(f"{ratios(mm2.mean(keepdims=True), _column(first, 'residual_mm2').mean(keepdims=True))[0]:.4f}")
    better, equal, worse = record(share, _column(before, "share")) if before else (0, 0, 0)
    cells += [f"{better}, {equal}, {worse}", f"{worse / len(here):.1%}"] if before else ["-", "-"]
    if rival:
        theirs = _column(rival, "share")
        cells += [f"{ratios(share.mean(keepdims=True), theirs.mean(keepdims=True))[0]:.4f}"]
        cells.append(", ".join(str(many) for many in record(share, theirs)))
    else:
        cells += ["-", "-"]
    sums = [_column(here, name).sum() for name in ("core_s", "wall_s")]
    return [*cells, f"{_column(here, 'parts').mean():.1f}", *(f"{total:.0f}" for total in sums)]


def _column(found: Sequence[Row], name: str) -> Floats:
    return np.array([getattr(row, name) for row in found], dtype=np.float64)


def ratios(values: Floats, others: Floats) -> Floats:
    """values / others, where two equal ones, zeros included, are 1."""
    same = np.abs(values - others) < EQUAL
    return np.where(same, 1.0, values / np.where(same, 1.0, np.maximum(others, EQUAL)))


def record(values: Floats, others: Floats) -> tuple[int, int, int]:
    """How many of the values are less than the others (better), equal, and more (worse)."""
    difference = values - others
    return int((difference <= -EQUAL).sum()), int((np.abs(difference) < EQUAL).sum()), int((difference >= EQUAL).sum())


def interval(values: Floats) -> tuple[float, float]:
    """95 % interval of the mean, by resampling the models."""
    rng = np.random.default_rng(0)
    means = np.array([values[rng.integers(0, len(values), len(values))].mean() for _ in range(RESAMPLES)])
    return float(np.quantile(means, 0.025)), float(np.quantile(means, 0.975))


if __name__ == "__main__":
    main()
