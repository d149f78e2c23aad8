"""The page of profile keys is current and complete, and its recipes are right."""

import re
from math import cos, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from machine.gcode.writer import write_gcode
from machine.kinematics.table import machine_points
from mdp.pose import Pose
from profiles.errors import ProfileError
from profiles.profile import SECTIONS, load
from profiles.wording import keys
from tests.machine.moves import program_of
from tools.docs.harness import DOCS
from tools.docs.make_tables import KEYS, page, table

TEXT = KEYS.read_text(encoding="utf-8")
PLACEHOLDERS = (DOCS / "machines.md").read_text(encoding="utf-8")


def test_the_tables_of_the_page_are_those_of_the_models() -> None:
    assert page(TEXT) == TEXT


def axes_of(row: str) -> list[str]:
    """The axes that share a row: x, y and z of `machine.x\\|y\\|z.limits_mm`; a placeholder for a row of one key."""
    return found[0].split("\\|") if (found := re.search(r"(\w+\\\|)+\w+", row)) else ["alone"]


@pytest.mark.parametrize("section", SECTIONS)
def test_the_page_has_a_row_for_every_key(section: str) -> None:
    rows = re.findall(rf"^\| `({section}\.[^`]*)` \|", TEXT, re.MULTILINE)
    shown = [re.sub(r"(\w+\\\|)+\w+", axis, row) for row in rows for axis in axes_of(row)]
    assert sorted(shown) == sorted(key for key, _ in keys(SECTIONS[section], f"{section}."))


def test_a_changed_row_is_made_good() -> None:
    row = "| `process.walls` | number of walls | `3` |"
    assert row in table("process")
    assert page(TEXT.replace(row, "| `process.walls` | legs |")) == TEXT


def test_the_page_lists_the_placeholders_that_blocks_may_hold() -> None:
    listed = {
        word for row in re.findall(r"^\| (`\{.*?) \|", PLACEHOLDERS, re.MULTILINE) for word in re.findall(r"\{(\w+)\}", row)
    }
    with pytest.raises(ProfileError, match="placeholder") as caught:
        write_gcode(program_of("empty", ()), load(settings=['machine.gcode.before_layer="{nothing}"']))
    assert listed == set(str(caught.value).partition("allowed are ")[2].split(", "))


@given(st.floats(-30, 30), st.floats(-60, 60), st.floats(20, 90))
def test_the_recipe_of_the_page_finds_the_tilt_axis(y_mm: float, z_mm: float, angle_deg: float) -> None:
    machine = load(settings=[f"machine.tilt.point_mm=[0,{y_mm!r},{z_mm!r}]"]).machine
    _, y, z = machine_points(machine, Pose(angle_deg, 0.0), np.zeros((1, 3)))[0]
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    axis = ((1 - c) * y - s * z) / (2 * (1 - c)), (s * y + (1 - c) * z) / (2 * (1 - c))
    assert axis == pytest.approx((y_mm, z_mm), abs=1e-6)


@given(st.floats(-30, 30), st.floats(-60, 60), st.floats(20, 90))
def test_the_recipe_of_the_page_finds_a_tilt_axis_along_y(x_mm: float, z_mm: float, angle_deg: float) -> None:
    machine = load(settings=["machine.tilt.axis=[0,1,0]", f"machine.tilt.point_mm=[{x_mm!r},0,{z_mm!r}]"]).machine
    x, _, z = machine_points(machine, Pose(angle_deg, 0.0), np.zeros((1, 3)))[0]
    c, s = cos(radians(angle_deg)), sin(radians(angle_deg))
    axis = ((1 - c) * x + s * z) / (2 * (1 - c)), ((1 - c) * z - s * x) / (2 * (1 - c))
    assert axis == pytest.approx((x_mm, z_mm), abs=1e-6)


def test_positive_values_turn_the_table_as_the_page_says() -> None:
    machine = load(settings=["machine.tilt.point_mm=[0,0,0]"]).machine
    rear, right = np.array([[0.0, 10.0, 0.0]]), np.array([[10.0, 0.0, 0.0]])
    assert machine_points(machine, Pose(10.0, 0.0), rear)[0, 2] > 0
    assert machine_points(machine, Pose(0.0, 10.0), right)[0, 1] > 0


def test_positive_values_raise_the_left_edge_of_a_table_that_tilts_about_y() -> None:
    machine = load(settings=["machine.tilt.axis=[0,1,0]", "machine.tilt.point_mm=[0,0,0]"]).machine
    left = np.array([[-10.0, 0.0, 0.0]])
    assert machine_points(machine, Pose(10.0, 0.0), left)[0, 2] > 0
