"""Evaluate: rankers and baselines on lists of models that were not used for training, and the figures of the 2020 paper.

    python -m mdp.learning.evaluate FOLDER [--manifest CSV] [--terms NAME,...] [--ranker FILE.onnx ...] [--without NAME,...] ...
    python -m mdp.learning.evaluate --figure7 TABLE.csv [--pictures DIR]

Prints tables in Markdown. figure8-NAME.png: importance of a ranker's features, and their correlation; figure7.png: J and core
time against the beam's width, from the table that tools/campaigns/widths.py writes.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from mdp.learning.baselines import BASELINES
from mdp.learning.command import COLUMN_SETS, Parser, add_records, check_range, run, split_names
from mdp.learning.command import table as markdown
from mdp.learning.lists import RatedList, Side, followed, of_side, read_lists
from mdp.learning.ndcg import NDCGS, REGRETS, Measure, Scores, as_searched, at, interval
from mdp.mesh import Floats
from mdp.ranking.ranker import LearnedRanker
from profiles.errors import UserError

ALWAYS = ("M2", "M6")  # features of the linear trade-off
SHUFFLES, CUT = 10, 5  # importance is the loss of NDCG@5, averaged over this number of shuffles


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables and draw the figures; returns the exit code."""
    return run(evaluate, arguments, "nothing is kept, it starts again")


def evaluate(arguments: Sequence[str] | None) -> None:
    """Run the comparison and draw the figures that the options select."""
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
    parser.add_argument("--pictures", type=Path, default=Path(), metavar="DIR", help="where pictures go; here by default")
    parser.add_argument("--figure7", type=Path, metavar="CSV", help="table of tools/campaigns/widths.py")
    parser.add_argument(
        "--least-removed", type=float, default=0.0, metavar="SHARE", help="of --figure7: the widest plain beam removes it"
    )
    options = parser.parse_args(arguments)
    check_range(options, "least_removed", 0.0, 1.0)
    unknown = [name for name in options.without if name not in BASELINES]
    if unknown:
        raise UserError(f"--without {unknown[0]} is not a baseline; allowed are {'; '.join(BASELINES)}")
    if options.folder is None and options.figure7 is None:
        raise UserError("a folder of records or --figure7 is needed; --help shows what is allowed")
    return options


def _compare(options: argparse.Namespace) -> None:
    """Print tables of all rankers, then the feature importance of each given ranker."""
    networks = [LearnedRanker(file) for file in options.ranker]
    learnt = COLUMN_SETS[options.columns or "paper"]
    columns = tuple(dict.fromkeys([*learnt, *ALWAYS, *(name for network in networks for name in network.columns)]))
    lists = read_lists(options.folder, options.manifest, columns, options.terms)
    sides = {side: [rated for rated in of_side(lists, side, options.fold) if rated.teaches] for side in Side}
    for side, some in sides.items():
        if not some:
            raise UserError(f"folder {options.folder}: it has no list for {side}; record models of more sources")
    rankers = {str(network.file): _scores(network) for network in networks}
    for name, fit in BASELINES.items():
        if name not in options.without:
            sys.stderr.write(f"fitting {name}\n")
            rankers[name] = fit(sides[Side.TRAIN], sides[Side.VALIDATION], learnt)
    known = [rated for rated in followed(sides[Side.TEST]) if rated.teaches]
    sys.stdout.write(f"{table('NDCG over all lists', rankers, sides[Side.TEST], NDCGS)}\n\n")
    regrets = table("Regret over the candidates that were followed", rankers, known, REGRETS) if known else "Regret: no list"
    sys.stdout.write(f"{regrets}\n\n")
    for network in networks:
        _analyse(network, sides[Side.TEST], options)


def table(title: str, rankers: Mapping[str, Scores], lists: Sequence[RatedList], measures: Mapping[str, Measure]) -> str:
    """A table in Markdown, one row per ranker: the means of the measures, and the 95 % interval of the first over models."""
    models = [rated.model for rated in lists]
    heads, lines = ("ranker", *measures, f"95 % interval of {next(iter(measures))}"), list[Sequence[str]]()
    for name, scores in rankers.items():
        given = [scores(rated) for rated in lists]
        values = [np.array([measure(*pair) for pair in zip(given, lists, strict=True)]) for measure in measures.values()]
        low, high = interval(values[0], models)
        lines.append((name, *(f"{value.mean():.4f}" for value in values), f"{low:.4f} to {high:.4f}"))
    return f"{title}: {len(lists)} lists of {len(set(models))} models\n\n{markdown(heads, lines, numbers=True)}"


def _scores(network: LearnedRanker) -> Scores:
    return as_searched(lambda rated: network.scores(rated.table(network.columns).astype(np.float64)))


def _analyse(network: LearnedRanker, lists: Sequence[RatedList], options: argparse.Namespace) -> None:
    from mdp.learning.pictures import draw_features, save

    lost = importance(_scores(network), network.columns, lists)
    rows = [(name, f"{value:.4f}") for name, value in zip(network.columns, lost, strict=True)]
    sys.stdout.write(markdown(("feature", "importance"), rows, numbers=True) + "\n")
    alike = [file for file in options.ranker if file.stem == network.file.stem]
    number = f"-{alike.index(network.file) + 1}" if len(alike) > 1 else ""
    file = options.pictures / f"figure8-{network.file.stem}{number}.png"
    save(draw_features(network.columns, lost, correlation(network.columns, lists)), file)
    sys.stdout.write(f"\n![importance and correlation]({file})\n")


def importance(scores: Scores, columns: Sequence[str], lists: Sequence[RatedList]) -> Floats:
    """(k,) drop in mean NDCG@5 when a named feature is shuffled among all candidates (Altmann 2010)."""
    rng, worth = np.random.default_rng(0), at(CUT)

    def mean(some: Sequence[RatedList]) -> float:
        return float(np.mean([worth(scores(rated), rated) for rated in some]))

    left = [[mean(shuffled(name, lists, rng)) for _ in range(SHUFFLES)] for name in columns]
    lost: Floats = mean(lists) - np.mean(left, axis=1)
    return lost


def shuffled(name: str, lists: Sequence[RatedList], rng: np.random.Generator) -> list[RatedList]:
    """The lists with one feature permuted among the candidates of all of them."""
    features = np.vstack([rated.features for rated in lists])
    column = lists[0].columns.index(name)
    features[:, column] = rng.permutation(features[:, column])
    parts = np.split(features, np.cumsum([len(rated.features) for rated in lists])[:-1])
    return [replace(rated, features=part) for rated, part in zip(lists, parts, strict=True)]


def correlation(columns: Sequence[str], lists: Sequence[RatedList]) -> Floats:
    """(k, k) Pearson correlation of the named features over all candidates; 0 for a constant feature."""
    rows = np.vstack([rated.table(columns) for rated in lists])
    with np.errstate(invalid="ignore"):
        matrix = np.corrcoef(rows, rowvar=False, dtype=np.float64)
    known: Floats = np.atleast_2d(np.nan_to_num(matrix))
    return known


def _draw_widths(options: argparse.Namespace) -> None:
    from mdp.learning.pictures import draw_widths, save
    from mdp.learning.widths import NOTHING_COMMON, compare, read_searches

    comparisons = compare(read_searches(options.figure7), options.least_removed)
    if not comparisons:
        raise UserError(f"table {options.figure7}: {NOTHING_COMMON}")
    file = options.pictures / "figure7.png"
    save(draw_widths(comparisons), file)
    sys.stdout.write(f"![J and time against the beam's width]({file})\n")


if __name__ == "__main__":
    sys.exit(main())
