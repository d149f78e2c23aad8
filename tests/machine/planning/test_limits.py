import numpy as np
import pytest

from machine.planning.limits import axis_limits, check, path_speeds, turn_speed
from machine.planning.moves import BeginLayer, BeginPart, Reorient
from machine.planning.plan import plan
from mdp.pose import Pose
from profiles.errors import MoveError
from profiles.profile import load
from slicer.estimate.timing import speeds_of
from tests.machine.hand import post_and_arm, squares
from tests.machine.moves import Travel, program_of

MACHINE = load().machine


def _checked(*moves) -> None:
    program = program_of("p", (BeginPart(3, Pose(0, 0), 1), BeginLayer(3, 7, 0.2, 0.2, 0.0), *moves))
    check(program, MACHINE)


@pytest.mark.parametrize(
    ("end", "message"),
    [
        ([161, 0, 5], "part 3, layer 7: X would go to 161.000 mm, allowed is -160 to 160 mm on generic A/C table"),
        ([0, -160.5, 5], "part 3, layer 7: Y would go to -160.500 mm"),
        ([0, 0, 261], "part 3, layer 7: Z would go to 261.000 mm, allowed is -80 to 260 mm"),
    ],
)
def test_a_point_outside_is_refused_with_part_layer_axis_value_and_range(end: list[float], message: str) -> None:
    with pytest.raises(MoveError) as error:
        _checked(Travel(np.array([[0, 0, 5], end], dtype=float), 100.0))
    assert message in str(error.value)


def test_a_rotary_angle_outside_is_refused() -> None:
    with pytest.raises(MoveError, match=r"A would go to 96\.000 deg, allowed is -95 to 95 deg"):
        _checked(Reorient(Pose(96.0, 0.0), 10.0))
    with pytest.raises(MoveError, match=r"C would go to -3601\.000 deg, allowed is -3600 to 3600 deg"):
        _checked(Reorient(Pose(0.0, -3601.0), 10.0))


def test_the_limit_itself_is_allowed() -> None:
    _checked(Travel(np.array([[0, 0, 5], [160, -160, 260]], dtype=float), 100.0), Reorient(Pose(95.0, 3600.0), 10.0))


def test_a_plan_outside_is_refused_before_any_text() -> None:
    profile = load()
    machine = profile.machine.model_copy(update={"x": profile.machine.x.model_copy(update={"limits_mm": (-3.0, 3.0)})})
    decomposition = post_and_arm(profile.machine)
    with pytest.raises(MoveError, match="before the first part: X would go to"):
        plan(decomposition, [squares(decomposition.parts[0], profile)], profile.model_copy(update={"machine": machine}))


def test_limits_use_the_machine_s_axis_letters() -> None:
    assert list(axis_limits(load(machine="fractal5pro").machine)) == ["X", "Y", "Z", "B", "A"]


def test_a_slanted_travel_is_slowed_to_keep_z_within_its_speed() -> None:
    slanted_then_level = np.array([[0, 0, 0], [3, 0, 4], [3, 0, 4], [6, 4, 4]], dtype=float)
    speeds = path_speeds(slanted_then_level, np.array([0, 2, 4]), np.array([150.0, 150.0]), speeds_of(load()).axes_mm_s)
    assert speeds == pytest.approx([15.0 / 0.8, 150.0])


def test_a_turn_of_both_axes_lasts_as_long_as_the_slower_one() -> None:
    assert turn_speed(30.0, 40.0, MACHINE) == pytest.approx(50.0)  # 1 s of tilt at 30 deg/s
    assert turn_speed(0.0, -120.0, MACHINE) == pytest.approx(60.0)
    assert turn_speed(0.0, 0.0, MACHINE) == 30.0


def test_a_cable_bounds_the_turn_like_a_limit() -> None:
    machine = load(settings=["machine.turn.budget_deg=400"]).machine
    assert axis_limits(machine)["C"] == (-400.0, 400.0)
