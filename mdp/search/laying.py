"""Laying: how a model is laid down and into which parts it is cut, chosen together by what both cost with their time.

Orientations that differ by a symmetry only count once. What the first of the rest would cost after a search is forecast from what
they need support for in one piece and from their bare time. Where that leaves no doubt, and what is found costs less than good
cuts would leave of the model as it stands, only one way to lie is searched; else the model as it stands, and another way if a
narrow search promises more.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, cos, inf, radians

from mdp.cost.cost import weight_of_stairs
from mdp.cost.footing import Plate, Stance
from mdp.decomposition import Decomposition, FrontRow
from mdp.directions.orientation import Orientation, facet_orientations, measure_upright, standing_still
from mdp.directions.revolution import find_revolution
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
# Shares of the cost as a model stands that another way to lie must cost less than: estimates are not good enough for CLEARLY;
# where it stands less firmly; where the file has it on a flat base; where nothing holds it as it stands.
CLEARLY, LESS_FIRMLY, FROM_FLAT_BASE, FROM_NO_BASE = 0.95, 0.85, 0.8, 1.1
ALIKE_BASE = 0.9  # times the share of its shadow that a model stands on; less is a smaller base
EVEN = 1.02  # times the least cost: of ways to lie that cost hardly more the one with the fewest scars is taken
NEAR = cos(radians(15.0))  # orientations that differ by less are one
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
    with its time; standing: the row that is taken of the model as it stands, where that was searched; upright: as it stands;
    stance: how the plate holds it."""

    orientation: Orientation | None
    decomposition: Decomposition
    total_mm2: float
    standing: FrontRow | None
    upright: Orientation
    stance: Stance


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
        return Lying(glimpse.orientation, decomposition, total, standing, upright.orientation, glimpse.stance)

    sure = next((other for other in others if other.forecast_mm2 < NO_DOUBT * other.limit_mm2(upright.forecast_mm2)), None)
    tried = [] if sure is None else [(sure, laid(sure, None))]
    for glimpse, lying in tried:
        if lying.total_mm2 < glimpse.limit_mm2(upright.hopeful_mm2):
            return lying
    found = search(mesh)
    standing = Lying(None, found, total_mm2(found.chosen, worth), found.chosen, upright.orientation, upright.stance)
    tried = [(glimpse, replace(lying, standing=found.chosen)) for glimpse, lying in tried]
    if sure is None:
        near = [other for other in others if other.forecast_mm2 < DOUBT * other.limit_mm2(upright.forecast_mm2)]
        likely = [_most_promising(near, quick, standing.total_mm2), _whole(others, quick, pricing, standing)]
        tried = [(glimpse, laid(glimpse, found.chosen)) for glimpse in dict.fromkeys(likely) if glimpse is not None]
    return _best_of(tried, standing)


def _best_of(tried: Sequence[tuple["Glimpse", Lying]], standing: Lying) -> Lying:
    """The way to lie on a flat base, then with the fewest scars, of those that cost less than they must, and hardly more than the
    best of them; as the model stands where it costs hardly more or less than that, or where there are none."""
    better = [lying for glimpse, lying in tried if lying.total_mm2 < glimpse.limit_of(standing, lying)]
    if not better:
        return standing
    least_mm2 = min(lying.total_mm2 for lying in better)
    even = [lying for lying in (*better, standing) if least_mm2 / EVEN <= lying.total_mm2 <= EVEN * least_mm2]
    return min(even, key=lambda lying: (lying.stance != Stance.FLAT, round(lying.decomposition.cost_mm2, 3)))


@dataclass(frozen=True, eq=False)
class Glimpse:
    """A model in some orientation: what its time and filament cost without any support, hardly any decomposition less, what it
    costs in one piece, and after a search, roughly, and where that does well; stance: how the plate holds it; share, saving_mm2:
    of the cost as the model stands, and by how much less than that, it must cost less; whole_share: the same in one piece, where
    the model as it stands is cut."""

    orientation: Orientation
    mesh: Mesh
    bare_mm2: float
    whole_mm2: float
    forecast_mm2: float
    hopeful_mm2: float
    stance: Stance
    share: float
    saving_mm2: float
    whole_share: float

    def limit_mm2(self, standing_mm2: float) -> float:
        """What it must cost less than, by what the model costs as it stands."""
        return min(self.share * standing_mm2, standing_mm2 - self.saving_mm2)

    def limit_of(self, standing: Lying, lying: Lying | None = None) -> float:
        """The same, where the model as it stands is searched; lying: how it is cut in this orientation, None: not at all."""
        limit_mm2, whole = self.limit_mm2(standing.total_mm2), lying is None or len(lying.decomposition.parts) == 1
        if whole and len(standing.decomposition.parts) > 1:
            return max(limit_mm2, self.whole_share * standing.total_mm2)
        return limit_mm2


def glimpses_of(mesh: Mesh, profile: Profile, pricing: PricingBy) -> list[Glimpse]:
    """A model as it stands, then in the first other orientations; infinite where it cannot be printed so."""
    worth, stair_mm2, scar_mm2 = Worth.of(profile), weight_of_stairs(profile), _scar_mm2(Worth.of(profile))
    upright, others = measure_upright(mesh, profile.process.self_supporting_angle_deg), distinct_orientations(mesh, profile)
    orientations = [upright, *others[:PRICED]]
    meshes = [mesh, *(standing_still(mesh, orientation.rotation) for orientation in orientations[1:])]
    prices = side_by_side([partial(_price_bare, turned, profile, pricing) for turned in meshes])
    glimpses, plate = [], Plate.under(mesh, profile)
    standing = plate.stance(upright, of_file=True)
    for orientation, turned, bare in zip(orientations, meshes, prices, strict=True):
        bare_mm2 = inf if bare is None else worth.of_print(bare.time_s, bare.filament_mm)
        scars_mm2, stairs_mm2 = scar_mm2 * orientation.risky_mm2, stair_mm2 * orientation.stairs_mm2
        shares = ((1.0, 1.0), (LEFT, STAIRS_LEFT), (LEAST_LEFT, LEAST_STAIRS_LEFT))
        whole_mm2, forecast_mm2, hopeful_mm2 = (
            bare_mm2 + left * scars_mm2 + stairs_left * stairs_mm2 for left, stairs_left in shares
        )
        stance = standing if orientation is upright else plate.stance(orientation)
        share = _share(standing, stance, _is_broader(orientation, upright))
        saving_mm2 = profile.search.turning_mm2 if share < 1.0 else -inf
        whole_share = FROM_NO_BASE if standing == Stance.LOOSE else ALIKE
        costs_mm2 = bare_mm2, whole_mm2, forecast_mm2, hopeful_mm2
        glimpses.append(Glimpse(orientation, turned, *costs_mm2, stance, share, saving_mm2, whole_share))
    return glimpses


def _is_broader(orientation: Orientation, upright: Orientation) -> bool:
    """Whether a model stands on a flat base that is broader for its height than that of its file."""
    return orientation.lean_deg > upright.lean_deg and orientation.standing_share >= ALIKE_BASE * upright.standing_share


def _share(standing: Stance, lying: Stance, broader: bool) -> float:
    """Of the cost as a model stands, which another way to lie must cost less than, by how it stands then and now."""
    if standing == Stance.FLAT and not (lying == Stance.FLAT and broader):
        return FROM_FLAT_BASE
    if lying < Stance.FIRM:
        return LESS_FIRMLY
    shaky = standing == Stance.LOOSE or (standing == Stance.HELD and lying == Stance.FLAT)
    return FROM_NO_BASE if shaky else CLEARLY


def _scar_mm2(worth: Worth) -> float:
    """What a mm2 that needs support counts, with the time that this takes."""
    return 1.0 + worth.second_mm2 * SUPPORT_S_MM2


def _most_promising(glimpses: Sequence[Glimpse], profile: Profile, standing_mm2: float) -> Glimpse | None:
    """The one that costs least after a narrow search; None where none costs less than it must."""
    quick, chosen = _with_search(profile, beam_width=1, directions=ceil(profile.search.directions / COARSER)), None
    more_mm2, least_mm2 = _scar_mm2(Worth.of(profile)) - 1.0, inf
    able = [glimpse for glimpse in glimpses if glimpse.bare_mm2 < PROMISING * glimpse.limit_mm2(standing_mm2)]
    for glimpse in able[:SEARCHED]:
        rows = decompose(glimpse.mesh, "", quick).front
        cost_mm2 = glimpse.bare_mm2 + min(row.cost_mm2 + more_mm2 * row.support_area_mm2 for row in rows)
        if cost_mm2 < min(PROMISING * glimpse.limit_mm2(standing_mm2), least_mm2):
            chosen, least_mm2 = glimpse, cost_mm2
    return chosen


def _whole(glimpses: Sequence[Glimpse], profile: Profile, pricing: PricingBy, standing: Lying) -> Glimpse | None:
    """The one that costs least in one piece, where that is less than it must cost, or hardly more than several parts of the model
    as it stands."""
    glimpse = min(glimpses, key=lambda glimpse: glimpse.whole_mm2, default=None)
    if glimpse is None:
        return None
    limit_mm2 = glimpse.limit_of(standing)
    if glimpse.whole_mm2 > DOUBT * limit_mm2:
        return None
    problem = Problem(glimpse.mesh, _with_search(profile, hidden_seam_share=1.0, clearance=False))  # of no use without cuts
    row = price_row(front_row(problem.root), (one_piece(glimpse.mesh, profile.machine),), pricing(profile))
    return glimpse if row.time_s is not None and total_mm2(row, Worth.of(profile)) < limit_mm2 else None


def distinct_orientations(mesh: Mesh, profile: Profile) -> list[Orientation]:
    """Up to RESTING orientations in which the model rests and the plate holds it, the one that is guessed to cost least first;
    without as it stands, those near another one, and those that a symmetry makes like another one. A turned body that is most
    of the model stands or lies along its axis."""
    angle_deg, revolution, costs_mm2 = profile.process.self_supporting_angle_deg, find_revolution(mesh), _guess(profile)
    upright, *others = facet_orientations(mesh, angle_deg)
    others = [other for other in others if revolution is None or revolution.is_square_to(other.rotation[2])]
    worst_mm2 = max(orientation.risky_mm2 + orientation.stairs_mm2 for orientation in [upright, *others])
    distinct, plate = [upright], Plate.under(mesh, profile)
    loose = plate.stance(upright, of_file=True) == Stance.LOOSE
    for orientation in sorted(others, key=costs_mm2):
        if len(distinct) > RESTING:
            break
        known = distinct[int(loose) :]  # nothing is too near to a way in which the model would come off
        near = any(float(orientation.rotation[2] @ other.rotation[2]) > NEAR for other in known)
        if near or any(_alike(orientation, other, worst_mm2) for other in known):
            continue
        if plate.stance(orientation) > Stance.LOOSE:
            distinct.append(orientation)
    return distinct[1:]


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
