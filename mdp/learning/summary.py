"""Summary: what a collection of records holds, as tables in Markdown."""

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from mdp.learning.index import FAILED, Row

HEADS = ("terms", "settings", "searches", "models", "records", "lists", "mean length", "mean J", "core h", "late")
MOST_NAMES = 20  # of searches that failed: about a screen


def summary(rows: Sequence[Row]) -> Iterator[str]:
    """The number of searches on each of the terms, then which of them have no record and why."""
    yield table(HEADS, [_of_terms([row for row in rows if row.terms == terms]) for terms in sorted({row.terms for row in rows})])
    reasons = Counter((row.terms, row.excluded.partition(":")[0]) for row in rows if row.excluded)
    if reasons:
        yield table(("terms", "no record because", "searches"), [(*key, str(count)) for key, count in sorted(reasons.items())])
    failed = [f"- {row.search.file}: {row.excluded.removeprefix(FAILED)}" for row in rows if row.excluded.startswith(FAILED)]
    more = [f"- and {len(failed) - MOST_NAMES} more"] if len(failed) > MOST_NAMES else []
    if failed:
        yield "\n".join([*failed[:MOST_NAMES], *more])


def _of_terms(rows: Sequence[Row]) -> tuple[str, ...]:
    recorded = [row for row in rows if not row.excluded]
    lists = sum(row.lists for row in recorded)
    means = ("-", "-")
    if lists:
        length = sum(row.lists * row.mean_list_length for row in recorded) / lists
        means = (f"{length:.1f}", f"{np.mean([row.outcome for row in recorded]):.4f}")
    settings = ", ".join(sorted({row.settings for row in rows}))
    counts = (len(rows), len({row.id for row in rows}), len(recorded), lists)
    hours = sum(row.seconds for row in rows) / 3600.0
    return (rows[0].terms, settings, *map(str, counts), *means, f"{hours:.2f}", str(sum(row.late for row in rows)))


def table(heads: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    rows = [f"| {' | '.join(cells)} |" for cells in (heads, *lines)]
    return "\n".join([rows[0], "|" + "---|" * len(heads), *rows[1:]])
