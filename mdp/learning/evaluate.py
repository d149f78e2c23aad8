"""Evaluate: rankers and baselines on the lists of models that no training saw, and the pictures of the 2020 paper.

    python -m mdp.learning.evaluate FOLDER [--manifest CSV] [--terms NAME,...] [--ranker FILE.onnx ...] [--without NAME,...] ...
    python -m mdp.learning.evaluate --figure7 TABLE.csv [--pictures DIR]

Prints tables in Markdown. figure8-NAME.png: importance of a ranker's features, and their correlation; figure7.png: J and time
against the beam's width, from the table of tools/compare_widths.py.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from mdp.learning.command import COLUMN_SETS, Parser, add_records, check_range, run, split_names
from mdp.learning.labels import RatedList, followed, rate
from mdp.learning.lists import TrainingList, of_side, read_lists
from mdp.learning.ndcg import Scores, as_searched
from mdp.learning.rankers.baselines import BASELINES, REGRET_BASELINES, Fit
from mdp.learning.sources import Side
from profiles.errors import LearningError

ALL_BASELINES = (*BASELINES, *REGRET_BASELINES)
ALWAYS = ("M2", "M6", "wasted")  # what lines are fitted in
Sides = dict[Side, list[RatedList]]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables and draw the pictures; the exit code."""
    return run(evaluate, arguments, "nothing is kept, it begins anew")


def evaluate(arguments: Sequence[str] | None) -> None:
    """Do what is asked for."""
    options = _options(arguments)
    if options.folder is not None:
        _compare(options)
    if options.figure7 is not None:
        _draw_widths(options.figure7, options.pictures)


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = Parser(prog="python -m mdp.learning.evaluate", description="judge rankers on lists that no training saw")
    add_records(parser, "that baselines learn from; default paper", nargs="?")
    parser.add_argument(
        "--ranker", type=Path, action="append", default=[], metavar="FILE.onnx", help="may be given several times"
    )
    leave = f"baselines to leave out, of {'; '.join(ALL_BASELINES)}"
    parser.add_argument("--without", type=split_names, default=(), metavar="NAME,...", help=leave)
    parser.add_argument("--repeats", type=int, default=10, metavar="K", help="how often each feature is shuffled")
    parser.add_argument("--pictures", type=Path, default=Path(), metavar="DIR", help="where pictures go; here by default")
    parser.add_argument("--figure7", type=Path, metavar="CSV", help="table of tools/compare_widths.py")
    options = parser.parse_args(arguments)
    check_range(options, "repeats", 1, 10_000)
    unknown = [name for name in options.without if name not in ALL_BASELINES]
    if unknown:
        raise LearningError(f"--without {unknown[0]}: is no baseline; {'; '.join(ALL_BASELINES)} are there")
    if options.folder is None and options.figure7 is None:
        raise LearningError("a folder of records or --figure7 is needed; --help shows what is allowed")
    return options


def _compare(options: argparse.Namespace) -> None:
    """Tables of all rankers, then what the features of each given one do."""
    from mdp.learning.evaluation.tables import regret_tables, tables
    from mdp.learning.rankers.exported import read_ranker

    given = {file: read_ranker(file) for file in options.ranker}
    learnt = COLUMN_SETS[options.columns or "paper"]
    columns = tuple(dict.fromkeys([*learnt, *ALWAYS, *(name for ranker in given.values() for name in ranker.columns)]))
    lists = read_lists(options.folder, options.manifest, columns, options.terms)
    cut, known = (_sides(options, some, columns) for some in (lists, followed(lists)))
    rankers: dict[str, Scores] = {f"{ranker.kind}, {file}": as_searched(ranker.scores) for file, ranker in given.items()}
    rankers |= _fitted(BASELINES, options.without, cut, learnt) | _fitted(REGRET_BASELINES, options.without, known, learnt)
    for text in (*tables(rankers, cut[Side.TEST]), *regret_tables(rankers, known[Side.TEST])):
        sys.stdout.write(f"{text}\n\n")
    for file, ranker in given.items():
        picture = options.pictures / f"figure8-{file.stem}.png"
        _analyse(as_searched(ranker.scores), ranker.columns, cut[Side.TEST], options.repeats, picture)


def _sides(options: argparse.Namespace, lists: Sequence[TrainingList], columns: Sequence[str]) -> Sides:
    """The lists of each side that have something to tell apart; LearningError where a side has none."""
    sides = {side: [rated for rated in rate(of_side(lists, side, options.fold), columns) if rated.teaches] for side in Side}
    for side, some in sides.items():
        if not some:
            raise LearningError(f"folder {options.folder}: no list of it is on the side {side}; record models of more sources")
    return sides


def _fitted(baselines: Mapping[str, Fit], without: Sequence[str], lists: Sides, columns: Sequence[str]) -> dict[str, Scores]:
    fitted = {}
    for name, fit in baselines.items():
        if name not in without:
            sys.stderr.write(f"fitting {name}\n")
            fitted[name] = fit(lists[Side.TRAIN], lists[Side.VALIDATION], columns)
    return fitted


def _analyse(scores: Scores, columns: Sequence[str], lists: Sequence[RatedList], repeats: int, file: Path) -> None:
    from mdp.learning.evaluation.analysis import correlation, importance
    from mdp.learning.evaluation.pictures import draw_features, save

    lost = importance(scores, columns, lists, repeats)
    rows = [f"| {name} | {value:.4f} |" for name, value in zip(columns, lost, strict=True)]
    sys.stdout.write("\n".join(["| feature | importance |", "|---|---:|", *rows, ""]))
    save(draw_features(columns, lost, correlation(columns, lists)), file)
    sys.stdout.write(f"\n![importance and correlation]({file})\n")


def _draw_widths(table: Path, folder: Path) -> None:
    from mdp.learning.evaluation.pictures import draw_widths, save
    from mdp.learning.evaluation.widths import compare, read_searches

    comparisons = compare(read_searches(table))
    if not comparisons:
        raise LearningError(f"table {table}: no model of it was searched with every ranker at all its widths")
    save(draw_widths(comparisons), folder / "figure7.png")
    sys.stdout.write(f"![J and time against the beam's width]({folder / 'figure7.png'})\n")


if __name__ == "__main__":
    sys.exit(main())
