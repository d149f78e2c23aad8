"""Travels within a limb, to it and from it, beside higher structures."""

from dataclasses import replace

import numpy as np
import pytest

from machine.kinematics.collision import hull
from machine.link.pause.park_moves import return_moves
from machine.planning import layer
from machine.planning.fit import standing_at
from machine.planning.moves import Pause
from machine.planning.plan import plan
from machine.planning.stand import Turn, route
from machine.planning.stops import Stop
from mdp.pose import Pose, level
from profiles.errors import MoveError
from profiles.profile import Profile, load
from slicer.estimate.timing import speeds_of
from tests.limbs import MODELS, moved_part, printed, sliced
from tests.machine.moves import Travel, moves_of

TOP_MM = 24.0  # of the posts


def _short(z_mm: float) -> Profile:
    """The profile of the sliced models with a Z axis that ends at z_mm."""
    profile = sliced("outer posts")[0]
    z = profile.machine.z.model_copy(update={"limits_mm": (-80.0, z_mm)})
    return profile.model_copy(update={"machine": profile.machine.model_copy(update={"z": z})})


@pytest.mark.parametrize("model", sorted(MODELS))
def test_a_limb_is_printed_next_to_earlier_parts_without_an_error(model: str) -> None:
    assert printed(model)[1].errors == ()


def test_travel_between_limbs_passes_over_the_post_between_them() -> None:
    starts, ends = moved_part(printed("outer posts")[0], 2)
    crosses = starts[:, 0] * ends[:, 0] < 0.0
    least = np.minimum(starts[crosses, 2], ends[crosses, 2])
    assert crosses.sum() >= 80  # at most one of the 90 layers ends where the next one begins
    assert least.min() >= TOP_MM + load().machine.clearance_mm


def test_the_tip_rises_only_to_cross_from_one_limb_to_the_other() -> None:
    starts, ends = moved_part(printed("outer posts")[0], 2)
    rises = (ends[:, 2] - starts[:, 2] > 0.5) & (starts[:, 2] < 20.0)
    assert rises.sum() == 70  # once in every layer from 6 to 20 mm


def test_the_dry_run_refuses_the_same_limbs_without_the_lifts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(layer, "clear_height_mm", lambda standing, way_mm, height_mm: height_mm)
    codes = {finding.code for finding in printed("outer posts")[1].errors}
    assert codes == {"contact"}


def test_a_z_axis_too_short_to_pass_over_earlier_parts_is_reported() -> None:
    _, decomposition, pieces = sliced("outer posts")
    with pytest.raises(MoveError, match=r"part 2: the way to it needs the tip at Z 25\.2 mm"):
        plan(decomposition, pieces, _without_turns(_short(24.5)))
    with pytest.raises(
        MoveError, match=r"part 2: a travel within it needs the tip at Z 2\d\.\d mm for the head to pass the bodies beside"
    ):
        plan(decomposition, [pieces[0], replace(pieces[1], layers=pieces[1].layers[:20])], _without_turns(_short(25.5)))


def _without_turns(profile: Profile) -> Profile:
    """A profile that keeps no height while the table turns, nor above earlier parts."""
    return profile.model_copy(update={"machine": profile.machine.model_copy(update={"lift_mm": 0.0})})


def test_a_stop_within_a_limb_lifts_the_tip_above_everything_printed() -> None:
    program, run = printed("outer posts", [Stop(2, 5, None, False)])
    stop = next(k for k, move in enumerate(moves_of(program)) if isinstance(move, Pause))
    before = moves_of(program)[stop - 1]
    assert isinstance(before, Travel)
    assert before.points_mm[-1, 2] >= TOP_MM + load().machine.clearance_mm
    assert run.errors == ()


def test_travel_across_stays_at_or_above_the_given_clearance_height() -> None:
    machine, start, end = load().machine, level(load().machine), Pose(30.0, 0.0)
    at, target = np.array([0.0, 0.0, 20.0]), np.array([10.0, 0.0, 20.0])
    post = hull(np.array([[-5.0, -5.0, 0.0], [5.0, 5.0, 0.0], [5.0, -5.0, 10.0], [-5.0, 5.0, 10.0]]), 0.2)
    speeds = speeds_of(load())._replace(lift_mm_s=10.0, travel_mm_s=100.0)
    low = route(Turn(start, end, at, target), 2, post, machine, speeds)
    high = route(Turn(start, end, at, target, (90.0, 120.0)), 2, post, machine, speeds)
    assert low.across_z_mm < 90.0
    assert (high.z_mm, high.across_z_mm) == (90.0, 120.0)


def test_the_return_into_a_limb_after_a_power_cut_passes_over_the_printed_parts() -> None:
    profile, decomposition, _ = sliced("leaning arm")
    arm = decomposition.parts[1]
    stands = hull(decomposition.parts[0].mesh.vertices, 0.3)
    goal = np.array([0.0, 0.0, 60.0])
    lines = return_moves(profile, stands, Turn(level(profile.machine), arm.pose, np.array([0.0, 0.0, 60.0]), goal))
    across = [k for k, line in enumerate(lines) if line.startswith("G0 X")]
    heights = [float(line.split()[1][1:]) for line in lines if line.startswith("G0 Z")]
    top_mm = float(stands.reach(profile.machine, arm.pose, np.array([[0.0, 0.0, 1.0]]))[0])
    assert len(across) == 2
    assert heights[1] >= top_mm + profile.machine.clearance_mm


def test_a_limb_moved_over_the_plate_keeps_its_points() -> None:
    moved = standing_at(sliced("outer posts")[1], (10.0, -5.0)).parts[1].base
    before = sliced("outer posts")[1].parts[1].base
    assert moved.limbs_mm is not None
    assert before.limbs_mm is not None
    assert moved.limbs_mm - before.limbs_mm == pytest.approx(np.tile([10.0, -5.0, 0.0], (2, 1)))
