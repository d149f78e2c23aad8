import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.kinematics.table import machine_points, workpiece_path, workpiece_points
from mdp.pose import UP, Pose, poses, rotation
from profiles.machine import Machine
from profiles.profile import load, shipped

VECTORS = Path(__file__).parents[2].parent / "shared" / "reference" / "xyzac_trt_vectors.json"
ANGLES = st.floats(-180, 180)


def _trt(params: dict[str, float]) -> Machine:
    """The generic machine with the axes of a LinuxCNC xyzac-trt machine."""
    r = np.array([params["x_rot_point"], params["y_rot_point"], params["z_rot_point"]])
    sign = 1 if params["conventional_directions"] else -1
    generic = load().machine
    wide = {"sign": sign, "limits_deg": (-400.0, 400.0)}
    tilt = generic.tilt.model_copy(update=wide | {"point_mm": tuple(r + np.array([0, params["y_offset"], params["z_offset"]]))})
    turn = generic.turn.model_copy(update=wide | {"point_mm": tuple(r)})
    return generic.model_copy(update={"tilt": tilt, "turn": turn, "tool_mm": (0.0, 0.0, params["tool_offset"])})


@pytest.mark.skipif(not VECTORS.exists(), reason="the independent test vectors lie beside the project")
def test_linuxcnc_vectors_come_out_to_a_millionth_of_a_millimetre() -> None:
    for vector in json.loads(VECTORS.read_text())["vectors"]:
        machine = _trt(vector["params"])
        world, joints = ([vector[name][axis] for axis in "XYZ"] for name in ("world", "joints"))
        pose = Pose(vector["world"]["A"], vector["world"]["C"])
        point = np.array(world) - machine.tool_mm - machine.turn.point_mm
        assert machine_points(machine, pose, point[None])[0] == pytest.approx(joints, abs=1e-6)
        assert pytest.approx(vector["nozzle_axis_in_part_frame"], abs=1e-6) == rotation(machine, pose).T @ UP


@given(ANGLES, ANGLES, st.lists(st.floats(-300, 300), min_size=3, max_size=3))
def test_back_from_the_machine_gives_the_same_workpiece_point(tilt: float, turn: float, point: list[float]) -> None:
    machine = load().machine
    there = machine_points(machine, Pose(tilt, turn), np.array([point]))
    row = np.concatenate([there, [[tilt, turn]]], axis=1)
    assert workpiece_points(machine, Pose(tilt, turn), there)[0] == pytest.approx(point, abs=1e-9)
    assert workpiece_path(machine, row)[0] == pytest.approx(point, abs=1e-9)


@pytest.mark.parametrize("name", shipped("machine"))
@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.05, 1))
def test_every_pose_brings_its_direction_upright(name: str, x: float, y: float, z: float) -> None:
    machine = load(machine=name).machine
    direction = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    found = poses(machine, direction)
    assert found
    for pose in found:
        assert rotation(machine, pose) @ direction == pytest.approx(UP, abs=2e-7)


def test_a_known_pose_tilts_the_rear_edge_up() -> None:
    point = machine_points(load().machine, Pose(90.0, 0.0), np.array([[0.0, 50.0, 0.0]]))[0]
    assert point == pytest.approx([0.0, -12.0, 38.0])
