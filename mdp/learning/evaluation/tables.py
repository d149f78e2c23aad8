"""Tables of rankers over lists, in Markdown: NDCG as in the 2020 paper, how often the best comes first, what a miss costs.

NDCG is of all candidates that were cut, as in the paper; regret of those that somebody followed.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from mdp.learning.labels import RatedList
from mdp.learning.ndcg import Measure, Scores, at, best_within, full_lists, interval, regret
from mdp.mesh import Floats

CUTS = (1, 2, 3, 4, 5)  # of the NDCG, as the paper's table has them
FIRST = (1, 2, 5)  # numbers of candidates that are followed
SEVERAL = 20  # candidates from which a list is no short one
SIZES = ((2, 5), (6, 10), (11, 20), (21, 35), (36, 49), (50, 10_000))  # of lists, the last ones full (mdp.learning.ndcg.FULL)

Given = Sequence[Floats]  # the scores of every list


def tables(rankers: Mapping[str, Scores], lists: Sequence[RatedList]) -> Iterator[str]:
    """Markdown: all lists, the full ones, and NDCG by the number of candidates."""
    given = {name: [scores(rated) for rated in lists] for name, scores in rankers.items()}
    yield _headed("All lists", lists, table(given, lists))
    full = full_lists(lists)
    of_full = {name: [own for own in scores if len(own) >= SIZES[-1][0]] for name, scores in given.items()}
    yield _headed("Full lists", full, table(of_full, full)) if full else "Full lists: none"
    yield f"NDCG@1 / NDCG@5 by the number of candidates\n\n{by_size(given, lists)}"


def _headed(title: str, lists: Sequence[RatedList], body: str) -> str:
    return f"{title}: {len(lists)} of {len({rated.model for rated in lists})} models\n\n{body}"


def table(given: Mapping[str, Given], lists: Sequence[RatedList]) -> str:
    """A row a ranker: NDCG, the 95 % interval of NDCG@1 and NDCG@5 over models, best within the first few."""
    heads = [*(f"NDCG@{cut}" for cut in CUTS), "95 % of @1", "95 % of @5", *(f"best in first {first}" for first in FIRST)]
    lines = [_row("ranker", heads), "|---|" + "---:|" * len(heads)]
    models = [rated.model for rated in lists]
    for name, scores in given.items():
        gains = [measured(at(cut), scores, lists) for cut in CUTS]
        cells = [f"{values.mean():.3f}" for values in gains]
        cells += ["{:.3f} to {:.3f}".format(*interval(values, models)) for values in (gains[0], gains[-1])]
        cells += [f"{measured(best_within(first), scores, lists).mean():.1%}" for first in FIRST]
        lines.append(_row(name, cells))
    return "\n".join(lines)


def regret_tables(rankers: Mapping[str, Scores], lists: Sequence[RatedList]) -> Iterator[str]:
    """Markdown: regret, a table for the lists of each terms."""
    for terms in sorted({rated.terms for rated in lists}):
        some = [rated for rated in lists if rated.terms == terms]
        given = {name: [scores(rated) for rated in some] for name, scores in rankers.items()}
        yield _headed(f"Regret, terms {terms}", some, regret_table(given, some))


def regret_table(given: Mapping[str, Given], lists: Sequence[RatedList]) -> str:
    """A row a ranker: mean regret, the 95 % interval of regret@1 over models, best within the first few, of long lists, too."""
    heads = [*(f"regret@{first}" for first in FIRST), "95 % of @1", *(f"best in first {first}" for first in FIRST)]
    lines = [_row("ranker", [*heads, f"in first 2 of {SEVERAL} and more"]), "|---|" + "---:|" * (len(heads) + 1)]
    several = np.array([len(rated.ratings) >= SEVERAL for rated in lists])
    for name, scores in given.items():
        losses = [measured(regret(first), scores, lists) for first in FIRST]
        hits = [measured(best_within(first), scores, lists) for first in FIRST]
        cells = [f"{values.mean():.4f}" for values in losses]
        cells.append("{:.4f} to {:.4f}".format(*interval(losses[0], [rated.model for rated in lists])))
        cells += [f"{values.mean():.1%}" for values in hits]
        cells.append(f"{hits[1][several].mean():.1%}" if several.any() else "-")
        lines.append(_row(name, cells))
    return "\n".join(lines)


def by_size(given: Mapping[str, Given], lists: Sequence[RatedList]) -> str:
    """A row a ranker, a column a range of sizes."""
    columns = [[row for row, rated in enumerate(lists) if low <= len(rated.ratings) <= high] for low, high in SIZES]
    named = [f"{low}-{high}" if high < SIZES[-1][1] else f"{low} and more" for low, high in SIZES]
    lines = [_row("ranker", named), "|---|" + "---:|" * len(SIZES)]
    lines.append(_row("lists", [str(len(rows)) for rows in columns]))
    for name, scores in given.items():
        ends = [measured(at(cut), scores, lists) for cut in (CUTS[0], CUTS[-1])]
        lines.append(
            _row(name, [" / ".join(f"{values[rows].mean():.3f}" for values in ends) if rows else "-" for rows in columns])
        )
    return "\n".join(lines)


def measured(measure: Measure, given: Given, lists: Sequence[RatedList]) -> Floats:
    """(lists,) a measure of every list."""
    return np.array([measure(scores, rated) for scores, rated in zip(given, lists, strict=True)])


def _row(name: str, cells: Sequence[str]) -> str:
    return f"| {name} | {' | '.join(cells)} |"
