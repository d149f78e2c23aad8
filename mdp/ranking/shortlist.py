"""Shortlist: the candidates that a learned ranker chooses from, the first ones by several trade-offs of each table.

No single trade-off between what is made safe and what is left risky for ever is best on most models, so the first few of each
stand side by side, and few directions have to be swept for them.
"""

from collections.abc import Iterator, Sequence
from itertools import islice

from mdp.ranking.ranking import CandidateTable, RankedCandidate, rank_by_trade_off

LISTED = (2.0, 1.0, 4.0)  # trade-offs, see ranking.rank_by_trade_off; more of them did not end better
EACH = 3  # candidates of a table by each of them


def shortlist(tables: Sequence[CandidateTable], bound_mm2: float) -> Iterator[RankedCandidate]:
    """Feasible candidates of some tables, each once: those that are listed, table by table; those that would leave bound_mm2 or
    more for ever are left out."""
    for number, table in enumerate(tables):
        rows: dict[int, RankedCandidate] = {}
        for trade_off in LISTED:
            for candidate in islice(rank_by_trade_off([table], trade_off, bound_mm2), EACH):
                rows.setdefault(candidate.row, RankedCandidate(number, candidate.row, candidate.round))
        yield from rows.values()
