"""The fit of break loads: exact without scatter, the true winners with it, and effects that too few bars cannot separate."""

from dataclasses import replace

import numpy as np
import pytest

from machine.setup.coupon.bars import BEND, TENSILE, Shape
from machine.setup.coupon.fit import evaluate, student_beyond
from profiles.errors import ProfileError
from tests.machine.setup.coupon.sheets import FACTORS, WHOLE_MPA, broken

TRUTH = (1.25, 0.8, 1.25, 1.0)  # overlap and heat help, more flow harms, more solid layers have no effect
WINNERS = {"interface_overlap": 0.75, "interface_temperature_add_c": 20.0}
NAN = float("nan")


@pytest.mark.parametrize("shape", [TENSILE, BEND])
def test_without_scatter_strengths_and_effects_are_exact(shape: Shape) -> None:
    outcome = evaluate(broken(TRUTH, 1, shape=shape))
    assert [effect.ratio for effect in outcome.effects] == pytest.approx(TRUTH)
    assert (outcome.joint_mpa, outcome.upright_mpa, outcome.lying_mpa) == pytest.approx((12.0, WHOLE_MPA["z"], WHOLE_MPA["x"]))
    assert outcome.scatter == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("plates", "ratio"), [(1, 1.7), (2, 1.35), (3, 1.25)])
def test_with_ten_per_cent_scatter_the_true_settings_win_in_95_of_100_runs(plates: int, ratio: float) -> None:
    truth = (ratio, 1.0 / ratio, ratio, 1.0)
    right = sum(evaluate(broken(truth, plates, 0.1, seed)).won == WINNERS for seed in range(200))
    assert right >= 190


def test_without_an_effect_no_setting_wins_in_95_of_100_runs() -> None:
    assert sum(evaluate(broken((1.0,) * 4, 2, 0.1, seed)).won == {} for seed in range(200)) >= 190


def test_the_scatter_and_the_strength_of_the_best_joint_are_estimated() -> None:
    outcomes = [evaluate(broken(TRUTH, 3, 0.1, seed)) for seed in range(100)]
    assert np.sqrt(np.mean([outcome.scatter**2 for outcome in outcomes])) == pytest.approx(0.1, rel=0.05)
    best = np.median([outcome.best_joint_mpa for outcome in outcomes])
    assert best == pytest.approx(12.0 * 1.25**2, rel=0.03)


def test_an_effect_hidden_by_scatter_keeps_the_default_and_states_the_detectable_effect() -> None:
    (effect,) = evaluate(broken((1.05,), 1, 0.1, 3)).effects
    assert not effect.significant
    assert not effect.wins
    assert effect.least_ratio > 1.1


def test_a_harmful_setting_is_reported_and_does_not_win() -> None:
    effect = evaluate(broken(TRUTH, 3, 0.05, 1)).effects[1]
    assert effect.significant
    assert not effect.wins


def test_bars_that_were_not_broken_are_left_out() -> None:
    sheet = broken(TRUTH, 1)
    loads = list(sheet.loads_n)
    loads[2] = loads[8] = loads[9] = (NAN,)
    outcome = evaluate(replace(sheet, loads_n=tuple(loads)))
    assert outcome.upright_mpa is None
    assert outcome.loads == 9
    assert [effect.ratio for effect in outcome.effects] == pytest.approx(TRUTH)


@pytest.mark.parametrize("told", [0, 1, 6, 8])
def test_too_few_loads_are_refused(told: int) -> None:
    sheet = broken(TRUTH, 1)
    loads = tuple(load if k >= 12 - told else (NAN,) for k, load in enumerate(sheet.loads_n))
    with pytest.raises(ProfileError, match=f"^{told} loads are too few for [5-7] numbers: at least"):
        evaluate(replace(sheet, loads_n=loads))


def test_loads_that_cannot_distinguish_settings_are_refused() -> None:
    sheet = broken(TRUTH, 3)
    loads = tuple(load if k in (0, 1, 8, 9, 10) else (NAN,) for k, load in enumerate(sheet.loads_n))
    with pytest.raises(ProfileError, match="do not distinguish the settings"):
        evaluate(replace(sheet, loads_n=loads))


@pytest.mark.parametrize("freedom", [1, 2, 3, 5, 8, 30])
def test_student_s_t_is_that_of_a_numerical_integral(freedom: int) -> None:
    angles = np.linspace(0.0, np.pi / 2.0, 200001)  # t = sqrt(freedom) tan(angle): the density is cos^(freedom - 1)
    density = np.cos(angles) ** (freedom - 1)
    for t in (0.3, 1.0, 2.5, 6.0):
        inside = density[angles <= np.arctan(t / np.sqrt(freedom))].sum() / density.sum()
        assert student_beyond(t, freedom) == pytest.approx(1.0 - inside, abs=1e-4)


def test_five_factors_are_evaluated_too() -> None:
    more = (*FACTORS, replace(FACTORS[0], key="walls"))
    sheet = replace(broken((*TRUTH, 1.1), 1), factors=more)
    assert [effect.ratio for effect in evaluate(sheet).effects] == pytest.approx((*TRUTH, 1.1))
