"""Ranker: which of the candidate cuts the beam follows."""

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

from mdp.ranking.features import Measures, Model
from mdp.ranking.ranking import RankedCandidate


class Ranker(Protocol):
    """Brings candidates, given in the classic order, into the order in which the beam takes them."""

    def rank(
        self, classic: Iterable[RankedCandidate], measures: Callable[[RankedCandidate], Measures], model: Model
    ) -> Iterator[RankedCandidate]:
        """The candidates, best first; measures gives the numbers of one."""
        ...


class ByReduction:
    """The classic ranking of the 2020 paper: as they come."""

    def rank(
        self, classic: Iterable[RankedCandidate], measures: Callable[[RankedCandidate], Measures], model: Model
    ) -> Iterator[RankedCandidate]:
        """The candidates as they come."""
        del measures, model
        return iter(classic)


RANKERS: dict[str, Ranker] = {"classic": ByReduction()}
