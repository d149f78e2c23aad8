"""Beam: the nodes that a search follows, one place each.

The first place follows the classic ranking, large parts first. Every further place follows a trade-off of its own between what
is made safe and what is left risky for ever, and takes its node from the children of its own and all lower places. So a wider
beam holds the narrower ones and never ends worse, and the places do not fill with what one ranking finds nearly equal.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from itertools import islice
from math import isqrt

from mdp.node import Node
from mdp.plane import Plane
from mdp.pool import Entry, Table, entries, round_of, same, traded
from mdp.ranker import Ranker
from mdp.record import Child, Offer, Trace
from mdp.rules import Rules
from mdp.threads import ahead

# Area left for ever counts as so many times the area made safe; None: the classic ranking. Many models, one greedy search
# each: 4 is best on average, no value is best on most models.
TRADE_OFFS = (None, 4.0, 1.0, 8.0, 2.0, 0.5, 16.0, 0.0)
RECORDED = 50  # candidates of a pool that are put on record, the B of the 2020 paper


@dataclass(frozen=True, eq=False)
class Branch:
    """A node that is followed, and the candidates for its next cut, worked out while other places are still picking."""

    node: Node
    coming: Future[Table]

    @property
    def table(self) -> Table:
        """The candidates, waited for."""
        return self.coming.result()


@dataclass(frozen=True, eq=False)
class Pick:
    """A candidate that a place of the beam took, and the node it leads to."""

    entry: Entry
    node: Node


class Beam:
    """A beam of search.beam_width places; bests holds the best node that each place ever had."""

    def __init__(self, rules: Rules, ranker: Ranker, trace: Trace | None) -> None:
        self.rules, self.ranker, self.trace = rules, ranker, trace
        width = rules.settings.beam_width
        self.nodes: list[Node | None] = [rules.root] + [None] * (width - 1)
        self.bests = [rules.root] * width
        self._branches: list[Branch | None] = [self._branch(rules.root, 0)]
        self._seen = {rules.root.signature: 0}  # solids and the lowest place that had them
        self._children: dict[tuple[int, int], Node | None] = {}
        self._taken: dict[int, list[Plane]] = {}

    @property
    def best(self) -> Node:
        """The best node ever held."""
        return min(self.bests, key=lambda node: node.cost_mm2)

    def advance(self) -> None:
        """One more cut at every place; places that find none stay empty."""
        if self.trace is not None:
            self.trace.stage([node.signature for node in self.nodes if node is not None])
        branches, self._branches = self._branches, []
        self._children.clear()
        self._taken.clear()
        picks: list[Pick | None] = []
        for place in range(len(self.nodes)):
            pick = self._pick([branch for branch in branches[: place + 1] if branch is not None], place)
            picks.append(pick)
            self._branches.append(None if pick is None or self.rules.full(pick.node) else self._branch(pick.node, place))
        if self.trace is not None:
            self._record(self.trace, [branch for branch in branches if branch is not None], picks)
        self.nodes = [None if pick is None else pick.node for pick in picks]
        for place, node in enumerate(self.nodes):
            if node is not None and node.cost_mm2 < self.bests[place].cost_mm2:
                self.bests[place] = node

    def close(self) -> None:
        """Leave off what was begun for a next cut."""
        for branch in self._branches:
            if branch is not None:
                branch.coming.cancel()

    def _branch(self, node: Node, place: int) -> Branch:
        return Branch(node, ahead(self.rules.table, node, TRADE_OFFS[place % len(TRADE_OFFS)] is None))

    def finalists(self) -> list[Node]:
        """The nodes worth polishing: at the second place and at every place with a square number the best one that it or a
        lower one ever held and that is no finalist yet."""
        found: list[Node] = []
        for count in range(2, len(self.bests) + 1):
            if count == 2 or isqrt(count) ** 2 == count:
                others = [node for node in self.bests[:count] if node.cuts and node not in found]
                found += [min(others, key=lambda node: node.cost_mm2)] if others else []
        return found

    def _pick(self, branches: Sequence[Branch], place: int) -> Pick | None:
        """What a place takes of the children of some branches: no solid twice, no two near-equal cuts of one node."""
        for entry in self._ordered(branches, place):
            branch = branches[entry.table]
            plane, taken = branch.table.plane(entry.row), self._taken.setdefault(entry.table, [])
            if any(same(plane, other) for other in taken):
                continue
            child = self._child(branch, entry)
            if child is not None and self._seen.get(child.signature, place + 1) > place:
                self._seen[child.signature] = place
                taken.append(plane)
                return Pick(entry, child)
        return None

    def _ordered(self, branches: Sequence[Branch], place: int) -> Iterator[Entry]:
        if not branches:
            return iter(())
        tables = [branch.table for branch in branches]
        bound_mm2 = min(node.cost_mm2 for node in self.bests[: place + 1])
        trade_off = TRADE_OFFS[place % len(TRADE_OFFS)]
        if trade_off is not None:
            return traded(tables, trade_off, bound_mm2)
        pool = entries(tables, self.rules.model.risky_mm2, bound_mm2, preferred_mm3=self.rules.preferred_mm3)
        return self.ranker.ordered(pool, lambda entry: tables[entry.table].plan(entry.row), self.rules.model)

    def _child(self, branch: Branch, entry: Entry) -> Node | None:
        key = (entry.table, entry.row)
        if key not in self._children:
            residual_mm2 = float(branch.table.worth.residual_mm2[entry.row])
            self._children[key] = self.rules.cut(branch.node, branch.table.plane(entry.row), residual_mm2)
        return self._children[key]

    def _record(self, trace: Trace, branches: Sequence[Branch], picks: Sequence[Pick | None]) -> None:
        """Put the stage's pool on record: the first candidates of the classic ranking, and what the places took."""
        tables = [branch.table for branch in branches]
        risky_mm2 = self.rules.model.risky_mm2
        bound_mm2, preferred_mm3 = self.best.cost_mm2, self.rules.preferred_mm3
        pool = entries(tables, risky_mm2, bound_mm2, preferred_mm3=preferred_mm3) if tables else iter(())
        offered = list(islice(pool, max(RECORDED, 2 * len(self.nodes))))
        place_of = {(entry.table, entry.row): place for place, entry in enumerate(offered)}
        made = []
        for pick in picks:
            if pick is None:
                continue
            key = (pick.entry.table, pick.entry.row)
            if key not in place_of:
                place_of[key] = len(offered)
                residual_mm2 = float(tables[pick.entry.table].worth.residual_mm2[pick.entry.row])
                offered.append(Entry(*key, round_of(residual_mm2 / risky_mm2)))
            made.append(Child(place_of[key], pick.node.signature, pick.node.cost_mm2))
        trace.pool([_offer(branches[entry.table], entry) for entry in offered], made)


def _offer(branch: Branch, entry: Entry) -> Offer:
    return Offer(branch.node.signature, branch.table.plane(entry.row), branch.table.plan(entry.row), entry.round)
