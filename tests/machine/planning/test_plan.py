from itertools import groupby, pairwise
from math import pi

import numpy as np
import pytest

from machine.dryrun import dry_run
from machine.gcode.writer import write_gcode
from machine.kinematics.collision import hull
from machine.kinematics.table import workpiece_points
from machine.planning.moves import BeginLayer, BeginPart, Reorient
from machine.planning.plan import plan
from machine.planning.stand import Turn, poses_between, route
from mdp.pose import Pose, level
from profiles.errors import MoveError
from profiles.profile import Profile, load
from slicer.estimate.timing import speeds_of
from slicer.paths import SlicedPart
from tests.machine.hand import post_and_arm, printed, squares
from tests.machine.moves import Retract, Stroke, Travel, Wipe, moves_of

BOTH = pytest.mark.parametrize("machine", ["generic_ac", "fractal5pro"])


def _strokes(moves, index):
    part = [k for k, move in enumerate(moves) if isinstance(move, BeginPart)]
    chosen = moves[part[index] : part[index + 1] if index + 1 < len(part) else None]
    return [move for move in chosen if isinstance(move, Stroke)]


@BOTH
def test_every_stroke_is_where_the_slicer_put_it_on_the_workpiece(machine: str) -> None:
    profile, decomposition, sliced, program = printed(machine)
    for index, (part, piece) in enumerate(zip(decomposition.parts, sliced, strict=True)):
        paths = [(layer.z_mm, path) for layer in piece.layers for path in layer.paths]
        for stroke, (z, path) in zip(_strokes(moves_of(program), index), paths, strict=True):
            wanted = (np.column_stack([path.points, np.full(len(path.points), z + part.base.offset_mm)])) @ part.rotation
            assert workpiece_points(profile.machine, part.pose, stroke.points_mm) == pytest.approx(wanted, abs=1e-9)


@BOTH
def test_each_travel_and_stroke_begins_where_the_last_one_ended(machine: str) -> None:
    moves = [move for move in moves_of(printed(machine)[3]) if isinstance(move, Stroke | Travel | Wipe)]
    for before, after in pairwise(moves):
        assert after.points_mm[0] == pytest.approx(before.points_mm[-1], abs=1e-9)


def test_a_reorientation_is_wipe_lift_turn_cross_lower_prime() -> None:
    moves = moves_of(printed()[3])
    turn = [k for k, move in enumerate(moves) if isinstance(move, Reorient)][1]
    begin = next(k for k in range(turn, 0, -1) if isinstance(moves[k], Wipe))
    names = [name for name, _ in groupby(type(move).__name__ for move in moves[begin : turn + 7])]
    assert names == ["Wipe", "Travel", "Reorient", "BeginPart", "Travel", "BeginLayer", "Retract", "Stroke"]
    lift, lower = moves[begin + 1].points_mm, moves[turn + 3].points_mm
    assert (lift[0, :2] == lift[1, :2]).all()
    assert lift[1, 2] > lift[0, 2]
    assert (lower[0, :2] == lower[1, :2]).all()
    assert lower[1, 2] < lower[0, 2]


def test_after_a_reorientation_no_more_is_pushed_standing_than_was_pulled_back() -> None:
    profile, _, _, program = printed()
    back = [float(np.sum(move.filament_mm)) for move in moves_of(program) if isinstance(move, Retract | Wipe)]
    assert min(back) == -profile.material.retract_mm
    assert sum(back) == pytest.approx(profile.material.retract_mm)


def test_the_filament_is_the_volume_of_the_sliced_parts_and_what_oozed_in_the_turn() -> None:
    profile, _, sliced, program = printed()
    filament = sum(float(move.filament_mm.sum()) for move in moves_of(program) if isinstance(move, Stroke))
    filament -= profile.material.prime_extra_mm
    assert filament * pi * profile.material.diameter_mm**2 / 4 == pytest.approx(sum(piece.volume_mm3 for piece in sliced))


def test_the_table_ends_level_for_the_next_homing() -> None:
    profile, _, _, program = printed()
    assert [move.pose for move in moves_of(program) if isinstance(move, Reorient)][-1] == level(profile.machine)


def _cramped(z_mm: float, xy_mm: float, plate_mm: float) -> Profile:
    """The generic machine with a short Z axis, X and Y limits of ±xy_mm and a plate of that radius."""
    machine = load().machine
    z = machine.z.model_copy(update={"limits_mm": (-80.0, z_mm)})
    x = machine.x.model_copy(update={"limits_mm": (-xy_mm, xy_mm)})
    table = machine.table.model_copy(update={"radius_mm": plate_mm})
    return load().model_copy(update={"machine": machine.model_copy(update={"x": x, "y": x, "z": z, "table": table})})


def _tall(profile: Profile):
    decomposition = post_and_arm(profile.machine)
    return decomposition, [squares(part, profile, 300 if part.index == 1 else 2) for part in decomposition.parts]


def test_with_a_short_z_axis_the_head_moves_aside_for_a_turn() -> None:
    profile = _cramped(60.5, 160.0, 60.0)
    program = plan(*_tall(profile), profile)
    turn = next(
        k for k, move in enumerate(moves_of(program)) if isinstance(move, Reorient) and move.pose != level(profile.machine)
    )
    x, y, z = moves_of(program)[turn - 1].points_mm[-1]
    assert z == 60.5
    assert np.hypot(x, y) > 60.0
    assert dry_run(write_gcode(program, profile), profile).errors == ()


def test_no_safe_place_is_refused_with_part_and_heights() -> None:
    machine = _cramped(60.5, 5.0, 100.0).machine
    post = hull(post_and_arm(load().machine).parts[0].mesh.vertices, 0.2)
    with pytest.raises(MoveError, match=r"part 2: .* A60.* needs the tip at Z 7.* mm, generic A/C table allows at most 60.5 mm"):
        route(
            Turn(level(machine), Pose(60.0, 0.0), np.array([0.0, 0.0, 60.0]), None),
            2,
            post,
            machine,
            speeds_of(load())._replace(lift_mm_s=10.0, travel_mm_s=100.0),
        )


def test_a_part_without_a_path_is_left_out() -> None:
    profile, decomposition, sliced, _ = printed()
    program = plan(decomposition, [sliced[0], SlicedPart(2, ())], profile)
    assert [move.index for move in moves_of(program) if isinstance(move, BeginPart)] == [1]


def test_strokes_are_slowed_to_what_the_hot_end_melts() -> None:
    profile = load(settings=["material.volumetric_limit_mm3_s=1"])
    decomposition = post_and_arm(profile.machine)
    program = plan(decomposition, [squares(decomposition.parts[0], profile)], profile)
    speeds = {move.speed_mm_s for move in moves_of(program) if isinstance(move, Stroke)}
    assert max(speeds) * ((0.45 - 0.2) * 0.2 + pi * 0.01) == pytest.approx(1.0)


def test_strokes_are_slowed_to_what_the_extruder_pushes() -> None:
    profile = load(settings=["machine.extruder_speed_mm_s=0.5", "machine.purge_mm=0"])
    decomposition = post_and_arm(profile.machine)
    program = plan(decomposition, [squares(decomposition.parts[0], profile)], profile)
    speeds = {move.speed_mm_s for move in moves_of(program) if isinstance(move, Stroke)}
    assert max(speeds) * ((0.45 - 0.2) * 0.2 + pi * 0.01) == pytest.approx(
        0.5 / 1.004 * pi * 1.75**2 / 4
    )  # rounded ends add volume to short strokes


def test_layers_are_numbered_from_one_in_every_part() -> None:
    numbers = [(move.part, move.index) for move in moves_of(printed()[3]) if isinstance(move, BeginLayer)]
    assert numbers == [(1, 1), (1, 2), (1, 3), (2, 1), (2, 2), (2, 3)]


def test_poses_between_go_from_start_to_end_in_small_steps() -> None:
    way = poses_between(Pose(0, 0), Pose(30, -40))
    assert (way[0], way[-1], len(way)) == (Pose(0, 0), Pose(30, -40), 101)
