"""Design of a coupon: factors balanced over its bars, and settings that a single bar cannot have."""

from itertools import combinations

import numpy as np
import pytest

from machine.setup.coupon.design import USUAL, Factor, factors, settings_of_bars, signs
from profiles.errors import ProfileError
from profiles.profile import load


def test_effects_of_factors_are_distinguished_from_each_other_and_from_bar_positions() -> None:
    rows = np.array(signs(5))
    height = np.repeat([-1, 1], 4)  # low bars first
    for one, other in combinations([*rows.T, height, np.ones(8)], 2):
        assert one @ other == 0


def test_no_effect_of_one_of_four_factors_is_mixed_with_that_of_two_together() -> None:
    rows = np.array(signs(4))
    for k, (i, j) in ((k, pair) for k in range(4) for pair in combinations(range(4), 2)):
        assert rows[:, k] @ (rows[:, i] * rows[:, j]) == 0


def test_half_of_the_bars_have_the_other_value_and_one_has_no_joint() -> None:
    bars = settings_of_bars([Factor("interface_flow", 1.05, 1.15), Factor("interface_overlap", 0.5, 0.75)])
    assert sum("interface_flow" in own for own in bars) == sum("interface_overlap" in own for own in bars) == 4
    assert {} in settings_of_bars(factors(load()))


def test_the_default_factors_differ_from_any_process() -> None:
    for setting in [f"process.{key}={value}" for key, values in USUAL.items() for value in values]:
        assert all(factor.own != factor.other for factor in factors(load(settings=[setting])))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["interface_flow"], "--vary interface_flow: KEY=VALUE is expected"),
        (["interface_flow=9"], "--vary: process.interface_flow is 9: it must be a number from 0.5 to 1.5"),
        (["line_width_mm=3"], "--vary: process.line_width_mm is 3: a 0.4 mm nozzle prints lines of 0.24 to 1 mm"),
        (["brim_mm=3"], "--vary brim_mm=3: brim_mm cannot differ from bar to bar"),
        (["interface_flow=1.1"], "the process has that value itself, so the bars would be alike"),
        (["interface_flow=1.1", "process.interface_flow=1.2"], "interface_flow is given twice"),
        ([f"walls={k}" for k in range(6)], "--vary is given 6 times: 8 bars can distinguish at most 5 settings"),
    ],
)
def test_factors_that_bars_cannot_be_printed_with_are_refused(given: list[str], said: str) -> None:
    with pytest.raises(ProfileError) as refusal:
        factors(load(), given)
    assert said in str(refusal.value)


def test_a_bar_hotter_than_the_nozzle_may_be_is_refused() -> None:
    with pytest.raises(ProfileError, match=r"printed at 230 °C: generic A/C table allows at most 225 °C"):
        factors(load(settings=["machine.nozzle_limit_c=225"]))
