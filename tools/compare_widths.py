"""Search many models at several beam widths and compare them (the paper's Fig. 7).

    python tools/compare_widths.py FOLDER --out FILE.csv [--widths 1,2,10] [--methods best,published] [--paper-terms]
                                   [--rankers classic,learned] [--set KEY=VALUE ...] [--every N] [--limit FACES] [--only TEXT]
                                   [--faces N] [--side test --manifest FILE.csv]
    python tools/compare_widths.py --out FILE.csv --summary

FOLDER holds models as npz (vertices in mm and faces). One line of FILE.csv is one search, written as soon as it is done; lines
that are there already are not searched again, so an interrupted run goes on where it stopped, and runs with other settings
(told apart by the column `settings`) may share the file. --summary prints the tables and searches nothing. --paper-terms:
seams cost nothing, faces on the platform count as risky, head and axes do not limit (`search.objective=risky`,
`search.count_platform_faces=true`, `search.clearance=false`). --faces: larger models are made coarser first; --side: only models
whose sources are on one side of the split of mdp.learning.sources, test: those that no training saw.
J(1) in the tables is J at the least width there is. Where there are two rankers, a table of both follows: without the faces on
the platform, which no cut can save, how much of what a wider plain beam wins a learned one wins, and in how much time.
"""

import argparse
import csv
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np

from mdp.learning.collection.models import coarser, read_model
from mdp.learning.collection.task import PAPER_TERMS
from mdp.learning.sources import Side, read_sources, side
from mdp.mesh import Floats, Mesh
from mdp.model_file import locate
from mdp.overhang import risky_upright, standing
from mdp.ranking.ranker import CLASSIC
from mdp.read import read_mesh
from mdp.search.search import decompose
from profiles.errors import MeshError
from profiles.profile import Profile, load

Key = tuple[str, str, str, int, str]
EQUAL = 1e-6  # shares of the risky area that differ less are a tie
RESAMPLES = 10_000


@dataclass(frozen=True)
class Row:
    """One search: J (the cost, where seams cost something) and its share of what printing straight up leaves risky, or what went
    wrong. core_s: processor time; floor: share of the faces on the platform that count as risky."""

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
    ranker: str = CLASSIC
    floor: float = 0.0

    @property
    def key(self) -> Key:
        """What tells the searches of a file apart."""
        return self.mesh, self.settings, self.method, self.width, self.ranker


def main(arguments: Sequence[str] | None = None) -> None:
    """Search what is missing in the file, or print its tables."""
    parser = argparse.ArgumentParser(description="compare beam widths over many models")
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--summary", action="store_true")
    parser.add_argument("--widths", default="1,2,10")
    parser.add_argument("--methods", default="best")
    parser.add_argument("--rankers", default=CLASSIC)
    parser.add_argument("--faces", type=int, default=None, help="models with more faces are made coarser")
    parser.add_argument("--side", choices=list(Side), default=None, help="only models on one side of the split by source")
    parser.add_argument("--fold", type=int, default=0, help="which split by source")
    parser.add_argument("--manifest", type=Path, default=None, help="id, source_repo and source_path of the models")
    parser.add_argument("--paper-terms", action="store_true")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--every", type=int, default=1, help="every N-th model by name")
    parser.add_argument("--limit", type=int, default=None, help="the most faces of a model")
    parser.add_argument("--only", default="", help="only models whose name has this in it")
    options = parser.parse_args(arguments)
    if not options.summary:
        if options.folder is None or not options.folder.is_dir():
            parser.error(f"FOLDER is {options.folder}: a folder of npz files is needed")
        if options.side is not None and options.manifest is None:
            parser.error("--side needs --manifest, which tells where the models come from")
        _run(options)
    print("\n\n".join(summary(read(options.out))))


def _run(options: argparse.Namespace) -> None:
    settings = [*(PAPER_TERMS if options.paper_terms else ()), *options.set]
    done = {row.key for row in read(options.out)}
    with options.out.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
        if file.tell() == 0:
            writer.writeheader()
        for path in _models(options):
            kinds = product(options.methods.split(","), _widths(options.widths), options.rankers.split(","))
            wanted = [(path.stem, " ".join(settings), *kind) for kind in kinds]
            for row in rows(path, [key for key in wanted if key not in done], options.limit, options.faces):
                writer.writerow(asdict(row))
                file.flush()
                print(
                    row.mesh, row.method, row.width, row.ranker, f"{row.share:.4f} {row.core_s:.1f} s", row.error, file=sys.stderr
                )


def _models(options: argparse.Namespace) -> list[Path]:
    """The models that are asked for."""
    paths = [path for path in sorted(options.folder.glob("*.npz"))[:: options.every] if options.only in path.stem]
    if options.side is None:
        return paths
    sources = read_sources(options.manifest)
    return [path for path in paths if path.stem in sources and side(sources[path.stem], options.fold) == options.side]


def _widths(text: str) -> list[int]:
    return sorted(int(width) for width in text.split(","))


def rows(path: Path, missing: Sequence[Key], limit: int | None, most_faces: int | None) -> Iterator[Row]:
    """The searches of one model that are missing."""
    if not missing:
        return
    try:
        mesh = read_model(path)
    except MeshError as error:
        for name, settings, method, width, ranker in missing:
            yield Row(name, settings, method, width, 0, 0.0, 0.0, 0.0, 0, 0.0, 0.0, 0, f"MeshError: {error}", ranker)
        return
    if limit is not None and len(mesh.faces) > limit:
        return
    mesh = mesh if most_faces is None else coarser(mesh, most_faces)
    for key in missing:
        _warm_up(key[1], key[-1])
    for key in missing:
        yield searched(key, mesh)


@cache
def _warm_up(settings: str, ranker: str) -> None:
    """Load the kernels and the ranker once, before anything is timed."""
    tree, _ = read_mesh(locate("demo:tree"))
    decompose(tree, "tree", load(settings=(*settings.split(), "search.directions=50")), ranker=ranker)


def searched(key: Key, mesh: Mesh) -> Row:
    """One search, its failure included."""
    name, settings, method, width, ranker = key
    profile = load(settings=(*settings.split(), f"search.method={method}", f"search.beam_width={width}"))
    core, wall = time.process_time(), time.perf_counter()
    search = (name, settings, method, width, len(mesh.faces))
    try:
        result = decompose(mesh, name, profile, ranker=ranker)
    except Exception as error:  # noqa: BLE001 - whatever fails is what the table counts
        spent = (time.process_time() - core, time.perf_counter() - wall)
        return Row(*search, 0.0, 0.0, 1.0, 0, *spent, 0, f"{type(error).__name__}: {error}", ranker)
    spent = (time.process_time() - core, time.perf_counter() - wall)
    if result.risky_area_mm2 <= 0.0:
        return Row(*search, 0.0, 0.0, 0.0, 1, *spent, result.candidates_evaluated, "", ranker)
    cost_mm2 = min(row.cost_mm2 for row in result.front) if profile.search.objective == "scar" else result.residual_area_mm2
    share, floor = cost_mm2 / result.risky_area_mm2, floor_mm2(mesh, profile) / result.risky_area_mm2
    return Row(
        *search,
        result.risky_area_mm2,
        cost_mm2,
        share,
        len(result.parts),
        *spent,
        result.candidates_evaluated,
        "",
        ranker,
        floor,
    )


def floor_mm2(mesh: Mesh, profile: Profile) -> float:
    """Area of the faces on the platform, where they count as risky."""
    if not profile.search.count_platform_faces:
        return 0.0
    risky = risky_upright(mesh, profile.process.self_supporting_angle_deg, count_platform_faces=True)
    return float(mesh.areas_mm2[risky & standing(mesh)].sum())


def read(path: Path) -> list[Row]:
    """The lines of a file; none when there is no such file."""
    if not path.exists():
        return []
    kinds: dict[str, Callable[[str], Any]] = get_type_hints(Row)
    with path.open(newline="", encoding="utf-8") as file:
        return [Row(**{key: kinds[key](value) for key, value in line.items()}) for line in csv.DictReader(file)]


def summary(records: Sequence[Row]) -> Iterator[str]:
    """A table in Markdown for each of the settings, then what failed."""
    for settings in dict.fromkeys(row.settings for row in records):
        here = [row for row in records if row.settings == settings]
        yield table([row for row in here if row.ranker == CLASSIC], settings)
        for method in sorted({row.method for row in here if row.ranker != CLASSIC}):
            yield rankers_table([row for row in here if row.method == method], f"{settings or 'default settings'}, {method}")
    failed = [f"- {row.mesh}, {row.method}, width {row.width}: {row.error}" for row in records if row.error]
    yield "\n".join([f"{len(failed)} of {len(records)} searches failed", *failed])


HEADS = (
    "method | B | models | mean J, share | mean J, mm2 | J(B) / J(1), mean of models | 95 % | J(B) / J(1) of the mean J"
    " | better, equal, worse than the next narrower | worse | mean J / published | better, equal, worse than published"
    " | parts | core s | wall s"
)


def table(records: Sequence[Row], settings: str) -> str:
    """One row a method and width, over the models with a risky face for which all of them were searched without failure."""
    shares = _by_search(records)
    models = sorted(set.intersection(*(set(by_mesh) for by_mesh in shares.values()))) if shares else []
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


def _by_search(records: Sequence[Row]) -> dict[tuple[str, int], dict[str, Row]]:
    searches: dict[tuple[str, int], dict[str, Row]] = {}
    for row in records:
        by_mesh = searches.setdefault((row.method, row.width), {})
        if not row.error and row.risky_mm2 > 0:
            by_mesh[row.mesh] = row
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


RANKER_HEADS = (
    "ranker | B | J without the floor | of plain B = 1 | of what plain 2 takes off plain 1"
    " | of the gap from plain 2 to the widest | core time, of plain B = 1 | of plain 10"
    " | worse than plain by > 1 % of J | better by > 1 %"
)
MORE = 0.01  # of J: a model is worse or better


def rankers_table(records: Sequence[Row], title: str) -> str:
    """One row a ranker and width, over the models with a risky face for which all of them were searched without failure."""
    searches: dict[tuple[str, int], dict[str, Row]] = {}
    for row in records:
        by_mesh = searches.setdefault((row.ranker, row.width), {})
        if not row.error and row.risky_mm2 > 0:
            by_mesh[row.mesh] = row
    models = sorted(set.intersection(*(set(by_mesh) for by_mesh in searches.values())))
    lines = [f"{title}, {len(models)} models", "", f"| {RANKER_HEADS} |", "|" + "---|" * (RANKER_HEADS.count("|") + 1)]
    plain = {width: [by_mesh[name] for name in models] for (ranker, width), by_mesh in searches.items() if ranker == CLASSIC}
    for ranker, width in sorted(searches, key=lambda key: (key[1], key[0])):
        here = [searches[ranker, width][name] for name in models]
        lines.append(f"| {ranker} | {width} | {' | '.join(_ranker_cells(here, plain, width))} |")
    return "\n".join(lines)


def _ranker_cells(here: list[Row], plain: dict[int, list[Row]], width: int) -> list[str]:
    costs = {number: _free(rows) for number, rows in plain.items()}
    means = {number: float(shares.mean()) for number, shares in costs.items()}
    own, widest = _free(here), max(plain, default=0)

    def of_gap(wide: int, narrow: int) -> str:
        known = wide in means and narrow in means and means[narrow] - means[wide] > EQUAL
        return f"{(means[narrow] - own.mean()) / (means[narrow] - means[wide]):.0%}" if known else "-"

    def of_time(number: int) -> str:
        return f"{_column(here, 'core_s').sum() / _column(plain[number], 'core_s').sum():.2f}" if number in plain else "-"

    first = f"{own.mean() / means[1]:.4f}" if 1 in means else "-"
    cells = [f"{own.mean():.4f}", first, of_gap(2, 1), of_gap(widest, 2), of_time(1), of_time(10)]
    if width not in costs:
        return [*cells, "-", "-"]
    equal = costs[width]
    worse, better = own > (1.0 + MORE) * equal + EQUAL, own < (1.0 - MORE) * equal - EQUAL
    return [*cells, f"{worse.mean():.1%}", f"{better.mean():.1%}"]


def _free(records: Sequence[Row]) -> Floats:
    """J without the floor, shares of what is risky straight up."""
    return np.array([row.share - row.floor for row in records])


def _column(records: Sequence[Row], name: str) -> Floats:
    return np.array([getattr(row, name) for row in records], dtype=np.float64)


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
