"""Parking: the path to the parking position, and the commands for the way there and back."""

import re

import numpy as np
import pytest

from machine.gcode.modes import ModalState, axes_of
from machine.kinematics.collision import solids
from machine.kinematics.table import machine_points
from machine.link.pause.park_moves import axis_position, lift_words, plan_park
from machine.link.pause.printed_bounds import PrintedBounds
from machine.planning.stand import find_park_position
from mdp.head import bodies, directions
from mdp.pose import UP, Pose, rotation
from profiles.profile import load

PROFILE = load()
MACHINE = PROFILE.machine
POSES = [Pose(0.0, 0.0), Pose(30.0, 725.0), Pose(-60.0, 45.0), Pose(85.0, 10.0)]


def printing(pose: Pose) -> tuple[PrintedBounds, np.ndarray]:
    """A print 20 mm wide and 10 mm high in a pose, and the tip's position on its top, 80 mm above the table."""
    bounds, at = PrintedBounds(MACHINE), machine_points(MACHINE, pose, np.array([[0.0, 0.0, 80.0]]))[0]
    for step in ((-10.0, -10.0, -10.0), (10.0, 10.0, 0.0)):
        bounds.extrude_to((*(at + step), pose.tilt_deg, pose.turn_deg, 0.0))
    return bounds, at


@pytest.mark.parametrize("pose", POSES)
def test_the_path_to_the_parking_position_is_clear_of_table_cradle_and_print(pose: Pose) -> None:
    bounds, at = printing(pose)
    printed, park = bounds.corners(), find_park_position(MACHINE, bounds.corners(), at, pose)
    assert park is not None
    tried = np.vstack([directions(rotation(MACHINE, pose) @ UP), UP])
    for point in np.linspace(park.lift_mm, park.stand_mm, 40):
        for name, reach in solids(MACHINE, pose, printed):
            for body in bodies(MACHINE):
                assert float((tried @ point + body.least(tried) - reach(tried)).max()) >= body.need_mm - 1e-6, name


@pytest.mark.parametrize("pose", POSES)
def test_parking_first_moves_straight_up_and_stays_within_the_axes(pose: Pose) -> None:
    bounds, at = printing(pose)
    park = find_park_position(MACHINE, bounds.corners(), at, pose)
    assert park is not None
    assert park.lift_mm[:2] == tuple(at[:2])
    assert park.lift_mm[2] == park.stand_mm[2] > at[2]
    for value, axis in zip(park.stand_mm, (MACHINE.x, MACHINE.y, MACHINE.z), strict=True):
        assert axis.limits_mm[0] <= value <= axis.limits_mm[1]


def test_at_the_top_of_the_z_axis_the_tip_only_moves_aside() -> None:
    top = MACHINE.z.limits_mm[1]
    park = find_park_position(MACHINE, printing(POSES[0])[0].corners(), np.array([0.0, 0.0, top]), POSES[0])
    assert park is not None
    assert park.lift_mm == (0.0, 0.0, top)
    assert park.stand_mm[2] == top


def test_if_the_table_blocks_the_path_up_the_tip_does_not_move() -> None:
    bounds, _ = printing(Pose(85.0, 0.0))
    assert find_park_position(MACHINE, bounds.corners(), np.array([0.0, 0.0, 20.0]), Pose(85.0, 0.0)) is None


def test_a_pause_before_the_place_is_known_moves_filament_only() -> None:
    modal = ModalState(axes_of(MACHINE))
    modal.take("M104 S200")
    away, back, park = plan_park(modal, PROFILE, PrintedBounds(MACHINE))
    assert park is None
    assert not [line for line in (*away, *back) if re.match(r"G[01] .*[XYZ]", line)]


def test_filament_that_the_program_has_pulled_back_already_is_not_pulled_again() -> None:
    modal = ModalState(axes_of(MACHINE))
    for command in ("M104 S200", "M83", "G92 E0", "G1 E5", f"G1 E-{PROFILE.material.retract_mm}"):
        modal.take(command)
    assert not [line for line in plan_park(modal, PROFILE, None)[0] if "E" in line]


def test_a_lift_in_workpiece_coordinates_moves_along_the_nozzle() -> None:
    words = lift_words(MACHINE, Pose(90.0, 0.0), 10.0, True)
    values = {word[0]: float(word[1:]) for word in words.split()}
    step = np.array([values.get(letter, 0.0) for letter in "XYZ"])
    assert rotation(MACHINE, Pose(90.0, 0.0)) @ step == pytest.approx([0.0, 0.0, 10.0], abs=1e-3)


def test_the_place_of_a_program_without_rotary_words_is_that_of_a_level_table() -> None:
    standing = axis_position(MACHINE, (1.0, 2.0, 3.0, None, None, None), False)
    assert standing is not None
    assert (standing[0].tolist(), standing[1]) == ([1.0, 2.0, 3.0], Pose(0.0, 0.0))
    assert axis_position(MACHINE, (1.0, 2.0, None, 0.0, 0.0, 0.0), False) is None


def test_a_material_may_want_the_nozzle_cooler_while_a_print_rests() -> None:
    modal = ModalState(axes_of(MACHINE))
    for command in ("M109 S200", "M83", "G1 X1 Y1 Z1 A0 C0 E1"):
        modal.take(command)
    cool, hot = (load(settings=[f"material.standby_c={c}"]) for c in (150, 250))
    ways = [plan_park(modal, profile, PrintedBounds(MACHINE))[0] for profile in (PROFILE, cool, hot)]
    assert ["M104 S150" in away for away in ways] == [False, True, False]
