"""Front: the best decomposition for every number of parts that one search has met, and which of them to take."""

from collections.abc import Sequence

from mdp.cost.cost import CostTerms, Seam, measure_seam
from mdp.decomposition import FrontRow
from mdp.search.node import Node

EQUAL = 0.01  # costs that differ by a smaller share are alike: then fewer parts, then shorter seams


class Front:
    """The best node met for every number of cuts."""

    def __init__(self, start: Node) -> None:
        self._start = len(start.cuts)
        self._best: dict[int, Node] = {self._start: start}

    def offer(self, node: Node) -> None:
        """Take note of a node and of all that led to it from the start."""
        step: Node | None = node
        while step is not None and len(step.cuts) >= self._start:
            held = self._best.get(len(step.cuts))
            if held is None or step.cost_mm2 < held.cost_mm2:
                self._best[len(step.cuts)] = step
            step = step.parent

    @property
    def nodes(self) -> list[Node]:
        """The nodes by their number of cuts."""
        return [self._best[count] for count in sorted(self._best)]

    def choose(self, parts: int | None = None) -> Node:
        """The node of the fewest parts among those whose cost is alike to the least; parts: that of the most parts up to so
        many, or of the fewest where all have more."""
        if parts is not None:
            return self._best[max((count for count in self._best if count < parts), default=self._start)]
        least_mm2 = min(node.cost_mm2 for node in self.nodes)
        return next(node for node in self.nodes if node.cost_mm2 <= least_mm2 * (1.0 + EQUAL))


def front_row(node: Node, terms: CostTerms, chosen: bool) -> FrontRow:
    """A node with what it costs, the seams apart."""
    seams = _seams(node, terms)
    scars_mm2 = terms.seam_mm * sum(seam.weighted_mm for seam in seams)
    planes = tuple(cut.base for cut in node.cuts)
    return FrontRow(planes, node.cost_mm2 - scars_mm2, sum(seam.length_mm for seam in seams), node.cost_mm2, chosen)


def _seams(node: Node, terms: CostTerms) -> Sequence[Seam]:
    seams = []
    while node.parent is not None:
        earlier = [cut.base for cut in node.parent.cuts]
        seams.append(measure_seam(node.parent.remainder.mesh, earlier, node.cuts[-1].base, terms.feather, terms.no_seam))
        node = node.parent
    return seams
