"""Joint choice of orientation and parts by their cost, including time."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import manifold3d as m3
import numpy as np
import pytest

from mdp.cost.footing import Footing
from mdp.cut import mesh_of
from mdp.decomposition import Decomposition, FrontRow, Part
from mdp.directions.orientation import facet_orientations, set_on_plate, side_in_words
from mdp.mesh import Mesh
from mdp.plane import Plane
from mdp.pose import about
from mdp.search import orient
from mdp.search.front import Price, Pricing, Weights
from mdp.search.orient import Oriented, distinct_orientations, forecast_orientations, orient_and_decompose, total_mm2
from mdp.search.plan_file import PlanFile, PlannedPart
from mdp.search.search import SearchRequest, decompose
from profiles.profile import Profile, load
from tests.shapes import box, branch, tee

PROFILE = load(settings=["search.directions=20", "search.polish=false"])


def by_height(profile: Profile) -> Pricing:
    """A printer that takes 10 s for every mm of height."""

    def price(parts: Sequence[Part]) -> Price:
        return sum(10.0 * float(np.ptp(part.in_part_frame().vertices[:, 2])) for part in parts), 1000.0

    return price


def found(mesh: Mesh) -> Oriented:
    return orient_and_decompose(
        mesh,
        PROFILE,
        by_height,
        partial(decompose, name="mesh", profile=PROFILE, request=SearchRequest(price=by_height(PROFILE))),
    )


@pytest.mark.parametrize(("sides", "others"), [((20, 20, 20), 0), ((20, 20, 40), 1), ((20, 30, 40), 2)])
def test_orientations_equal_by_symmetry_count_once(sides: tuple[int, int, int], others: int) -> None:
    assert len(distinct_orientations(box(*sides), PROFILE)) == others


def test_a_tee_is_laid_on_its_side_where_nothing_needs_support() -> None:
    oriented = found(tee())
    assert oriented.orientation is not None
    assert (len(oriented.decomposition.parts), oriented.decomposition.cost_mm2) == (1, 0.0)
    surface_mm2 = 2 * 700.0 + 160.0 * 10.0  # surface of a T of 7 cm2, 10 mm thick
    flat_mm2 = 0.1 * 10.0 * 10.0 + 100.0 + 0.055 * surface_mm2  # 100 s, a metre, turned
    assert oriented.total_mm2 == pytest.approx(flat_mm2, rel=0.02)  # its stance counts hardly anything


def test_the_best_orientation_is_kept() -> None:
    assert found(box(40, 30, 10)).orientation is None


@pytest.mark.parametrize("mesh", [tee(), branch(), box(10, 20, 60)], ids=["tee", "branch", "box"])
def test_a_chosen_orientation_costs_no_more_than_one_piece_as_it_stands(mesh: Mesh) -> None:
    whole = decompose(mesh, "mesh", PROFILE, SearchRequest(price=by_height(PROFILE))).front[0]
    footing_mm2 = forecast_orientations(mesh, PROFILE, by_height)[0].footing_mm2
    assert found(mesh).total_mm2 <= total_mm2(whole, Weights.of(PROFILE)) + footing_mm2


def test_a_model_stays_where_turning_it_saves_less_than_it_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    standing = decompose(tee(), "mesh", PROFILE, SearchRequest(price=by_height(PROFILE))).front[0]
    footing_mm2 = forecast_orientations(tee(), PROFILE, by_height)[0].footing_mm2
    saved_mm2 = total_mm2(standing, Weights.of(PROFILE)) + footing_mm2 - 110.0  # for 100 s and a metre
    for share, turned in ((0.9, True), (1.1, False)):
        monkeypatch.setattr(orient, "TURNED", share * saved_mm2 / 3000.0)
        assert (found(tee()).orientation is not None) == turned


def leaning_plate() -> Mesh:
    """A plate of 40 x 30 x 4 mm that leans by 30 degrees on one edge, which is cut level to stand on."""
    turn = about(np.array([0.0, 1.0, 0.0]), np.radians(30.0))
    return set_on_plate(box(40, 30, 4), turn)


def test_of_two_orientations_without_support_the_one_without_stairs_is_chosen() -> None:
    ways = distinct_orientations(leaning_plate(), PROFILE)
    assert ways[0].stairs_mm2 == pytest.approx(0.0, abs=1e-6)
    assert facet_orientations(leaning_plate(), 45.0)[0].stairs_mm2 == pytest.approx(
        2.0 * (40 * 30 * np.cos(np.radians(30.0)) + 4 * 30 * np.sin(np.radians(30.0)))
    )


def searches(mesh: Mesh, price_by: Callable[[Profile], Pricing]) -> tuple[Oriented, int]:
    """The chosen orientation of a mesh, and the number of searches that it took."""
    searched: list[Mesh] = []

    def search(mesh: Mesh) -> Decomposition:
        searched.append(mesh)
        return decompose(mesh, "mesh", PROFILE, SearchRequest(price=price_by(PROFILE)))

    return orient_and_decompose(mesh, PROFILE, price_by, search), len(searched)


def test_an_orientation_decided_by_the_forecast_is_not_searched() -> None:
    oriented, count = searches(tee(arm=80.0), by_height)
    assert (oriented.orientation is None, oriented.standing, count) == (False, None, 1)
    oriented, count = searches(box(40, 30, 10), by_height)
    assert (oriented.orientation, count) == (None, 1)


def test_an_unsuccessful_search_of_an_orientation_is_compared_with_the_given_one() -> None:
    def surprised(profile: Profile) -> Pricing:
        bare = profile.process.support == "none"  # a profile of a forecast
        return lambda parts: by_height(profile)(parts) if bare or np.ptp(parts[0].mesh.vertices[:, 2]) > 39 else None

    oriented, count = searches(tee(), surprised)
    assert (oriented.orientation, count) == (None, 2)


def test_an_orientation_more_expensive_than_forecast_is_compared_with_the_given_one() -> None:
    upright = forecast_orientations(tee(), PROFILE, by_height)[0]
    hoped_mm2 = (upright.forecast_mm2 + upright.optimistic_mm2) / 2.0  # less than the forecast, but not certain
    more_s = (hoped_mm2 - found(tee()).total_mm2) / PROFILE.search.second_mm2

    def slow_when_low(profile: Profile) -> Pricing:
        def price(parts: Sequence[Part]) -> Price:
            low = profile.process.support != "none" and np.ptp(parts[0].mesh.vertices[:, 2]) < 39
            found = by_height(profile)(parts)
            assert found is not None
            return found[0] + more_s * low, found[1]

        return price

    assert searches(tee(), slow_when_low)[1] == 2


def on_a_small_plate(profile: Profile) -> Pricing:
    """A printer that takes 10 s per mm of height, with a plate for bases up to 20 mm wide."""

    def price(parts: Sequence[Part]) -> Price | None:
        vertices = parts[0].mesh.vertices
        return by_height(profile)(parts) if np.ptp(vertices[vertices[:, 2] < 0.1, 0]) < 20.0 else None

    return price


def test_no_orientation_is_taken_that_the_machine_has_no_room_for() -> None:
    price = on_a_small_plate(PROFILE)
    search = partial(decompose, name="mesh", profile=PROFILE, request=SearchRequest(price=price))
    assert orient_and_decompose(tee(), PROFILE, on_a_small_plate, search).orientation is None


def test_an_unprintable_given_orientation_is_replaced() -> None:
    def too_high(profile: Profile) -> Pricing:
        bare = profile.process.support == "none"  # a profile of a forecast
        return lambda parts: by_height(profile)(parts) if bare or np.ptp(parts[0].mesh.vertices[:, 2]) < 39 else None

    oriented, _ = searches(tee(), too_high)
    assert oriented.orientation is not None
    assert np.isfinite(oriented.total_mm2)


def test_the_side_on_the_build_plate_has_a_name() -> None:
    assert side_in_words(facet_orientations(tee(), 45.0)[0]) == "as it stands"
    sides = {side_in_words(orientation) for orientation in distinct_orientations(box(20, 30, 40), PROFILE)}
    assert sides <= {"on its front", "on its back", "on its left side", "on its right side", "upside down"}


def test_a_cone_on_its_tip_is_set_on_its_base() -> None:
    cone = mesh_of(m3.Manifold.cylinder(40.0, 0.01, 12.0, 64))
    oriented = found(cone)
    assert oriented.orientation is not None
    assert oriented.orientation.rotation[2] == pytest.approx([0, 0, -1], abs=1e-6)
    assert (oriented.held, oriented.upright.risky_mm2) == (True, 0.0)


def test_orientations_are_15_degrees_apart_from_each_other_and_from_that_of_the_file() -> None:
    barrel = mesh_of(
        m3.Manifold.cylinder(40.0, 10.0, 10.0, 48).scale((1.0, 1.3, 1.0))
    )  # its sides are facets 6 to 10 degrees apart
    ups = np.array([np.array([0.0, 0.0, 1.0]), *(other.rotation[2] for other in distinct_orientations(barrel, PROFILE))])
    assert len(ups) > 1
    assert (ups @ ups.T - np.eye(len(ups))).max() < np.cos(np.radians(15.0))


@pytest.mark.parametrize("pedestal_mm", [0.0, 5.0])
def test_a_model_that_would_tip_over_costs_half_its_surface(pedestal_mm: float) -> None:
    """A needle that neither its brim nor a pedestal can hold lies on its side."""
    profile = load(settings=["search.directions=20", "search.polish=false", f"search.pedestal_mm={pedestal_mm}"])
    needle = mesh_of(m3.Manifold.cylinder(150.0, 1.0, 1.0, 32))
    upright, *others = forecast_orientations(needle, profile, by_height)
    assert not upright.footing.held(of_file=True)
    assert upright.footing_mm2 >= 0.5 * needle.areas_mm2.sum()
    if not pedestal_mm:
        assert min(other.footing_mm2 for other in others) < 0.3 * needle.areas_mm2.sum()


def stance_mm2(x_mm: float, y_mm: float, height_mm: float, surface_mm2: float) -> float:
    """Cost of an unsteady block: 1 N at its top towards a corner of its base and a brim of 5 mm with sharp corners."""
    x, y = x_mm + 10.0, y_mm + 10.0
    tension_mpa = height_mm * np.hypot(6.0 / (x * y**2), 6.0 / (y * x**2)) - 1.24e-6 * 9.81 * x_mm * y_mm * height_mm / (x * y)
    return float(0.06 * tension_mpa / 0.05 * surface_mm2)


def test_a_narrow_base_an_unsteady_stance_and_a_turn_count_as_shares_of_the_surface() -> None:
    steady = Footing(base_share=0.2, touching_share=0.2, lean_deg=30.0, tension_mpa=0.0, brimmed_mpa=0.0)
    assert orient.footing_share(steady) == 0.0
    assert orient.footing_share(replace(steady, base_share=0.1)) == pytest.approx(0.06)
    assert orient.footing_share(replace(steady, base_share=0.0, brimmed_mpa=0.025)) == pytest.approx(0.12 + 0.03)
    assert orient.footing_share(replace(steady, brimmed_mpa=0.1)) == pytest.approx(0.06)
    upright, *others = forecast_orientations(box(40, 40, 10), PROFILE, by_height)
    surface_mm2 = 2 * 1600.0 + 4 * 400.0
    assert upright.footing_mm2 == pytest.approx(stance_mm2(40.0, 40.0, 10.0, surface_mm2), rel=0.1)
    on_side_mm2 = 0.055 * surface_mm2 + stance_mm2(40.0, 10.0, 40.0, surface_mm2)
    assert others[0].footing_mm2 == pytest.approx(on_side_mm2, rel=0.1)


def mushroom() -> m3.Manifold:
    """A half ball on a stem, which needs less support upside down."""
    return m3.Manifold.sphere(20.0, 64).trim_by_plane((0.0, 0.0, 1.0), 0.0) + m3.Manifold.cylinder(30.0, 8.0, 8.0, 64).translate(
        (0.0, 0.0, -30.0)
    )


def block_above() -> m3.Manifold:
    """The half-space above the plane z = 0."""
    return m3.Manifold.cube((100.0, 100.0, 100.0), True).translate((0.0, 0.0, 50.0))


def lowest_z(mesh: Mesh) -> float:
    """The least z of the directions that may point up: -1 where the model may be turned upside down."""
    return min((float(orientation.rotation[2, 2]) for orientation in distinct_orientations(mesh, PROFILE)), default=1.0)


def test_a_model_on_a_face_is_not_turned_onto_a_rounded_end() -> None:
    assert lowest_z(mesh_of(mushroom())) > -0.5
    thin = mushroom() ^ (m3.Manifold.cylinder(30.0, 4.0, 4.0, 64).translate((0.0, 0.0, -30.0)) + block_above())
    assert lowest_z(mesh_of(thin)) == pytest.approx(-1.0)  # its stem touches with 4 % of the shadow: too little
    assert lowest_z(mesh_of(mushroom().trim_by_plane((0.0, 0.0, -1.0), -17.0))) == pytest.approx(-1.0)  # onto a flat top


def test_a_cone_standing_on_its_tip_is_turned_over() -> None:
    upright, *others = forecast_orientations(mesh_of(m3.Manifold.cylinder(40.0, 0.01, 12.0, 64)), PROFILE, by_height)
    assert min(other.forecast_mm2 for other in others) < upright.bare_mm2


def test_a_base_is_found_among_hundreds_of_facets_that_need_less_support() -> None:
    tip = m3.Manifold.batch_hull([m3.Manifold.sphere(3.0, 32), m3.Manifold.sphere(1.0, 48).translate((0.0, 0.0, 30.0))])
    tips = [tip.rotate(turn) for turn in ((0, 90, 0), (0, 90, 90), (0, 90, 180), (0, 90, 270), (0, 180, 0))]
    foot = m3.Manifold.cylinder(30.0, 3.0, 3.0, 32) + m3.Manifold.cylinder(2.0, 6.0, 6.0, 64).translate((0.0, 0.0, 28.0))
    assert lowest_z(mesh_of(m3.Manifold.batch_boolean([foot, *tips], m3.OpType.Add))) == pytest.approx(-1.0)


def test_a_forecast_contains_the_footing() -> None:
    assert forecast_orientations(box(40, 40, 40), PROFILE, by_height)[1:] == []
    flat = forecast_orientations(box(40, 24, 40), PROFILE, by_height)[1]
    surface_mm2 = 2 * 1600.0 + 4 * 960.0
    assert flat.footing_mm2 == pytest.approx(0.055 * surface_mm2 + stance_mm2(40.0, 40.0, 24.0, surface_mm2), rel=0.01)
    assert flat.bare_mm2 == pytest.approx(0.1 * 240.0 + 100.0 + flat.footing_mm2)  # 240 s, a metre
    assert flat.optimistic_mm2 == flat.forecast_mm2 == flat.whole_mm2 == flat.bare_mm2


def test_a_model_that_leans_on_a_blunt_end_is_offered_straight_on_it() -> None:
    """A rod with a ball at its end, leaning by 20 degrees: upright it stands on no facet of its hull."""
    club = m3.Manifold.cylinder(60.0, 5.0, 5.0, 64) + m3.Manifold.sphere(9.0, 64)
    leaning = mesh_of(club.rotate((20.0, 0.0, 0.0)))
    along = about(np.array([1.0, 0.0, 0.0]), np.radians(20.0)) @ np.array([0.0, 0.0, 1.0])
    straight = max(float(abs(other.rotation[2] @ along)) for other in orient.straight_orientations(leaning, 45.0))
    assert straight == pytest.approx(1.0, abs=1e-6)


def test_a_rounded_model_is_offered_straight_along_the_sides_of_its_file() -> None:
    """An ellipsoid that leans by 20 degrees: the sides of its box are neither facets nor principal axes."""
    leaning = mesh_of(m3.Manifold.sphere(10.0, 48).scale((1.0, 1.5, 3.0)).rotate((20.0, 30.0, 10.0)))
    ups = np.array([other.rotation[2] for other in orient.straight_orientations(leaning, 45.0)])
    for side in ([1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, -1]):
        assert (ups @ side).max() == pytest.approx(1.0)
    assert (ups @ [0, 0, 1]).max() < 0.999  # the given orientation is not listed as another one


def test_every_further_part_is_charged_a_share_of_what_one_piece_costs() -> None:
    flat = box(40, 30, 10)
    halves = decompose(
        flat, "box", PROFILE, SearchRequest(plan=PlanFile("", parts=(PlannedPart.of(Plane(np.array([0.0, 0.0, 1.0]), 5.0)),)))
    )
    one = FrontRow((), 1000.0, 0.0, 1000.0, time_s=1000.0, filament_mm=1000.0)  # with time and filament 1200 mm2
    two = FrontRow((), 800.0, 0.0, 800.0, chosen=True, time_s=500.0, filament_mm=1000.0)
    oriented = orient_and_decompose(flat, PROFILE, by_height, lambda mesh: replace(halves, front=(one, two)))
    assert oriented.total_mm2 == pytest.approx(800.0 + 0.1 * 500.0 + 100.0 + 0.03 * 1200.0, rel=0.005)  # plus its stance


def test_all_orientations_are_forecast_if_none_is_stable() -> None:
    spikes = [
        m3.Manifold.cylinder(30.0, 6.0, 0.1, 16).rotate(turn) for turn in ((0, 180, 0), (0, 60, 0), (0, 60, 120), (0, 60, 240))
    ]
    caltrop = mesh_of(m3.Manifold.batch_boolean(spikes, m3.OpType.Add))
    without_brim = load(settings=["search.directions=20", "search.polish=false", "process.small_base_brim_mm=0"])
    forecasts = forecast_orientations(caltrop, without_brim, by_height)
    assert [forecast.footing.held() for forecast in forecasts] == [False] * 4


def axis_heights(mesh: Mesh) -> set[float]:
    """The values of abs(cos) between a body's axis z and the vertical in its orientations, 0 to 1."""
    return {round(abs(float(orientation.rotation[2, 2])), 3) for orientation in distinct_orientations(mesh, PROFILE)}


def test_a_body_of_revolution_is_upright_or_along_its_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    cup = m3.CrossSection([[(0.0, 0.0), (8.0, 0.0), (20.0, 30.0), (0.0, 30.0)]]).revolve(24)
    drum = m3.Manifold.cylinder(30.0, 20.0, 20.0, 48) - m3.Manifold.cylinder(30.0, 5.0, 9.0, 48)
    assert 0.0 not in axis_heights(mesh_of(drum))  # it is already upright
    sides = distinct_orientations(mesh_of(drum), PROFILE, for_person=True)
    assert any(abs(float(side.rotation[2, 2])) < 1e-6 for side in sides)
    lying = mesh_of(cup.rotate((90.0, 0.0, 0.0)))
    along = {round(abs(float(orientation.rotation[2, 1])), 3) for orientation in distinct_orientations(lying, PROFILE)}
    assert 1.0 in along
    assert along <= {0.0, 1.0}
    monkeypatch.setattr(orient, "find_revolution", lambda mesh: None)
    assert not axis_heights(mesh_of(cup)) <= {0.0, 1.0}  # on its slanted side
    assert 0.0 in axis_heights(mesh_of(drum))
