"""Laying: how a model is laid down and into which parts it is cut, chosen together by what both cost with their time.

Orientations that differ by a symmetry only count once. The rest are ranked by a rough guess, the first of them cut by a narrow
search, and the most promising one by the whole search: that takes as long as three searches at most.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, inf

from mdp.cost.cost import weight_of_stairs
from mdp.decomposition import Decomposition, FrontRow
from mdp.directions.orientation import Orientation, measure_upright, resting_orientations, standing_still
from mdp.mesh import Mesh
from mdp.search.front import EQUAL, Price, Pricing, Worth
from mdp.search.parts import one_piece
from mdp.search.search import decompose
from profiles.profile import Profile

RESTING = 20  # orientations that are ranked, those that a symmetry makes alike counted once
PRICED, SEARCHED = 6, 2  # of them whose bare time is looked at, and that a narrow search cuts
COARSER = 3  # fewer directions in the narrow search
CLEARLY = 0.95  # of the cost: estimates are not good enough to turn a model over for less
# Fitted to estimates of 8 models in 92 orientations, mean error 330 s.
SUPPORT_S_MM2, LAYER_S = 1.4, 4.5  # printing time for each mm2 that needs support, and for each layer
PricingBy = Callable[[Profile], Pricing]


@dataclass(frozen=True, eq=False)
class Lying:
    """A model laid down and cut: turned whole by the orientation, None where it stays as it stands; total_mm2: what it costs
    with its time; standing: the row that is taken of the model as it stands."""

    orientation: Orientation | None
    decomposition: Decomposition
    total_mm2: float
    standing: FrontRow | None


def lay_down(mesh: Mesh, profile: Profile, pricing: PricingBy, search: Callable[[Mesh], Decomposition]) -> Lying:
    """The orientation whose decomposition costs least with its time; as it stands unless another one saves search.turning_mm2 and
    more than estimates are wrong.

    search: the whole search of a mesh; pricing: what parts take to print by a profile.
    """
    worth, upright = Worth.of(profile), search(mesh)
    best = Lying(None, upright, total_mm2(upright.chosen, worth), upright.chosen)
    limit_mm2 = min(CLEARLY * best.total_mm2, best.total_mm2 - profile.search.turning_mm2)
    orientation = _most_promising(mesh, profile, pricing, limit_mm2)
    if orientation is None:
        return best
    decomposition = search(standing_still(mesh, orientation.rotation))
    lying = Lying(orientation, decomposition, total_mm2(decomposition.chosen, worth), upright.chosen)
    return lying if lying.total_mm2 < limit_mm2 else best


@dataclass(frozen=True, eq=False)
class _Glimpse:
    """A model in some orientation: what its time and filament cost without any support, hardly any decomposition less, and what
    it costs in one piece, roughly."""

    orientation: Orientation
    mesh: Mesh
    bare_mm2: float
    whole_mm2: float


def _most_promising(mesh: Mesh, profile: Profile, pricing: PricingBy, limit_mm2: float) -> Orientation | None:
    """The orientation that is likely to cost least when it is cut; None where none is likely to cost less than the limit."""
    worth = Worth.of(profile)
    scar_mm2 = 1.0 + worth.second_mm2 * SUPPORT_S_MM2  # of a mm2 that needs support, with the time that this takes
    stair_mm2 = weight_of_stairs(profile)
    glimpses = []
    for orientation in distinct_orientations(mesh, profile)[:PRICED]:
        turned = standing_still(mesh, orientation.rotation)
        bare = _price_bare(turned, profile, pricing)
        if bare is not None:
            bare_mm2 = worth.of_print(bare.time_s, bare.filament_mm)
            whole_mm2 = bare_mm2 + scar_mm2 * orientation.risky_mm2 + stair_mm2 * orientation.stairs_mm2
            glimpses.append(_Glimpse(orientation, turned, bare_mm2, whole_mm2))
    best = min(glimpses, key=lambda glimpse: glimpse.whole_mm2, default=None)
    if best is None:
        return None
    chosen = None
    if best.whole_mm2 < limit_mm2:
        chosen, limit_mm2 = best.orientation, best.whole_mm2
    others = [glimpse for glimpse in glimpses if glimpse is not best and glimpse.bare_mm2 < limit_mm2]
    if chosen is not None and not others:
        return chosen  # in one piece already it costs less than the others may
    quick = _with_search(profile, beam_width=1, directions=ceil(profile.search.directions / COARSER))
    for glimpse in sorted([best, *others], key=lambda glimpse: glimpse.whole_mm2)[:SEARCHED]:
        rows = decompose(glimpse.mesh, "", quick).front
        cost_mm2 = glimpse.bare_mm2 + min(row.cost_mm2 + (scar_mm2 - 1.0) * row.support_area_mm2 for row in rows)
        if cost_mm2 < limit_mm2:
            chosen, limit_mm2 = glimpse.orientation, cost_mm2
    return chosen


def distinct_orientations(mesh: Mesh, profile: Profile) -> list[Orientation]:
    """Up to RESTING orientations in which the model rests, the one that is guessed to cost least first; without as it stands and
    without those that cannot be told from another one by what needs support, their stairs and their height."""
    angle_deg = profile.process.self_supporting_angle_deg
    upright = measure_upright(mesh, angle_deg)
    resting = resting_orientations(mesh, angle_deg)
    worst_mm2 = max(orientation.risky_mm2 + orientation.stairs_mm2 for orientation in [upright, *resting])
    distinct = [upright]
    for orientation in sorted(resting, key=_guess(profile)):
        if not any(_alike(orientation, known, worst_mm2) for known in distinct):
            distinct.append(orientation)
    return distinct[1 : RESTING + 1]


def _alike(first: Orientation, second: Orientation, worst_mm2: float) -> bool:
    same_area = abs(first.risky_mm2 - second.risky_mm2) + abs(first.stairs_mm2 - second.stairs_mm2) <= EQUAL * worst_mm2
    return same_area and abs(first.height_mm - second.height_mm) <= EQUAL * second.height_mm


def total_mm2(row: FrontRow | None, worth: Worth) -> float:
    """What a row costs with its time and filament; infinite where they count and the row has none, for it cannot be printed."""
    if row is None:
        return 0.0
    price_mm2 = worth.of_row(row)
    return inf if price_mm2 is None else row.cost_mm2 + price_mm2


def _guess(profile: Profile) -> Callable[[Orientation], float]:
    """What orientations cost in one piece, roughly and but for what is the same in all of them, mm2."""
    second_mm2, layer_mm, stair_mm2 = Worth.of(profile).second_mm2, profile.process.layer_height_mm, weight_of_stairs(profile)

    def cost_mm2(orientation: Orientation) -> float:
        seconds = SUPPORT_S_MM2 * orientation.risky_mm2 + LAYER_S * ceil(orientation.height_mm / layer_mm)
        return orientation.risky_mm2 + stair_mm2 * orientation.stairs_mm2 + second_mm2 * seconds

    return cost_mm2


def _price_bare(mesh: Mesh, profile: Profile, pricing: PricingBy) -> Price | None:
    """What a mesh in one piece takes without any support, which hardly any decomposition goes below; None where it cannot be
    printed so."""
    bare = profile.model_copy(update={"process": profile.process.model_copy(update={"support": "none"})})
    return pricing(bare)((one_piece(mesh, profile.machine),))


def _with_search(profile: Profile, **settings: object) -> Profile:
    return profile.model_copy(update={"search": profile.search.model_copy(update=settings)})
