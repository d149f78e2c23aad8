"""The sequence of poses against every combination of branches and turns."""

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mdp.mesh import Floats
from mdp.pose import Pose, least_rotation, poses, rotation_deg
from profiles.machine import Machine
from profiles.profile import load
from tests.checks import assert_same_direction

GENERIC = load().machine
LEANING = st.lists(st.tuples(st.floats(1, 80), st.floats(-180, 180)), min_size=1, max_size=7)


def wound(limits_deg: tuple[float, float] = (-36000.0, 36000.0), budget_deg: float | None = None) -> Machine:
    """The generic machine with these limits of its turn axis."""
    turn = GENERIC.turn.model_copy(update={"limits_deg": limits_deg, "budget_deg": budget_deg})
    return GENERIC.model_copy(update={"turn": turn})


def direction(lean_deg: float, around_deg: float) -> Floats:
    a, b = np.radians([lean_deg, around_deg])
    return np.array([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)])


def total(chosen: list[Pose]) -> float:
    return sum(rotation_deg(a, b) for a, b in pairwise(chosen))


def least_of_all(options: list[list[Pose]], most_deg: float) -> float:
    """The least rotation over every path: all branches, all whole turns inside ±most_deg."""
    costs, at = np.zeros(1), np.array([[options[0][0].tilt_deg, options[0][0].turn_deg]])
    for choices in options[1:]:
        turned = [(p.tilt_deg, p.turn_deg + 360.0 * k) for p in choices for k in range(-3, 4)]
        states = np.array([state for state in turned if abs(state[1]) <= most_deg])
        costs = (costs[:, None] + np.abs(at[:, None] - states[None]).sum(axis=2)).ravel()
        at = np.tile(states, (len(at), 1))
    return float(costs.min())


@settings(max_examples=25, deadline=None)
@given(LEANING, st.sampled_from([180.0, 270.0, 400.0]))
def test_no_combination_of_branches_and_turns_rotates_less(leaning: list[tuple[float, float]], most_deg: float) -> None:
    machine = wound((-most_deg, most_deg))
    options = [[Pose(0.0, 0.0)], *(poses(machine, direction(*angles)) for angles in leaning)]
    chosen = least_rotation(machine, options)
    assert abs(total(chosen) - least_of_all(options, most_deg + 1e-9)) < 1e-6


@settings(max_examples=50, deadline=None)
@given(LEANING, st.sampled_from([(-180.0, 180.0), (-90.0, 300.0), (0.0, 360.0)]), st.none() | st.floats(180, 400))
def test_every_pose_stays_inside_limits_and_cables_and_brings_its_direction_upright(
    leaning: list[tuple[float, float]], limits_deg: tuple[float, float], budget_deg: float | None
) -> None:
    machine = wound(limits_deg, budget_deg)
    reached = [angles for angles in leaning if poses(machine, direction(*angles))]
    chosen = least_rotation(machine, [[Pose(0.0, 0.0)], *(poses(machine, direction(*angles)) for angles in reached)])
    least, most = machine.turn.reach_deg
    assert all(least - 1e-6 <= pose.turn_deg <= most + 1e-6 for pose in chosen)
    for pose, angles in zip(chosen[1:], reached, strict=True):
        assert_same_direction(machine, pose, direction(*angles))


def test_a_cable_is_unwound_before_it_is_used_up() -> None:
    round_and_round = [[Pose(0.0, 0.0)], *([Pose(40.0, 120.0 * k % 360.0)] for k in range(1, 7))]
    free = [pose.turn_deg for pose in least_rotation(wound(), round_and_round)]
    cabled = [pose.turn_deg for pose in least_rotation(wound(budget_deg=400.0), round_and_round)]
    assert free == [0.0, 120.0, 240.0, 360.0, 480.0, 600.0, 720.0]
    assert max(map(abs, cabled)) <= 400.0
    assert {round(a - b) % 360 for a, b in zip(free, cabled, strict=True)} == {0}


def test_a_part_printed_level_keeps_the_turn_of_the_part_before() -> None:
    options = [[Pose(0.0, 0.0)], [Pose(30.0, 80.0)], [Pose(0.0, 0.0)], [Pose(30.0, 90.0)]]
    assert [pose.turn_deg for pose in least_rotation(wound(), options)] == [0.0, 80.0, 80.0, 90.0]


def test_a_part_printed_level_turns_if_the_kept_turn_does_not_fit() -> None:
    options = [[Pose(0.0, 0.0)], [Pose(30.0, 80.0)], [Pose(0.0, 0.0)], [Pose(30.0, 90.0)]]
    chosen = least_rotation(wound(), options, lambda part, pose: part != 2)
    assert [pose.turn_deg for pose in chosen] == [0.0, 80.0, 0.0, 90.0]


@given(st.floats(-170, 170))
def test_the_same_direction_twice_does_not_turn_the_table(around_deg: float) -> None:
    once = poses(wound(), direction(50.0, around_deg))
    chosen = least_rotation(wound(), [[Pose(0.0, 0.0)], once, once])
    assert chosen[1] == chosen[2]
