"""Choice from a front: the fewest parts within tolerance of the minimum cost, seconds counted by their price."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.decomposition import FrontRow
from mdp.plane import Plane
from mdp.search.front import Weights, choose, pareto_optimal
from profiles.messages import advice
from profiles.profile import load

PLANE = Plane(np.array([0.0, 0.0, 1.0]), 5.0)


def front(*costs_and_times: tuple[float, float | None]) -> list[FrontRow]:
    """Rows of one part, two parts and so on, with these mm² of blemishes and seconds."""
    rows = enumerate(costs_and_times)
    return [FrontRow((PLANE,) * count, cost_mm2, 0.0, cost_mm2, time_s=time_s) for count, (cost_mm2, time_s) in rows]


# The bunny: cutting reduces blemishes and takes time.
BUNNY = front((1885.0, 10529.0), (1771.0, 10751.0), (1495.0, 11350.0), (1384.0, 11948.0), (1406.0, None))


@pytest.mark.parametrize(("second_mm2", "parts"), [(0.0, 4), (0.1, 4), (0.3, 3), (0.45, 3), (0.5, 2), (0.6, 1), (100.0, 1)])
def test_the_dearer_a_second_the_fewer_the_parts_that_take_long(second_mm2: float, parts: int) -> None:
    assert choose(BUNNY, Weights(second_mm2)).place + 1 == parts


@given(st.lists(st.tuples(st.floats(0, 1e4), st.floats(1, 1e5)), min_size=1, max_size=8))
def test_without_a_price_of_time_the_fewest_parts_near_the_least_marks_are_chosen(
    values: list[tuple[float, float]],
) -> None:
    rows = front(*values)
    least_mm2 = min(row.cost_mm2 for row in rows)
    limit_mm2 = least_mm2 + 0.01 * rows[0].cost_mm2
    assert choose(rows, Weights(0.0)).place == next(place for place, row in enumerate(rows) if row.cost_mm2 <= limit_mm2)


def test_a_small_part_that_saves_next_to_nothing_is_not_cut_off() -> None:
    assert choose(front((640.0, None), (336.0, None), (331.0, None)), Weights(0.0)).place == 1


@given(st.lists(st.tuples(st.floats(0, 1e4), st.floats(1, 1e5)), min_size=1, max_size=8))
def test_if_only_time_counts_the_fastest_row_that_saves_marks_is_chosen(values: list[tuple[float, float]]) -> None:
    rows = front(*values)
    fastest_s = min(row.time_s or 0.0 for row, good in zip(rows, pareto_optimal(rows), strict=True) if good)
    assert (rows[choose(rows, Weights(1e9)).place].time_s or 0.0) - fastest_s <= 1e-3


# Three rows with 100 mm² of time each (200 s at 0.5 mm²/s); the first cut saves 400 mm² of blemishes, the second 200 mm².
THREE = front((1000.0, 200.0), (600.0, 200.0), (400.0, 200.0))


@pytest.mark.parametrize(("least_saving", "parts"), [(0.0, 3), (0.18, 3), (0.19, 2), (0.36, 2), (0.37, 1)])
def test_every_further_part_saves_at_least_that_share_of_the_cost_of_one_piece(least_saving: float, parts: int) -> None:
    assert choose(THREE, Weights(0.5), least_saving=least_saving).place + 1 == parts


def test_the_chosen_row_has_the_lowest_total_of_cost_time_and_the_charge_for_further_parts() -> None:
    choice = choose(THREE, Weights(0.5), least_saving=0.19)
    assert (choice.place, choice.reason) == (1, "for the lowest total")
    marked = choice.marked(THREE)
    assert [row.total_mm2 for row in marked] == pytest.approx([1100.0, 700.0 + 0.19 * 1100.0, 500.0 + 0.38 * 1100.0])
    assert [row.chosen for row in marked] == [False, True, False]
    assert [row.total_mm2 for row in choose(THREE, Weights(0.0)).marked(THREE)] == [None] * 3


def test_the_savings_of_more_cuts_are_reported_with_their_time() -> None:
    choice = choose(THREE, Weights(0.5), least_saving=0.4)
    assert choice.note == (
        "3 parts would save 600 mm² of visible marks (support on 400 instead of 1000 mm²) with 2 more cuts: "
        f"{advice('parts', 3)}",
    )
    rows = front((1000.0, 900.0), (500.0, 800.0))
    rows = [replace(row, filament_mm=filament_mm) for row, filament_mm in zip(rows, (10_000.0, 12_000.0), strict=True)]
    choice = choose(rows, Weights(0.5), least_saving=0.6)
    assert choice.note == (
        "2 parts would save 500 mm² of visible marks (support on 500 instead of 1000 mm²), but take 2.0 m more filament: "
        f"{advice('parts', 2)}",
    )


def test_a_row_that_costs_more_than_one_with_fewer_parts_is_not_taken_however_fast() -> None:
    assert choose(front((100.0, 900.0), (120.0, 1.0)), Weights(1.0)).place == 0


def test_a_row_that_cannot_be_printed_is_not_taken_while_another_one_can() -> None:
    rows = front((200.0, 900.0), (100.0, None))
    assert [choose(rows, Weights(second_mm2)).place for second_mm2 in (0.0, 1.0)] == [0, 0]
    assert choose(front((200.0, None), (100.0, None)), Weights(1.0)).place == 1


def test_savings_given_up_for_time_are_reported_with_figures() -> None:
    choice = choose(BUNNY, Weights(1.0))
    assert choice.reason == "for the lowest total"
    assert choice.note == (
        "4 parts would save 501 mm² of visible marks (support on 1380 instead of 1880 mm²), but take 24 min longer: "
        f"{advice('parts', 4)}",
    )
    assert choose(BUNNY, Weights(0.0)).note == ()


@pytest.mark.parametrize(
    ("setting", "price"),
    [
        ("process.support=auto", 0.3),
        ("process.support=none", 0.0),
        ("search.objective=risky", 0.0),
        ("search.method=published", 0.0),
        ("search.seam_mm=0", 0.0),
    ],
)
def test_seconds_and_filament_count_where_scars_do_and_support_is_printed(setting: str, price: float) -> None:
    worth = Weights.of(load(settings=["search.second_mm2=0.3", "search.metre_mm2=40", setting]))
    assert worth == Weights(price, 0.04 * (price > 0.0))


def test_of_two_equally_fast_rows_the_one_with_less_filament_is_chosen_if_that_has_a_price() -> None:
    rows = [
        replace(row, filament_mm=filament_mm)
        for row, filament_mm in zip(front((100.0, 60.0), (90.0, 60.0)), (4e3, 5e3), strict=True)
    ]
    assert [choose(rows, Weights(0.5, filament_mm2)).place for filament_mm2 in (0.0, 0.05)] == [1, 0]


def test_a_row_without_a_time_is_said_to_be_no_choice() -> None:
    assert choose(front((200.0, 900.0), (100.0, None)), Weights(1.0)).reason == "for the lowest cost that prints well"


def test_without_a_price_of_time_cuts_have_no_charge() -> None:
    assert choose(THREE, Weights(0.0), least_saving=1.0).place == 2


def test_a_row_that_is_not_sound_is_not_taken_though_it_has_a_time() -> None:
    rows = [*THREE[:2], replace(THREE[2], flaw="the first part is too small to carry the others")]
    choice = choose(rows, Weights(0.5))
    assert choice.place == 1
    assert "but the first part is too small to carry the others" in choice.note[0]
