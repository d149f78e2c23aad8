"""Laying: how a model is laid down and into which parts it is cut, chosen together by what both cost with their time.

How firmly it stands, and that its file has it otherwise, counts as a share of its surface. Orientations that differ by a symmetry
only count once. What the first of the rest would cost after a search is forecast from what they need support for in one piece and
from their bare time. Where that leaves no doubt, and what is found costs less than good cuts would leave of the model as it
stands, only one orientation is searched; else the model as it stands, and another one if a narrow search promises more.
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
from mdp.search.front import EQUAL, Price, Pricing, Worth, charge_mm2, front_row, price_row
from mdp.search.parts import one_piece
from mdp.search.problem import Problem
from mdp.search.search import decompose
from mdp.zone import NO_ZONES
from profiles.profile import Profile

RESTING = 20  # orientations that are ranked, those that a symmetry makes alike counted once
PRICED = 3  # of them whose bare time is looked at
# Shares of a model's surface that it counts as blemished surface how it stands on the plate, and that it lies otherwise than its
# file has it: learned from choices between orientations (tools/fit_choices.py), TURNED also from what judges objected to.
FOOTING = {Stance.LOOSE: 0.14, Stance.HELD: 0.11, Stance.FIRM: 0.1, Stance.FLAT: 0.0}
TURNED = 0.06
NEAR = cos(radians(15.0))  # orientations that differ by less are one
# Fitted to estimates of 8 models in 92 orientations, mean error 330 s.
SUPPORT_S_MM2, LAYER_S = 1.4, 4.5  # printing time for each mm2 that needs support, and for each layer
# Fitted to whole searches of 429 orientations of 66 models with seams of 0.8 mm (tools/RESULTS.md).
LEFT, STAIRS_LEFT = 0.6, 0.75  # share of what needs support in one piece that cuts leave, and of the stairs
LEAST_LEFT, LEAST_STAIRS_LEFT = 0.3, 0.45  # where they do well: chosen on 34 models more, on which LEFT promised too much
# Of what the model costs as it stands: a forecast below the first leaves no doubt, one above the second no hope.
NO_DOUBT, DOUBT = 0.9, 1.3
PROMISING = 1.03  # of the same: narrow searches end higher
SEARCHED, COARSER = 2, 3  # orientations that a narrow search cuts, in so many times fewer directions
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
    """The orientation whose decomposition costs least, with its time, its cuts' charge (search.least_saving) and its footing.

    search: the whole search of a mesh; pricing: what parts take to print by a profile.
    """
    copy = coarse_copy(mesh, profile, NO_ZONES)
    looked_at, quick = (mesh, profile) if copy is None else (copy, as_it_is(profile))
    upright, *others = glimpses_of(looked_at, quick, pricing)
    others = sorted((glimpse for glimpse in others if glimpse.bare_mm2 < inf), key=lambda glimpse: glimpse.forecast_mm2)

    def laid(glimpse: Glimpse, standing: FrontRow | None) -> Lying:
        turned = glimpse.mesh if copy is None else standing_still(mesh, glimpse.orientation.rotation)
        return _lying(glimpse, search(turned), upright.orientation, profile, standing)

    sure = next((other for other in others if other.forecast_mm2 < NO_DOUBT * upright.forecast_mm2), None)
    tried = [] if sure is None else [laid(sure, None)]
    for lying in tried:
        if lying.total_mm2 < upright.hopeful_mm2:
            return lying
    standing = _lying(upright, search(mesh), upright.orientation, profile)
    row = standing.decomposition.chosen
    tried = [replace(lying, standing=row) for lying in tried]
    if sure is None:
        near = [other for other in others if other.forecast_mm2 < DOUBT * standing.total_mm2]
        likely = [_most_promising(near, quick, standing.total_mm2), _whole(others, quick, pricing, standing.total_mm2)]
        tried = [laid(glimpse, row) for glimpse in dict.fromkeys(likely) if glimpse is not None]
    return min((standing, *tried), key=lambda lying: lying.total_mm2)


def _lying(
    glimpse: "Glimpse", decomposition: Decomposition, upright: Orientation, profile: Profile, standing: FrontRow | None = None
) -> Lying:
    """A model in an orientation and cut, with all that this costs."""
    worth, row, further = Worth.of(profile), decomposition.chosen, len(decomposition.parts) - 1
    charge = charge_mm2(decomposition.front, worth, profile.search.least_saving) if further else 0.0
    total = total_mm2(row, worth) + glimpse.footing_mm2 + further * charge
    orientation = None if glimpse.orientation is upright else glimpse.orientation
    return Lying(orientation, decomposition, total, standing or (row if orientation is None else None), upright, glimpse.stance)


@dataclass(frozen=True, eq=False)
class Glimpse:
    """A model in some orientation: what its time and filament cost without any support, hardly any decomposition less, what it
    costs in one piece, and after a search, roughly, and where that does well; stance: how the plate holds it; footing_mm2: what
    that and that it is turned counts, which is in all of these costs."""

    orientation: Orientation
    mesh: Mesh
    bare_mm2: float
    whole_mm2: float
    forecast_mm2: float
    hopeful_mm2: float
    stance: Stance
    footing_mm2: float


def glimpses_of(mesh: Mesh, profile: Profile, pricing: PricingBy) -> list[Glimpse]:
    """A model as it stands, then in the first other orientations; infinite where it cannot be printed so."""
    worth, stair_mm2, scar_mm2 = Worth.of(profile), weight_of_stairs(profile), _scar_mm2(Worth.of(profile))
    upright, others = measure_upright(mesh, profile.process.self_supporting_angle_deg), distinct_orientations(mesh, profile)
    orientations = [upright, *others[:PRICED]]
    meshes = [mesh, *(standing_still(mesh, orientation.rotation) for orientation in orientations[1:])]
    prices = side_by_side([partial(_price_bare, turned, profile, pricing) for turned in meshes])
    glimpses, plate, surface_mm2 = [], Plate.under(mesh, profile), float(mesh.areas_mm2.sum())
    for orientation, turned, bare in zip(orientations, meshes, prices, strict=True):
        of_file = orientation is upright
        stance = plate.stance(orientation.rotation, of_file=of_file)
        footing_mm2 = surface_mm2 * (FOOTING[stance] + (0.0 if of_file else TURNED))
        bare_mm2 = footing_mm2 + (inf if bare is None else worth.of_print(bare.time_s, bare.filament_mm))
        scars_mm2, stairs_mm2 = scar_mm2 * orientation.risky_mm2, stair_mm2 * orientation.stairs_mm2
        shares = ((1.0, 1.0), (LEFT, STAIRS_LEFT), (LEAST_LEFT, LEAST_STAIRS_LEFT))
        whole_mm2, forecast_mm2, hopeful_mm2 = (
            bare_mm2 + left * scars_mm2 + stairs_left * stairs_mm2 for left, stairs_left in shares
        )
        glimpses.append(Glimpse(orientation, turned, bare_mm2, whole_mm2, forecast_mm2, hopeful_mm2, stance, footing_mm2))
    return glimpses


def _scar_mm2(worth: Worth) -> float:
    """What a mm2 that needs support counts, with the time that this takes."""
    return 1.0 + worth.second_mm2 * SUPPORT_S_MM2


def _most_promising(glimpses: Sequence[Glimpse], profile: Profile, standing_mm2: float) -> Glimpse | None:
    """The one that costs least after a narrow search; None where none costs less than it must."""
    quick, chosen = _with_search(profile, beam_width=1, directions=ceil(profile.search.directions / COARSER)), None
    more_mm2, least_mm2 = _scar_mm2(Worth.of(profile)) - 1.0, inf
    able = [glimpse for glimpse in glimpses if glimpse.bare_mm2 < PROMISING * standing_mm2]
    for glimpse in able[:SEARCHED]:
        rows = decompose(glimpse.mesh, "", quick).front
        cost_mm2 = glimpse.bare_mm2 + min(row.cost_mm2 + more_mm2 * row.support_area_mm2 for row in rows)
        if cost_mm2 < min(PROMISING * standing_mm2, least_mm2):
            chosen, least_mm2 = glimpse, cost_mm2
    return chosen


def _whole(glimpses: Sequence[Glimpse], profile: Profile, pricing: PricingBy, standing_mm2: float) -> Glimpse | None:
    """The one that costs least in one piece, where that is less than the model as it stands."""
    glimpse = min(glimpses, key=lambda glimpse: glimpse.whole_mm2, default=None)
    if glimpse is None or glimpse.whole_mm2 > DOUBT * standing_mm2:
        return None
    problem = Problem(glimpse.mesh, _with_search(profile, hidden_seam_share=1.0, clearance=False))  # of no use without cuts
    row = price_row(front_row(problem.root), (one_piece(glimpse.mesh, profile.machine),), pricing(profile))
    total = total_mm2(row, Worth.of(profile)) + glimpse.footing_mm2
    return glimpse if row.time_s is not None and total < standing_mm2 else None


def distinct_orientations(mesh: Mesh, profile: Profile) -> list[Orientation]:
    """Up to RESTING orientations in which the model rests and the plate holds it, sorted by what they are guessed to cost with
    their footing; without as it stands, those near another one, and those that a symmetry makes like another one. A turned body
    that is most of the model stands or lies along its axis."""
    angle_deg, revolution, costs_mm2 = profile.process.self_supporting_angle_deg, find_revolution(mesh), _guess(profile)
    upright, *others = facet_orientations(mesh, angle_deg)
    others = [other for other in others if revolution is None or revolution.is_square_to(other.rotation[2])]
    worst_mm2 = max(orientation.risky_mm2 + orientation.stairs_mm2 for orientation in [upright, *others])
    distinct, stances, plate = [upright], [Stance.LOOSE], Plate.under(mesh, profile)
    loose = plate.stance(upright.rotation, of_file=True) == Stance.LOOSE
    for orientation in sorted(others, key=lambda other: round(costs_mm2(other), 6)):
        if len(distinct) > RESTING:
            break
        known = distinct[int(loose) :]  # nothing is too near to a way in which the model would come off
        near = any(float(orientation.rotation[2] @ other.rotation[2]) > NEAR for other in known)
        if near or any(_alike(orientation, other, worst_mm2) for other in known):
            continue
        stance = plate.stance(orientation.rotation)
        if stance > Stance.LOOSE:
            distinct.append(orientation)
            stances.append(stance)
    surface_mm2 = float(mesh.areas_mm2.sum())
    order = sorted(range(1, len(distinct)), key=lambda k: costs_mm2(distinct[k]) + FOOTING[stances[k]] * surface_mm2)
    return [distinct[k] for k in order]


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
