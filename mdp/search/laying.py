"""Laying: how a model is laid down and into which parts it is cut, chosen together by what both cost with their time.

Orientations that differ by a symmetry only count once. What the first of the rest would cost after a search is forecast from what
they need support for in one piece and from their bare time. Where that leaves no doubt, and what is found costs less than good
cuts would leave of the model as it stands, only one way to lie is searched; else the model as it stands, and another way if a
narrow search promises more.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, inf

from mdp.cost.cost import weight_of_stairs
from mdp.decomposition import Decomposition, FrontRow
from mdp.directions.orientation import Orientation, measure_upright, resting_orientations, standing_still
from mdp.kernels.processes import side_by_side
from mdp.mesh import Mesh
from mdp.search.coarse import as_it_is, coarse_copy
from mdp.search.front import EQUAL, Price, Pricing, Worth, front_row, price_row
from mdp.search.parts import one_piece
from mdp.search.problem import Problem
from mdp.search.search import decompose
from mdp.zone import NO_ZONES
from profiles.profile import Profile

RESTING = 20  # orientations that are ranked, those that a symmetry makes alike counted once
PRICED = 3  # of them whose bare time is looked at
CLEARLY = 0.95  # of the cost: estimates are not good enough to turn a model over for less
ALIKE = 1.03  # of the cost: nobody cuts a model for less who may lay it down in one piece
# Fitted to estimates of 8 models in 92 orientations, mean error 330 s.
SUPPORT_S_MM2, LAYER_S = 1.4, 4.5  # printing time for each mm2 that needs support, and for each layer
# Fitted to whole searches of 429 orientations of 66 models (tools/RESULTS.md).
LEFT, STAIRS_LEFT = 0.6, 0.75  # share of what needs support in one piece that cuts leave, and of the stairs
LEAST_LEFT, LEAST_STAIRS_LEFT = 0.3, 0.45  # where they do well: chosen on 34 models more, on which LEFT promised too much
# Of the cost below which another way to lie is taken: a forecast below the first leaves no doubt, one above the second no hope.
NO_DOUBT, DOUBT = 0.9, 1.3
PROMISING = 1.03  # of that cost: narrow searches end higher
SEARCHED, COARSER = 2, 3  # ways to lie that a narrow search cuts, in so many times fewer directions
PricingBy = Callable[[Profile], Pricing]


@dataclass(frozen=True, eq=False)
class Lying:
    """A model laid down and cut: turned whole by the orientation, None where it stays as it stands; total_mm2: what it costs
    with its time; standing: the row that is taken of the model as it stands, where that was searched; upright: as it stands."""

    orientation: Orientation | None
    decomposition: Decomposition
    total_mm2: float
    standing: FrontRow | None
    upright: Orientation


def lay_down(mesh: Mesh, profile: Profile, pricing: PricingBy, search: Callable[[Mesh], Decomposition]) -> Lying:
    """The orientation whose decomposition costs least with its time; as it stands unless another one saves search.turning_mm2 and
    more than estimates are wrong, or costs as much in one piece as this one in several parts.

    search: the whole search of a mesh; pricing: what parts take to print by a profile.
    """
    worth, copy = Worth.of(profile), coarse_copy(mesh, profile, NO_ZONES)
    looked_at, quick = (mesh, profile) if copy is None else (copy, as_it_is(profile))
    upright, *others = glimpses_of(looked_at, quick, pricing)
    others = sorted((glimpse for glimpse in others if glimpse.bare_mm2 < inf), key=lambda glimpse: glimpse.forecast_mm2)

    def laid(glimpse: Glimpse, standing: FrontRow | None) -> Lying:
        turned = glimpse.mesh if copy is None else standing_still(mesh, glimpse.orientation.rotation)
        decomposition = search(turned)
        total = total_mm2(decomposition.chosen, worth)
        return Lying(glimpse.orientation, decomposition, total, standing, upright.orientation)

    limit_mm2 = _limit_mm2(upright.forecast_mm2, profile)
    lying = laid(others[0], None) if others and others[0].forecast_mm2 < NO_DOUBT * limit_mm2 else None
    if lying is not None and lying.total_mm2 < _limit_mm2(upright.hopeful_mm2, profile):
        return lying
    found = search(mesh)
    best = Lying(None, found, total_mm2(found.chosen, worth), found.chosen, upright.orientation)
    if lying is not None:
        lying = replace(lying, standing=found.chosen)
    else:
        near = [glimpse for glimpse in others if glimpse.forecast_mm2 < DOUBT * limit_mm2]
        likely = _most_promising(near, quick, PROMISING * _limit_mm2(best.total_mm2, profile))
        if likely is None and len(found.parts) > 1:
            likely = _whole(others, quick, pricing, ALIKE * best.total_mm2)
        lying = None if likely is None else laid(likely, found.chosen)
    return lying if lying is not None and _is_better(lying, best, profile) else best


def _is_better(lying: Lying, standing: Lying, profile: Profile) -> bool:
    """Whether a model is to lie so instead of as it stands."""
    whole = len(lying.decomposition.parts) == 1 < len(standing.decomposition.parts)
    alike = whole and lying.total_mm2 < ALIKE * standing.total_mm2
    return alike or lying.total_mm2 < _limit_mm2(standing.total_mm2, profile)


def _limit_mm2(standing_mm2: float, profile: Profile) -> float:
    """What another way to lie must cost less than, by what it costs as the model stands."""
    return min(CLEARLY * standing_mm2, standing_mm2 - profile.search.turning_mm2)


@dataclass(frozen=True, eq=False)
class Glimpse:
    """A model in some orientation: what its time and filament cost without any support, hardly any decomposition less, what it
    costs in one piece, and after a search, roughly, and where that does well."""

    orientation: Orientation
    mesh: Mesh
    bare_mm2: float
    whole_mm2: float
    forecast_mm2: float
    hopeful_mm2: float


def glimpses_of(mesh: Mesh, profile: Profile, pricing: PricingBy) -> list[Glimpse]:
    """A model as it stands, then in the first other orientations; infinite where it cannot be printed so."""
    worth, stair_mm2, scar_mm2 = Worth.of(profile), weight_of_stairs(profile), _scar_mm2(Worth.of(profile))
    upright, others = measure_upright(mesh, profile.process.self_supporting_angle_deg), distinct_orientations(mesh, profile)
    orientations = [upright, *others[:PRICED]]
    meshes = [mesh, *(standing_still(mesh, orientation.rotation) for orientation in orientations[1:])]
    prices = side_by_side([partial(_price_bare, turned, profile, pricing) for turned in meshes])
    glimpses = []
    for orientation, turned, bare in zip(orientations, meshes, prices, strict=True):
        bare_mm2 = inf if bare is None else worth.of_print(bare.time_s, bare.filament_mm)
        scars_mm2, stairs_mm2 = scar_mm2 * orientation.risky_mm2, stair_mm2 * orientation.stairs_mm2
        shares = ((1.0, 1.0), (LEFT, STAIRS_LEFT), (LEAST_LEFT, LEAST_STAIRS_LEFT))
        costs_mm2 = (bare_mm2 + left * scars_mm2 + stairs_left * stairs_mm2 for left, stairs_left in shares)
        glimpses.append(Glimpse(orientation, turned, bare_mm2, *costs_mm2))
    return glimpses


def _scar_mm2(worth: Worth) -> float:
    """What a mm2 that needs support counts, with the time that this takes."""
    return 1.0 + worth.second_mm2 * SUPPORT_S_MM2


def _most_promising(glimpses: Sequence[Glimpse], profile: Profile, limit_mm2: float) -> Glimpse | None:
    """The one that costs least after a narrow search; None where none costs less than the limit."""
    quick, chosen = _with_search(profile, beam_width=1, directions=ceil(profile.search.directions / COARSER)), None
    more_mm2 = _scar_mm2(Worth.of(profile)) - 1.0
    for glimpse in [glimpse for glimpse in glimpses if glimpse.bare_mm2 < limit_mm2][:SEARCHED]:
        rows = decompose(glimpse.mesh, "", quick).front
        cost_mm2 = glimpse.bare_mm2 + min(row.cost_mm2 + more_mm2 * row.support_area_mm2 for row in rows)
        if cost_mm2 < limit_mm2:
            chosen, limit_mm2 = glimpse, cost_mm2
    return chosen


def _whole(glimpses: Sequence[Glimpse], profile: Profile, pricing: PricingBy, limit_mm2: float) -> Glimpse | None:
    """The one that costs least in one piece, where that is less than the limit."""
    glimpse = min(glimpses, key=lambda glimpse: glimpse.whole_mm2, default=None)
    if glimpse is None or glimpse.whole_mm2 > DOUBT * limit_mm2:
        return None
    problem = Problem(glimpse.mesh, _with_search(profile, hidden_seam_share=1.0, clearance=False))  # of no use without cuts
    row = price_row(front_row(problem.root), (one_piece(glimpse.mesh, profile.machine),), pricing(profile))
    return glimpse if row.time_s is not None and total_mm2(row, Worth.of(profile)) < limit_mm2 else None


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
