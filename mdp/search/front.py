"""Pareto front: the best decomposition of a search for every number of parts, and the choice among them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mdp.cost.cost import excess_mm2
from mdp.decomposition import FrontRow, Part
from mdp.kernels.processes import parallel_map
from mdp.ranking.node import Node
from mdp.sweep.limbs import limb_faces
from profiles.errors import counted
from profiles.messages import advice, three_digits
from profiles.profile import Profile

# Costs within this share are equal: of the uncut model's cost when choosing fewer parts, of their own when choosing shorter
# seams.
EQUAL = 0.01

ASKED, BY_PLAN = "by you", "by the plan"  # what follows "chosen"
LEAST_PARTS = "for the fewest parts at about the lowest cost"
PRINTABLE = "for the lowest cost that prints well"
Price = tuple[float, float]  # printing time of the parts, s, and filament, mm
Pricing = Callable[[Sequence[Part]], Price | None]  # None: the parts cannot be printed


class ParetoFront:
    """The best node for every number of cuts: among those within tolerance of the least cost, the one with the shortest seams;
    the cheapest if seams cost nothing.
    """

    def __init__(self, start: Node) -> None:
        self._start = len(start.cuts)
        self._by_count: dict[int, list[Node]] = {self._start: [start]}
        self._equal = EQUAL if start.terms.seam_mm > 0.0 else 0.0

    def offer(self, node: Node) -> None:
        """Add a node and all nodes on its path from the start."""
        for step in node.path[self._start :]:
            held = self._by_count.setdefault(len(step.cuts), [])
            if step not in held:
                most_mm2 = min(alternative.cost_mm2 for alternative in (step, *held)) * (1.0 + self._equal)
                held[:] = [alternative for alternative in (*held, step) if alternative.cost_mm2 <= most_mm2]

    def replace(self, node: Node, alternative: Node) -> None:
        """Replace a node by an alternative of about equal cost."""
        self._by_count[len(node.cuts)] = [alternative]

    @property
    def nodes(self) -> list[Node]:
        """The best nodes by ascending number of cuts."""
        return [self._best(count) for count in sorted(self._by_count)]

    def up_to(self, parts: int) -> Node:
        """The node with the most parts up to a number, or with the fewest if all have more."""
        return self._best(max((count for count in self._by_count if count < parts), default=self._start))

    def _best(self, count: int) -> Node:
        alike = self._by_count[count]
        if self._equal <= 0.0 or len(alike) == 1:
            return alike[0]
        return min(alike, key=lambda node: sum(seam.length_mm for seam in node.seams))


def front_row(node: Node) -> FrontRow:
    """The front row of a node, with its cost split into terms. Every area counts once in the area that needs support."""
    scars_mm2, over_mm2 = sum(cut.cut_cost.seam_mm2 for cut in node.cuts), 0.0
    seam_mm = sum((seam.length_mm for seam in node.seams), 0.0)
    if node.terms.need is not None:
        plain_mm2 = float(node.remainder.mesh.areas_mm2[node.remainder.risky].sum())
        over_mm2 = _excess_mm2(node) + (node.remainder.risky_mm2 - plain_mm2)
    stairs_mm2 = node.stairs_mm2 + sum(cut.cut_cost.stairs_mm2 for cut in node.cuts)
    return FrontRow(
        tuple(node.planes), node.cost_mm2 - scars_mm2 - over_mm2 - stairs_mm2, seam_mm, node.cost_mm2, stairs_mm2=stairs_mm2
    )


def _excess_mm2(node: Node) -> float:
    """Extra cost of area that needs support on the parts cut off, beyond the area itself, mm2."""
    total_mm2 = 0.0
    for whole, base in zip(node.path, node.planes, strict=False):
        before = whole.remainder
        cut = np.ones(len(before.mesh.faces), np.bool_) if base.limbs_mm is None else limb_faces(before, base)
        total_mm2 += 0.0 if before.pieces is None else excess_mm2(before.mesh, before.pieces, base, cut)
    return total_mm2


def price_rows(rows: Sequence[FrontRow], parts: Mapping[int, Sequence[Part]], price: Pricing) -> list[FrontRow]:
    """Rows with time and filament of their parts. parts: parts of the rows to price, by position."""
    places = list(parts)
    prices = parallel_map(lambda k: price(parts[places[k]]), len(places))
    known = dict(zip(places, prices, strict=True))
    return [with_price(row, known.get(place)) for place, row in enumerate(rows)]


def with_price(row: FrontRow, price: Price | None) -> FrontRow:
    """A row with time and filament of its parts, unchanged if they are unknown."""
    return row if price is None else replace(row, time_s=price[0], filament_mm=price[1])


def pareto_optimal(rows: Sequence[FrontRow | Node]) -> list[bool]:
    """Pareto-optimal rows or nodes, given by ascending number of parts: whether each costs less than all with fewer parts."""
    return [all(row.cost_mm2 < fewer.cost_mm2 for fewer in rows[:place]) for place, row in enumerate(rows)]


@dataclass(frozen=True)
class Weights:
    """Exchange rates of a second of printing and a mm of filament against blemished area, mm2."""

    second_mm2: float = 0.0
    filament_mm2: float = 0.0

    @classmethod
    def of(cls, profile: Profile) -> "Weights":
        """Exchange rates of a profile; zero without support, since time and filament would then be no reason against cuts."""
        search = profile.search.effective
        return cls() if profile.process.support != "auto" else cls(search.second_mm2, 1e-3 * search.metre_mm2)

    def of_print(self, time_s: float, filament_mm: float) -> float:
        """Cost of a print's time and filament, mm2."""
        return self.second_mm2 * time_s + self.filament_mm2 * filament_mm

    def of_row(self, row: FrontRow) -> float | None:
        """Cost of a row's time and filament, mm2; None if they count but are unknown."""
        if not self:
            return 0.0
        return None if row.time_s is None else self.of_print(row.time_s, row.filament_mm or 0.0)

    def __bool__(self) -> bool:
        """Whether time or filament counts."""
        return self.second_mm2 > 0.0 or self.filament_mm2 > 0.0


@dataclass(frozen=True)
class Choice:
    """The position of the chosen row in a front, and the reason as it follows the word "chosen".

    note: the saving and the price of the row with the fewest blemishes; totals_mm2: the totals that were compared, by position,
    empty if only the costs were.
    """

    place: int
    reason: str
    note: tuple[str, ...] = ()
    totals_mm2: Mapping[int, float] = field(default_factory=dict)

    def marked(self, rows: Iterable[FrontRow]) -> list[FrontRow]:
        """The rows with their totals, and the chosen one marked."""
        return [
            replace(
                row, chosen=place == self.place, reason=self.reason * (place == self.place), total_mm2=self.totals_mm2.get(place)
            )
            for place, row in enumerate(rows)
        ]


def charge_mm2(rows: Sequence[FrontRow], weights: Weights, least_saving: float) -> float:
    """Charge for each part beyond those of the first row: a share of its cost including time; 0 if time does not count, as
    without support, or if no row has a time.
    """
    timed = [row for row in rows if row.time_s is not None]
    return least_saving * (timed[0].cost_mm2 + (weights.of_row(timed[0]) or 0.0)) if weights and timed else 0.0


def choose(rows: Sequence[FrontRow], weights: Weights, least_saving: float = 0.0) -> Choice:
    """Choose the row with the least cost, including time, filament and a charge for every further part. rows: by ascending number
    of parts.

    weights: exchange rates of time and filament. least_saving: the charge, as a share of the first row's cost including time. If
    any row has a time, rows without one cannot be printed, and flawed rows are not chosen. If none has, or time does not count,
    as without support, there is no charge: the choice is the row with the fewest parts within tolerance of the least cost.
    """
    unflawed = [place == 0 or not row.flaw for place, row in enumerate(rows)]
    pareto_optimal_rows = [place for place, good in enumerate(pareto_optimal(rows)) if good and unflawed[place]]
    timed = [place for place in pareto_optimal_rows if rows[place].time_s is not None]
    places, first = timed or pareto_optimal_rows, (timed or pareto_optimal_rows)[0]
    charge, totals = charge_mm2([rows[place] for place in places], weights, least_saving), dict[int, float]()
    if weights and timed:
        further = {place: rows[place].parts - rows[first].parts for place in places}
        totals = {
            place: rows[place].cost_mm2 + (weights.of_row(rows[place]) or 0.0) + charge * further[place] for place in places
        }
    limit_mm2 = min(rows[place].cost_mm2 for place in places) + EQUAL * rows[first].cost_mm2
    scars = taken = next(place for place in places if rows[place].cost_mm2 <= limit_mm2)
    if totals:
        taken = min(places, key=lambda place: totals[place])
    least_mm2 = min(row.cost_mm2 for row in rows)
    if rows[taken].cost_mm2 <= least_mm2:
        reason = "for the lowest cost"
    elif taken == scars:
        reason = LEAST_PARTS if min(rows[place].cost_mm2 for place in places) <= least_mm2 else PRINTABLE
    else:
        reason = "for the lowest total"
    cheapest = min(rows, key=lambda row: row.cost_mm2)
    worth = cheapest.flaw and cheapest.cost_mm2 < (1.0 - EQUAL) * rows[taken].cost_mm2
    return Choice(taken, reason, _savings_notes(cheapest if worth else rows[scars], rows[taken]), totals)


def _savings_notes(fewest_scars: FrontRow, taken: FrontRow) -> tuple[str, ...]:
    """A note on what the row with the fewest blemishes would save and cost, compared with the chosen one."""
    saved_mm2, longer_s = taken.cost_mm2 - fewest_scars.cost_mm2, (fewest_scars.time_s or 0.0) - (taken.time_s or 0.0)
    more_mm = (fewest_scars.filament_mm or 0.0) - (taken.filament_mm or 0.0)
    parts = fewest_scars.parts
    if saved_mm2 <= 0.0:
        return ()
    price = f" with {parts - taken.parts} more {'cut' if parts == taken.parts + 1 else 'cuts'}"
    if fewest_scars.flaw:
        price = f", but {fewest_scars.flaw}"
    elif longer_s > 0.0:
        longer = f"{three_digits(longer_s / 60.0, 0)} min" if longer_s >= 60.0 else f"{longer_s:.0f} s"
        price = f", but take {longer} longer"
    elif more_mm >= 50.0:
        price = f", but take {three_digits(more_mm / 1000.0, 1)} m more filament"
    less, more = (three_digits(max(row.support_area_mm2, 0.0), 0) for row in (fewest_scars, taken))
    support = f" (support on {less} instead of {more} mm²)" if float(less) < float(more) else ""
    saved = f"{three_digits(saved_mm2, 0)} mm² of visible marks{support}{price}"
    return (f"{counted(parts, 'part')} would save {saved}: {advice('parts', parts)}",)
