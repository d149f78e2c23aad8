"""Orientation and parts are chosen together, by what both cost with their time."""

from collections.abc import Callable, Sequence
from functools import partial

import manifold3d as m3
import numpy as np
import pytest

from mdp.cost.footing import Stance
from mdp.cut import mesh_of
from mdp.decomposition import Decomposition, Part
from mdp.directions.orientation import measure_upright, side_in_words, standing_still
from mdp.mesh import Mesh
from mdp.pose import about
from mdp.search import laying
from mdp.search.front import Price, Pricing, Worth
from mdp.search.laying import Lying, distinct_orientations, glimpses_of, lay_down, total_mm2
from mdp.search.search import decompose
from profiles.profile import Profile, load
from tests.shapes import box, branch, tee

PROFILE = load(settings=["search.directions=20", "search.polish=false"])


def by_height(profile: Profile) -> Pricing:
    """A printer that takes 10 s for every mm of height."""

    def price(parts: Sequence[Part]) -> Price:
        return Price(sum(10.0 * float(np.ptp(part.in_part_frame().vertices[:, 2])) for part in parts), 1000.0)

    return price


def laid_down(mesh: Mesh) -> Lying:
    return lay_down(mesh, PROFILE, by_height, partial(decompose, name="mesh", profile=PROFILE, price=by_height(PROFILE)))


@pytest.mark.parametrize(("sides", "others"), [((20, 20, 20), 0), ((20, 20, 40), 1), ((20, 30, 40), 2)])
def test_orientations_that_a_symmetry_makes_alike_count_once(sides: tuple[int, int, int], others: int) -> None:
    assert len(distinct_orientations(box(*sides), PROFILE)) == others


def test_a_tee_is_laid_on_its_side_where_nothing_needs_support() -> None:
    found = laid_down(tee())
    assert found.orientation is not None
    assert (len(found.decomposition.parts), found.decomposition.cost_mm2) == (1, 0.0)
    surface_mm2 = 2 * 700.0 + 160.0 * 10.0  # of a T of 7 cm2 that is 10 mm thick
    assert found.total_mm2 == pytest.approx(0.1 * 10.0 * 10.0 + 100.0 + 0.06 * surface_mm2)  # 100 s, a metre, turned


def test_what_lies_best_stays_as_it_stands() -> None:
    assert laid_down(box(40, 30, 10)).orientation is None


@pytest.mark.parametrize("mesh", [tee(), branch(), box(10, 20, 60)], ids=["tee", "branch", "box"])
def test_laid_down_it_costs_no_more_than_in_one_piece_as_it_stands(mesh: Mesh) -> None:
    whole = decompose(mesh, "mesh", PROFILE, price=by_height(PROFILE)).front[0]
    footing_mm2 = glimpses_of(mesh, PROFILE, by_height)[0].footing_mm2
    assert laid_down(mesh).total_mm2 <= total_mm2(whole, Worth.of(PROFILE)) + footing_mm2


def test_a_model_stays_where_turning_it_saves_less_than_it_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    standing = decompose(tee(), "mesh", PROFILE, price=by_height(PROFILE)).front[0]
    saved_mm2 = total_mm2(standing, Worth.of(PROFILE)) - 110.0  # of 100 s and a metre
    for share, turned in ((0.9, True), (1.1, False)):
        monkeypatch.setattr(laying, "TURNED", share * saved_mm2 / 3000.0)
        assert (laid_down(tee()).orientation is not None) == turned


def leaning_plate() -> Mesh:
    """A plate of 40 x 30 x 4 mm that leans on one edge by 30 degrees, the edge cut level to stand on."""
    turn = about(np.array([0.0, 1.0, 0.0]), np.radians(30.0))
    return standing_still(box(40, 30, 4), turn)


def test_of_two_ways_to_lie_that_need_no_support_the_one_without_stairs_is_taken() -> None:
    ways = distinct_orientations(leaning_plate(), PROFILE)
    assert ways[0].stairs_mm2 == pytest.approx(0.0, abs=1e-6)
    assert measure_upright(leaning_plate(), 45.0).stairs_mm2 == pytest.approx(
        2.0 * (40 * 30 * np.cos(np.radians(30.0)) + 4 * 30 * np.sin(np.radians(30.0)))
    )


def searches(mesh: Mesh, price_by: Callable[[Profile], Pricing]) -> tuple[Lying, int]:
    """How a mesh is laid down, and how many searches that took."""
    searched: list[Mesh] = []

    def search(mesh: Mesh) -> Decomposition:
        searched.append(mesh)
        return decompose(mesh, "mesh", PROFILE, price=price_by(PROFILE))

    return lay_down(mesh, PROFILE, price_by, search), len(searched)


def test_what_can_be_told_without_a_search_is_not_searched() -> None:
    lying, count = searches(tee(arm=80.0), by_height)
    assert (lying.orientation is None, lying.standing, count) == (False, None, 1)
    lying, count = searches(box(40, 30, 10), by_height)
    assert (lying.orientation, count) == (None, 1)


def test_what_is_searched_in_vain_is_compared_with_how_it_stands() -> None:
    def surprised(profile: Profile) -> Pricing:
        bare = profile.process.support == "none"  # a forecast's
        return lambda parts: by_height(profile)(parts) if bare or np.ptp(parts[0].mesh.vertices[:, 2]) > 39 else None

    lying, count = searches(tee(), surprised)
    assert (lying.orientation, count) == (None, 2)


def test_a_way_that_ends_dearer_than_good_cuts_would_leave_it_is_compared_with_how_it_stands() -> None:
    upright = glimpses_of(tee(), PROFILE, by_height)[0]
    hoped_mm2 = (upright.forecast_mm2 + upright.hopeful_mm2) / 2.0  # less than the forecast, and no certainty
    more_s = (hoped_mm2 - laid_down(tee()).total_mm2) / PROFILE.search.second_mm2

    def slow_when_low(profile: Profile) -> Pricing:
        def price(parts: Sequence[Part]) -> Price:
            low = profile.process.support != "none" and np.ptp(parts[0].mesh.vertices[:, 2]) < 39
            found = by_height(profile)(parts)
            assert found is not None
            return Price(found.time_s + more_s * low, found.filament_mm)

        return price

    assert searches(tee(), slow_when_low)[1] == 2


def on_a_small_plate(profile: Profile) -> Pricing:
    """The same printer with a plate for bases up to 20 mm wide."""

    def price(parts: Sequence[Part]) -> Price | None:
        vertices = parts[0].mesh.vertices
        return by_height(profile)(parts) if np.ptp(vertices[vertices[:, 2] < 0.1, 0]) < 20.0 else None

    return price


def test_no_orientation_is_taken_that_the_machine_has_no_room_for() -> None:
    price = on_a_small_plate(PROFILE)
    search = partial(decompose, name="mesh", profile=PROFILE, price=price)
    assert lay_down(tee(), PROFILE, on_a_small_plate, search).orientation is None


def test_a_model_that_cannot_be_printed_as_it_stands_once_it_is_searched_is_laid_down() -> None:
    def too_high(profile: Profile) -> Pricing:
        bare = profile.process.support == "none"  # a forecast's
        return lambda parts: by_height(profile)(parts) if bare or np.ptp(parts[0].mesh.vertices[:, 2]) < 39 else None

    lying, _ = searches(tee(), too_high)
    assert lying.orientation is not None
    assert np.isfinite(lying.total_mm2)


def test_the_side_that_a_model_lies_on_has_a_name() -> None:
    assert side_in_words(measure_upright(tee(), 45.0)) == "as it stands"
    sides = {side_in_words(orientation) for orientation in distinct_orientations(box(20, 30, 40), PROFILE)}
    assert sides <= {"on its front", "on its back", "on its left side", "on its right side", "upside down"}


def test_a_cone_on_its_point_is_set_on_its_base_though_nothing_else_tells_the_two_apart() -> None:
    cone = mesh_of(m3.Manifold.cylinder(40.0, 0.01, 12.0, 64))
    lying = laid_down(cone)
    assert lying.orientation is not None
    assert lying.orientation.rotation[2] == pytest.approx([0, 0, -1], abs=1e-6)
    assert (lying.stance, lying.upright.risky_mm2) == (Stance.FLAT, 0.0)


def test_another_facet_near_that_of_the_file_or_of_another_way_is_none() -> None:
    barrel = mesh_of(m3.Manifold.cylinder(40.0, 10.0, 10.0, 48))  # its sides are facets 7.5 degrees apart
    assert [side_in_words(orientation) != "" for orientation in distinct_orientations(barrel, PROFILE)] == [True]


def test_how_a_model_stands_and_that_it_is_turned_count_as_shares_of_its_surface() -> None:
    wheel = m3.Manifold.cylinder(12.0, 60.0, 60.0, 64) + m3.Manifold.cylinder(32.0, 20.0, 20.0, 64)  # a hub on one side
    on_its_rim = mesh_of(wheel.rotate((90.0, 0.0, 0.0)).translate((0.0, 0.0, 60.0)))
    upright, *others = glimpses_of(on_its_rim, PROFILE, by_height)
    surface_mm2 = on_its_rim.areas_mm2.sum()
    assert (upright.stance, upright.footing_mm2) == (Stance.FIRM, pytest.approx(0.1 * surface_mm2))
    on_its_face = next(other for other in others if other.stance == Stance.FLAT)
    assert on_its_face.footing_mm2 == pytest.approx(0.06 * surface_mm2)


def test_a_glimpse_counts_its_footing_in_all_that_it_forecasts() -> None:
    upright, *others = glimpses_of(box(40, 8, 40), PROFILE, by_height)
    assert upright.footing_mm2 == 0.0
    lying = others[0]
    assert lying.bare_mm2 == pytest.approx(0.1 * 80.0 + 100.0 + 0.06 * (2 * 1600.0 + 4 * 320.0))  # 80 s, a metre
    assert lying.hopeful_mm2 == lying.forecast_mm2 == lying.whole_mm2 == lying.bare_mm2


def test_a_turned_body_stands_or_lies_along_its_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    cup = mesh_of(m3.CrossSection([[(0.0, 0.0), (8.0, 0.0), (20.0, 30.0), (0.0, 30.0)]]).revolve(24))

    def heights() -> set[float]:
        return {round(abs(float(orientation.rotation[2, 2])), 3) for orientation in distinct_orientations(cup, PROFILE)}

    assert heights() <= {0.0, 1.0}
    monkeypatch.setattr(laying, "find_revolution", lambda mesh: None)
    assert not heights() <= {0.0, 1.0}  # on its slanted side
