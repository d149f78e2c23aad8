"""Record: all candidates that a search evaluated and their outcomes, as arrays for training a ranker.

One row per candidate ranked in a stage, cut or not; one row per node (the model is node 0). A node's outcome is the least final
cost over all decompositions through it, stopping there included, as a share of the model's risky area. A node that the beam
dropped was not pursued: its outcome is its own cost, and `node_expanded` marks it.
"""

import io
import zipfile
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mdp.mesh import Floats, Ints
from mdp.plane import PLATFORM, Plane
from mdp.ranking.features import COLUMNS, features
from mdp.ranking.ranking import Model, RankedCandidate

VERSION = 2  # version of the arrays; version 1 had only the six metrics of the paper
NO_NODE = -1
FIRST_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest date of a zip file; the clock would change the bytes

Arrays = dict[str, NDArray[Any]]


@dataclass(eq=False)
class Offer:
    """A ranked candidate. parent: signature of the node it would cut; features: its COLUMNS; round: first round whose residual
    threshold admits it. A trace adds the stage, the numbers of the parent and of the resulting node, and whether that node was
    new.
    """

    parent: Hashable
    plane: Plane
    features: Floats
    round: int
    stage: int = 0
    parent_number: int = NO_NODE
    child: int = NO_NODE
    chosen: bool = False


def offer(candidate: RankedCandidate) -> Offer:
    """A candidate in the form that is recorded."""
    table, row = candidate.table, candidate.row
    return Offer(table.node.signature, table.plane(row), features(table, np.array([row]))[0], candidate.round)


# the number of the offer that led to it, its signature, and its cost if the search stops there
Child = tuple[int, Hashable, float]


class Trace:
    """Records a search: `begin_stage`, then `add` for every ranking of that stage, finally `arrays` or `to_bytes`."""

    def __init__(self, name: str, model: Model, root: Hashable, cost_mm2: float | None = None) -> None:
        """root: signature of the uncut model, whose risky area is the reference of all shares; cost_mm2: the cost of the uncut
        model, by default that area.
        """
        self.name, self.model = name, model
        self._number: dict[Hashable, int] = {root: 0}  # number of the node with a solid of this signature; twins share one
        whole_mm2 = model.risky_mm2 if cost_mm2 is None else cost_mm2
        self._costs = [whole_mm2 / model.risky_mm2 if model.risky_mm2 > 0 else 0.0]  # cost of every node, the model first
        model_itself = Offer(root, PLATFORM, np.full(len(COLUMNS), np.nan), 0)
        self._made_by = [model_itself]  # the offer that led to each node
        self._expanded = set[int]()
        self._candidates: list[Offer] = []
        self._stage = 0
        self._known: dict[tuple[int, bytes, float], Offer] = {}

    def begin_stage(self, beam: Sequence[Hashable]) -> None:
        """Begin the next stage. beam: signatures of the nodes that are cut in it."""
        self._stage += 1
        self._known.clear()
        self._expanded.update(self._number[signature] for signature in beam)

    def add(self, offers: Sequence[Offer], children: Sequence[Child]) -> None:
        """Record candidates that competed in this stage, and the cuts made from them, including twins of known solids.

        A candidate added several times in a stage gets one row.
        """
        candidates = [self._candidate(offer) for offer in offers]
        for row, signature, cost_mm2 in children:
            candidate = candidates[row]
            if candidate.child == NO_NODE:
                candidate.child = self._number.setdefault(signature, len(self._costs))
                candidate.chosen = candidate.child == len(self._costs)
                if candidate.chosen:
                    self._costs.append(cost_mm2 / self.model.risky_mm2)
                    self._made_by.append(candidate)
            else:  # from a twin of its parent: the same solid, whose signature may differ by rounding
                self._number.setdefault(signature, candidate.child)

    def outcomes(self) -> Floats:
        """(nodes,) outcome of every node as a share of the model's risky area."""
        best = np.array(self._costs)
        links = [(candidate.parent_number, candidate.child) for candidate in self._candidates if candidate.child != NO_NODE]
        changed = True
        while changed:  # a twin can link a node to an earlier one, so one pass from the last node to the first may not suffice
            changed = False
            for parent, child in reversed(links):
                if best[child] < best[parent]:
                    best[parent], changed = best[child], True
        return best

    def arrays(self) -> Arrays:
        """All recorded arrays.

        Candidates (n rows): features, parent_features (NaN where the parent is the model), stage (1, 2, ...), round, parent,
        normal, offset_mm, chosen (the cut made a new node), child (its node or that of its twin; -1 if not cut), outcome (the
        child's; NaN if not cut). Nodes (k rows): node_cost and node_outcome (shares), node_stage, node_parent, node_expanded. And
        version, columns, model, risky_mm2, volume_mm3, radius_mm.
        """
        outcomes = self.outcomes()
        rows, made_by = self._candidates, self._made_by
        child = _integers(row.child for row in rows)
        return {
            "features": _table([row.features for row in rows], len(COLUMNS)),
            "parent_features": _table([made_by[row.parent_number].features for row in rows], len(COLUMNS)),
            "stage": _integers(row.stage for row in rows),
            "round": _integers(row.round for row in rows),
            "parent": _integers(row.parent_number for row in rows),
            "normal": _table([row.plane.normal for row in rows], 3),
            "offset_mm": np.array([row.plane.offset_mm for row in rows], dtype=np.float64),
            "chosen": np.array([row.chosen for row in rows], dtype=np.bool_),
            "child": child,
            "outcome": np.where(child == NO_NODE, np.nan, outcomes[child]),
            "node_cost": np.array(self._costs),
            "node_outcome": outcomes,
            "node_stage": _integers(made.stage for made in made_by),
            "node_parent": _integers(made.parent_number for made in made_by),
            "node_expanded": np.array([number in self._expanded for number in range(len(made_by))]),
            "version": np.array(VERSION),
            "columns": np.array(COLUMNS),
            "model": np.array(self.name),
            "risky_mm2": np.array(self.model.risky_mm2),
            "volume_mm3": np.array(self.model.volume_mm3),
            "radius_mm": np.array(self.model.radius_mm),
        }

    def to_bytes(self) -> bytes:
        """The arrays as the content of an .npz file; equal searches give equal bytes."""
        return npz(self.arrays())

    def _candidate(self, offer: Offer) -> Offer:
        offer.stage, offer.parent_number = self._stage, self._number[offer.parent]
        known = self._known.setdefault((offer.parent_number, offer.plane.normal.tobytes(), offer.plane.offset_mm), offer)
        if known is offer:
            self._candidates.append(offer)
        return known


def npz(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Arrays as a compressed .npz for numpy.load, without a date."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, array, allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=FIRST_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, member.getvalue())
    return content.getvalue()


def _integers(values: Iterable[int]) -> Ints:
    return np.fromiter(values, np.int32)


def _table(rows: Sequence[Floats], columns: int) -> Floats:
    return np.array(rows, dtype=np.float64).reshape(-1, columns)
