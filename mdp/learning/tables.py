"""Tables of rankers over lists, in Markdown: NDCG as in the 2020 paper, how often the best comes first, what a miss costs."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from mdp.learning.labels import RatedList
from mdp.learning.ndcg import Measure, Scores, at, best_within, full_lists, interval, regret
from mdp.mesh import Floats

CUTS = (1, 2, 3, 4, 5)  # of the NDCG, as the paper's table has them
FIRST = (1, 2, 5)  # numbers of candidates that are followed
HEADS = (*(f"NDCG@{cut}" for cut in CUTS), "95 % of @1", *(f"best in first {first}" for first in FIRST))


def tables(rankers: Mapping[str, Scores], lists: Sequence[RatedList]) -> Iterator[str]:
    """A table of all lists, and one of those that the beam filled."""
    yield f"All lists: {_counts(lists)}\n\n{table(rankers, lists)}"
    full = full_lists(lists)
    yield f"Full lists: {_counts(full)}\n\n{table(rankers, full)}" if full else "Full lists: none"


def _counts(lists: Sequence[RatedList]) -> str:
    return f"{len(lists)} of {len({rated.model for rated in lists})} models"


def table(rankers: Mapping[str, Scores], lists: Sequence[RatedList]) -> str:
    """A row a ranker: NDCG, the 95 % interval of NDCG@1 over models, how often the best is among the first few."""
    lines = [_row("ranker", HEADS), "|---|" + "---:|" * len(HEADS)]
    for name, scores in rankers.items():
        given = [scores(rated) for rated in lists]
        gains = [measured(at(cut), given, lists) for cut in CUTS]
        cells = [f"{values.mean():.3f}" for values in gains]
        cells.append("{:.3f} to {:.3f}".format(*interval(gains[0], [rated.model for rated in lists])))
        cells += [f"{measured(best_within(first), given, lists).mean():.1%}" for first in FIRST]
        lines.append(_row(name, cells))
    return "\n".join(lines)


def regret_table(rankers: Mapping[str, Scores], lists: Sequence[RatedList]) -> str:
    """One row per ranker: how much worse the best of its first few candidates ends than the best of the list, as a share of that.

    lists: without the candidates that nobody followed, of which only the cost of stopping there is known.
    """
    heads = [f"regret of first {first}" for first in FIRST]
    lines = [f"Regret, followed candidates: {_counts(lists)}", "", _row("ranker", heads), "|---|" + "---:|" * len(heads)]
    for name, scores in rankers.items():
        given = [scores(rated) for rated in lists]
        lines.append(_row(name, [f"{measured(regret(first), given, lists).mean():.4f}" for first in FIRST]))
    return "\n".join(lines)


def measured(measure: Measure, given: Sequence[Floats], lists: Sequence[RatedList]) -> Floats:
    """(lists,) a measure of every list; given: the scores of each."""
    return np.array([measure(scores, rated) for scores, rated in zip(given, lists, strict=True)])


def _row(name: str, cells: Sequence[str]) -> str:
    return f"| {name} | {' | '.join(cells)} |"
