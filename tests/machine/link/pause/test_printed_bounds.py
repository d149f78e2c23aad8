"""Printed bounds: a stroke in any notation is included in the box around the print."""

import pytest

from machine.gcode.modes import ModalState, axes_of
from machine.kinematics.table import origin_mm
from machine.link.pause.printed_bounds import PrintedBounds
from profiles.profile import load

MACHINE = load().machine
START = ("G90", "M83", "G92 E0", "G0 X0 Y0 Z5")


def box(*commands: str) -> list[list[float]]:
    """Minimum and maximum X Y Z printed by these commands; [] if they print nothing."""
    bounds, modal = PrintedBounds(MACHINE), ModalState(axes_of(MACHINE))
    for command in (*START, *commands):
        bounds.track(modal, command)
    corners = bounds.corners(followed_table=True).points_mm + origin_mm(MACHINE)
    return [corners.min(axis=0).round(6).tolist(), corners.max(axis=0).round(6).tolist()] if len(corners) else []


@pytest.mark.parametrize("stroke", ["G1 X10 Y20 E1", "G01 X10 Y20 E1", "g1 x10 y20 e1", "G1X10Y20E1", "G0 X10 Y20 E1"])
def test_a_stroke_is_in_the_box_from_its_beginning_to_its_end_however_it_is_written(stroke: str) -> None:
    assert box(stroke) == [[0.0, 0.0, 5.0], [10.0, 20.0, 5.0]]


@pytest.mark.parametrize("second", ["G2 X0 Y0 I-5 J0 E1", "g02 x0 y0 i-5 e1", "G2 X0 Y0 R5 E1"])
def test_two_half_circles_are_as_wide_as_the_circle(second: str) -> None:
    assert box("G2 X10 Y0 I5 J0 E1", second) == [[0.0, -5.0, 5.0], [10.0, 5.0, 5.0]]


def test_an_arc_in_inches_is_as_wide_as_its_inches() -> None:
    assert box("G20", "G3 I1 E1") == [[0.0, -25.4, 5.0], [50.8, 25.4, 5.0]]


@pytest.mark.parametrize("travel", ["G1 X10 Y20", "G1 X10 Y20 E-1", "G2 X10 Y0 I5 J0"])
def test_a_move_that_pushes_no_filament_is_not_in_the_box(travel: str) -> None:
    assert box(travel) == []


def test_a_move_with_an_unknown_filament_position_counts_as_extruding() -> None:
    bounds, modal = PrintedBounds(MACHINE), ModalState(axes_of(MACHINE))
    printed = [bounds.track(modal, command)[1] for command in ("M83", "G1 X1 Y1 Z1", "G1 X2 E1", "M82", "G1 X3 E9")]
    assert printed == [False, False, True, False, True]
