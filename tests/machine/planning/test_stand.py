"""Routes around a table turn against brute force: sample points on head, table, cradle and print in every pose."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine.kinematics.collision import hull, solids
from machine.kinematics.table import machine_points
from machine.planning.stand import Turn, least_z, poses_between, route, stands, sweep, way_s
from mdp.head import bodies, corners
from mdp.pose import Pose, level
from profiles.errors import MoveError
from profiles.machine import Machine, TableBox
from profiles.profile import load
from slicer.estimate.timing import speeds_of

SPEEDS = speeds_of(load())._replace(lift_mm_s=10.0, travel_mm_s=150.0)
PRINT = corners((-20.0, -15.0, 0.0), (20.0, 15.0, 50.0))
AT, TARGET = np.array([10.0, 5.0, 50.2]), np.array([0.0, -40.0, 30.0])
TURN = Pose(60.0, 50.0)
YOKE = TableBox(name="yoke", min_mm=(-130.0, -20.0, -40.0), max_mm=(-110.0, 20.0, 60.0))


def _machine(name: str) -> Machine:
    generic = load().machine
    changed = {
        "disc": {},
        "cradle": {"cradle": [YOKE]},
        "rectangle": {"table": generic.table.model_copy(update={"size_mm": (180.0, 120.0), "radius_mm": 108.2})},
        "fractal": None,
    }[name]
    return load(machine="fractal5pro").machine if changed is None else generic.model_copy(update=changed)


def _filled(least, most, step: float = 6.0) -> np.ndarray:
    """Sample points on the six faces of a box."""
    axes = [np.linspace(a, b, max(2, int((b - a) / step) + 1)) for a, b in zip(least, most, strict=True)]
    grid = np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1).T
    return grid[np.any((grid == np.array(least)) | (grid == np.array(most)), axis=1)]


@cache
def _head(name: str) -> np.ndarray:
    """Sample points on the head, tip at the origin: the silhouette's rings up to 150 mm, and the boxes."""
    machine = _machine(name)
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    profile = [*machine.head.silhouette_mm, *((machine.head.silhouette_mm[-1][0], z) for z in np.linspace(20, 150, 40))]
    rings = [np.column_stack([r * np.cos(around), r * np.sin(around), np.full(24, h)]) for r, h in profile]
    return np.vstack([*rings, *(_filled(box.min_mm, box.max_mm, 8.0) for box in machine.head.boxes)])


def _turned(machine: Machine, pose: Pose) -> np.ndarray:
    """Sample points on the bodies that turn, in the frame of X Y Z."""
    table = machine.table
    if table.size_mm is not None:
        x, y = (size / 2 for size in table.size_mm)
        plate = _filled((-x, -y, -table.thickness_mm), (x, y, 0.0))
    else:
        around, radii = np.linspace(0, 2 * np.pi, 72, endpoint=False), np.linspace(0, table.radius_mm, 16)
        plate = np.array([[r * np.cos(a), r * np.sin(a), 0.0] for r in radii for a in around])
    tilted = Pose(pose.tilt_deg, machine.turn.zero_deg)
    bodies = [machine_points(machine, pose, np.vstack([plate, _filled(PRINT.min(axis=0), PRINT.max(axis=0))]))]
    return np.vstack(bodies + [machine_points(machine, tilted, _filled(box.min_mm, box.max_mm)) for box in machine.cradle])


def _least_distance(name: str, tips: np.ndarray) -> np.ndarray:
    """(n,) least distance of the head at (n, 3) tips from the bodies that turn, over the poses of the turn."""
    machine = _machine(name)
    least = np.full(len(tips), np.inf)
    poses = poses_between(level(machine), TURN)
    for pose in (*poses[::20], poses[-1]):
        points = _turned(machine, pose)
        for k, tip in enumerate(tips):
            near = points[points[:, 2] > tip[2] - least[k]]
            for piece in np.array_split(near, max(1, len(near) // 200)):
                if len(piece):
                    gap = np.linalg.norm(piece[:, None] - (_head(name) + tip)[None], axis=2).min()
                    least[k] = min(least[k], float(gap))
    return least


def _turn_of(machine: Machine, target: np.ndarray | None = TARGET) -> Turn:
    return Turn(level(machine), TURN, AT, target)


@cache
def _route(name: str):
    machine = _machine(name)
    return route(_turn_of(machine), 2, hull(PRINT, 0.0), machine, SPEEDS)


ALL = pytest.mark.parametrize("name", ["disc", "cradle", "rectangle", "fractal"])


@ALL
def test_through_the_whole_turn_the_head_keeps_the_lift_from_table_cradle_and_print(name: str) -> None:
    way = _route(name)
    assert _least_distance(name, np.array([[*way.over_mm, way.z_mm]]))[0] >= _machine(name).lift_mm - 1e-6


@pytest.mark.parametrize("name", ["disc", "cradle"])
def test_no_candidate_position_is_both_faster_and_safe(name: str) -> None:
    machine, way = _machine(name), _route(name)
    quicker = []
    for x, y in list(stands(machine, _turn_of(machine)))[::4]:
        for z in np.arange(AT[2] + machine.clearance_mm, way.z_mm + 40.0, 4.0):
            seconds = way_s(_turn_of(machine), (x, y), (z, max(z, TARGET[2] + 1)), machine, SPEEDS)
            if seconds < way.seconds - 0.25:
                quicker.append((x, y, z))
    assert not quicker or (_least_distance(name, np.array(quicker)) < machine.lift_mm).all()


def test_between_two_poses_that_are_tried_nothing_reaches_farther_than_is_reckoned_with() -> None:
    machine, printed = _machine("cradle"), hull(PRINT, 0.0)
    (tried, swept), poses = sweep(machine, printed, level(machine), TURN), poses_between(level(machine), TURN)
    assert len(swept) == len(poses) - 1
    nearest = np.inf
    for known, (a, b) in zip(swept, pairwise(poses), strict=True):
        between = Pose(0.5 * (a.tilt_deg + b.tilt_deg), 0.5 * (a.turn_deg + b.turn_deg))
        reach = np.array([reach_of(tried) for _, reach_of in solids(machine, between, printed)])
        nearest = min(nearest, float((known - reach).min()))
    assert 0.0 <= nearest < 0.01  # mm


def test_a_cradle_in_the_path_costs_time() -> None:
    assert _route("cradle").seconds >= _route("disc").seconds


def test_the_tip_crosses_above_the_next_part_with_clearance() -> None:
    way = _route("disc")
    assert way.across_z_mm >= TARGET[2] + _machine("disc").clearance_mm


def test_a_machine_too_low_for_every_position_reports_the_height_it_needs() -> None:
    machine = load().machine
    low = machine.model_copy(update={axis: machine.x.model_copy(update={"limits_mm": (-5.0, 5.0)}) for axis in "xy"})
    low = low.model_copy(update={"z": machine.z.model_copy(update={"limits_mm": (-80.0, 52.0)})})
    with pytest.raises(MoveError, match=r"part 2: turning the table to A60.000 C50.000 needs the tip at Z \d+\.\d mm"):
        route(_turn_of(low, None), 2, hull(PRINT, 0.0), low, SPEEDS)


def test_a_place_that_is_high_enough_but_cannot_be_reached_is_not_called_too_low(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("machine.planning.stand._ways_clear", lambda *_: False)
    with pytest.raises(MoveError, match=r"A60\.000 C50\.000 needs a place for the head that it cannot reach"):
        route(_turn_of(load().machine, None), 2, hull(PRINT, 0.0), load().machine, SPEEDS)


@given(st.integers(0, 10**6), st.sampled_from((1, 3)), st.floats(-80.0, 80.0), st.floats(-80.0, 80.0))
@settings(max_examples=30)
def test_the_least_height_is_that_of_all_directions_bodies_and_turns(seed: int, every: int, x: float, y: float) -> None:
    machine, rng = _machine("cradle"), np.random.default_rng(seed)
    tried = np.column_stack([rng.uniform(-1.0, 1.0, (9, 2)), rng.choice([0.0, 0.5, 1.0], 9)])
    reach = rng.uniform(-40.0, 40.0, (7, 2, 9))
    heights = []
    for body in bodies(machine):
        for short_turn in reach[::every]:
            for solid in short_turn:
                missing = solid + max(machine.lift_mm, machine.clearance_mm) - body.least(tried) - tried[:, :2] @ [x, y]
                level = [-np.inf if gap <= 0.0 else np.inf for gap in missing]
                heights.append(min(gap / up if up else flat for gap, up, flat in zip(missing, tried[:, 2], level, strict=True)))
    assert least_z(machine, tried, reach, (x, y), every) == pytest.approx(max(heights))
