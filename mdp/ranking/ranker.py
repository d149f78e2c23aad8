"""Ranker: which of the candidate cuts the beam follows."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol

from mdp.ranking.ranking import CandidateTable, RankedCandidate


class Ranker(Protocol):
    """Brings candidates of some tables, given in the classic order, into the order in which the beam takes them."""

    def rank(self, classic: Iterable[RankedCandidate], tables: Sequence[CandidateTable]) -> Iterator[RankedCandidate]:
        """The candidates, best first."""
        ...


class ByReduction:
    """The classic ranking of the 2020 paper: as they come."""

    def rank(self, classic: Iterable[RankedCandidate], tables: Sequence[CandidateTable]) -> Iterator[RankedCandidate]:
        """The candidates as they come."""
        del tables
        return iter(classic)


RANKERS: dict[str, Ranker] = {"classic": ByReduction()}
