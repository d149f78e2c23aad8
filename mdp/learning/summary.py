"""Summary: what a collection of records holds, as tables in Markdown: `python -m mdp.learning.summary FOLDER`."""

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from mdp.learning import command
from mdp.learning.collection.index import FAILED, INDEX, Row, read_index
from mdp.learning.lists import read_record
from mdp.mesh import Ints
from profiles.errors import LearningError

LENGTHS = (1, 5, 10, 20, 30, 40, 50, 51, 101)  # where the classes of list lengths begin
HEADS = (
    "terms",
    "settings",
    "searches",
    "models",
    "records",
    "lists",
    "rows",
    "length: mean",
    "median",
    "J: mean",
    "core h",
    "late",
)
MOST_NAMES = 20  # of searches that failed: about a screen


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables of a folder; the exit code."""
    return command.run(_print, arguments, "nothing was changed")


def _print(arguments: Sequence[str] | None) -> None:
    parser = command.Parser(prog="python -m mdp.learning.summary", description="tell what a collection of records holds")
    parser.add_argument("folder", type=Path, help="what mdp.learning.collect has written")
    sys.stdout.write("\n\n".join(summary(parser.parse_args(arguments).folder)) + "\n")


def summary(folder: Path) -> Iterator[str]:
    """The sets, their lists by length, the orientations, and what has no record and why; LearningError without an index."""
    rows = read_index(folder)
    if not rows:
        raise LearningError(f"folder {folder}: has no {INDEX}, or one without a line; mdp.learning.collect writes it")
    terms = sorted({row.terms for row in rows})
    lengths = {name: _lengths(folder, [row for row in rows if row.terms == name]) for name in terms}
    yield table(HEADS, [_of_terms(name, [row for row in rows if row.terms == name], lengths[name]) for name in terms])
    classes = [_class_name(k) for k in range(len(LENGTHS))]
    yield table(("lists of length", *classes), [(name, *_by_class(lengths[name])) for name in terms])
    turns = sorted({row.orientation for row in rows})
    yield table(("records of orientation", *map(str, turns)), [(name, *_by_turn(name, turns, rows)) for name in terms])
    yield from _excluded(rows)


def _lengths(folder: Path, rows: Sequence[Row]) -> Ints:
    """The lengths of all lists."""
    stages = [read_record(folder / row.search.file)["stage"] for row in rows if not row.excluded]
    lengths = [np.unique(stage, return_counts=True)[1] for stage in stages]
    return np.concatenate(lengths).astype(np.int32) if lengths else np.zeros(0, np.int32)


def _of_terms(terms: str, rows: Sequence[Row], lengths: Ints) -> tuple[str, ...]:
    recorded = [row for row in rows if not row.excluded]
    settings = ", ".join(sorted({row.settings for row in rows}))
    counts = (len(rows), len({row.id for row in rows}), len(recorded), len(lengths), int(lengths.sum()))
    means = ("-", "-", "-")
    if len(lengths) > 0:
        cost = np.mean([row.outcome for row in recorded])
        means = (f"{lengths.mean():.1f}", f"{np.median(lengths):g}", f"{cost:.4f}")
    hours = sum(row.seconds for row in rows) / 3600.0
    return (terms, settings, *map(str, counts), *means, f"{hours:.2f}", str(sum(row.late for row in rows)))


def _class_name(number: int) -> str:
    first, after = LENGTHS[number], (*LENGTHS, None)[number + 1]
    if after is None:
        return f"{first} or more"
    return str(first) if after == first + 1 else f"{first} to {after - 1}"


def _by_class(lengths: Ints) -> list[str]:
    return [str(count) for count in np.histogram(lengths, [*LENGTHS, np.iinfo(np.int32).max])[0]]


def _by_turn(terms: str, turns: Sequence[int], rows: Sequence[Row]) -> list[str]:
    counts = Counter(row.orientation for row in rows if row.terms == terms and not row.excluded)
    return [str(counts[turn]) for turn in turns]


def _excluded(rows: Sequence[Row]) -> Iterator[str]:
    """How many searches have no record for each reason, then the sentences of those that failed."""
    reasons = Counter((row.terms, row.excluded.partition(":")[0]) for row in rows if row.excluded)
    if reasons:
        yield table(("terms", "no record because", "searches"), [(*key, str(count)) for key, count in sorted(reasons.items())])
    failed = [f"- {row.search.file}: {row.excluded.removeprefix(FAILED)}" for row in rows if row.excluded.startswith(FAILED)]
    more = [f"- and {len(failed) - MOST_NAMES} more"] if len(failed) > MOST_NAMES else []
    if failed:
        yield "\n".join([*failed[:MOST_NAMES], *more])


def table(heads: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    rows = [f"| {' | '.join(cells)} |" for cells in (heads, *lines)]
    return "\n".join([rows[0], "|" + "---|" * len(heads), *rows[1:]])


if __name__ == "__main__":
    sys.exit(main())
