"""Quantities: measures with three digits, and the cost of a print whose material has a price."""

import pytest

from machine.gcode.settings import foot
from machine.quantities import amount, percent, price, price_in_words, price_json
from profiles.messages import three_digits
from profiles.profile import load

PRICED = load(settings=["material.price_per_kg=25", "material.currency=EUR", "material.density_g_cm3=1.25"])
TEN_GRAMS_MM = 8000.0 / (3.141592653589793 * 1.75**2 / 4)  # 8 cm3


def test_filament_costs_what_a_kilogram_costs_by_its_weight() -> None:
    assert price(TEN_GRAMS_MM, PRICED.material) == pytest.approx(0.25)
    assert price_in_words(TEN_GRAMS_MM, PRICED.material) == "0.25 EUR"
    assert price_json(TEN_GRAMS_MM, PRICED.material) == {"cost": pytest.approx(0.25), "currency": "EUR"}


def test_an_amount_has_at_most_three_digits() -> None:
    assert [amount(value) for value in (0.0, 9.447, 9.996, 20.66, 99.96, 1234.5)] == [
        "0.00",
        "9.45",
        "10.0",
        "20.7",
        "100",
        "1230",
    ]
    assert [amount(value, 1) for value in (-1e-9, 0.04, 86.94, 344.8, 1784.9)] == ["0.0", "0.0", "86.9", "345", "1780"]


def test_a_measure_with_a_sign_or_more_decimals_has_at_most_three_digits() -> None:
    assert [three_digits(value, 1) for value in (-0.04, -9.96, -123.4, 359.96)] == ["0.0", "-10.0", "-123", "360"]
    assert [three_digits(value, 1) for value in (5.7499, 5.75, 44.4499)] == ["5.7", "5.8", "44.4"]
    assert [three_digits(value, 4) for value in (0.12345, 0.012345, 0.000012)] == ["0.123", "0.0123", "0.0000"]


def test_a_share_of_100_percent_has_no_decimals() -> None:
    assert [percent(share, 1) for share in (None, 0.0, 0.8497, 0.9996, -0.123)] == ["-", "0.0", "85.0", "100", "-12.3"]


def test_without_a_price_no_cost_is_shown_or_written() -> None:
    assert (price(1.0, load().material), price_in_words(1.0, load().material), price_json(1.0, load().material)) == (None, "", {})
    assert not [line for line in foot(load(), 1.0, 1.0) if "cost = " in line or "price" in line or "currency" in line]


def test_a_file_states_the_cost_in_the_words_that_print_hosts_read() -> None:
    lines = list(foot(PRICED, TEN_GRAMS_MM, 1.0))
    assert "; filament cost = 0.25" in lines
    assert "; material.price_per_kg = 25.0" in lines
