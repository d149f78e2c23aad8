"""The table that compares the ways to print a model; its last line names the best."""

from dataclasses import replace

import numpy as np

from machine.cli.commands.decompose import advice
from mdp.decomposition import FrontRow
from mdp.plane import Plane
from profiles.profile import load
from tests.machine.cli.terminal.test_report import alone, tee_in_parts
from tests.shapes import box, hollow, tee

PROFILE = load()
PLANES = (Plane(np.array([1.0, 0.0, 0.0]), 5.0), Plane(np.array([-1.0, 0.0, 0.0]), 5.0))
WHOLE = FrontRow((), 300.0, 0.0, 425.4, stairs_mm2=125.4, time_s=3723.0, filament_mm=4040.0)
CUT = FrontRow(PLANES, 30.0, 80.0, 78.0, stairs_mm2=6.0, time_s=3600.0, filament_mm=3900.0)


def test_the_chosen_row_is_recommended() -> None:
    decomposition = replace(tee_in_parts(), front=(WHOLE, replace(CUT, chosen=True, reason="for the lowest cost")))
    assert advice(decomposition, PROFILE).splitlines() == [
        "print it      needs support mm²    less  seams mm  stair-stepping mm²  cost mm²   time  filament m",
        "in one piece                300                 0                 125       425  1h 2m         4.0",
        "in 3 parts                 30.0  90.0 %        80                   6      78.0  1h 0m         3.9",
        "best: print it in 3 parts",
    ]


def test_a_user_who_requested_other_parts_is_advised_which_cost_less() -> None:
    decomposition = replace(alone(tee(), 300.0), front=(replace(WHOLE, chosen=True, reason="by you"), CUT))
    assert advice(decomposition, PROFILE).splitlines()[-1] == "best: print it in 3 parts: --parts 3"


def test_a_model_without_risk_is_one_part_and_saves_nothing() -> None:
    assert advice(alone(box(), 0.0), PROFILE).splitlines()[1].split() == ["in", "one", "piece", "0.0", "0", "0", "0.0", "-", "-"]


def test_a_rounding_error_is_no_negative_share() -> None:
    assert "-0.0" not in advice(alone(hollow(), 100.0 - 1e-9), PROFILE)
