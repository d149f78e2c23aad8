"""Search many models at several beam widths and compare them (the 2020 paper's Fig. 7).

    python tools/campaigns/widths.py FOLDER --out FILE.csv [--widths 1,2,10] [--rankers classic,learned] [--paper-terms] ...
    python tools/campaigns/widths.py --out FILE.csv --summary [--least-removed SHARE]

FOLDER holds models as npz (vertices in mm and faces). One line of FILE.csv is one search, written as soon as it is done; existing
lines are not searched again, and runs with other settings may share the file. --paper-terms: seams are free, faces on the build
plate are risky, head and axes set no limits. --faces: larger models are simplified first. --side: only models whose sources are
on one side of the split of mdp.learning.lists. --least-removed: tables of the models of which the widest plain beam removes at
least this fraction of the risky area; on the others the width makes no difference.
"""

import argparse
import shlex
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path

from machine.pipeline.output import check_writable
from mdp.batch.rows import append_row, read_rows, write_rows
from mdp.learning.collection import PAPER_TERMS
from mdp.learning.command import Parser, check_range, run
from mdp.learning.lists import FOLDS, Side, read_sources, side
from mdp.learning.models import coarser, model_files, read_model
from mdp.learning.widths import NOTHING_COMMON, compare, read_searches, table
from mdp.mesh import Mesh
from mdp.model_file import locate
from mdp.ranking.ranker import CLASSIC, ranker_named
from mdp.read import read_mesh
from mdp.search.search import SearchRequest, decompose
from profiles.errors import MeshError, UserError
from profiles.profile import Profile, load
from tools.bench.harness import timed


@dataclass(frozen=True)
class Row:
    """One search: J (the cost, if seams have a cost) and its ratio to the risky area of printing straight up, or its error.
    core_s: processor time."""

    mesh: str
    settings: str
    method: str
    width: int
    faces: int = 0
    risky_mm2: float = 0.0
    residual_mm2: float = 0.0
    share: float = 0.0
    parts: int = 0
    core_s: float = 0.0
    wall_s: float = 0.0
    candidates: int = 0
    error: str = ""
    ranker: str = CLASSIC

    @property
    def key(self) -> tuple[str, str, str, int, str]:
        """Key of a search in a file."""
        return self.mesh, self.settings, self.method, self.width, self.ranker


def main(arguments: Sequence[str] | None = None) -> int:
    """Search what is missing in the file, or print its tables; returns the exit code."""
    return run(_main, arguments, "run the same command again to continue")


def _main(arguments: Sequence[str] | None) -> None:
    parser = Parser(prog="tools/campaigns/widths.py", description="compare beam widths over many models")
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--summary", action="store_true")
    parser.add_argument("--least-removed", type=float, default=0.0, metavar="SHARE")
    parser.add_argument("--widths", type=_widths, default="1,2,10")
    parser.add_argument("--methods", default="best")
    parser.add_argument("--rankers", default=CLASSIC)
    parser.add_argument("--faces", type=int)
    parser.add_argument("--side", choices=list(Side))
    parser.add_argument("--fold", type=int, choices=range(FOLDS), default=0)
    parser.add_argument("--manifest", type=Path)
    parser.add_argument("--paper-terms", action="store_true")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--only", default="")
    options = parser.parse_args(arguments)
    check_range(options, "least_removed", 0.0, 1.0)
    check_range(options, "every", 1)
    check_range(options, "faces", 4)
    if not options.summary:
        if options.folder is None:
            parser.error("FOLDER: a folder of npz files is needed")
        if options.side is not None and options.manifest is None:
            parser.error("--side needs --manifest, which tells where the models come from")
        _search_models(options)
    searches, records = read_searches(options.out), read_rows(options.out, Row)
    failed = [f"- {row.mesh}, {row.method}, width {row.width}: {row.error}" for row in records if row.error]
    print("\n".join([f"{len(failed)} of {len(records)} searches failed", *failed]))
    comparisons = compare(searches, options.least_removed)
    if options.summary and not comparisons:
        raise UserError(f"table {options.out}: {NOTHING_COMMON}")
    for comparison in comparisons:
        print(f"\n{table(comparison)}")


def _widths(text: str) -> list[int]:
    try:
        return sorted(int(width) for width in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: whole numbers between commas are allowed") from None


def _search_models(options: argparse.Namespace) -> None:
    settings = shlex.join([*(PAPER_TERMS if options.paper_terms else ()), *options.set])
    kinds = list(product(options.methods.split(","), options.widths, options.rankers.split(",")))
    for method, width, ranker in kinds:  # errors are reported before anything is written
        _profile(settings, method, width)
        ranker_named(ranker)
    check_writable(options.out)
    models = model_files(options.folder, options.only, options.every)
    if options.side is not None:
        sources = read_sources(options.manifest)
        models = [path for path in models if path.stem in sources and side(sources[path.stem], options.fold) == options.side]
    done = {row.key for row in read_rows(options.out, Row)}
    if not options.out.exists():
        write_rows(options.out, Row, ())
    for path in models:
        wanted = [Row(path.stem, settings, method, width, ranker=ranker) for method, width, ranker in dict.fromkeys(kinds)]
        for row in searched_rows(path, [row for row in wanted if row.key not in done], options.faces):
            append_row(options.out, row)
            print(row.mesh, row.method, row.width, row.ranker, f"{row.share:.4f} {row.core_s:.1f} s", row.error, file=sys.stderr)


def searched_rows(path: Path, missing: Sequence[Row], most_faces: int | None) -> Iterator[Row]:
    """The missing searches of one model."""
    if not missing:
        return
    try:
        mesh = read_model(path)
    except MeshError as error:
        yield from (replace(row, error=f"MeshError: {error}") for row in missing)
        return
    mesh = mesh if most_faces is None else coarser(mesh, most_faces)
    for row in missing:
        _warm_up(row.settings, row.ranker)
    for row in missing:
        yield searched(row, mesh)


@cache
def _warm_up(settings: str, ranker: str) -> None:
    """Load the kernels and the ranker once, before anything is measured."""
    tree, _ = read_mesh(locate("demo:tree"))
    decompose(tree, "tree", load(settings=(*shlex.split(settings), "search.directions=50")), SearchRequest(ranker=ranker))


def _profile(settings: str, method: str, width: int) -> Profile:
    return load(settings=(*shlex.split(settings), f"search.method={method}", f"search.beam_width={width}"))


def searched(row: Row, mesh: Mesh) -> Row:
    """Run one search, including its failure."""
    profile = _profile(row.settings, row.method, row.width)
    row = replace(row, faces=len(mesh.faces))
    try:
        result, used = timed(lambda: decompose(mesh, row.mesh, profile, SearchRequest(ranker=row.ranker)))
    except Exception as error:  # noqa: BLE001 - the table counts every failure
        return replace(row, share=1.0, error=f"{type(error).__name__}: {error}")
    row = replace(row, core_s=used.core_s, wall_s=used.wall_s, parts=1, candidates=result.candidates_evaluated)
    risky_mm2 = result.risky_area_mm2
    if risky_mm2 <= 0.0:
        return row
    cost_mm2 = min(plan.cost_mm2 for plan in result.front) if profile.search.objective == "scar" else result.residual_area_mm2
    return replace(row, risky_mm2=risky_mm2, residual_mm2=cost_mm2, share=cost_mm2 / risky_mm2, parts=len(result.parts))


if __name__ == "__main__":
    sys.exit(main())
