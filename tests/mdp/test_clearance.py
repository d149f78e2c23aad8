"""Poses blocked by parts of a cradle above the table: checked by intersecting solids in manifold3d."""

import manifold3d as m3
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mdp.clearance import allowed_poses, find_obstacle
from mdp.head import Block, Body, bodies, corners
from mdp.mesh import Floats
from mdp.pose import Pose, rotation, shift, unit
from profiles.machine import Machine, TableBox
from profiles.profile import load

MACHINE = load(settings=["machine.clearance_mm=0"]).machine
PART = corners((-5.0, -5.0, 30.0), (5.0, 5.0, 45.0))
LEANING = unit((0.0, -0.6, 0.8))


def with_post(machine: Machine, y_mm: float, height_mm: float) -> Machine:
    """The machine with a post of the cradle 20 mm wide beside the table."""
    post = TableBox(name="post", min_mm=(-10.0, y_mm, -20.0), max_mm=(10.0, y_mm + 8.0, height_mm))
    return machine.model_copy(update={"cradle": [post]})


def with_clip(y_mm: float, height_mm: float) -> Machine:
    """The machine without a cradle but with a clip 20 mm wide on its plate."""
    clip = TableBox(name="clip", min_mm=(-10.0, y_mm, 0.0), max_mm=(10.0, y_mm + 8.0, height_mm))
    return MACHINE.model_copy(update={"cradle": [], "table": MACHINE.table.model_copy(update={"clips": [clip]})})


def outline(body: Body) -> Floats:
    """Corners of a body of the head; for a ring, those of 24-gons inside its discs and of copies 300 mm higher."""
    if isinstance(body, Block):
        return corners(body.min_mm, body.max_mm)
    turns = np.arange(24) * np.pi / 12
    discs = [np.column_stack([r * np.cos(turns), r * np.sin(turns), np.full(24, h)]) for r, h in body.discs_mm]
    return np.vstack([*discs, *(disc + np.array([0.0, 0.0, 300.0]) for disc in discs)])


def meet(machine: Machine, pose: Pose) -> bool:
    """Whether a body of the head, swept over all tip positions, intersects the post or clip; by exact solids."""
    tips = PART @ rotation(machine, pose).T + shift(machine, pose)
    tilted = Pose(pose.tilt_deg, machine.turn.zero_deg) if machine.cradle else pose
    (box,) = machine.cradle or machine.table.clips
    post = corners(box.min_mm, box.max_mm) @ rotation(machine, tilted).T + shift(machine, tilted)
    swept = [(tips[:, None] + outline(body)[None]).reshape(-1, 3) for body in bodies(machine)]
    return any((m3.Manifold.hull_points(hull) ^ m3.Manifold.hull_points(post)).volume() > 1e-6 for hull in swept)


@given(st.floats(-140, 140), st.floats(5, 120))
def test_no_pose_is_allowed_at_which_the_head_meets_a_post_of_the_cradle(y_mm: float, height_mm: float) -> None:
    machine = with_post(MACHINE, y_mm, height_mm)
    assert not any(meet(machine, pose) for pose in allowed_poses(machine, LEANING, PART))


@given(st.floats(-100, 92), st.floats(2, 60))
def test_no_pose_is_allowed_at_which_the_head_meets_a_clip_that_turns_with_the_plate(y_mm: float, height_mm: float) -> None:
    machine = with_clip(y_mm, height_mm)
    assert not any(meet(machine, pose) for pose in allowed_poses(machine, LEANING, PART))


def test_a_distant_low_clip_blocks_no_pose_and_one_next_to_the_part_is_named() -> None:
    assert len(allowed_poses(with_clip(80.0, 6.0), LEANING, PART)) == 2
    reason = find_obstacle(with_clip(10.0, 40.0), Pose(0.0, 0.0), PART)
    assert reason == "the head's hot end would meet the plate's clip"


def test_a_post_beside_the_part_would_collide_in_every_pose() -> None:
    beside = with_post(MACHINE, 10.0, 200.0)
    free = allowed_poses(MACHINE.model_copy(update={"cradle": []}), LEANING, PART)
    assert [meet(beside, pose) for pose in free] == [True, True]


@pytest.mark.parametrize(("height", "count"), [(5.0, 2), (200.0, 0)])
def test_a_distant_low_post_blocks_no_pose_and_a_tall_one_next_to_the_part_blocks_both(height: float, count: int) -> None:
    free = len(allowed_poses(MACHINE.model_copy(update={"cradle": []}), LEANING, PART))
    beside = with_post(MACHINE, 110.0 if height < 100 else 10.0, height)
    assert (free, len(allowed_poses(beside, LEANING, PART))) == (2, count)


def test_bodies_under_the_table_change_nothing() -> None:
    under = MACHINE.model_copy(update={"cradle": [TableBox(name="arm", min_mm=(-10, 60, -40), max_mm=(10, 80, -1))]})
    assert allowed_poses(under, LEANING, PART) == allowed_poses(MACHINE, LEANING, PART)
    assert np.isfinite([pose.turn_deg for pose in allowed_poses(under, LEANING, PART)]).all()
