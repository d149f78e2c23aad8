from itertools import pairwise
from math import pi

import numpy as np
import pytest

from machine.collide import hull
from machine.dryrun import dry_run
from machine.gcode import write_gcode
from machine.kinematics.table import machine_points, workpiece_points
from machine.moves import BeginLayer, BeginPart, Reorient, Retract, Stroke, Travel, Wipe
from machine.plan import plan
from machine.reorient import poses_between, safe_pose
from mdp.pose import Pose, level
from profiles.errors import MoveError
from profiles.profile import Profile, load
from slicer.paths import SlicedPart
from tests.machine.hand import post_and_arm, printed, squares

BOTH = pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro"])


def _strokes(moves, index):
    part = [k for k, move in enumerate(moves) if isinstance(move, BeginPart)]
    chosen = moves[part[index] : part[index + 1] if index + 1 < len(part) else None]
    return [move for move in chosen if isinstance(move, Stroke)]


@BOTH
def test_every_stroke_lies_where_the_slicer_put_it_on_the_workpiece(machine: str) -> None:
    profile, decomposition, sliced, program = printed(machine)
    for index, (part, piece) in enumerate(zip(decomposition.parts, sliced, strict=True)):
        paths = [(layer.z_mm, path) for layer in piece.layers for path in layer.paths]
        for stroke, (z, path) in zip(_strokes(program.moves, index), paths, strict=True):
            wanted = (np.column_stack([path.points, np.full(len(path.points), z + part.base.offset_mm)])) @ part.rotation
            assert workpiece_points(profile.machine, part.pose, stroke.points_mm) == pytest.approx(wanted, abs=1e-9)


@BOTH
def test_each_travel_and_stroke_begins_where_the_last_one_ended(machine: str) -> None:
    moves = [move for move in printed(machine)[3].moves if isinstance(move, Stroke | Travel | Wipe)]
    for before, after in pairwise(moves):
        assert after.points_mm[0] == pytest.approx(before.points_mm[-1], abs=1e-9)


def test_a_reorientation_is_wipe_lift_turn_cross_lower_prime() -> None:
    moves = printed()[3].moves
    turn = [k for k, move in enumerate(moves) if isinstance(move, Reorient)][1]
    names = [type(move).__name__ for move in moves[turn - 2 : turn + 7]]
    assert names == ["Wipe", "Travel", "Reorient", "BeginPart", "Travel", "Travel", "BeginLayer", "Retract", "Stroke"]
    lift, across, lower = (moves[turn + k].points_mm for k in (-1, 2, 3))
    assert (lift[0, :2] == lift[1, :2]).all()
    assert lift[1, 2] > lift[0, 2]
    assert across[0, 2] == across[1, 2] == lift[1, 2]
    assert (lower[0, :2] == lower[1, :2]).all()
    assert lower[1, 2] < lower[0, 2]


def test_after_a_reorientation_more_is_primed_than_was_retracted() -> None:
    profile, _, _, program = printed()
    back = [float(np.sum(move.filament_mm)) for move in program.moves if isinstance(move, Retract | Wipe)]
    material = profile.material
    assert -(material.retract_mm + material.prime_extra_mm) in back
    assert sum(back) == pytest.approx(material.retract_mm - material.prime_extra_mm)


def test_the_filament_is_the_volume_of_the_sliced_parts() -> None:
    profile, _, sliced, program = printed()
    filament = sum(float(move.filament_mm.sum()) for move in program.moves if isinstance(move, Stroke))
    assert filament * pi * profile.material.diameter_mm**2 / 4 == pytest.approx(sum(piece.volume_mm3 for piece in sliced))


def test_the_table_ends_level_for_the_next_homing() -> None:
    profile, _, _, program = printed()
    assert [move.pose for move in program.moves if isinstance(move, Reorient)][-1] == level(profile.machine)


def _rim(profile: Profile) -> np.ndarray:
    around = np.linspace(0, 2 * pi, 721)
    radius = profile.machine.table.radius_mm
    return np.column_stack([radius * np.cos(around), radius * np.sin(around), np.zeros(721)])


@BOTH
def test_the_tip_is_above_plate_and_print_in_every_pose_of_a_turn(machine: str) -> None:
    profile, decomposition, _, program = printed(machine)
    post = decomposition.parts[0].mesh.vertices * [1, 1, 0.6 / 60.0]
    start, z, bodies = level(profile.machine), 0.0, _rim(profile)
    for move in program.moves:
        z = float(move.points_mm[-1, 2]) if isinstance(move, Travel) else z
        if isinstance(move, Reorient):
            for pose in poses_between(start, move.pose, 0.1):
                assert z >= machine_points(profile.machine, pose, bodies)[:, 2].max() + profile.machine.lift_mm
            start, bodies = move.pose, np.vstack([_rim(profile), post])


def _cramped(z_mm: float, xy_mm: float, plate_mm: float) -> Profile:
    """The generic machine with a short Z axis, X and Y of +-xy_mm and a plate of that radius."""
    machine = load().machine
    z = machine.z.model_copy(update={"limits_mm": (-80.0, z_mm)})
    x = machine.x.model_copy(update={"limits_mm": (-xy_mm, xy_mm)})
    table = machine.table.model_copy(update={"radius_mm": plate_mm})
    return load().model_copy(update={"machine": machine.model_copy(update={"x": x, "y": x, "z": z, "table": table})})


def _tall(profile: Profile):
    decomposition = post_and_arm(profile.machine)
    return decomposition, [squares(part, profile, 300 if part.index == 1 else 2) for part in decomposition.parts]


def test_with_a_short_z_axis_the_head_stands_aside() -> None:
    profile = _cramped(60.5, 160.0, 60.0)
    program = plan(*_tall(profile), profile)
    turn = next(k for k, move in enumerate(program.moves) if isinstance(move, Reorient) and move.pose != level(profile.machine))
    x, y, z = program.moves[turn - 1].points_mm[-1]
    assert z == 60.5
    assert np.hypot(x, y) > 60.0
    assert not dry_run(write_gcode(program, profile), profile).failed


def test_no_safe_place_is_refused_with_part_and_heights() -> None:
    machine = _cramped(60.5, 5.0, 100.0).machine
    post = hull(post_and_arm(load().machine).parts[0].mesh.vertices, 0.2)
    with pytest.raises(
        MoveError, match=r"part 2: .* A60.* needs the tip at Z 90.6.* mm, generic A/C table allows at most 60.5 mm"
    ):
        safe_pose(machine, post, np.array([0.0, 0.0, 60.0]), level(machine), Pose(60.0, 0.0), 2)


def test_a_part_without_a_path_is_left_out() -> None:
    profile, decomposition, sliced, _ = printed()
    program = plan(decomposition, [sliced[0], SlicedPart(2, ())], profile)
    assert [move.index for move in program.moves if isinstance(move, BeginPart)] == [1]


def test_strokes_are_slowed_to_what_the_hot_end_melts() -> None:
    profile = load(settings=["material.volumetric_limit_mm3_s=1"])
    decomposition = post_and_arm(profile.machine)
    program = plan(decomposition, [squares(decomposition.parts[0], profile)], profile)
    speeds = {move.speed_mm_s for move in program.moves if isinstance(move, Stroke)}
    assert max(speeds) * ((0.45 - 0.2) * 0.2 + pi * 0.01) == pytest.approx(1.0)


def test_layers_are_numbered_from_one_in_every_part() -> None:
    numbers = [(move.part, move.index) for move in printed()[3].moves if isinstance(move, BeginLayer)]
    assert numbers == [(1, 1), (1, 2), (1, 3), (2, 1), (2, 2), (2, 3)]


def test_poses_between_go_from_start_to_end_in_small_steps() -> None:
    way = poses_between(Pose(0, 0), Pose(30, -40), 1.0)
    assert (way[0], way[-1], len(way)) == (Pose(0, 0), Pose(30, -40), 51)
