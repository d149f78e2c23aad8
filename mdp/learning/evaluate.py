"""Evaluate: rankers and baselines on lists of models that no training saw, and the pictures of the 2020 paper.

    python -m mdp.learning.evaluate FOLDER [--manifest CSV] [--terms NAME,...] [--ranker FILE.onnx ...] [--without NAME,...] ...
    python -m mdp.learning.evaluate --figure7 TABLE.csv [--pictures DIR]

Prints tables in Markdown. figure8-NAME.png: importance of a ranker's features, and their correlation; figure7.png: J and core
time against the beam's width, from the table that tools/compare_widths.py writes.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mdp.learning.baselines import BASELINES
from mdp.learning.command import COLUMN_SETS, Parser, add_records, check_range, run, split_names
from mdp.learning.labels import RatedList, followed, rate
from mdp.learning.lists import of_side, read_lists
from mdp.learning.ndcg import Scores, as_searched
from mdp.learning.sources import Side
from mdp.ranking.network import Network
from profiles.errors import LearningError

ALWAYS = ("M2", "M6")  # what lines are fitted in


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables and draw the pictures; the exit code."""
    return run(evaluate, arguments, "nothing is kept, it begins anew")


def evaluate(arguments: Sequence[str] | None) -> None:
    """Do what is asked for."""
    options = _options(arguments)
    if options.folder is not None:
        _compare(options)
    if options.figure7 is not None:
        _draw_widths(options)


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = Parser(prog="python -m mdp.learning.evaluate", description="judge rankers on lists that no training saw")
    add_records(parser, "that baselines learn from; default paper", nargs="?")
    parser.add_argument(
        "--ranker", type=Path, action="append", default=[], metavar="FILE.onnx", help="may be given several times"
    )
    leave = f"baselines to leave out, of {'; '.join(BASELINES)}"
    parser.add_argument("--without", type=split_names, default=(), metavar="NAME,...", help=leave)
    parser.add_argument("--repeats", type=int, default=10, metavar="K", help="how often each feature is shuffled")
    parser.add_argument("--pictures", type=Path, default=Path(), metavar="DIR", help="where pictures go; here by default")
    parser.add_argument("--figure7", type=Path, metavar="CSV", help="table of tools/compare_widths.py")
    parser.add_argument("--least-removed", type=float, default=0.0, metavar="SHARE", help="only models with that much gain")
    options = parser.parse_args(arguments)
    check_range(options, "repeats", 1, 10_000)
    check_range(options, "least_removed", 0.0, 1.0)
    unknown = [name for name in options.without if name not in BASELINES]
    if unknown:
        raise LearningError(f"--without {unknown[0]}: is no baseline; {'; '.join(BASELINES)} are there")
    if options.folder is None and options.figure7 is None:
        raise LearningError("a folder of records or --figure7 is needed; --help shows what is allowed")
    return options


def _compare(options: argparse.Namespace) -> None:
    """Tables of all rankers, then what the features of each given one do."""
    from mdp.learning.tables import regret_table, tables

    networks = [Network(file) for file in options.ranker]
    learnt = COLUMN_SETS[options.columns or "paper"]
    columns = tuple(dict.fromkeys([*learnt, *ALWAYS, *(name for network in networks for name in network.columns)]))
    lists = read_lists(options.folder, options.manifest, columns, options.terms)
    sides = {side: [rated for rated in rate(of_side(lists, side, options.fold), columns) if rated.teaches] for side in Side}
    for side, some in sides.items():
        if not some:
            raise LearningError(f"folder {options.folder}: no list of it is on the side {side}; record models of more sources")
    rankers = {str(network.file): _scores(network) for network in networks}
    for name, fit in BASELINES.items():
        if name not in options.without:
            sys.stderr.write(f"fitting {name}\n")
            rankers[name] = fit(sides[Side.TRAIN], sides[Side.VALIDATION], learnt)
    known = [rated for rated in rate(followed(of_side(lists, Side.TEST, options.fold)), columns) if rated.teaches]
    for text in (*tables(rankers, sides[Side.TEST]), regret_table(rankers, known) if known else "Regret: no list"):
        sys.stdout.write(f"{text}\n\n")
    for network in networks:
        _analyse(network, sides[Side.TEST], options)


def _scores(network: Network) -> Scores:
    return as_searched(lambda rated: network.scores(rated.table(network.columns).astype(np.float64)))


def _analyse(network: Network, lists: Sequence[RatedList], options: argparse.Namespace) -> None:
    from mdp.learning.analysis import correlation, importance
    from mdp.learning.pictures import draw_features, save

    lost = importance(_scores(network), network.columns, lists, options.repeats)
    rows = [f"| {name} | {value:.4f} |" for name, value in zip(network.columns, lost, strict=True)]
    sys.stdout.write("\n".join(["| feature | importance |", "|---|---:|", *rows, ""]))
    file = options.pictures / f"figure8-{network.file.stem}.png"
    save(draw_features(network.columns, lost, correlation(network.columns, lists)), file)
    sys.stdout.write(f"\n![importance and correlation]({file})\n")


def _draw_widths(options: argparse.Namespace) -> None:
    from mdp.learning.pictures import draw_widths, save
    from mdp.learning.widths import compare, read_searches

    comparisons = compare(read_searches(options.figure7), options.least_removed)
    file = options.pictures / "figure7.png"
    save(draw_widths(comparisons), file)
    sys.stdout.write(f"![J and time against the beam's width]({file})\n")


if __name__ == "__main__":
    sys.exit(main())
