import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from machine.kinematics.table import machine_points, workpiece_path, workpiece_points
from mdp.mesh import Floats
from mdp.pose import SINGULAR, UP, Pose, axis_rotation, level, poses, rotation, unit
from profiles.machine import Machine
from profiles.profile import load, load_one, shipped

Place = tuple[float, float, float]
TRT_VECTORS = Path(__file__).parents[3].parent / "shared" / "reference" / "xyzac_trt_vectors.json"
ANGLES = st.floats(-180, 180)
PLACES = st.tuples(*[st.floats(-300, 300)] * 3)
VECTORS = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)
TILTING = [name for name in shipped("machine") if load_one(name)["machine"].tilts]  # type: ignore[attr-defined]


def _chain(
    axes: tuple[Place, Place], points: tuple[Place, Place, Place], signs: tuple[int, int], zeros: tuple[float, float]
) -> Machine:
    """A table with any two axes through any two points, any signs, zeros and tool vector."""
    generic = load().machine
    turning = [
        axis.model_copy(update={"axis": v, "point_mm": p, "sign": s, "zero_deg": z, "limits_deg": (-1000.0, 1000.0)})
        for axis, v, p, s, z in zip((generic.tilt, generic.turn), axes, points[:2], signs, zeros, strict=True)
    ]
    return generic.model_copy(update={"tilt": turning[0], "turn": turning[1], "tool_mm": points[2]})


def _apart(axes: tuple[Place, Place]) -> bool:
    return float(np.linalg.norm(np.cross(unit(axes[0]), unit(axes[1])))) > 0.2


SIGNS = st.tuples(*[st.sampled_from([-1, 1])] * 2)
CHAINS = st.builds(
    _chain, st.tuples(VECTORS, VECTORS).filter(_apart), st.tuples(PLACES, PLACES, PLACES), SIGNS, st.tuples(ANGLES, ANGLES)
)


def _trt(params: dict[str, float]) -> Machine:
    """The generic machine with the axes of a LinuxCNC xyzac-trt machine."""
    r = np.array([params["x_rot_point"], params["y_rot_point"], params["z_rot_point"]])
    sign = 1 if params["conventional_directions"] else -1
    generic = load().machine
    wide = {"sign": sign, "limits_deg": (-400.0, 400.0)}
    tilt = generic.tilt.model_copy(update=wide | {"point_mm": tuple(r + np.array([0, params["y_offset"], params["z_offset"]]))})
    turn = generic.turn.model_copy(update=wide | {"point_mm": tuple(r)})
    return generic.model_copy(update={"tilt": tilt, "turn": turn, "tool_mm": (0.0, 0.0, params["tool_offset"])})


@pytest.mark.skipif(not TRT_VECTORS.exists(), reason="the independent test vectors lie beside the project")
def test_linuxcnc_vectors_come_out_to_a_millionth_of_a_millimetre() -> None:
    for vector in json.loads(TRT_VECTORS.read_text())["vectors"]:
        machine = _trt(vector["params"])
        world, joints = ([vector[name][axis] for axis in "XYZ"] for name in ("world", "joints"))
        pose = Pose(vector["world"]["A"], vector["world"]["C"])
        point = np.array(world) - machine.tool_mm - machine.turn.point_mm
        assert machine_points(machine, pose, point[None])[0] == pytest.approx(joints, abs=1e-6)
        assert pytest.approx(vector["nozzle_axis_in_part_frame"], abs=1e-6) == rotation(machine, pose).T @ UP


@given(st.data())
def test_back_from_the_machine_gives_the_same_workpiece_point(data: st.DataObject) -> None:
    machine, pose, point = data.draw(CHAINS), Pose(data.draw(ANGLES), data.draw(ANGLES)), np.array([data.draw(PLACES)])
    there = machine_points(machine, pose, point)
    row = np.concatenate([there, [[pose.tilt_deg, pose.turn_deg]]], axis=1)
    assert workpiece_points(machine, pose, there)[0] == pytest.approx(point[0], abs=1e-9)
    assert workpiece_path(machine, row)[0] == pytest.approx(point[0], abs=1e-9)


@given(st.data())
def test_back_from_the_workpiece_gives_the_same_axes(data: st.DataObject) -> None:
    machine, axes = data.draw(CHAINS), [*data.draw(PLACES), data.draw(ANGLES), data.draw(ANGLES)]
    point = workpiece_path(machine, np.array([axes]))
    assert machine_points(machine, Pose(axes[3], axes[4]), point)[0] == pytest.approx(axes[:3], abs=1e-9)


@given(CHAINS, VECTORS.map(unit))
def test_every_pose_of_any_chain_brings_its_direction_upright(machine: Machine, direction: Floats) -> None:
    for pose in poses(machine, direction):
        far = np.linalg.norm(np.cross(unit(machine.turn.axis), direction)) > SINGULAR
        assert rotation(machine, pose) @ direction == pytest.approx(UP, abs=1e-9 if far else 2 * SINGULAR)


def test_a_direction_just_beyond_what_the_axes_reach_has_no_pose() -> None:
    machine = _chain(((1.0, 6.103515625e-05, 0.0), (0.0, 0.5, 1.0)), ((0.0, 0.0, 0.0),) * 3, (-1, -1), (0.0, 0.0))
    assert poses(machine, unit((0.0, 0.5, 1.0))) == []  # at best 3e-5 from upright


@given(CHAINS, st.floats(-170, 170), st.floats(-170, 170))
def test_the_pose_that_a_direction_was_made_with_is_among_its_poses(machine: Machine, tilt: float, turn: float) -> None:
    pose = Pose(machine.tilt.zero_deg + tilt, machine.turn.zero_deg + turn)
    direction = rotation(machine, pose).T @ UP
    turned = axis_rotation(machine.turn, pose.turn_deg) @ direction
    corner = abs(np.linalg.det([unit(machine.turn.axis), unit(machine.tilt.axis), turned]))
    assume(corner > 0.02)  # near the point where both branches meet, one digit of the direction changes the angles a lot
    apart = [max(abs(p.tilt_deg - pose.tilt_deg), abs(p.turn_deg - pose.turn_deg)) for p in poses(machine, direction)]
    assert min(apart) < 1e-9


@pytest.mark.parametrize("name", TILTING)
@given(st.floats(1e-6, 80), st.floats(-180, 180))
def test_small_tilts_keep_their_digits(name: str, lean_deg: float, around_deg: float) -> None:
    machine = load(machine=name).machine
    a, b = np.radians([lean_deg, around_deg])
    direction = np.array([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)])
    for pose in poses(machine, direction):
        assert abs(abs(pose.tilt_deg - machine.tilt.zero_deg) - lean_deg) < 1e-9


@pytest.mark.parametrize("name", TILTING)
@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.75, 1))
def test_every_machine_reaches_every_direction_that_leans_a_little(name: str, x: float, y: float, z: float) -> None:
    machine = load(machine=name).machine
    direction = unit([x, y, z])
    reached = poses(machine, direction)
    assert reached
    for pose in reached:
        assert rotation(machine, pose) @ direction == pytest.approx(UP, abs=2e-7)


@given(VECTORS.map(unit))
def test_a_machine_with_three_axes_prints_upright_and_nothing_else(direction: Floats) -> None:
    machine = load(settings=["machine.shape=fixed"]).machine
    assert poses(machine, UP) == [Pose(0.0, 0.0)]
    assert poses(machine, direction) == [] or direction[2] == pytest.approx(1.0)
    assert machine_points(machine, level(machine), np.array([[1.0, 2.0, 3.0]]))[0] == pytest.approx([1.0, 2.0, 3.0])


@given(st.floats(-5000, 5000))
def test_a_level_table_keeps_the_turn_it_has(turn_deg: float) -> None:
    assume(abs(turn_deg) <= 3600)
    assert poses(load().machine, UP, turn_deg) == [Pose(0.0, turn_deg)]


def test_both_pose_branches_are_found() -> None:
    reached = poses(load().machine, unit([0.0, 1.0, 1.0]))
    assert [round(pose.tilt_deg, 9) for pose in reached] == [45.0, -45.0]
    assert [round(pose.turn_deg, 9) % 360.0 for pose in reached] == [0.0, 180.0]


def test_a_known_pose_tilts_the_rear_edge_up() -> None:
    point = machine_points(load().machine, Pose(90.0, 0.0), np.array([[0.0, 50.0, 0.0]]))[0]
    assert point == pytest.approx([0.0, -12.0, 38.0])
