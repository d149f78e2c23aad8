"""Joint search over orientation and decomposition, by the cost of both with printing time.

How well the model stands on the plate, and whether it is turned from its file's orientation, counts as a share of its surface.
Orientations that differ by a symmetry count once. The cost after a search is forecast for the first few, from the support that
they need in one piece and from their time without any. If one forecast is clearly best, and its search finds a lower cost than
good cuts would give the model as it stands, only that orientation is searched. Otherwise the model is searched as it stands, and
in another orientation if a narrow search promises a better result.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from heapq import heappop, heappush
from itertools import chain
from math import ceil, cos, inf, radians

import numpy as np

from mdp.cost.cost import weight_of_stairs
from mdp.cost.footing import SMALL_BASE, BuildPlate, Footing
from mdp.decomposition import Decomposition, FrontRow
from mdp.directions.orientation import Orientation, facet_orientations, set_on_plate, straight_orientations
from mdp.directions.revolution import find_revolution
from mdp.kernels.processes import parallel_map
from mdp.mesh import Mesh
from mdp.overhang import UP
from mdp.search.coarse import coarse_copy
from mdp.search.front import EQUAL, Price, Pricing, Weights, charge_mm2, front_row, with_price
from mdp.search.parts import one_piece
from mdp.search.problem import Problem, with_search
from mdp.search.search import decompose
from mdp.zone import NO_ZONES
from profiles.profile import Profile

BOUND_SLACK = 1e-4  # degrees, and share of an area, by which rounding may lower a bound
MAX_RANKED = 20  # orientations that are ranked
MAX_FORECASTS = 3  # orientations whose time is estimated, besides the model as it stands
# Blemished share of a model's surface that a narrow base, an unsteady stance, or a turn from the file's orientation is worth:
# fitted so that the chosen row of each sheet of the book of choices is marked best most often (tools/RESULTS.md).
NARROW, UNSTEADY, TURNED = 0.12, 0.06, 0.055
TORN_OFF = 0.5  # that share if the plate does not hold the model at all: more than any turn costs
NEAR = cos(radians(15.0))  # orientations that differ by less count as equal
# Fitted to estimates of 8 models in 92 orientations, mean error 330 s.
SUPPORT_S_MM2, LAYER_S = 1.4, 4.5  # printing time for each mm2 that needs support, and for each layer
# Fitted to whole searches of 429 orientations of 66 models with seams of 0.8 mm (tools/RESULTS.md).
# shares of the area needing support in one piece that remains after cuts, and of the stair-stepping
LEFT, STAIRS_LEFT = 0.6, 0.75
LEAST_LEFT, LEAST_STAIRS_LEFT = 0.3, 0.45  # those shares for good results (34 more models)
# Ratios to the cost of the model as it stands: a forecast below the first is clearly better, one above the second is discarded.
CONFIDENT_RATIO, REJECTION_RATIO = 0.9, 1.3
PROMISING_RATIO = 1.03  # that ratio for narrow searches, which end with a higher cost
# Orientations that a narrow search cuts, and the factor by which it tries fewer directions.
NARROW_SEARCHES, COARSER = 2, 3
PricingBy = Callable[[Profile], Pricing]


@dataclass(frozen=True, eq=False)
class Oriented:
    """A model turned and cut. orientation: its rotation as a whole, None if it stays as it stands; total_mm2: the cost of its
    parts including time, filament, charge for cuts, and footing; standing: the chosen row of the model as it stands, if that was
    searched; upright: the model as it stands; held, upright_held: whether the plate holds it in the chosen and in the present
    orientation.
    """

    orientation: Orientation | None
    decomposition: Decomposition
    total_mm2: float
    standing: FrontRow | None
    upright: Orientation
    held: bool
    upright_held: bool


def orient_and_decompose(mesh: Mesh, profile: Profile, pricing: PricingBy, search: Callable[[Mesh], Decomposition]) -> Oriented:
    """Choose the orientation with the cheapest decomposition, including time, the charge for cuts (search.least_saving) and
    footing.

    search: the whole search of a mesh; pricing: returns the time and filament of parts for a profile.
    """
    copy = coarse_copy(mesh, profile, NO_ZONES)
    coarse, quick = (mesh, profile) if copy is None else (copy, with_search(profile, simplify_faces=0))
    upright, *others = forecast_orientations(coarse, quick, pricing)
    others = sorted((other for other in others if other.bare_mm2 < inf), key=lambda other: other.forecast_mm2)

    def searched(forecast: OrientationForecast) -> Oriented:
        turned = forecast.mesh if copy is None else set_on_plate(mesh, forecast.orientation.rotation)
        return _oriented(forecast, search(turned), upright, profile)

    sure = next((other for other in others if other.forecast_mm2 < CONFIDENT_RATIO * upright.forecast_mm2), None)
    first = None if sure is None else searched(sure)
    if first is not None and first.total_mm2 < upright.optimistic_mm2:
        return first
    standing = _oriented(upright, search(mesh), upright, profile)
    if first is None:
        near = [other for other in others if other.forecast_mm2 < REJECTION_RATIO * standing.total_mm2]
        likely = [
            _most_promising(near, quick, standing.total_mm2),
            _best_in_one_piece(others, quick, pricing, standing.total_mm2),
        ]
        tried = [searched(forecast) for forecast in dict.fromkeys(likely) if forecast is not None]
    else:
        tried = [first]
    best = min((standing, *tried), key=lambda oriented: oriented.total_mm2)
    return replace(best, standing=standing.decomposition.chosen)


def _oriented(
    forecast: "OrientationForecast", decomposition: Decomposition, upright: "OrientationForecast", profile: Profile
) -> Oriented:
    """A model turned and cut, with its total cost."""
    weights, row, further = Weights.of(profile), decomposition.chosen, len(decomposition.parts) - 1
    charge = charge_mm2(decomposition.front, weights, profile.search.least_saving) if further else 0.0
    total = total_mm2(row, weights) + forecast.footing_mm2 + further * charge
    orientation, upright_held = None if forecast is upright else forecast.orientation, upright.footing.held(of_file=True)
    held = upright_held if orientation is None else forecast.footing.held()
    return Oriented(orientation, decomposition, total, None, upright.orientation, held, upright_held)


@dataclass(frozen=True, eq=False)
class OrientationForecast:
    """Forecast cost of a model in an orientation. bare_mm2: of its time and filament without any support (hardly any
    decomposition costs less); whole_mm2: in one piece; forecast_mm2: after a typical search; optimistic_mm2: after a search with
    a good result. All include footing_mm2, the cost of its footing and of being turned.
    """

    orientation: Orientation
    mesh: Mesh
    bare_mm2: float
    whole_mm2: float
    forecast_mm2: float
    optimistic_mm2: float
    footing: Footing
    footing_mm2: float


def forecast_orientations(mesh: Mesh, profile: Profile, pricing: PricingBy) -> list[OrientationForecast]:
    """Forecasts for a model as it stands, then for the first other orientations; infinite if it cannot be printed that way, or if
    there is no other orientation to compare it with.
    """
    weights, stair_mm2, scar_mm2 = Weights.of(profile), weight_of_stairs(profile), _scar_mm2(Weights.of(profile))
    footed = _with_footing(mesh, profile, most=MAX_FORECASTS)
    upright = footed[0][0]
    meshes = [mesh, *(set_on_plate(mesh, orientation.rotation) for orientation, _ in footed[1:])]
    prices = parallel_map(lambda k: _price_bare(meshes[k], profile, pricing), len(meshes)) if len(meshes) > 1 else [None]
    forecasts, surface_mm2 = [], float(mesh.areas_mm2.sum())
    for (orientation, footing), turned, bare in zip(footed, meshes, prices, strict=True):
        footing_mm2 = surface_mm2 * (footing_share(footing) + (0.0 if orientation is upright else TURNED))
        bare_mm2 = footing_mm2 + (inf if bare is None else weights.of_print(*bare))
        scars_mm2, stairs_mm2 = scar_mm2 * orientation.risky_mm2, stair_mm2 * orientation.stairs_mm2
        shares = ((1.0, 1.0), (LEFT, STAIRS_LEFT), (LEAST_LEFT, LEAST_STAIRS_LEFT))
        whole_mm2, forecast_mm2, optimistic_mm2 = (
            bare_mm2 + left * scars_mm2 + stairs_left * stairs_mm2 for left, stairs_left in shares
        )
        forecasts.append(
            OrientationForecast(orientation, turned, bare_mm2, whole_mm2, forecast_mm2, optimistic_mm2, footing, footing_mm2)
        )
    return forecasts


def footing_share(footing: Footing) -> float:
    """Cost of a footing as a share of the model's surface."""
    return NARROW * footing.narrow + UNSTEADY * footing.unsteady + TORN_OFF * footing.torn_off


def _scar_mm2(weights: Weights) -> float:
    """Cost of a mm2 that needs support, including its printing time, mm2."""
    return 1.0 + weights.second_mm2 * SUPPORT_S_MM2


def _most_promising(
    forecasts: Sequence[OrientationForecast], profile: Profile, standing_mm2: float
) -> OrientationForecast | None:
    """The cheapest orientation after a narrow search; None if none comes close to the cost of the model as it stands."""
    quick, chosen = with_search(profile, beam_width=1, directions=ceil(profile.search.directions / COARSER)), None
    more_mm2, least_mm2 = _scar_mm2(Weights.of(profile)) - 1.0, inf
    able = [forecast for forecast in forecasts if forecast.bare_mm2 < PROMISING_RATIO * standing_mm2]
    for forecast in able[:NARROW_SEARCHES]:
        rows = decompose(forecast.mesh, "", quick).front
        cost_mm2 = forecast.bare_mm2 + min(row.cost_mm2 + more_mm2 * row.support_area_mm2 for row in rows)
        if cost_mm2 < min(PROMISING_RATIO * standing_mm2, least_mm2):
            chosen, least_mm2 = forecast, cost_mm2
    return chosen


def _best_in_one_piece(
    forecasts: Sequence[OrientationForecast], profile: Profile, pricing: PricingBy, standing_mm2: float
) -> OrientationForecast | None:
    """The cheapest orientation in one piece, if it costs less than the model as it stands; else None."""
    forecast = min(forecasts, key=lambda forecast: forecast.whole_mm2, default=None)
    if forecast is None or forecast.whole_mm2 > REJECTION_RATIO * standing_mm2:
        return None
    # these terms matter only for cuts
    problem = Problem(forecast.mesh, with_search(profile, hidden_seam_share=1.0, clearance=False))
    row = with_price(front_row(problem.root), pricing(profile)((one_piece(forecast.mesh, profile.machine),)))
    total = total_mm2(row, Weights.of(profile)) + forecast.footing_mm2
    return forecast if row.time_s is not None and total < standing_mm2 else None


def distinct_orientations(mesh: Mesh, profile: Profile, *, for_person: bool = False) -> list[Orientation]:
    """Up to MAX_RANKED orientations in which the plate holds the model, by estimated cost including footing; all orientations if
    the plate holds it in none, not even as it stands.

    The model as it stands is left out, and so are orientations near another one or symmetric to it. A body of revolution that
    makes up most of the model has its axis vertical or horizontal. for_person: also orientations that turn a model from a face
    onto a point, an edge or a rounded end (nine in ten are marked wrong in the book of choices), or a body of revolution from
    upright onto its side.
    """
    return [orientation for orientation, _ in _with_footing(mesh, profile, for_person)[1:]]


def _with_footing(
    mesh: Mesh, profile: Profile, for_person: bool = False, most: int = MAX_RANKED
) -> list[tuple[Orientation, Footing]]:
    """The model as it stands, then up to `most` of the orientations of distinct_orientations, each with its footing."""
    angle_deg = profile.process.self_supporting_angle_deg
    upright, *others = *facet_orientations(mesh, angle_deg), *straight_orientations(mesh, angle_deg)
    worst_mm2 = max(orientation.risky_mm2 + orientation.stairs_mm2 for orientation in [upright, *others])
    plate = BuildPlate.under(mesh, profile)
    standing = plate.footing(upright.rotation)
    held = standing.held(of_file=True)
    keep = held and not for_person
    on_face = keep and standing.on_face
    others = _along_axis(mesh, others, keep)
    able = _possibly_stable(others, plate, on_face)
    ranked = _cheapest_first(able, plate, profile)
    firm = (one for one in ranked if one[1].held() and not (on_face and one[1].on_tip))
    first = next(firm, None)
    if first is not None:
        ranked = chain([first], firm)
    elif not held:
        ranked = _cheapest_first(others, plate, profile)
    known = [upright] if held else []  # otherwise no orientation is too near to it
    distinct: list[tuple[Orientation, Footing]] = []
    for orientation, footing in ranked:
        near = any(float(orientation.rotation[2] @ other.rotation[2]) > NEAR for other in known)
        if not near and not any(_is_equivalent(orientation, other, worst_mm2) for other in known):
            known.append(orientation)
            distinct.append((orientation, footing))
        if len(distinct) == most:
            break
    return [(upright, standing), *distinct]


def _possibly_stable(orientations: list[Orientation], plate: BuildPlate, on_face: bool) -> list[Orientation]:
    """The orientations that the bounds by the model's hull do not exclude: the plate may hold it, with on_face on more than a
    tip.
    """
    if not orientations:
        return []
    touching_mm2, lean_deg = plate.stance_bounds(np.array([orientation.rotation for orientation in orientations]))
    able = lean_deg > -BOUND_SLACK
    if on_face:
        shadows_mm2 = np.array([orientation.shadow_mm2 for orientation in orientations])
        able &= touching_mm2 > (1.0 - BOUND_SLACK) * SMALL_BASE * shadows_mm2
    return [orientations[k] for k in np.flatnonzero(able)]


def _cheapest_first(
    orientations: Sequence[Orientation], plate: BuildPlate, profile: Profile
) -> Iterator[tuple[Orientation, Footing]]:
    """Orientations by the sum of their estimated cost and their footing's; ties keep their order.

    A footing takes a hundred times as long as an estimate and never lowers the sum, so it is measured only when the estimate's
    turn comes.
    """
    surface_mm2 = float(plate.mesh.areas_mm2.sum())
    guesses_mm2 = [_estimate_mm2(orientation, profile) for orientation in orientations]
    measured: list[tuple[float, int, Footing]] = []
    for k in sorted(range(len(orientations)), key=lambda k: guesses_mm2[k]):
        while measured and measured[0][0] < round(guesses_mm2[k], 6):
            _, first, footing = heappop(measured)
            yield orientations[first], footing
        footing = plate.footing(orientations[k].rotation)
        heappush(measured, (round(guesses_mm2[k] + surface_mm2 * footing_share(footing), 6), k, footing))
    while measured:
        _, first, footing = heappop(measured)
        yield orientations[first], footing


def _along_axis(mesh: Mesh, others: list[Orientation], keep: bool) -> list[Orientation]:
    """The orientations in which a body of revolution has a vertical or horizontal axis. keep: only vertical, if it is vertical in
    the file.
    """
    revolution = find_revolution(mesh)
    if revolution is None:
        return others
    fits = revolution.is_upright_along if keep and revolution.is_upright_along(UP) else revolution.is_square_to
    return [other for other in others if fits(other.rotation[2])]


def _is_equivalent(first: Orientation, second: Orientation, worst_mm2: float) -> bool:
    same_area = abs(first.risky_mm2 - second.risky_mm2) + abs(first.stairs_mm2 - second.stairs_mm2) <= EQUAL * worst_mm2
    return same_area and abs(first.height_mm - second.height_mm) <= EQUAL * second.height_mm


def total_mm2(row: FrontRow | None, weights: Weights) -> float:
    """Cost of a row including time and filament, mm2; infinite if these count but the row has none, since it cannot be
    printed.
    """
    if row is None:
        return 0.0
    price_mm2 = weights.of_row(row)
    return inf if price_mm2 is None else row.cost_mm2 + price_mm2


def _estimate_mm2(orientation: Orientation, profile: Profile) -> float:
    """Rough cost of an orientation in one piece, without terms that are equal for all, mm2."""
    layers = ceil(orientation.height_mm / profile.process.layer_height_mm)
    seconds = SUPPORT_S_MM2 * orientation.risky_mm2 + LAYER_S * layers
    stairs_mm2 = weight_of_stairs(profile) * orientation.stairs_mm2
    return orientation.risky_mm2 + stairs_mm2 + Weights.of(profile).second_mm2 * seconds


def _price_bare(mesh: Mesh, profile: Profile, pricing: PricingBy) -> Price | None:
    """Time and filament of a mesh in one piece without any support, which hardly any decomposition undercuts; None if it cannot
    be printed that way.
    """
    bare = profile.model_copy(update={"process": profile.process.model_copy(update={"support": "none"})})
    return pricing(bare)((one_piece(mesh, profile.machine),))
