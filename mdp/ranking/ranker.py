"""Ranker: which of the candidate cuts the beam follows.

`classic` is the ranking of the 2020 paper; `learned` the network that ships; the name of an .onnx file is a network of one's own.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Protocol

from mdp.ranking import SUFFIX
from mdp.ranking.candidate_table import CandidateTable
from mdp.ranking.network import Network
from mdp.ranking.ranking import RankedCandidate
from profiles.errors import RankerError

CLASSIC, LEARNED = "classic", "learned"


class Ranker(Protocol):
    """Brings offered candidates of some tables into the order in which the beam takes them.

    learned: whether it is offered the shortlist and wants features, which takes a tenth of the sweeps that the classic ranking
    takes; otherwise it is offered candidates in the classic order.
    """

    @property
    def learned(self) -> bool:
        """See above."""
        ...

    def rank(self, offered: Iterable[RankedCandidate], tables: Sequence[CandidateTable]) -> Iterator[RankedCandidate]:
        """The candidates, best first."""
        ...


class ByReduction:
    """The classic ranking of the 2020 paper: as they come."""

    learned = False

    def rank(self, offered: Iterable[RankedCandidate], tables: Sequence[CandidateTable]) -> Iterator[RankedCandidate]:
        """The candidates as they come."""
        del tables
        return iter(offered)


@cache
def ranker_named(name: str) -> Ranker:
    """The ranker of a name, see above.

    Raises RankerError for a name that is none and for a file that holds no ranker.
    """
    if name == CLASSIC:
        return ByReduction()
    if name == LEARNED:
        return shipped()
    if not name.endswith(SUFFIX):
        raise RankerError(f"--ranker {name}: {CLASSIC}, {LEARNED} or the name of an {SUFFIX} file is allowed")
    own = Network(Path(name))
    own.check()
    return own


@cache
def shipped() -> Network:
    """The network that ships."""
    return Network(Path(str(files("mdp") / "ranker.onnx")))
