"""Ranker: which of the candidate cuts the beam follows."""

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

from mdp.features import Model, Plan
from mdp.pool import Entry


class Ranker(Protocol):
    """Brings candidates, given in the classic order, into the order in which the beam takes them."""

    def ordered(self, pool: Iterable[Entry], plan: Callable[[Entry], Plan], model: Model) -> Iterator[Entry]:
        """The candidates, best first; plan gives the numbers of one."""
        ...


class ByReduction:
    """The classic ranking of the 2020 paper: as they come."""

    def ordered(self, pool: Iterable[Entry], plan: Callable[[Entry], Plan], model: Model) -> Iterator[Entry]:
        """The candidates as they come."""
        del plan, model
        return iter(pool)


RANKERS: dict[str, Ranker] = {"classic": ByReduction()}
