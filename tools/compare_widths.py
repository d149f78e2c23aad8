"""Search many models at several beam widths and compare them (the paper's Fig. 7).

    python tools/compare_widths.py FOLDER --out FILE.csv [--widths 1,2,10] [--methods best,published] [--paper-terms]
                                   [--rankers classic,learned] [--set KEY=VALUE ...] [--every N] [--limit FACES] [--only TEXT]
                                   [--faces N] [--side test --manifest FILE.csv [--fold K]]
    python tools/compare_widths.py --out FILE.csv --summary [--least-removed SHARE]

FOLDER holds models as npz (vertices in mm and faces). One line of FILE.csv is one search, written as soon as it is done; lines
that are there already are not searched again, so an interrupted run goes on where it stopped, and runs with other settings
(told apart by the column `settings`) may share the file. --summary prints the tables and searches nothing. --paper-terms:
seams cost nothing, faces on the platform count as risky, head and axes do not limit (`search.objective=risky`,
`search.count_platform_faces=true`, `search.clearance=false`). --faces: larger models are made coarser first; --side: only models
whose sources are on one side of the split of mdp.learning.lists, test: those that no training saw.
--least-removed: the tables are of the models of which the widest plain beam removes at least this share of the risky area: on the
others the width of the beam makes no difference.
"""

import argparse
import csv
import shlex
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any, TextIO, get_type_hints

from mdp.learning.collection import PAPER_TERMS
from mdp.learning.command import Parser, check_range, run
from mdp.learning.lists import FOLDS, Side, read_sources, side
from mdp.learning.models import coarser, read_model
from mdp.learning.widths import NOTHING_COMMON, compare, read_searches, table
from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.ranking.ranker import CLASSIC, ranker_named
from mdp.read import read_mesh
from mdp.search.search import SearchRequest, decompose
from profiles.errors import MeshError, UserError
from profiles.profile import Profile, load

Key = tuple[str, str, str, int, str]


@dataclass(frozen=True)
class Row:
    """One search: J (the cost, where seams cost something) and its share of what printing straight up leaves risky, or what went
    wrong. core_s: processor time."""

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

    @property
    def key(self) -> Key:
        """What tells the searches of a file apart."""
        return self.mesh, self.settings, self.method, self.width, self.ranker


def main(arguments: Sequence[str] | None = None) -> int:
    """Search what is missing in the file, or print its tables; the exit code."""
    return run(_main, arguments, "run the same command again to continue")


def _main(arguments: Sequence[str] | None) -> None:
    parser = Parser(prog="tools/compare_widths.py", description="compare beam widths over many models")
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--summary", action="store_true")
    parser.add_argument("--least-removed", type=float, default=0.0, metavar="SHARE")
    parser.add_argument("--widths", type=_widths, default="1,2,10")
    parser.add_argument("--methods", default="best")
    parser.add_argument("--rankers", default=CLASSIC)
    parser.add_argument("--faces", type=int, default=None, help="models with more faces are made coarser")
    parser.add_argument("--side", choices=list(Side), default=None, help="only models on one side of the split by source")
    parser.add_argument("--fold", type=int, choices=range(FOLDS), default=0, help="which split by source")
    parser.add_argument("--manifest", type=Path, default=None, help="id, source_repo and source_path of the models")
    parser.add_argument("--paper-terms", action="store_true")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--every", type=int, default=1, help="every N-th model by name")
    parser.add_argument("--limit", type=int, default=None, help="the most faces of a model")
    parser.add_argument("--only", default="", help="only models whose name has this in it")
    options = parser.parse_args(arguments)
    check_range(options, "least_removed", 0.0, 1.0)
    check_range(options, "every", 1)
    check_range(options, "faces", 4)
    check_range(options, "limit", 1)
    if not options.summary:
        if options.folder is None or not options.folder.is_dir():
            parser.error(f"FOLDER is {options.folder}: a folder of npz files is needed")
        if options.side is not None and options.manifest is None:
            parser.error("--side needs --manifest, which tells where the models come from")
        _search_models(options)
    searches, records = read_searches(options.out), read(options.out)
    failed = [f"- {row.mesh}, {row.method}, width {row.width}: {row.error}" for row in records if row.error]
    print("\n".join([f"{len(failed)} of {len(records)} searches failed", *failed]))
    comparisons = compare(searches, options.least_removed)
    if options.summary and not comparisons:
        raise UserError(f"table {options.out}: {NOTHING_COMMON}")
    for comparison in comparisons:
        print(f"\n{table(comparison)}")


def _search_models(options: argparse.Namespace) -> None:
    settings = [*(PAPER_TERMS if options.paper_terms else ()), *options.set]
    methods, rankers = options.methods.split(","), options.rankers.split(",")
    for method, width in product(methods, options.widths):  # errors are reported before anything is written
        _profile(settings, method, width)
    for ranker in rankers:
        ranker_named(ranker)
    done, models = {row.key for row in read(options.out)}, _models(options)
    if not models:
        raise UserError(f"folder {options.folder}: holds no model (*.npz) that is asked for")
    with _opened(options.out) as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
        if file.tell() == 0:
            writer.writeheader()
        for path in models:
            kinds = product(methods, options.widths, rankers)
            wanted = list(dict.fromkeys((path.stem, shlex.join(settings), *kind) for kind in kinds))
            for row in rows(path, [key for key in wanted if key not in done], options.limit, options.faces):
                writer.writerow(asdict(row))
                file.flush()
                print(
                    row.mesh, row.method, row.width, row.ranker, f"{row.share:.4f} {row.core_s:.1f} s", row.error, file=sys.stderr
                )


def _opened(table: Path) -> TextIO:
    try:
        return table.open("a", newline="", encoding="utf-8")
    except OSError as error:
        raise UserError(f"table {table}: cannot be written ({error.strerror})") from None


def _models(options: argparse.Namespace) -> list[Path]:
    """The models that are asked for."""
    paths = [path for path in sorted(options.folder.glob("*.npz"))[:: options.every] if options.only in path.stem]
    if options.side is None:
        return paths
    sources = read_sources(options.manifest)
    return [path for path in paths if path.stem in sources and side(sources[path.stem], options.fold) == options.side]


def _widths(text: str) -> list[int]:
    try:
        return sorted(int(width) for width in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: whole numbers between commas are allowed") from None


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
    decompose(tree, "tree", load(settings=(*shlex.split(settings), "search.directions=50")), SearchRequest(ranker=ranker))


def _profile(settings: Sequence[str], method: str, width: int) -> Profile:
    return load(settings=(*settings, f"search.method={method}", f"search.beam_width={width}"))


def searched(key: Key, mesh: Mesh) -> Row:
    """One search, its failure included."""
    name, settings, method, width, ranker = key
    profile = _profile(shlex.split(settings), method, width)
    core, wall = time.process_time(), time.perf_counter()
    search = (name, settings, method, width, len(mesh.faces))
    try:
        result = decompose(mesh, name, profile, SearchRequest(ranker=ranker))
    except Exception as error:  # noqa: BLE001 - whatever fails is what the table counts
        spent = (time.process_time() - core, time.perf_counter() - wall)
        return Row(*search, 0.0, 0.0, 1.0, 0, *spent, 0, f"{type(error).__name__}: {error}", ranker)
    spent = (time.process_time() - core, time.perf_counter() - wall)
    if result.risky_area_mm2 <= 0.0:
        return Row(*search, 0.0, 0.0, 0.0, 1, *spent, result.candidates_evaluated, "", ranker)
    cost_mm2 = min(row.cost_mm2 for row in result.front) if profile.search.objective == "scar" else result.residual_area_mm2
    return Row(
        *search,
        result.risky_area_mm2,
        cost_mm2,
        cost_mm2 / result.risky_area_mm2,
        len(result.parts),
        *spent,
        result.candidates_evaluated,
        "",
        ranker,
    )


def read(path: Path) -> list[Row]:
    """The lines of a file; none when there is no such file. Raises UserError for a file that is no such table."""
    if not path.exists():
        return []
    kinds: dict[str, Callable[[str], Any]] = get_type_hints(Row)
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file)
            absent = [
                field.name for field in fields(Row) if field.name != "ranker" and field.name not in (reader.fieldnames or ())
            ]
            lines = list(reader)
        if absent and lines:
            raise UserError(f"table {path}: has no column {', '.join(absent)}; this command did not write it")
        return [Row(**{key: kinds[key](value) for key, value in line.items() if key in kinds}) for line in lines]
    except (OSError, UnicodeDecodeError, ValueError, TypeError, csv.Error) as error:
        raise UserError(f"table {path}: cannot be read ({error})") from None


if __name__ == "__main__":
    sys.exit(main())
